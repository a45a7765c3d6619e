//! One duty's way from the network's outputs to the hardware (contract sections 7 to 9), of one output or of several (9b).

use std::ops::Range;

use ndarray::{ArrayView1, Axis};
use policy::DutyPath;

use crate::head::Head;
use crate::limits::Limits;
use crate::mapping::Mapping;
use crate::real::Real;
use crate::state::Remembered;
use crate::status;
use crate::trace::{Command, Decision, Trace};

/// What stands between the network and a duty, in the format.
#[derive(Debug, Clone)]
pub(crate) struct Path<T> {
    /// Columns of the last layer.
    columns: Range<usize>,
    pub head: Head<T>,
    pub mapping: Option<Mapping<T>>,
    limits: Limits<T>,
    pub initial_duty: T,
    fallback: T,
}

/// What the steps of section 9 gave, before it is known whether the step is usable.
struct Limited {
    bits: u32,
    is_number: bool,
}

impl<T: Real> Path<T> {
    pub fn new(path: &DutyPath<'_>) -> Self {
        Self {
            columns: path.columns(),
            head: Head::new(path.head),
            mapping: path.mapping.map(Mapping::new),
            limits: Limits::new(path.limits),
            initial_duty: T::nearest(path.limits.initial_duty),
            fallback: T::nearest(path.fallback),
        }
    }

    /// What is remembered of it after `init`; `kept` are the coefficients and their check word of a reset.
    pub fn start(&self, kept: Option<Remembered<T>>) -> Remembered<T> {
        let initial = self.mapping.as_ref().map(|mapping| mapping.initial);
        let fresh = Remembered {
            previous_duty: self.initial_duty,
            previous_command: self.initial_duty,
            soft_cap: self.limits.soft_start.map(|soft| soft.from),
            mapping: initial,
            mapping_check: initial.map(|initial| initial.check_word()),
        };
        match kept {
            // the check word is not computed anew: a damaged coefficient would pass for a good one
            Some(Remembered {
                mapping, mapping_check, ..
            }) => Remembered {
                mapping,
                mapping_check,
                ..fresh
            },
            None => fresh,
        }
    }

    /// Action index, and duty before the mapping, of all outputs of the network; nothing else is looked at, so not of a law.
    pub fn decide(&self, outputs: &ArrayView1<'_, T>) -> (u32, T) {
        self.head
            .decide(outputs.slice_axis(Axis(0), self.columns.clone().into()))
    }

    /// Action index and duty before the mapping.
    pub fn decided(&self, trace: &Trace<T>) -> (u32, T) {
        let outputs: ArrayView1<'_, T> = trace.q_values.slice_axis(Axis(0), self.columns.clone().into());
        match self.head.scheduled(trace.base, &trace.factors, outputs) {
            Some(duty) => (0, duty),
            None => {
                let (index, chosen) = self.head.decide(outputs);
                (index, self.head.duty(trace.base, chosen))
            }
        }
    }

    /// Sections 8 and 9 up to the limits: fills in all but the command.
    fn limited(&self, signals: &[T], own: Remembered<T>, decision: &mut Decision<T>) -> Limited {
        let d = decision.duty_sim;
        let mut bits = 0;
        let mut t = d;
        if let (Some(mapping), Some(coefficients)) = (&self.mapping, own.mapping) {
            let i = signals[mapping.load_current];
            t = Mapping::apply(coefficients, d, i);
            bits |= if mapping.outside(d, i) {
                status::MAPPING_RANGE
            } else {
                0
            };
        }
        decision.mapped = t;
        let limited = self.limits.apply(t, own.previous_command, own.soft_cap);
        decision.slewed = limited.slewed;
        decision.soft_started = limited.soft_started;
        decision.limited = limited.limited;
        Limited {
            bits: bits | limited.status,
            // what cannot come out of a sound state is no reason to command it
            is_number: self.limits.contains(limited.limited),
        }
    }

    /// Section 10: what is remembered behind a step with this command.
    pub fn next(&self, own: Remembered<T>, command: &Command<T>, usable: bool) -> Remembered<T> {
        let soft_cap = match (self.limits.soft_start, own.soft_cap) {
            (Some(soft), Some(cap)) => Some(self.limits.next_cap(soft, cap, usable)),
            (_, cap) => cap,
        };
        Remembered {
            previous_duty: command.duty_sim,
            previous_command: command.duty,
            soft_cap,
            ..own
        }
    }
}

/// Sections 8, 9 and 9b, from the chosen duties to the commands. One output that cannot be trusted stops all: they leave
/// one network, and a state that gave one of them no number may have given the others a wrong one.
pub(crate) fn act<T: Real>(paths: &[Path<T>], remembered: impl Fn(usize) -> Remembered<T>, trace: &mut Trace<T>) {
    let mut bits = if trace.features.iter().any(|feature| feature.clipped) {
        status::CLIPPED
    } else {
        0
    };
    let mut trusted = trace.sound;
    for (index, path) in paths.iter().enumerate() {
        let mut decision = trace.decision(index);
        let limited = path.limited(&trace.signals, remembered(index), &mut decision);
        bits |= limited.bits;
        trusted &= limited.is_number;
        trace.set_decision(index, decision);
    }
    trace.computed_status = bits;
    let held = if trace.all_valid { 0 } else { status::HELD };
    let primes = if trace.primed { 0 } else { status::PRIMED };
    for (index, path) in paths.iter().enumerate() {
        let mut decision = trace.decision(index);
        decision.command = if trace.usable && trusted {
            Command {
                duty: decision.limited,
                duty_sim: decision.duty_sim,
                action_index: decision.action_index,
                status: bits | held | primes,
            }
        } else {
            Command {
                duty: path.fallback,
                duty_sim: path.fallback,
                action_index: if trusted { decision.action_index } else { 0 },
                status: status::FALLBACK | if trusted { 0 } else { status::STATE },
            }
        };
        trace.set_decision(index, decision);
    }
}
