//! A log as the trainer's answers: what an integer format changes of its decisions, and golden answers to keep.

use interp::decisions::{self, Decisions};
use policy::{Activation, DutyPath, Golden, Head, NumericFormat, OutputAnswers, Policy, Schedule, Squash};
use toml_input::{Faults, Message};

use super::log::{Done, Log};
use super::{Wanted, course};

/// What the policy's integer format changes of the decisions of a log whose features and decisions are the contract's in floats, and how
/// many rows do not count there; `None` where none does.
///
/// # Errors
/// As of [`replay`](super::replay).
pub(super) fn changed(policy: &Policy, log: &Log, wanted: Wanted) -> Result<(Option<Decisions>, usize), Faults> {
    let float = policy.clone().with_format(NumericFormat::F32);
    let course = course::<f32>(&log.widened(&float), log)?;
    // its own observations: by how much the log's are off is none of the format's doing
    let seen = |row: usize, feature: usize| course.observation(feature).get(row).copied();
    let answered = answered(policy, log, seen);
    let late = log.is_late(wanted.skip);
    let counted = answered.iter().copied().filter(|row| late.get(*row) == Some(&true));
    let rows: Vec<usize> = counted.collect();
    let uncounted = log.rows() - answered.len();
    if rows.is_empty() {
        return Ok((None, uncounted));
    }
    let own = course.outputs.iter().map(|own| OutputAnswers {
        action_indices: own.actions.clone(),
        duties: own.duties.iter().map(|duty| *duty as f32).collect(),
    });
    let mut known = policy.clone();
    known.golden = Some(golden(policy, &rows, seen, own.collect()));
    let mut found = decisions::decisions(&known, None);
    if let Some(found) = &mut found {
        at_rows(found, &rows);
    }
    Ok((found, uncounted))
}

/// Rows of golden answers as those of the log that they came from.
fn at_rows(decisions: &mut Decisions, rows: &[usize]) {
    let of = |row: &mut usize| *row = rows.get(*row).copied().unwrap_or(*row);
    match decisions {
        Decisions::Choice(choices) => choices.worst.iter_mut().for_each(|worst| of(&mut worst.row)),
        Decisions::Continuous(duties) => duties.worst.iter_mut().for_each(|worst| of(&mut worst.row)),
        Decisions::Schedule(gains) => gains.worst.iter_mut().for_each(|worst| of(&mut worst.row)),
        Decisions::Several(outputs) => outputs.iter_mut().for_each(|own| at_rows(&mut own.decisions, rows)),
    }
}

/// The rows that the controller answers: of others it never computes a decision, it holds the sample before.
fn answered(policy: &Policy, log: &Log, seen: impl Fn(usize, usize) -> Option<f64>) -> Vec<usize> {
    let signals = policy.signals.iter().enumerate();
    let measured: Vec<Vec<bool>> = signals
        .map(|(index, signal)| {
            let is_inside = |value: f64| (signal.range.low..=signal.range.high).contains(&value);
            log.physical(policy, index).map(is_inside).collect()
        })
        .collect();
    let is_measured = |row: &usize| measured.iter().all(|rows| rows.get(*row) == Some(&true));
    let is_seen = |row: &usize| {
        let mut features = policy.features.iter().enumerate();
        features.all(|(index, feature)| seen(*row, index).is_some_and(|value| feature.can_be(value)))
    };
    (0..log.rows()).filter(is_measured).filter(is_seen).collect()
}

/// The answers of a log that the contract explains: its observations, or where it does not have all of them the contract's, with the
/// trainer's choices or duties. Rows that the controller never answers are left out.
///
/// # Errors
/// If an output has no choice or duty in the log, no row is left, or the law of gains cannot be told from the observations.
pub fn answers(policy: &Policy, log: &Log) -> Result<Golden, Faults> {
    let float = policy.clone().with_format(NumericFormat::F32);
    let course = course::<f32>(&log.widened(&float), log)?;
    let paths = policy.paths();
    let own: Option<Vec<OutputAnswers>> = paths.iter().zip(&log.done).map(of_log).collect();
    let Some(own) = own else {
        let message = Message::new("the log does not say what the trainer's network chose").found(log.columns());
        return Err(message
            .expected("a column `action`, of a continuous output or a law with gains `duty`")
            .hint("`action` is the index of the choice, from 0; where the duties of the contract are a list, `duty` alone says it, too")
            .into());
    };
    let logged: Option<Vec<&Vec<f64>>> = log.observed.iter().map(Option::as_ref).collect();
    let seen = |row: usize, feature: usize| {
        let of = logged.as_ref().and_then(|logged| logged.get(feature).copied());
        of.map_or_else(|| course.observation(feature), Vec::as_slice)
            .get(row)
            .copied()
    };
    let rows = answered(policy, log, seen);
    if rows.is_empty() {
        let message = Message::new("no row of the log is one that the controller answers");
        return Err(message
            .found("in each a signal outside its range, or an observation that no plausible measurement gives")
            .hint("look at `range` of the signals")
            .into());
    }
    let mut golden = golden(policy, &rows, seen, own);
    golden.outside = log.rows() - rows.len();
    if let Some(head) = policy.head.schedule() {
        golden.law = law(policy, head, &golden)?;
    }
    Ok(golden)
}

