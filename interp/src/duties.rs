//! What a numeric format does to the duty of a continuous head: the trainer's observations, answered in the format at hand.

use policy::{Continuous, Golden, NumericFormat, Policy, Scalar};
use serde::Serialize;

use crate::Real;
use crate::decisions::{Asked, answers_of};
use crate::head::Head;

/// The trainer's duties against those of the numeric format. Errors are shares of the head's range, from its least to its
/// largest duty.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Duties {
    /// Name of the format.
    pub numeric_format: &'static str,
    /// Observations that were compared: all golden vectors.
    pub observations: usize,
    /// From the least to the largest duty of the head.
    pub range: f64,
    /// Largest error.
    pub largest: f64,
    /// Mean error.
    pub mean: f64,
    /// Allowed error.
    pub allowed: f64,
    /// Where the error is largest.
    pub worst: Option<WorstDuty>,
}

/// One observation with its duties.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct WorstDuty {
    /// Row of the golden vectors.
    pub row: usize,
    /// The observation, in network input order.
    pub observation: Vec<f32>,
    /// Duty of the trainer's actor.
    pub expected: f64,
    /// Duty in the format.
    pub found: f64,
}

impl Duties {
    /// No duty is off by more than allowed.
    #[must_use]
    pub fn kept(&self) -> bool {
        self.largest <= self.allowed
    }
}

/// Answers the golden observations in the policy's format.
pub(crate) fn duties(asked: &Asked<'_>, head: &Continuous) -> Duties {
    let Asked { policy, golden, .. } = asked;
    let expected = expected(asked, head);
    let found = found(asked, policy);
    let errors: Vec<f64> = expected.iter().zip(&found).map(|(e, f)| error(head, *e, *f)).collect();
    let worst = (0..errors.len()).reduce(|worst, row| if errors[row] > errors[worst] { row } else { worst });
    let features = policy.features.len().max(1);
    let told = |row: usize| {
        let observation = golden.observations.chunks_exact(features).nth(row)?.to_vec();
        Some(WorstDuty {
            row,
            observation,
            expected: expected[row],
            found: found[row],
        })
    };
    Duties {
        numeric_format: policy.numeric_format.name(),
        observations: golden.count,
        range: head.span(),
        largest: worst.map_or(0.0, |row| errors[row]),
        mean: errors.iter().sum::<f64>() / golden.count.max(1) as f64,
        allowed: golden.allowed_duty_error(policy.numeric_format),
        worst: worst.and_then(told),
    }
}

/// Difference of two duties as a share of the head's range; infinite if one is no number.
pub(crate) fn error(head: &Continuous, expected: f64, found: f64) -> f64 {
    let error = (expected - found).abs() / head.span();
    if error.is_nan() { f64::INFINITY } else { error }
}

/// The trainer's duties: as recorded, else those of its outputs, else those of its network in binary64.
fn expected(asked: &Asked<'_>, head: &Continuous) -> Vec<f64> {
    if let Some(known) = given(head, asked.golden) {
        return known;
    }
    // binary64 stands for exact arithmetic: the format at hand must not be its own judge
    found(asked, &asked.policy.clone().with_format(NumericFormat::F64))
}

/// What the golden vectors say of the duties; `None` if they hold neither duties nor outputs.
pub(crate) fn given(head: &Continuous, golden: &Golden) -> Option<Vec<f64>> {
    if !golden.duties.is_empty() {
        return Some(golden.duties.iter().copied().map(f64::from).collect());
    }
    let outputs = golden.q_values.iter().map(|output| head.duty(f64::from(*output)));
    (!golden.q_values.is_empty()).then(|| outputs.collect())
}

fn found(asked: &Asked<'_>, policy: &Policy) -> Vec<f64> {
    match policy.numeric_format.scalar() {
        Scalar::F32 => in_format::<f32>(asked, policy),
        Scalar::F64 => in_format::<f64>(asked, policy),
    }
}

fn in_format<T: Real>(asked: &Asked<'_>, policy: &Policy) -> Vec<f64> {
    let head = Head::<T>::new(asked.head);
    let answers = answers_of::<T>(asked, policy);
    answers
        .iter()
        .map(|outputs| head.decide(outputs.view()).1.to_f64())
        .collect()
}
