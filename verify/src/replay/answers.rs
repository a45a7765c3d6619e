//! A log as the trainer's answers: what an integer format changes of its decisions, and golden answers to keep.

use interp::decisions::{Decisions, decisions};
use policy::{DutyPath, Golden, Head, NumericFormat, OutputAnswers, Policy};
use toml_input::{Faults, Message};

use super::explain::Course;
use super::log::{Done, Log};
use super::{Wanted, compared, course};

/// What the policy's integer format changes of the decisions of a log whose features and decisions are the contract's in floats;
/// `None` where the format is no integer's, or the log differs in floats as well.
///
/// # Errors
/// As of [`replay`](super::replay).
pub(super) fn changed(policy: &Policy, log: &Log, wanted: Wanted) -> Result<Option<Decisions>, Faults> {
    if !policy.numeric_format.is_integer() || matches!(policy.head, Head::Schedule(_)) || wanted.exploring {
        return Ok(None);
    }
    let float = policy.clone().with_format(NumericFormat::F32);
    if !compared(&float, log, wanted)?.equal() {
        return Ok(None);
    }
    let course = course::<f32>(&log.widened(&float), log)?;
    let own = course.outputs.iter().map(|own| OutputAnswers {
        action_indices: own.actions.clone(),
        duties: own.duties.iter().map(|duty| *duty as f32).collect(),
    });
    let mut answered = policy.clone();
    answered.golden = Some(golden(policy, log, &course, own.collect()));
    Ok(decisions(&answered, None))
}

/// The answers of a log that the contract explains: its observations, or where it does not have all of them the contract's, with the
/// trainer's choices or duties.
///
/// # Errors
/// If an output has no choice or duty in the log, or the policy is one of gains, whose answers a log does not have.
pub fn answers(policy: &Policy, log: &Log) -> Result<Golden, Faults> {
    if matches!(policy.head, Head::Schedule(_)) {
        let message = Message::new("a log has no golden answers of gains").found("`gains` in [actions]");
        return Err(message
            .hint("golden answers of the trainer: obs [n, features], output [n, gains]")
            .into());
    }
    let float = policy.clone().with_format(NumericFormat::F32);
    let course = course::<f32>(&log.widened(&float), log)?;
    let paths = policy.paths();
    let own: Option<Vec<OutputAnswers>> = paths.iter().zip(&log.done).map(of_log).collect();
    let Some(own) = own else {
        let message = Message::new("the log does not say what the trainer's network chose").found(log.columns());
        return Err(message
            .expected("a column `action`, of a continuous output `duty`")
            .hint("`action` is the index of the choice, from 0; where the duties of the contract are a list, `duty` alone says it, too")
            .into());
    };
    Ok(golden(policy, log, &course, own))
}

fn of_log((path, done): (&DutyPath<'_>, &Done)) -> Option<OutputAnswers> {
    let mut answers = OutputAnswers::default();
    match path.head.is_choice() {
        true => answers.action_indices.clone_from(done.actions.as_ref()?),
        false => answers.duties = done.commanded()?.iter().map(|duty| *duty as f32).collect(),
    }
    Some(answers)
}

fn golden(policy: &Policy, log: &Log, course: &Course, own: Vec<OutputAnswers>) -> Golden {
    let logged: Option<Vec<&Vec<f64>>> = log.observed.iter().map(Option::as_ref).collect();
    let value = |row: usize, feature: usize| {
        let of = logged.as_ref().and_then(|logged| logged.get(feature).copied());
        let of = of.map_or_else(|| course.observation(feature), Vec::as_slice);
        of.get(row).copied().unwrap_or(f64::NAN) as f32
    };
    let features = policy.features.len();
    let observations = (0..log.rows()).flat_map(|row| (0..features).map(move |feature| (row, feature)));
    let limits = policy.golden.as_ref();
    let paths = policy.paths();
    // each head has answers of its own kind
    let own = own
        .into_iter()
        .zip(&paths)
        .map(|(own, path)| match path.head.is_choice() {
            true => OutputAnswers {
                duties: Vec::new(),
                ..own
            },
            false => OutputAnswers {
                action_indices: Vec::new(),
                ..own
            },
        });
    let own: Vec<OutputAnswers> = own.collect();
    let (one, outputs) = match (own.as_slice(), &policy.head) {
        ([one], head) if !matches!(head, Head::Several(_)) => (one.clone(), Vec::new()),
        _ => (OutputAnswers::default(), own),
    };
    Golden {
        count: log.rows(),
        outside: 0,
        observations: observations.map(|(row, feature)| value(row, feature)).collect(),
        q_values: Vec::new(),
        action_indices: one.action_indices,
        duties: one.duties,
        law: Vec::new(),
        outputs,
        tolerance: policy.golden_tolerance(),
        decisions: limits.and_then(|limits| limits.decisions),
        duty_error: limits.and_then(|limits| limits.duty_error),
    }
}
