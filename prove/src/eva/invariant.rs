//! The sound states of a policy (numeric contract, section 1), number by number.
//!
//! The ends come from the reference interpreter, which knows the contract alone: what the compiler made of it is not asked.

use interp::{Controller, Real};
use policy::{Filter, Policy, Scalar};

/// How it is shown that a step leaves a number within its ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Shown {
    /// Intervals are enough.
    Directly,
    /// The word of a low-pass with this gain k, `y + k(x - y)`: intervals forget that both y are one. In slices of y, thin
    /// towards the ends, they are enough.
    InSlices {
        /// k in binary64.
        gain: f64,
    },
    /// In the same slices, those of this word.
    WithSlicesOf(usize),
    /// Not by intervals; the argument of the contract holds.
    ByContract(&'static str),
}

/// A number of the state.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Word {
    /// Member of the struct, such as `memory[3]`.
    pub place: String,
    /// Name for people, such as `error.0.delay[2]`.
    pub name: String,
    /// Smallest and largest value; `None` where no step reads it.
    pub ends: Option<(f64, f64)>,
    /// How its ends are shown.
    pub shown: Shown,
}

/// All sound states.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Invariant {
    /// Numbers in the order of the state.
    pub words: Vec<Word>,
    /// Words of filter memory.
    pub memory: usize,
    /// K: bad steps bridged.
    pub hold: u32,
}

impl Invariant {
    pub fn of(policy: &Policy) -> Self {
        match policy.numeric_format.scalar() {
            Scalar::F32 => Self::in_format::<f32>(policy),
            Scalar::F64 => Self::in_format::<f64>(policy),
        }
    }

    fn in_format<T: Real>(policy: &Policy) -> Self {
        let controller = Controller::<T>::new(policy);
        let state = controller.state();
        let shown = memories(policy);
        let held = (0..state.held.len()).map(|index| (format!("held[{index}]"), Shown::Directly));
        let memory = (0..state.memory.len()).map(|word| {
            let shown = shown.get(word).copied().unwrap_or(Shown::Directly);
            (format!("memory[{word}]"), shown)
        });
        let paths = policy.paths();
        // output by output (section 9b)
        let others = paths.iter().enumerate().flat_map(|(index, path)| {
            let duties = ["previous_duty", "previous_command"];
            let cap = state.output(index).soft_cap.map(|_| "soft_cap");
            let product = path.mapping.and_then(|mapping| mapping.coefficients.r);
            let letters = ["mapping_a", "mapping_b", "mapping_c"];
            let letters = letters.into_iter().chain(product.map(|_| "mapping_r"));
            let coefficients = letters.filter(|_| path.mapping.is_some());
            let stems = duties.into_iter().chain(cap).chain(coefficients);
            stems.map(|stem| path.named(stem)).collect::<Vec<String>>()
        });
        let places = held.chain(memory).chain(others.map(|place| (place, Shown::Directly)));
        let ends = controller.sound_ends();
        let words = places
            .zip(ends.iter().zip(controller.state_names()))
            .map(|((place, shown), (ends, name))| Word {
                place,
                name: name.clone(),
                ends: ends.map(|(low, high)| (low.to_f64(), high.to_f64())),
                shown,
            });
        Self {
            words: words.collect(),
            memory: state.memory.len(),
            hold: policy.fallback.hold,
        }
    }

    /// The word of that number of the filter memories.
    pub fn memory_word(&self, index: usize) -> Option<&Word> {
        self.words.iter().find(|word| word.place == format!("memory[{index}]"))
    }
}

/// How each word of the filter memories is shown, in the order of the state.
fn memories(policy: &Policy) -> Vec<Shown> {
    const DERIVATIVE: &str =
        "the bound of a filtered derivative rests on a relation between its two words, which intervals do not hold";
    const CHAIN: &str = "a low-pass behind a low-pass would need slices of both";
    // observers stand in front of the filters, and clamp what they keep
    let observed = policy.observers.iter().map(policy::Observer::words).sum();
    let mut all = vec![Shown::Directly; observed];
    for feature in &policy.features {
        let mut behind = Shown::Directly;
        for filter in &feature.filters {
            let first = all.len();
            match *filter {
                Filter::Delay { samples } => all.extend(std::iter::repeat_n(behind, samples)),
                Filter::MovingAverage { samples } => {
                    all.extend(std::iter::repeat_n(behind, samples.saturating_sub(1)));
                }
                Filter::BackwardDifference => all.push(behind),
                Filter::LowPass { time_constant } => {
                    let own = match behind {
                        Shown::Directly => Shown::InSlices {
                            gain: policy.sample_period / (time_constant + policy.sample_period),
                        },
                        Shown::InSlices { .. } | Shown::WithSlicesOf(_) => Shown::ByContract(CHAIN),
                        Shown::ByContract(why) => Shown::ByContract(why),
                    };
                    all.push(own);
                    behind = match own {
                        Shown::InSlices { .. } => Shown::WithSlicesOf(first),
                        other => other,
                    };
                }
                Filter::FilteredDerivative { .. } => {
                    all.push(behind);
                    behind = Shown::ByContract(DERIVATIVE);
                    all.push(behind);
                }
                Filter::Integrator { .. } => {
                    // it is clamped, whatever comes in
                    behind = Shown::Directly;
                    all.push(behind);
                }
            }
        }
    }
    all
}

