//! Known answers of the trainer: was the network read as he meant, and does the numeric format keep his decisions?

use std::fmt;

use ndarray::aview1;
use policy::{Activation, Golden, Head, NumericFormat, Policy, Scalar};
use serde::Serialize;

use crate::decisions::answers;
pub use crate::refusal::refusal;
pub use crate::several::OutputResult;
pub use crate::unproven::unproven;
use crate::{Controller, Real, argmax};
use crate::{duties, gains, several};

/// Known answers of the trainer against the interpreter or a build.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GoldenResult {
    /// Number of vectors.
    pub vectors: usize,
    /// Vectors with an action to compare; 0 if the trainer gave Q values only.
    pub actions_compared: usize,
    /// Vectors with the trainer's action.
    pub actions_equal: usize,
    /// Largest |Q - golden| relative to the largest |Q| of its vector; `None` if the trainer gave actions only.
    pub worst_relative_error: Option<f64>,
    /// Largest |duty - golden| of a continuous head or a gain schedule as a share of its range; `None` for a choice.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub worst_duty_error: Option<f64>,
    /// Largest |gain - golden gain| of a gain schedule as a share of that gain's range; `None` of any other head.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub worst_gain_error: Option<f64>,
    /// Of a gain schedule the range of the limits, of which the error of the duty is a share: no gain has this one.
    #[serde(skip)]
    pub limits_range: Option<f64>,
    /// Largest |duty - duty of the golden output| as that share: small where the network is right and only the way from its
    /// output to the duty is another.
    #[serde(skip)]
    pub output_error: Option<f64>,
    /// Other activations of the hidden layers with which the same weights give every golden answer, as a contract says them.
    #[serde(skip)]
    pub activations: Vec<String>,
    /// Allowed error.
    pub tolerance: f64,
    /// The answers are those of a network that was rounded to integers: told, not judged. The trainer's network is judged
    /// in binary32 then.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub rounded: bool,
    /// Each of several outputs, in their order; the numbers above are then their sums and largest errors. Empty where there is one.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub outputs: Vec<OutputResult>,
}

impl GoldenResult {
    /// All duties, or all Q values within the tolerance, or all actions equal where the trainer gave no Q values; or rounded. With Q values
    /// the actions are [`crate::decisions::Decisions`], which know ties.
    #[must_use]
    pub fn passed(&self) -> bool {
        if !self.outputs.is_empty() {
            return self.outputs.iter().all(|own| own.result.passed());
        }
        let actions = self.actions_equal == self.actions_compared;
        let errors = match [self.worst_duty_error, self.worst_gain_error] {
            [None, None] => [self.worst_relative_error, None],
            errors => errors,
        };
        let mut given = errors.iter().flatten().peekable();
        let read = match given.peek() {
            None => actions,
            Some(_) => given.all(|error| *error <= self.tolerance),
        };
        self.rounded || read
    }
}

impl fmt::Display for GoldenResult {
    /// In one line: equal actions, the largest error of Q beside the allowed one, and whether that is too much; of several outputs
    /// each by its name.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.outputs.is_empty() {
            let each: Vec<String> = self.outputs.iter().map(ToString::to_string).collect();
            return f.write_str(&each.join("; "));
        }
        let mut parts = Vec::new();
        if self.actions_compared > 0 {
            parts.push(format!(
                "action equal in {} of {}",
                self.actions_equal, self.actions_compared
            ));
        }
        if let Some(error) = self.worst_duty_error {
            let range = self
                .limits_range
                .map(|range| format!("the range of the limits, {}", (1e6 * range).round() / 1e6));
            let range = range.unwrap_or_else(|| "its range".to_owned());
            parts.push(format!(
                "largest error of the duty {error:.1e} of {range} (allowed {:.0e})",
                self.tolerance
            ));
        }
        if let Some(error) = self.worst_gain_error {
            parts.push(format!(
                "largest error of a gain {error:.1e} of its range (allowed {:.0e})",
                self.tolerance
            ));
        }
        if let Some(error) = self.worst_relative_error {
            parts.push(format!(
                "largest relative error of Q {error:.1e} (allowed {:.0e})",
                self.tolerance
            ));
        }
        let word = if self.passed() { "" } else { "DIFFERENT: " };
        write!(f, "{word}{}", parts.join(", "))
    }
}

