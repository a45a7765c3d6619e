//! Gain schedules (contract section 7c) against the trainer's answers, and what a numeric format does to their gains.

use policy::{Golden, NumericFormat, Policy, Scalar, Schedule};
use serde::Serialize;

use crate::decisions::answers;
use crate::golden::GoldenResult;
use crate::{Controller, Real};

/// The trainer's gains against those of the numeric format. Errors are shares of each gain's own range, from its least to its
/// largest value.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Gains {
    /// Name of the format.
    pub numeric_format: &'static str,
    /// Observations that were compared: all golden vectors.
    pub observations: usize,
    /// Largest error.
    pub largest: f64,
    /// Mean over all observations of the largest error of each.
    pub mean: f64,
    /// Allowed error.
    pub allowed: f64,
    /// Where the error is largest.
    pub worst: Option<WorstGain>,
}

/// One observation with the gain that is farthest off.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct WorstGain {
    /// Row of the golden vectors.
    pub row: usize,
    /// The observation, in network input order.
    pub observation: Vec<f32>,
    /// Which gain.
    pub gain: usize,
    /// From its least to its largest value.
    pub range: f64,
    /// Its value in the trainer's actor.
    pub expected: f64,
    /// Its value in the format.
    pub found: f64,
}

impl Gains {
    /// No gain is off by more than allowed.
    #[must_use]
    pub fn kept(&self) -> bool {
        self.largest <= self.allowed
    }
}

/// Answers the golden observations in the policy's format; `None` without golden vectors.
pub(crate) fn gains(policy: &Policy, head: &Schedule) -> Option<Gains> {
    let golden = policy.golden.as_ref()?;
    let expected = match golden.q_values.is_empty() {
        false => of_outputs(head, &golden.q_values),
        // binary64 stands for exact arithmetic: the format at hand must not be its own judge
        true => found(&policy.clone().with_format(NumericFormat::F64), golden),
    };
    let found = found(policy, golden);
    let errors: Vec<(usize, f64)> = expected.iter().zip(&found).map(|(e, f)| largest(head, e, f)).collect();
    let worst = (0..errors.len()).reduce(|worst, row| if errors[row].1 > errors[worst].1 { row } else { worst });
    let features = policy.features.len().max(1);
    let told = |row: usize| {
        let (gain, _) = errors[row];
        Some(WorstGain {
            row,
            observation: golden.observations.chunks_exact(features).nth(row)?.to_vec(),
            gain,
            range: head.gains.get(gain)?.span(),
            expected: *expected[row].get(gain)?,
            found: *found[row].get(gain)?,
        })
    };
    Some(Gains {
        numeric_format: policy.numeric_format.name(),
        observations: golden.count,
        largest: worst.map_or(0.0, |row| errors[row].1),
        mean: errors.iter().map(|(_, error)| error).sum::<f64>() / golden.count.max(1) as f64,
        allowed: golden.allowed_duty_error(policy.numeric_format),
        worst: worst.and_then(told),
    })
}

/// The gains that the trainer's outputs are, a row for each vector.
fn of_outputs(head: &Schedule, outputs: &[f32]) -> Vec<Vec<f64>> {
    let row = |row: &[f32]| {
        let both = head.gains.iter().zip(row);
        both.map(|(gain, y)| gain.value(f64::from(*y))).collect()
    };
    outputs.chunks_exact(head.gains.len().max(1)).map(row).collect()
}

fn found(policy: &Policy, golden: &Golden) -> Vec<Vec<f64>> {
    match policy.numeric_format.scalar() {
        Scalar::F32 => in_format::<f32>(policy, golden),
        Scalar::F64 => in_format::<f64>(policy, golden),
    }
}

fn in_format<T: Real>(policy: &Policy, golden: &Golden) -> Vec<Vec<f64>> {
    let controller = Controller::<T>::new(policy);
    let row = |outputs: &ndarray::Array1<T>| {
        let gains = controller.gains(&outputs.view()).unwrap_or_default();
        gains.into_iter().map(Real::to_f64).collect()
    };
    answers(&controller, golden).iter().map(row).collect()
}