/// Largest number of slices of a word on either side of 0; with so many all its runs together take a quarter of a minute.
const MOST_SLICES: usize = 160;

/// The ends of slices from -bound to bound, ascending; `None` where too many would be needed.
///
/// A slice from `lo` to `hi` is kept by `y + k(x - y)` with `|x| <= X` if `hi + k(X - lo) <= M`. With `D = M - lo` and
/// `d = M - hi` that is `d >= k(D - (M - X))`: so the distance to the end may shrink by k from slice to slice, and by more
/// near the end.
pub(super) fn slices(bound: f64, gain: f64) -> Option<Vec<f64>> {
    // M exceeds X by 2^-19 of itself (contract section 1). A quarter of that is room: the ends of slices are rounded outwards, by a
    // 32nd each in binary32, and what is multiplied and subtracted to nearest
    let excess = bound / f64::from(1 << 19);
    let (used, rounded) = (0.75 * excess, excess / 16.0);
    let mut distances = Vec::new();
    let mut distance = bound;
    while distance > used {
        distances.push(distance);
        if distances.len() > MOST_SLICES {
            return None;
        }
        // beyond 8 few slices are saved
        distance = (gain * (distance - used) + rounded).max(distance / 8.0);
    }
    distances.push(distance);
    let upper = distances.iter().map(|distance| bound - distance).chain([bound]);
    let upper: Vec<f64> = upper.collect();
    let lower = upper.iter().rev().map(|end| -end);
    // 0 once
    Some(lower.chain(upper.iter().skip(1).copied()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slices_cover_the_whole_range_in_order() {
        let ends = slices(3.0, 0.1).expect("few");
        assert_eq!((ends[0], ends[ends.len() - 1]), (-3.0, 3.0));
        assert!(ends.windows(2).all(|pair| pair[0] < pair[1]), "{ends:?}");
        assert!(ends.len() < 25, "{}", ends.len());
        assert_eq!(slices(3.0, 0.9999), None);
    }

    /// By the rule in binary64: from the slice one step stays within the bound.
    #[test]
    fn every_slice_is_kept() {
        // with 0.99 too many would be needed, which is said instead
        assert_eq!(slices(100.0, 0.99), None);
        for gain in [0.001, 0.02, 0.1, 0.12, 0.13, 0.3, 0.5, 0.8, 0.9, 0.93] {
            // X from M as in section 1
            let (bound, growth) = (100.0, 1.0 + 1.0 / 1_048_576.0);
            let most = bound / growth / growth;
            let ends = slices(bound, gain).expect("few");
            for pair in ends.windows(2) {
                // ends as binary32 has them, outwards
                let low = f64::from((pair[0] as f32).next_down()).max(-bound);
                let high = f64::from((pair[1] as f32).next_up()).min(bound);
                // with what the difference, the product and the gain are rounded by
                let rounded = 1.0 + 3.0 / f64::from(1 << 24);
                // the bound is a number of the format, so what is not above it is not rounded above it
                let next = high + gain * (most - low) * rounded;
                assert!(next <= bound, "{gain} {pair:?} {next}");
                let next = low - gain * (most + high) * rounded;
                assert!(next >= -bound, "{gain} {pair:?} {next}");
            }
        }
    }

    #[test]
    fn words_of_filters_behind_those_of_observers_are_shown_as_filters() {
        let case = concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../tests/golden/cases/observed/policy.toml"
        );
        let policy = policy::load(std::path::Path::new(case)).expect("a policy");
        let invariant = Invariant::of(&policy);
        let in_slices = |word: &&Word| matches!(word.shown, Shown::InSlices { .. });
        let names: Vec<&str> = invariant
            .words
            .iter()
            .filter(in_slices)
            .map(|word| word.name.as_str())
            .collect();
        assert!(!names.is_empty(), "no low-pass");
        assert!(names.iter().all(|name| name.contains("low_pass")), "{names:?}");
    }
}
