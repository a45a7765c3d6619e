//! Names of the words of a state, for people.

use policy::Policy;

use crate::feature::Feature;
use crate::real::Real;
use crate::state::State;

/// One name a word, in the order of contract section 1.
pub(crate) fn state_names<T: Real>(policy: &Policy, features: &[Feature<T>], state: &State<T>) -> Vec<String> {
    let mut names: Vec<String> = policy
        .signals
        .iter()
        .map(|signal| format!("held.{}", signal.name))
        .collect();
    for observer in &policy.observers {
        let estimates = policy::Estimate::STATE.map(|estimate| estimate.word().to_owned());
        let kept = ["last_load_current", "last_input_voltage"].map(str::to_owned);
        let words = estimates.into_iter().chain(kept).take(observer.words());
        names.extend(words.map(|word| format!("{}.{word}", observer.name)));
    }
    for (feature, spec) in features.iter().zip(&policy.features) {
        for (n, filter) in feature.filters.iter().enumerate() {
            names.extend(
                filter
                    .word_names()
                    .iter()
                    .map(|word| format!("{}.{n}.{word}", spec.name)),
            );
        }
    }
    names.extend(["previous_duty", "previous_command"].map(str::to_owned));
    names.extend(state.soft_cap.map(|_| "soft_cap".to_owned()));
    if let Some(coefficients) = &state.mapping {
        names.extend(["mapping.a", "mapping.b", "mapping.c"].map(str::to_owned));
        names.extend(coefficients.r.map(|_| "mapping.r".to_owned()));
        names.push("mapping.check".to_owned());
    }
    names.extend(["bad_count", "primed"].map(str::to_owned));
    names
}