/// Compares the network's outputs, a row for each golden vector, with the trainer's answers; rows that are missing count as
/// wrong.
#[must_use]
pub fn judge(golden: &Golden, head: &Head, answers: &[&[f64]]) -> GoldenResult {
    match head {
        Head::Several(outputs) => several::judge(golden, outputs, answers),
        Head::Choice(_) | Head::Residual(_) => judge_choices(golden, answers),
        Head::Continuous(head) => judge_duties(golden, head, answers),
        Head::Schedule(head) => gains::judge(golden, head, answers),
    }
}

fn judge_duties(golden: &Golden, head: &policy::Continuous, answers: &[&[f64]]) -> GoldenResult {
    // `zip` below leaves out what is missing, and must not pass it
    let missing = if answers.len() < golden.count {
        f64::INFINITY
    } else {
        0.0
    };
    let found = || {
        answers
            .iter()
            .filter_map(|row| row.first())
            .map(|output| head.duty(*output))
    };
    let worst = |expected: &[f64]| {
        let errors = expected.iter().zip(found()).map(|(e, f)| duties::error(head, *e, f));
        errors.fold(missing, f64::max)
    };
    let from_outputs: Vec<f64> = golden.q_values.iter().map(|y| head.duty(f64::from(*y))).collect();
    GoldenResult {
        vectors: golden.count,
        actions_compared: 0,
        actions_equal: 0,
        worst_relative_error: None,
        worst_duty_error: duties::given(head, golden).map(|expected| worst(&expected)),
        worst_gain_error: None,
        limits_range: None,
        output_error: (!from_outputs.is_empty()).then(|| worst(&from_outputs)),
        activations: Vec::new(),
        tolerance: golden.tolerance,
        rounded: false,
        outputs: Vec::new(),
    }
}

fn judge_choices(golden: &Golden, answers: &[&[f64]]) -> GoldenResult {
    let actions_equal = golden
        .action_indices
        .iter()
        .zip(answers)
        .filter(|(expected, q)| argmax(aview1(q)) == **expected as usize)
        .count();
    // `zip` below leaves out what is missing, and must not pass it
    let missing = answers.len() < golden.count;
    let actions = golden.q_values.len() / golden.count.max(1);
    let worst = golden
        .q_values
        .chunks_exact(actions.max(1))
        .zip(answers)
        .map(|(expected, q)| relative_error(expected, q))
        .fold(if missing { f64::INFINITY } else { 0.0 }, f64::max);
    GoldenResult {
        vectors: golden.count,
        actions_compared: golden.action_indices.len(),
        actions_equal,
        worst_relative_error: (!golden.q_values.is_empty()).then_some(worst),
        worst_duty_error: None,
        worst_gain_error: None,
        limits_range: None,
        output_error: None,
        activations: Vec::new(),
        tolerance: golden.tolerance,
        rounded: false,
        outputs: Vec::new(),
    }
}

/// Largest difference relative to the largest expected |Q|; infinite if a value is no number.
fn relative_error(expected: &[f32], got: &[f64]) -> f64 {
    // relative to the largest of the row: near 0 a Q value has lost its digits to the sums that it is made of
    let largest = expected
        .iter()
        .map(|q| f64::from(q.abs()))
        // a row of zeros has no largest: the division stays one by a number
        .fold(f64::MIN_POSITIVE, f64::max);
    expected
        .iter()
        .zip(got)
        .map(|(e, g)| (f64::from(*e) - g).abs() / largest)
        .map(|error| if error.is_nan() { f64::INFINITY } else { error })
        .fold(0.0, f64::max)
}

/// The interpreter's answers against the trainer's; `None` without golden vectors.
///
/// A network in integers is judged in binary32: how it was read is the question here, what rounding costs that of
/// [`crate::decisions`].
#[must_use]
pub fn golden_result(policy: &Policy) -> Option<GoldenResult> {
    let golden = policy.golden.as_ref()?;
    let format = match policy.numeric_format.is_integer() {
        true => NumericFormat::F32,
        false => policy.numeric_format,
    };
    let policy = policy.clone().with_format(format);
    let mut result = judged(&policy, golden);
    // actions alone may be equal by chance, of a few answers, or where most are one action
    let is_by_chance = || !result.is_of_numbers() && result.worst_relative_error.is_none() && is_by_chance(golden);
    if !result.passed() && !is_by_chance() {
        result.activations = activations(&policy, golden);
    }
    Some(result)
}

