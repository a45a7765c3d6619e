//! An empirical term: what is left where no cause explains the records, described and not explained.
//!
//! ```text
//! in    records over time, the model that the causes leave
//! fit   a correction of the duty over duty, voltage, current and rate, few coefficients (plant/src/effects/empirical.rs)
//! keep  if it lowers the error in what was left out of the fit, spoils no channel, and comes to rest
//! out   a better model with no statement about a cause, or a reason why not
//! ```
//!
//! Invariant: it is fitted behind everything else and moves nothing else. Verdict and causes are those without it.

mod choose;
mod stable;
mod terms;

use std::collections::BTreeMap;

use plant::Parameters;

use crate::drive::{Model, simulate};
use crate::fit::State;
use crate::gain::{Pair, Regime};
use crate::problem::{Problem, Starts};
use crate::record::Record;
use crate::words::si;
use crate::worth::{self, Worth};

/// The left-out error falls to this share of what it was, or there is no term: half of that is what five folds of one record scatter.
const MARGIN: f64 = 0.9;
/// No channel of the training records, and of the held-out records no record's, may be worse than by this factor.
const WORSE: f64 = 1.02;
/// Fewest rows over time in all: five folds of fewer hold no course of anything.
const FEWEST_ROWS: usize = 200;

/// What is written of an empirical term.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Empirical {
    /// What it does, in a sentence, and that it is no cause.
    pub sentence: String,
    /// Whether `plant.extended.toml` has it.
    pub written: bool,
    /// Coefficients by their keys under `[empirical]`, duty.
    pub coefficients: BTreeMap<&'static str, f64>,
    /// What was left out in turn, `records` or `stretches`.
    pub left_out: &'static str,
    /// Error over the noise in what was left out, root mean square: without and with the term.
    pub left_out_error: [f64; 2],
    /// Errors of records, without and with the term.
    pub errors: Vec<Worth>,
}

/// A term with the records to which it was fitted.
#[derive(Debug)]
pub struct Described {
    /// For `diagnosis.json`.
    pub findings: Empirical,
    /// The records.
    pub problem: Problem,
    /// Without it.
    pub before: State,
    /// With it.
    pub after: State,
}

/// The model without a correction that it already has, and a note where it has one: beside it causes would take what it describes, or
/// leave what it imitates.
pub fn without_standing(model: &Parameters) -> (Parameters, Option<String>) {
    let mut plain = model.clone();
    plain.empirical = Parameters::default().empirical;
    let note = (plain.empirical != model.empirical).then(|| {
        "the model's table [empirical] is left out of the diagnosis, which compares and extends the model without it: a correction \
         that explains nothing must not stand beside causes"
            .to_owned()
    });
    (plain, note)
}

/// Whether records could show a term at all.
fn has_course(records: &[Record]) -> bool {
    let over_time = || records.iter().filter(|record| !record.settled);
    records.len() == over_time().count() && over_time().map(Record::rows).sum::<usize>() >= FEWEST_ROWS
}

/// The term that describes what `model` leaves of the records, if there is one; `trim` is what the edges add.
#[must_use]
pub fn described(problem: &Problem, model: &Model, trim: f64) -> Option<Described> {
    if !has_course(&problem.records) {
        return None;
    }
    let mut problem = problem.clone();
    // its constant stands for all duty that is added, and the trim is that of the file
    problem.trim_held = true;
    let starts = Starts {
        trim,
        ..problem.first_starts(model)
    };
    let before = State::settle(&problem, model, &starts, None);
    let mut null = before.clone();
    let shown: Vec<[f64; 2]> = (problem.records.iter().enumerate())
        .flat_map(|(n, record)| simulate(model, record, &before.starts.of(n)))
        .map(|row| [row[0], row[1]])
        .collect();
    let candidates = terms::candidates(&problem, &shown, &mut null.model.plant);
    let folds = choose::folds(&problem);
    let (error, channels) = choose::without(&problem, &before, &folds);
    let best = choose::chosen(&problem, &null, &candidates, &folds)?;
    let spoils = best
        .channels
        .iter()
        .zip(&channels)
        .any(|(is, was)| *is > WORSE * was.max(1.0));
    if best.error > MARGIN * error || spoils {
        return None;
    }
    let after = best.fit.state;
    if !stable::is_stable(&problem, &model.plant, &after.model.plant) {
        return None;
    }
    let named = best.fit.causes.iter().zip(&best.fit.values);
    let coefficients = named
        .map(|(n, value)| (candidates[*n].form.knobs[0].name, *value))
        .collect();
    let errors = worth::of_training(&problem, &before, &after);
    Some(Described {
        findings: Empirical {
            sentence: String::new(),
            written: true,
            coefficients,
            left_out: if problem.records.len() >= 3 {
                "records"
            } else {
                "stretches"
            },
            left_out_error: [error, best.error],
            errors,
        },
        problem,
        before,
        after,
    })
}

impl Described {
    /// Lets held-out records judge: a term that makes one of them worse is not written.
    pub fn judged(&mut self, pair: Option<&Pair>) {
        let mut worst: Option<(f64, String)> = None;
        let mut list = Vec::new();
        if let Some(pair) = pair {
            for held in pair.errors().iter().filter(|held| held.regime == Regime::All) {
                // within the noise nothing is better or worse
                let ratio = held.rmse_after / held.rmse_before.max(held.floor);
                if worst.as_ref().is_none_or(|(most, _)| ratio > *most) {
                    worst = Some((ratio, format!("{} of {}", held.channel, held.record)));
                }
            }
            list = worth::of_held(pair);
        }
        list.append(&mut self.findings.errors);
        self.findings.errors = list;
        let refused = worst.filter(|(ratio, _)| *ratio > WORSE);
        self.findings.written = refused.is_none();
        let [before, after] = self.findings.left_out_error;
        let what = format!(
            "A correction of the duty with {} describes a part of what is left, and explains nothing: where its rows were left \
             out of the fit the error falls from {before:.1} to {after:.1} times the noise.",
            match self.findings.coefficients.len() {
                1 => "1 coefficient".to_owned(),
                more => format!("{more} coefficients"),
            }
        );
        let judged = match (&refused, self.findings.errors.iter().find(|worth| worth.heldout)) {
            (Some((ratio, place)), _) => format!(
                " But in {place}, held out, it makes the error {ratio:.2} times as large: it does not hold there and is not written."
            ),
            (None, Some(worth)) => format!(
                " In {} of {}, held out, it takes the error from {} to {}. plant.extended.toml has it.",
                worth.channel,
                worth.record,
                si(worth.rmse_before, worth.unit),
                si(worth.rmse_after, worth.unit)
            ),
            (None, None) => " plant.extended.toml has it; no held-out record has judged it.".to_owned(),
        };
        self.findings.sentence = what + &judged;
    }
}
