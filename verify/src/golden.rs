//! Known answers of the trainer.

use interp::argmax;
use ndarray::aview1;
use policy::{Golden, Policy, Scalar};

use crate::protocol::numbers;
use crate::report::GoldenResult;
use crate::traces::Event;

/// The observations of the known answers as events; empty without them.
pub(crate) fn events(policy: &Policy) -> Vec<Event> {
    policy.golden.as_ref().map_or_else(Vec::new, |golden| {
        let features = policy.features.len();
        golden
            .observations
            .chunks_exact(features)
            .map(|o| Event::Network(o.iter().copied().map(f64::from).collect()))
            .collect()
    })
}

/// Judges the Q values, given as bits, that answer [`events`]; values that are missing count as wrong.
pub(crate) fn judge(golden: &Golden, scalar: Scalar, actions: usize, words: &[u32]) -> GoldenResult {
    let q_values = numbers(scalar, words);
    let answers: Vec<&[f64]> = q_values.chunks_exact(actions).collect();
    let actions_equal = golden
        .action_indices
        .iter()
        .zip(&answers)
        .filter(|(expected, q)| argmax(aview1(q)) == **expected as usize)
        .count();
    let missing = answers.len() < golden.count;
    let worst = golden
        .q_values
        .chunks_exact(actions)
        .zip(&answers)
        .map(|(expected, q)| relative_error(expected, q))
        .fold(if missing { f64::INFINITY } else { 0.0 }, f64::max);
    GoldenResult {
        vectors: golden.count,
        actions_compared: golden.action_indices.len(),
        actions_equal,
        worst_relative_error: (!golden.q_values.is_empty()).then_some(worst),
        tolerance: golden.tolerance,
        rounded: false,
    }
}

/// Largest difference relative to the largest expected |Q|; infinite if a value is no number.
fn relative_error(expected: &[f32], got: &[f64]) -> f64 {
    let largest = expected
        .iter()
        .map(|q| f64::from(q.abs()))
        .fold(f64::MIN_POSITIVE, f64::max);
    expected
        .iter()
        .zip(got)
        .map(|(e, g)| (f64::from(*e) - g).abs() / largest)
        .map(|error| if error.is_nan() { f64::INFINITY } else { error })
        .fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn golden() -> Golden {
        Golden {
            count: 2,
            observations: vec![0.0, 1.0],
            q_values: vec![1.0, -4.0, 2.0, 3.0],
            action_indices: vec![0, 1],
            tolerance: 1e-5,
            decisions: None,
        }
    }

    fn judged(q: [f32; 4]) -> GoldenResult {
        judge(&golden(), Scalar::F32, 2, &q.map(f32::to_bits))
    }

    #[test]
    fn equal_answers_pass() {
        let result = judged([1.0, -4.0, 2.0, 3.0]);
        assert!(result.passed());
        assert_eq!((result.actions_equal, result.worst_relative_error), (2, Some(0.0)));
    }

    #[test]
    fn error_is_relative_to_the_largest_q_of_its_vector() {
        assert_eq!(judged([1.5, -4.0, 2.0, 3.0]).worst_relative_error, Some(0.125));
    }

    #[test]
    fn nan_and_missing_answers_do_not_pass() {
        assert!(!judged([f32::NAN, -4.0, 2.0, 3.0]).passed());
        assert!(!judge(&golden(), Scalar::F32, 2, &[1.0_f32.to_bits(), (-4.0_f32).to_bits()]).passed());
    }

    #[test]
    fn another_action_does_not_pass() {
        let result = judged([1.0, -4.0, 3.0, 2.999_999_9]);
        assert_eq!(result.actions_equal, 1);
        assert!(!result.passed());
    }
}