fn judged(policy: &Policy, golden: &Golden) -> GoldenResult {
    let rows = match policy.numeric_format.scalar() {
        Scalar::F32 => wide::<f32>(policy, golden),
        Scalar::F64 => wide::<f64>(policy, golden),
    };
    let rows: Vec<&[f64]> = rows.iter().map(Vec::as_slice).collect();
    judge(golden, &policy.head, &rows)
}

/// Fewest answers that are not the most frequent action, for equal actions to tell one network from another: to guess each of them between
/// two has a chance of one in a million.
const TELLING: usize = 20;

/// Whether another network may well have chosen these actions.
fn is_by_chance(golden: &Golden) -> bool {
    let each: Vec<&[u32]> = match golden.outputs.as_slice() {
        [] => vec![&golden.action_indices],
        outputs => outputs.iter().map(|output| &output.action_indices[..]).collect(),
    };
    let most = |actions: &[u32]| {
        let mut sorted = actions.to_vec();
        sorted.sort_unstable();
        sorted.chunk_by(|a, b| a == b).map(<[u32]>::len).max().unwrap_or(0)
    };
    each.iter().map(|actions| actions.len() - most(actions)).sum::<usize>() < TELLING
}

/// The activations with which the same weights give every golden answer.
fn activations(policy: &Policy, golden: &Golden) -> Vec<String> {
    let mut other = policy.clone();
    let fitting = Activation::EACH.iter().filter(|activation| {
        let hidden = other.layers.len().saturating_sub(1);
        for layer in other.layers.iter_mut().take(hidden) {
            layer.activation = **activation;
        }
        hidden > 0 && judged(&other, golden).passed()
    });
    fitting.map(|activation| activation.written()).collect()
}

fn wide<T: Real + Into<f64>>(policy: &Policy, golden: &Golden) -> Vec<Vec<f64>> {
    let rows = answers::<T>(&Controller::new(policy), golden);
    rows.into_iter()
        .map(|q| q.into_iter().map(Into::into).collect())
        .collect()
}

/// What to look at when the network does not give the trainer's answers.
const MISREAD: &str = "look at hidden_activation, the order of layers, transpose, and in the golden file at the order of obs's \
                           columns and at the first action, which is 0: the contract says something else than the trainer did";

/// The same of a continuous head.
const MISREAD_DUTY: &str = "look at squash or clip, scale and offset in [actions], at hidden_activation, the order of layers, transpose, and \
                            in the golden file at the order of obs's columns: the contract says something else than the trainer did";

/// All actions equal, and Q values off by no more than this share: their sums were made in another order. Sums of 64 products
/// in binary32, ordered otherwise, were seen to differ by 8.5e-6. A share of its own and none of the tolerance, for a wide
/// tolerance does not make a wrong network one that was rounded.
const ROUNDING: f64 = 1e-4;

/// What to look at where the network is right and its duties are not.
const SCALED: &str = "the network's outputs are the trainer's: squash or clip, scale and offset in [actions] make another duty of them \
                      than the training did";

/// What to look at where the same network was computed otherwise.
const ROUNDED: &str = "every action is equal: the trainer adds in another order, or in another format; golden_tolerance in \
                       [network] says how far its Q values may be off";

/// What to look at where the gains are right and the duties are not.
const LAW: &str = "the gains are the trainer's: base, sources, features and the order of gains in [actions] make another duty of them \
                   than the training did";

impl GoldenResult {
    /// Whether duties or gains were compared, and no choice.
    pub(crate) fn is_of_numbers(&self) -> bool {
        self.worst_duty_error.is_some() || self.worst_gain_error.is_some()
    }

    /// What to look at, if it has not passed.
    #[must_use]
    pub fn hint(&self) -> String {
        match self.activations.as_slice() {
            [] => several::hint(self).unwrap_or_else(|| self.general_hint().to_owned()),
            fitting => format!(
                "with hidden_activation = {} the same weights give all {} golden answers",
                fitting.join(" or "),
                self.vectors
            ),
        }
    }

    fn general_hint(&self) -> &'static str {
        if self.worst_gain_error.is_some_and(|error| error <= self.tolerance) {
            return LAW;
        }
        if self.is_of_numbers() {
            let is_read = self.output_error.is_some_and(|error| error <= self.tolerance);
            return if is_read { SCALED } else { MISREAD_DUTY };
        }
        let is_near = self.worst_relative_error.is_some_and(|error| error <= ROUNDING);
        let is_equal = self.actions_compared > 0 && self.actions_equal == self.actions_compared;
        if is_near && is_equal { ROUNDED } else { MISREAD }
    }
}

#[cfg(test)]
mod tests;
