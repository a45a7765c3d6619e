//! Whether a state is one that the controller can have written (contract section 1).

use policy::{DutyPath, Policy};

use crate::controller::Controller;
use crate::head::Head;
use crate::mapping::Mapping;
use crate::real::{Range, Real};
use crate::state::{Remembered, State};

/// What the parts of a sound state lie within, in the format.
#[derive(Debug, Clone)]
pub(crate) struct Sound<T> {
    held: Vec<Range<T>>,
    /// Largest magnitude of each word of the filter memories.
    memory: Vec<T>,
    outputs: Vec<Remembers<T>>,
    /// K: bad steps bridged.
    hold: u32,
}

/// The same of what is remembered of an output.
#[derive(Debug, Clone)]
struct Remembers<T> {
    /// `None` where no source reads it.
    previous_duty: Option<Range<T>>,
    /// `None` where neither a source nor a limiter reads it.
    previous_command: Option<Range<T>>,
    soft_cap: Option<Range<T>>,
}

impl<T: Real> Remembers<T> {
    fn new(policy: &Policy, path: &DutyPath<'_>) -> Self {
        // reset and fallback write these two without a limiter, and a contract may put them outside of the limits
        let start = [path.limits.initial_duty, path.fallback].map(T::nearest);
        let limits = Range::inwards(path.limits.duty);
        let duties = Head::new(path.head).duties();
        let slewed = path.limits.slew.is_some();
        Self {
            // a flip in what nothing reads decides no duty: asked, it would only stop a controller that works
            previous_duty: policy
                .reads(path.previous_duty)
                .then(|| hull(start.into_iter().chain(duties))),
            previous_command: (policy.reads(path.previous_command) || slewed)
                .then(|| hull(start.into_iter().chain([limits.lo, limits.hi]))),
            soft_cap: (path.limits.soft_start).map(|soft| hull([T::nearest(soft.from), limits.hi].into_iter())),
        }
    }

    fn holds(&self, own: Remembered<T>) -> bool {
        let within = |range: Option<Range<T>>, x: T| range.is_none_or(|range| range.contains(x));
        within(self.previous_duty, own.previous_duty)
            && within(self.previous_command, own.previous_command)
            && own.soft_cap.is_none_or(|cap| within(self.soft_cap, cap))
            // whoever wrote the check word has compared the coefficients with their intervals
            && own.mapping.map(|own| own.check_word()) == own.mapping_check
    }
}

impl<T: Real> Sound<T> {
    pub fn new(policy: &Policy) -> Self {
        Self {
            held: policy
                .signals
                .iter()
                .map(|signal| Range::inwards(signal.range))
                .collect(),
            memory: policy::memory_bounds(policy).into_iter().map(T::nearest).collect(),
            outputs: policy.paths().iter().map(|path| Remembers::new(policy, path)).collect(),
            hold: policy.fallback.hold,
        }
    }

    /// What each number of `state` lies within, in the order of its words; nothing for one that no step reads. Coefficients
    /// lie within because their check word says so, and are not compared.
    pub fn ends<'a>(&self, mappings: impl Iterator<Item = Option<&'a Mapping<T>>>) -> Vec<Option<Range<T>>>
    where
        T: 'a,
    {
        let mut ends: Vec<Option<Range<T>>> = self.held.iter().copied().map(Some).collect();
        ends.extend(self.memory.iter().map(|&bound| Some(Range { lo: -bound, hi: bound })));
        for (own, mapping) in self.outputs.iter().zip(mappings) {
            ends.extend([own.previous_duty, own.previous_command]);
            ends.extend(own.soft_cap.map(Some));
            ends.extend(mapping.into_iter().flat_map(Mapping::adjustable).map(Some));
        }
        ends
    }

    /// Whether all parts of the state lie within; a NaN lies nowhere.
    pub fn holds(&self, state: &State<T>) -> bool {
        let bounded = |(&x, &bound): (&T, &T)| Range { lo: -bound, hi: bound }.contains(x);
        self.held.iter().zip(&state.held).all(|(range, &x)| range.contains(x))
            && state.memory.iter().zip(&self.memory).all(bounded)
            && (self.outputs.iter().enumerate()).all(|(index, own)| own.holds(state.output(index)))
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
        let mappings = self.paths.iter().map(|path| path.mapping.as_ref());
        let ends = self.sound.ends(mappings).into_iter();
        ends.map(|range| range.map(|range| (range.lo, range.hi))).collect()
    }

    /// Least and largest duty that an output can have commanded before a step (section 1); `None` where no step reads it.
    #[must_use]
    pub fn duty_before(&self, output: usize) -> Option<(T, T)> {
        let range = self.sound.outputs.get(output)?.previous_duty?;
        Some((range.lo, range.hi))
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
