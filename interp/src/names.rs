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
    let mut checks = Vec::new();
    for (index, path) in policy.paths().into_iter().enumerate() {
        let named = |part: &str| path.name.map_or(part.to_owned(), |name| format!("{name}.{part}"));
        let own = state.output(index);
        names.extend(["previous_duty", "previous_command"].map(named));
        names.extend(own.soft_cap.map(|_| named("soft_cap")));
        if let Some(coefficients) = &own.mapping {
            names.extend(["mapping.a", "mapping.b", "mapping.c"].map(named));
            names.extend(coefficients.r.map(|_| named("mapping.r")));
            checks.push(named("mapping.check"));
        }
    }
    names.extend(checks);
    names.extend(["bad_count", "primed"].map(str::to_owned));
    names
}
