//! The specification: what the numeric contract says of one step, as terms.
//!
//! Generated from [`Policy`] and `docs/reference/numeric-contract.md` alone, section by section; nothing here knows what the emitted code
//! looks like. The network is outside: its outputs go into [`choose`], an observation leaves [`sense`].

pub(crate) mod curves;
mod decide;
mod filter;
mod observer;
mod sense;
mod state;
pub(crate) mod tables;

pub(crate) use decide::{Chosen, Command, choose, commit, decide};
pub(crate) use sense::{Sensed, measurement, sense};
pub(crate) use state::{Own, State, accepted, check_word, initial, reset};

use policy::{Interval, Limits, Policy, Scalar};

use crate::float::Float;
use crate::term::{Term, Terms};

/// Bits of the status word (section 9).
pub(crate) mod status {
    pub(crate) const HELD: u64 = 1;
    pub(crate) const FALLBACK: u64 = 1 << 1;
    pub(crate) const PRIMED: u64 = 1 << 2;
    pub(crate) const CLIPPED: u64 = 1 << 3;
    pub(crate) const MAPPING_RANGE: u64 = 1 << 4;
    pub(crate) const SLEW_LIMITED: u64 = 1 << 5;
    pub(crate) const SOFT_START: u64 = 1 << 6;
    pub(crate) const LIMITED: u64 = 1 << 7;
    pub(crate) const STATE: u64 = 1 << 8;
}

/// A policy and the store of its terms.
#[derive(Clone, Copy)]
pub(crate) struct Spec<'a> {
    pub policy: &'a Policy,
    pub terms: &'a Terms,
    pub float: Float<'a>,
}

impl<'a> Spec<'a> {
    pub(crate) fn new(policy: &'a Policy, terms: &'a Terms) -> Self {
        let format = policy.numeric_format.scalar();
        Spec {
            policy,
            terms,
            float: Float { terms, format },
        }
    }

    fn format(self) -> Scalar {
        self.float.format
    }

    /// A constant of the contract, rounded once to nearest.
    fn nearest(self, value: f64) -> Term {
        self.float.constant(self.format().nearest(value))
    }

    /// A range whose ends are rounded inwards.
    fn inwards(self, range: Interval) -> (Term, Term) {
        let (low, high) = (self.format().up(range.low), self.format().down(range.high));
        (self.float.constant(low), self.float.constant(high))
    }

    /// A range whose ends are rounded to nearest.
    fn ends(self, range: Interval) -> (Term, Term) {
        (self.nearest(range.low), self.nearest(range.high))
    }

    /// The largest change of duty, rounded down (section 9).
    pub(crate) fn slew_step(self, limits: &Limits) -> Option<Term> {
        let slew = limits.slew?;
        Some(self.float.constant(self.format().down(slew)))
    }

    /// By how much the soft cap rises: `(max - from)/steps` in binary64 (section 10).
    pub(crate) fn soft_raise(self, limits: &Limits) -> Option<Term> {
        let start = limits.soft_start?;
        Some(self.nearest((limits.duty.high - start.from) / f64::from(start.steps)))
    }

    /// Where a sound soft cap lies (section 1).
    pub(crate) fn soft_range(self, limits: &Limits) -> Option<(Term, Term)> {
        let start = limits.soft_start?;
        let (_, high) = self.inwards(limits.duty);
        Some((self.nearest(start.from), high))
    }

    fn zero(self) -> Term {
        self.float.constant(0.0)
    }

    fn counter(self, value: u64) -> Term {
        self.terms.bits(value, 32)
    }

    fn hold(self) -> u64 {
        u64::from(self.policy.fallback.hold)
    }
}
