//! The duties of a log against those of its actions: an index says nothing of what it commands.

use policy::{Expr, Head, Input, Policy};
use serde::Serialize;

use super::explain::number;
use super::log::Log;

/// What differs by less than this share of the largest duty is the same duty.
// three digits of a log; neighbours in a table of actions are farther apart
const SAME: f64 = 5e-3;

/// Duties that the log has with its actions, beside those of the contract.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DutyResult {
    /// Rows with a duty that were compared.
    pub rows: usize,
    /// Rows with the duty that the contract has for the action.
    pub equal: usize,
    /// Line of the first other one.
    pub first_line: Option<usize>,
    /// Where the duties come from: a column, or a feature.
    pub source: String,
    /// What the log has with each action of the contract, if it is one duty.
    pub logged: Vec<Option<f64>>,
    /// What the contract has.
    pub own: Vec<f64>,
    /// The duties were worked out from a feature, by its scale and offset in the contract.
    pub derived: bool,
}

/// A row of the log, its action, its duty.
type Pair = (usize, usize, f64);

/// Compares; `None` where the log does not say which duty an action had, or an action adds to a law.
pub(super) fn duties(policy: &Policy, log: &Log) -> Option<DutyResult> {
    let Head::Choice(table) = &policy.head else {
        return None;
    };
    let own: Vec<f64> = table.iter().map(|action| action.duty).collect();
    let (source, derived, pairs) = pairs(policy, log)?;
    let largest = own.iter().fold(0.0_f64, |most, duty| most.max(duty.abs()));
    let is_same = |a: f64, b: f64| (a - b).abs() <= SAME * largest;
    let others: Vec<&Pair> = (pairs.iter())
        .filter(|(_, action, duty)| !own.get(*action).is_some_and(|own| is_same(*own, *duty)))
        .collect();
    let logged = (0..own.len()).map(|action| {
        let mut of_it = pairs.iter().filter(|pair| pair.1 == action).map(|pair| pair.2);
        let first = of_it.next()?;
        of_it.all(|duty| is_same(first, duty)).then_some(first)
    });
    (!pairs.is_empty()).then(|| DutyResult {
        rows: pairs.len(),
        equal: pairs.len() - others.len(),
        first_line: others.first().map(|(row, ..)| log.line(*row)),
        source,
        logged: logged.collect(),
        own: own.clone(),
        derived,
    })
}

/// Where the duties of the log's actions stand, and the pairs.
fn pairs(policy: &Policy, log: &Log) -> Option<(String, bool, Vec<Pair>)> {
    let actions = log.actions.as_ref()?;
    let action = |row: usize| Some(*actions.get(row)? as usize);
    if let Some(duties) = &log.duty {
        let pair = |(row, duty): (usize, &f64)| Some((row, action(row)?, *duty));
        return Some((
            "duty".to_owned(),
            false,
            duties.iter().enumerate().filter_map(pair).collect(),
        ));
    }
    // what is before a row is the duty of the action in the row before, unless an episode begins
    let behind = |duties: Vec<Option<f64>>| -> Vec<Pair> {
        let goes_on = |row: &usize| !log.begins.get(*row).copied().unwrap_or(true);
        (1..duties.len())
            .filter(goes_on)
            .filter_map(|row| Some((row - 1, action(row - 1)?, (*duties.get(row)?)?)))
            .collect()
    };
    if let Some(duties) = &log.previous_duty {
        let duties = duties.iter().map(|duty| Some(*duty)).collect();
        return Some(("previous_duty".to_owned(), false, behind(duties)));
    }
    let plain = |index: &usize| {
        let feature = policy.features.get(*index);
        let is_plain = feature.is_some_and(|feature| {
            matches!(feature.source, Expr::Input(Input::PreviousDuty))
                && feature.filters.is_empty()
                && feature.scale != 0.0
        });
        is_plain && log.observed.get(*index).is_some_and(Option::is_some)
    };
    let index = (0..policy.features.len()).find(plain)?;
    let (feature, values) = (policy.features.get(index)?, log.observed.get(index)?.as_ref()?);
    let is_clipped = |value: f64| feature.clip.is_some_and(|clip| value <= clip.low || value >= clip.high);
    let duty = |value: &f64| (!is_clipped(*value)).then(|| (value - feature.offset) / feature.scale);
    Some((feature.name.clone(), true, behind(values.iter().map(duty).collect())))
}

impl DutyResult {
    /// What is to be said of other duties.
    pub(super) fn text(&self) -> Option<String> {
        let first = self.first_line?;
        let (others, rows) = (self.rows - self.equal, self.rows);
        let seen: Vec<(usize, f64)> = (self.logged.iter().enumerate())
            .filter_map(|(action, duty)| Some((action, (*duty)?)))
            .collect();
        let is_other = |(action, duty): &&(usize, f64)| {
            let own = self.own.get(*action).copied().unwrap_or(f64::NAN);
            (own - duty).abs() > SAME * duty.abs().max(own.abs())
        };
        let worst = seen.iter().find(is_other).map(|(action, duty)| {
            let own = self.own.get(*action).copied().unwrap_or(f64::NAN);
            format!(
                ": action {action} commands {} in the contract and {} in the log",
                number(own),
                number(*duty)
            )
        });
        let remedy = match seen.len() == self.own.len() {
            true => {
                let list: Vec<String> = seen.iter().map(|(_, duty)| number(*duty)).collect();
                format!("; duties = [{}] in [actions] fits the log", list.join(", "))
            }
            false => "; look at their order and their ends in [actions]".to_owned(),
        };
        let doubt = match self.derived {
            true => format!(", if scale and offset of {} are right", self.source),
            false => {
                ". A duty that was logged behind a mapping or a limit is another one: log the one before".to_owned()
            }
        };
        Some(format!(
            "the duties of the actions, by {}, are others in {others} of {rows} rows, first in line {first}{}{remedy}{doubt}",
            self.source,
            worst.unwrap_or_default()
        ))
    }
}