/// The gain that is farthest off, and by which share of its range; infinite if one is no number.
fn largest(head: &Schedule, expected: &[f64], found: &[f64]) -> (usize, f64) {
    let errors = head.gains.iter().zip(expected.iter().zip(found)).map(|(gain, (e, f))| {
        let error = (e - f).abs() / gain.span();
        if error.is_nan() { f64::INFINITY } else { error }
    });
    let larger = |worst: (usize, f64), this: (usize, f64)| if this.1 > worst.1 { this } else { worst };
    errors.enumerate().fold((0, 0.0), larger)
}

/// Compares the network's outputs with the trainer's outputs and duties; rows that are missing count as wrong.
pub(crate) fn judge(golden: &Golden, head: &Schedule, answers: &[&[f64]]) -> GoldenResult {
    // `zip` below leaves out what is missing, and must not pass it
    let is_whole = answers.len() >= golden.count && answers.iter().all(|row| row.len() >= head.gains.len());
    let missing = if is_whole { 0.0 } else { f64::INFINITY };
    let found: Vec<Vec<f64>> = (answers.iter())
        .map(|row| head.gains.iter().zip(*row).map(|(gain, y)| gain.value(*y)).collect())
        .collect();
    let of_gains = || {
        let expected = of_outputs(head, &golden.q_values);
        let errors = expected.iter().zip(&found).map(|(e, f)| largest(head, e, f).1);
        errors.fold(missing, f64::max)
    };
    let of_duties = || {
        let laws = golden.law.chunks_exact(head.gains.len() + 1);
        let rows = golden.duties.iter().zip(laws).zip(&found);
        rows.filter_map(|((duty, law), gains)| duty_error(head, f64::from(*duty), law, gains))
            .fold(missing, f64::max)
    };
    GoldenResult {
        vectors: golden.count,
        actions_compared: 0,
        actions_equal: 0,
        worst_relative_error: None,
        worst_duty_error: (!golden.law.is_empty()).then(of_duties),
        worst_gain_error: (!golden.q_values.is_empty()).then(of_gains),
        limits_range: Some(head.limits.high - head.limits.low),
        output_error: None,
        activations: Vec::new(),
        tolerance: golden.tolerance,
        rounded: false,
        outputs: Vec::new(),
    }
}

/// Error of the duty of a law, base before factors, as a share of the limits; `None` where a factor is not known.
fn duty_error(head: &Schedule, expected: f64, law: &[f64], gains: &[f64]) -> Option<f64> {
    let (base, factors) = law.split_first()?;
    if law.iter().any(|value| value.is_nan()) {
        return None;
    }
    let products = gains.iter().zip(factors).map(|(gain, x)| gain * x);
    let sum: f64 = base + products.sum::<f64>();
    let (low, high) = (head.limits.low, head.limits.high);
    // in the dead zone the base alone is commanded, and an observation does not say whether it is one
    let of = |duty: f64| (expected - duty.clamp(low, high)).abs();
    let rest = if head.dead_zone.is_empty() {
        f64::INFINITY
    } else {
        of(*base)
    };
    let error = of(sum).min(rest) / (high - low).max(f64::MIN_POSITIVE);
    Some(if error.is_nan() { f64::INFINITY } else { error })
}

#[cfg(test)]
mod tests {
    use policy::{Expr, Factor, Gain, Interval, Source, Squash};

    use super::*;

    /// duty = 0.3 + g0 x + g1 within 0.1 to 0.9, with g0 of -0.5 to 0.5 and g1 of 0 to 0.2.
    fn head() -> Schedule {
        let clip = |low, high| Some(Squash::Clip(Interval { low, high }));
        let source = Source {
            tree: Expr::Constant(0.3),
            text: "0.3".to_owned(),
        };
        let gain = |factor, squash, scale| Gain {
            factor,
            squash,
            scale,
            offset: 0.0,
            limits: None,
            factor_bound: Interval { low: -4.0, high: 4.0 },
        };
        Schedule {
            gains: vec![
                gain(Factor::Feature(0), clip(-1.0, 1.0), 0.5),
                gain(Factor::One, clip(0.0, 0.2), 1.0),
            ],
            base: source,
            base_bound: Interval { low: 0.3, high: 0.3 },
            dead_zone: Vec::new(),
            limits: Interval { low: 0.1, high: 0.9 },
        }
    }

