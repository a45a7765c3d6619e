//! The sound states of a policy (numeric contract, section 1), number by number.
//!
//! The ends come from the reference interpreter, which knows the contract alone: what the compiler made of it is not asked.

use interp::{Controller, Real};
use policy::{Filter, Policy, Scalar};

use super::slices::{Ends, source};

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
        /// Where x lies, if more is known of it than how large it is.
        input: Option<Ends>,
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
        for (index, filter) in feature.filters.iter().enumerate() {
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
                            // of what another filter remembers only the magnitude is known
                            input: (index == 0).then(|| source(&feature.source, policy)),
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

#[cfg(test)]
mod tests {
    use super::*;

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
