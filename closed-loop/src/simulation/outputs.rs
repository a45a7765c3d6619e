//! What each of several outputs did while one of them drove the plant.

use interp::status;
use policy::{DutyPath, Policy, Scalar};
use report::grouped;
use serde::Serialize;

use super::findings::{Setting, Step};
use crate::controller::{Answer, Trajectory};
use crate::tables::line;

/// The columns of a table for people, behind the first.
pub(super) const OUTPUTS: [&str; 5] = ["least duty", "largest duty", "limits", "at a limit", "in fallback"];

/// One output over the run at the first sampling instant, from its start.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OutputUse {
    /// Its name in the contract.
    pub name: String,
    /// Whether its duty is the plant's.
    pub drives: bool,
    /// Least and largest commanded duty, 0..1.
    pub duty: [f64; 2],
    /// Its limits in the contract.
    pub limits: [f64; 2],
    /// Control periods with the duty at one of them.
    pub at_limit: usize,
    /// Control periods in which the fallback was commanded.
    pub fallbacks: usize,
    /// Control periods of the run.
    pub periods: usize,
}

/// All outputs of a contract with several, in its order; none where there is one.
pub(super) fn outputs(setting: &Setting, step: &Step) -> Vec<OutputUse> {
    let names = setting.policy.output_names();
    let Some((_, course)) = step.courses.first().filter(|_| !names.is_empty()) else {
        return Vec::new();
    };
    let paths = setting.policy.paths();
    let used = |(index, path): (usize, &DutyPath<'_>)| {
        let answers = answers(&course.shown, setting.output, index);
        let scalar = setting.policy.numeric_format.scalar();
        one(path, index == setting.output, scalar, &answers)
    };
    paths.iter().enumerate().map(used).collect()
}

/// The answers of the output `index` where `driving` drives the plant.
fn answers(run: &Trajectory, driving: usize, index: usize) -> Vec<Answer> {
    if index == driving {
        return run.periods.iter().map(|period| period.answer).collect();
    }
    // the others stand without the one that drives
    let place = if index < driving {
        index
    } else {
        index.saturating_sub(1)
    };
    let of_period = run.others.iter().filter_map(|others| others.get(place));
    of_period.copied().collect()
}

fn one(path: &DutyPath<'_>, drives: bool, scalar: Scalar, answers: &[Answer]) -> OutputUse {
    let duties = || answers.iter().map(|answer| answer.duty);
    let is_fallback = |answer: &&Answer| answer.status & status::FALLBACK != 0;
    // as the controller has them, rounded inwards
    let (low, high) = (scalar.up(path.limits.duty.low), scalar.down(path.limits.duty.high));
    let is_at = |answer: &&Answer| !is_fallback(answer) && (answer.duty <= low || answer.duty >= high);
    OutputUse {
        name: path.name.unwrap_or_default().to_owned(),
        drives,
        duty: [
            duties().fold(f64::INFINITY, f64::min),
            duties().fold(f64::NEG_INFINITY, f64::max),
        ],
        limits: [path.limits.duty.low, path.limits.duty.high],
        at_limit: answers.iter().filter(is_at).count(),
        fallbacks: answers.iter().filter(is_fallback).count(),
        periods: answers.len(),
    }
}

impl OutputUse {
    /// What the table calls it.
    pub(super) fn called(&self) -> String {
        match self.drives {
            true => format!("{} (plant)", self.name),
            false => self.name.clone(),
        }
    }

    /// In [`OUTPUTS`].
    pub(super) fn cells(&self) -> [String; 5] {
        let [least, largest] = self.duty.map(|duty| format!("{duty:.4}"));
        let of = |count: usize| format!("{} of {}", grouped(count as u64), grouped(self.periods as u64));
        let limits = format!("{} .. {}", self.limits[0], self.limits[1]);
        [least, largest, limits, of(self.at_limit), of(self.fallbacks)]
    }
}

/// Table for people; empty where there is one output.
pub(super) fn table(setting: &Setting, step: &Step) -> String {
    let outputs = outputs(setting, step);
    if outputs.is_empty() {
        return String::new();
    }
    let mut out = line("outputs", &OUTPUTS.map(str::to_owned));
    for output in &outputs {
        out.push_str(&line(&output.called(), &output.cells()));
    }
    out.push_str(&line("status of all", &[status_words(step)]));
    out
}

/// The bits of the one status word over the run, each with its control periods: `PRIMED in 1, LIMITED in 80`.
pub(super) fn status_words(step: &Step) -> String {
    let periods = step
        .courses
        .first()
        .map_or(&[][..], |(_, course)| &course.shown.periods);
    let bits = status::NAMES.iter().enumerate().filter_map(|(bit, name)| {
        let set = periods.iter().filter(|period| period.answer.status >> bit & 1 == 1);
        let count = set.count();
        (count > 0).then(|| format!("{name} in {}", grouped(count as u64)))
    });
    let bits: Vec<String> = bits.collect();
    match bits.is_empty() {
        true => "-".to_owned(),
        false => bits.join(", "),
    }
}

/// Which output drives the plant, in words; `None` where there is one.
pub(super) fn drives(policy: &Policy, output: usize) -> Option<String> {
    let names = policy.output_names();
    let own = names.get(output)?;
    let others: Vec<&str> = names.iter().filter(|name| *name != own).copied().collect();
    let (list, verb) = match others.as_slice() {
        [one] => ((*one).to_owned(), "is"),
        many => (many.join(", "), "are"),
    };
    Some(format!("{own} drives the plant, {list} {verb} computed beside it"))
}

/// Names of the outputs that do not drive the plant.
pub(super) fn names_beside(setting: &Setting) -> Vec<&str> {
    let names = setting.policy.output_names();
    let others = names
        .into_iter()
        .enumerate()
        .filter(|(index, _)| *index != setting.output);
    others.map(|(_, name)| name).collect()
}