    /// Factors 1 and 2; outputs .5 and .1, and -.25 and .2, with the duties of the law.
    fn golden() -> Golden {
        Golden {
            count: 2,
            outside: 0,
            observations: vec![1.0, 2.0],
            q_values: vec![0.5, 0.1, -0.25, 0.2],
            action_indices: Vec::new(),
            duties: vec![0.65, 0.25],
            law: vec![0.3, 1.0, 1.0, 0.3, 2.0, 1.0],
            outputs: Vec::new(),
            tolerance: 1e-5,
            decisions: None,
            duty_error: None,
        }
    }

    fn judged(golden: &Golden, answers: [[f64; 2]; 2]) -> GoldenResult {
        judge(golden, &head(), &[&answers[0], &answers[1]])
    }

    const RIGHT: [[f64; 2]; 2] = [[0.5, 0.1], [-0.25, 0.2]];

    #[test]
    fn right_outputs_pass_and_their_duties_too() {
        let result = judged(&golden(), RIGHT);
        assert!(result.passed(), "{result}");
        assert!(result.worst_gain_error.unwrap() < 1e-7 && result.worst_duty_error.unwrap() < 1e-6);
        // cut off by the clip: the same gain
        let saturated = Golden {
            q_values: vec![0.5, 0.1, -0.25, 7.0],
            ..golden()
        };
        assert!(judged(&saturated, RIGHT).passed());
    }

    #[test]
    fn the_error_of_a_gain_is_a_share_of_its_own_range() {
        let result = judged(&golden(), [[0.5, 0.1], [-0.25, 0.15]]);
        assert!(!result.passed());
        // .05 of .2
        assert!((result.worst_gain_error.unwrap() - 0.25).abs() < 1e-6);
        // .05 of .8
        assert!((result.worst_duty_error.unwrap() - 0.0625).abs() < 1e-6);
    }

    #[test]
    fn right_gains_with_other_duties_blame_the_law() {
        let swapped = Golden {
            law: vec![0.3, 2.0, 1.0, 0.3, 1.0, 1.0],
            ..golden()
        };
        let result = judged(&swapped, RIGHT);
        assert!(!result.passed());
        assert!(
            result.hint().contains("base, sources, features and the order of gains"),
            "{}",
            result.hint()
        );
    }

    #[test]
    fn rows_that_do_not_tell_the_law_are_left_out_and_missing_rows_are_not() {
        let hidden = Golden {
            law: vec![0.3, f64::NAN, 1.0, 0.3, 2.0, 1.0],
            q_values: Vec::new(),
            duties: vec![0.9, 0.25],
            ..golden()
        };
        assert!(judged(&hidden, RIGHT).passed());
        assert!(!judge(&golden(), &head(), &[&RIGHT[0]]).passed());
        assert!(!judged(&golden(), [[f64::NAN, 0.1], [-0.25, 0.2]]).passed());
    }

    /// An observation does not say whether the step is in the dead zone: the base alone is right as well.
    #[test]
    fn with_a_dead_zone_the_base_is_an_answer_too() {
        let mut head = head();
        let still = Golden {
            q_values: Vec::new(),
            duties: vec![0.3, 0.25],
            ..golden()
        };
        let answers: [&[f64]; 2] = [&RIGHT[0], &RIGHT[1]];
        assert!(!judge(&still, &head, &answers).passed());
        head.dead_zone = vec![policy::Still {
            source: head.base.clone(),
            within: 1.0,
        }];
        assert!(judge(&still, &head, &answers).passed());
    }
}
