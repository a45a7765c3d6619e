//! Whether a state is one that the controller can have written (contract section 1).

use policy::{Input, Policy};

use crate::controller::Controller;
use crate::head::Head;
use crate::mapping::Mapping;
use crate::real::{Range, Real};
use crate::state::State;

/// What the parts of a sound state lie within, in the format.
#[derive(Debug, Clone)]
pub(crate) struct Sound<T> {
    held: Vec<Range<T>>,
    /// Largest magnitude of each word of the filter memories.
    memory: Vec<T>,
    /// `None` where no source reads it.
    previous_duty: Option<Range<T>>,
    /// `None` where neither a source nor a limiter reads it.
    previous_command: Option<Range<T>>,
    soft_cap: Option<Range<T>>,
    /// K: bad steps bridged.
    hold: u32,
}

impl<T: Real> Sound<T> {
    pub fn new(policy: &Policy) -> Self {
        // reset and fallback write these two without a limiter, and a contract may put them outside of the limits
        let start = [policy.limits.initial_duty, policy.fallback.duty].map(T::nearest);
        let limits = Range::inwards(policy.limits.duty);
        let duties = Head::new(policy).duties();
        let slewed = policy.limits.slew.is_some();
        Self {
            held: policy
                .signals
                .iter()
                .map(|signal| Range::inwards(signal.range))
                .collect(),
            memory: policy::memory_bounds(policy).into_iter().map(T::nearest).collect(),
            // a flip in what nothing reads decides no duty: asked, it would only stop a controller that works
            previous_duty: policy
                .reads(Input::PreviousDuty)
                .then(|| hull(start.into_iter().chain(duties))),
            previous_command: (policy.reads(Input::PreviousCommand) || slewed)
                .then(|| hull(start.into_iter().chain([limits.lo, limits.hi]))),
            soft_cap: (policy.limits.soft_start).map(|soft| hull([T::nearest(soft.from), limits.hi].into_iter())),
            hold: policy.fallback.hold,
        }
    }

    /// What each number of `state` lies within, in the order of its words; nothing for one that no step reads. Coefficients
    /// lie within because their check word says so, and are not compared.
    pub fn ends(&self, state: &State<T>, mapping: Option<&Mapping<T>>) -> Vec<Option<Range<T>>> {
        let mut ends: Vec<Option<Range<T>>> = self.held.iter().copied().map(Some).collect();
        ends.extend(self.memory.iter().map(|&bound| Some(Range { lo: -bound, hi: bound })));
        ends.extend([self.previous_duty, self.previous_command]);
        ends.extend(state.soft_cap.map(|_| self.soft_cap));
        ends.extend(mapping.into_iter().flat_map(Mapping::adjustable).map(Some));
        ends
    }

    /// Whether all parts of the state lie within; a NaN lies nowhere.
    pub fn holds(&self, state: &State<T>) -> bool {
        let within = |range: Option<Range<T>>, x: T| range.is_none_or(|range| range.contains(x));
        let bounded = |(&x, &bound): (&T, &T)| Range { lo: -bound, hi: bound }.contains(x);
        // whoever wrote the check word has compared the coefficients with their intervals
        let coefficients = state.mapping.map(|own| own.check_word()) == state.mapping_check;
        self.held.iter().zip(&state.held).all(|(range, &x)| range.contains(x))
            && state.memory.iter().zip(&self.memory).all(bounded)
            && within(self.previous_duty, state.previous_duty)
            && within(self.previous_command, state.previous_command)
            && state.soft_cap.is_none_or(|cap| within(self.soft_cap, cap))
            && coefficients
            // the counter stops one above K, so it never wraps, and a larger one was not counted
            && state.bad_count <= self.hold.saturating_add(1)
            && state.primed <= 1
    }
}

impl<T: Real> Controller<T> {
    /// Lower and upper end of each number of a sound state (section 1), in the order of the words; nothing for a number
    /// that no step reads.
    #[must_use]
    pub fn sound_ends(&self) -> Vec<Option<(T, T)>> {
        let ends = self.sound.ends(self.state(), self.mapping.as_ref()).into_iter();
        ends.map(|range| range.map(|range| (range.lo, range.hi))).collect()
    }
}

/// From the smallest to the largest of some numbers.
fn hull<T: Real>(numbers: impl Iterator<Item = T>) -> Range<T> {
    // nothing lies within: the first number sets both ends
    let none = Range {
        lo: T::MAX,
        hi: -T::MAX,
    };
    numbers.fold(none, |range, x| Range {
        lo: if x < range.lo { x } else { range.lo },
        hi: if x > range.hi { x } else { range.hi },
    })
}
