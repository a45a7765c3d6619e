//! Contract section 1: what a sound state lies within.

use policy::{DutyPath, Policy, Scalar};

use super::head;
use crate::program::{Guard, Guarded, Literal, Place, SignalPort, Within};

/// Ranges of all parts of the state that a source, a filter or a limiter reads.
pub fn lower(policy: &Policy, signals: &[SignalPort]) -> Guard {
    let scalar = policy.numeric_format.scalar();
    let within = |place: Place, range: (Literal, Literal)| Guarded {
        place,
        within: Within::of(scalar, range),
    };
    let held = signals.iter().enumerate();
    let mut numbers: Vec<Guarded> = held
        .map(|(index, signal)| within(Place::Held(index), signal.range))
        .collect();
    numbers.extend(memories(policy, scalar));
    for (index, path) in policy.paths().iter().enumerate() {
        remembered(policy, path, index, &mut numbers);
    }
    Guard {
        numbers,
        // the counter stops one above K
        bad_count: policy.fallback.hold.saturating_add(1),
    }
}

/// What is remembered of the output of that index.
fn remembered(policy: &Policy, path: &DutyPath<'_>, index: usize, numbers: &mut Vec<Guarded>) {
    let scalar = policy.numeric_format.scalar();
    let mut within = |place: Place, range: (Literal, Literal)| {
        numbers.push(Guarded {
            place,
            within: Within::of(scalar, range),
        });
    };
    // what nothing reads decides no duty, and each comparison is paid in every step
    // reset and fallback write these two without a limiter, and they may lie outside of the duty limits
    let start = [path.limits.initial_duty, path.fallback].map(|duty| Literal::nearest(scalar, duty));
    let (min, max) = Literal::inward(scalar, path.limits.duty);
    if policy.reads(path.previous_duty) {
        let duties = head::duties(scalar, path.head);
        within(Place::PreviousDuty(index), hull(start.into_iter().chain(duties)));
    }
    if policy.reads(path.previous_command) || path.limits.slew.is_some() {
        let range = hull(start.into_iter().chain([min, max]));
        within(Place::PreviousCommand(index), range);
    }
    if let Some(soft) = path.limits.soft_start {
        let range = hull([Literal::nearest(scalar, soft.from), max].into_iter());
        within(Place::SoftCap(index), range);
    }
}

/// The words of the filter memories; neighbours of one bound together, so that a long line is one loop.
fn memories(policy: &Policy, scalar: Scalar) -> Vec<Guarded> {
    let mut runs: Vec<(Literal, usize, usize)> = Vec::new();
    for (word, bound) in policy::memory_bounds(policy).into_iter().enumerate() {
        let bound = Literal::nearest(scalar, bound);
        match runs.last_mut() {
            // all words of a delay have one bound, and so have features that read one signal
            Some((last, _, count)) if *last == bound => *count += 1,
            _ => runs.push((bound, word, 1)),
        }
    }
    let guarded = |(bound, first, count): (Literal, usize, usize)| Guarded {
        place: Place::Memory { first, count },
        within: Within::of(scalar, (Literal::nearest(scalar, -bound.value()), bound)),
    };
    runs.into_iter().map(guarded).collect()
}

/// From the smallest to the largest of some numbers.
fn hull(numbers: impl Iterator<Item = Literal>) -> (Literal, Literal) {
    let none = (Literal::exact(f64::INFINITY), Literal::exact(f64::NEG_INFINITY));
    numbers.fold(none, |(low, high), x| {
        (
            if x.value() < low.value() { x } else { low },
            if x.value() > high.value() { x } else { high },
        )
    })
}