/// Base and factors in each row, which a duty is nothing without.
fn law(policy: &Policy, head: &Schedule, golden: &Golden) -> Result<Vec<f64>, Message> {
    let told = policy::law_told(head, &policy.features, &golden.observations);
    let law = told.map_err(|text| {
        unsaid(
            head,
            format!("`{text}`, which is no number and no source of a feature without filters"),
        )
    })?;
    let mut rows = law.chunks_exact(head.gains.len() + 1);
    match rows.any(|row| row.iter().all(|value| value.is_finite())) {
        true => Ok(law),
        false => Err(unsaid(
            head,
            "features that lie at an end of their clip in every row".to_owned(),
        )),
    }
}

/// Duties that say nothing of the gains, and what would.
fn unsaid(head: &Schedule, found: String) -> Message {
    let mut ways: Vec<String> = head.gains.iter().map(|gain| of_action(gain.squash)).collect();
    ways.sort();
    ways.dedup();
    Message::new("the logged duties are no golden answers of this law: an observation does not tell all that it reads")
        .found(found)
        .expected("a base that is a number or the source of a feature, and factors that are features or such sources")
        .hint(format!(
            "write `obs` and `output` [n, gains], the network's last layer before squash or clip, yourself: the trainer's, or of its logged \
             actions {}",
            ways.join(", ")
        ))
}

/// The output of the network by the action that its squash makes.
fn of_action(squash: Option<Squash>) -> String {
    let (formula, behind) = match squash {
        Some(Squash::Curve(curve)) => {
            let formula = match curve {
                Activation::Tanh => "atanh(action)",
                Activation::Softsign => "action / (1 - |action|)",
                Activation::Sigmoid => "ln(action / (1 - action))",
                Activation::HardSigmoid => "6 action - 3",
                _ => "what the curve makes the action of",
            };
            (formula, format!("squash = {}", curve.written()))
        }
        // beyond an end the gain is that of the end
        Some(Squash::Clip(_)) => ("action", "a clip".to_owned()),
        None => ("action", "no squash".to_owned()),
    };
    format!("output = {formula} for {behind}")
}

/// The `golden_tolerance` with which the contract takes these answers, where it has a smaller one; `None` where it takes them, or they are
/// choices.
#[must_use]
pub fn tolerance(policy: &Policy, golden: &Golden) -> Option<String> {
    let mut known = policy.clone();
    known.golden = Some(golden.clone());
    let result = interp::golden::golden_result(&known).filter(|result| !result.passed())?;
    let error = result.worst_duty_error.filter(|error| error.is_finite())?;
    (error > golden.tolerance).then(|| decisions::accepting(error))
}

fn of_log((path, done): (&DutyPath<'_>, &Done)) -> Option<OutputAnswers> {
    let mut answers = OutputAnswers::default();
    match path.head.is_choice() {
        true => answers.action_indices.clone_from(done.actions.as_ref()?),
        false => answers.duties = done.commanded()?.iter().map(|duty| *duty as f32).collect(),
    }
    Some(answers)
}

fn golden(
    policy: &Policy,
    rows: &[usize],
    seen: impl Fn(usize, usize) -> Option<f64>,
    own: Vec<OutputAnswers>,
) -> Golden {
    let value = |row: usize, feature: usize| seen(row, feature).unwrap_or(f64::NAN) as f32;
    let features = policy.features.len();
    let observations = rows
        .iter()
        .flat_map(|row| (0..features).map(move |feature| (*row, feature)));
    let limits = policy.golden.as_ref();
    let paths = policy.paths();
    // each head has answers of its own kind
    let own = own
        .into_iter()
        .zip(&paths)
        .map(|(own, path)| match path.head.is_choice() {
            true => OutputAnswers {
                action_indices: of_rows(&own.action_indices, rows),
                duties: Vec::new(),
            },
            false => OutputAnswers {
                action_indices: Vec::new(),
                duties: of_rows(&own.duties, rows),
            },
        });
    let own: Vec<OutputAnswers> = own.collect();
    let (one, outputs) = match (own.as_slice(), &policy.head) {
        ([one], head) if !matches!(head, Head::Several(_)) => (one.clone(), Vec::new()),
        _ => (OutputAnswers::default(), own),
    };
    Golden {
        count: rows.len(),
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

fn of_rows<T: Copy>(values: &[T], rows: &[usize]) -> Vec<T> {
    rows.iter().filter_map(|row| values.get(*row).copied()).collect()
}
