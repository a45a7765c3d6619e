//! A column that was logged one row below the others: all that is made of it differs, and none of that is to blame.

use interp::Sample;
use policy::Policy;

use super::log::{Log, done_names};
use super::{Replay, Wanted, compared};

/// Fewest rows that must be left to compare, as a share: the last row of an episode has no value in a column that came late.
const LEFT: f64 = 0.5;

/// A column of a log.
#[derive(Debug, Clone, Copy)]
pub(super) enum Column {
    /// A signal, by index into the contract.
    Signal(usize),
    /// What the network saw, by feature.
    Observation(usize),
    /// The choice of an output.
    Action(usize),
    /// The duty of an output.
    Duty(usize),
    /// The duty before, of an output.
    PreviousDuty(usize),
}

/// The name of the one column that is late, if there is one: with each of its values a row earlier all is equal.
pub(super) fn column(policy: &Policy, log: &Log, wanted: Wanted, found: &Replay) -> Option<String> {
    // one thing that differs has its own reason, such as a delay in the contract
    if accused(found) < 2 {
        return None;
    }
    let is_late = |(_, column): &(String, Column)| {
        let moved = log.earlier(*column);
        let said = moved.is_late(wanted.skip).iter().filter(|said| **said).count();
        let is_enough = said as f64 > LEFT * log.rows() as f64;
        is_enough && compared(policy, &moved, wanted).is_ok_and(|replay| replay.equal())
    };
    candidates(policy, log, found)
        .into_iter()
        .find(is_late)
        .map(|(name, _)| name)
}

/// How many comparisons came out different.
fn accused(found: &Replay) -> usize {
    let features = found.compared().filter(|(_, compared)| compared.first_line.is_some());
    let outputs = found.commands();
    let commands = outputs.iter().map(|output| {
        let actions = (output.actions).is_some_and(|actions| !actions.exploring && actions.first_line.is_some());
        let duties = output.duties.is_some_and(|duties| duties.first_line.is_some());
        usize::from(actions) + usize::from(duties)
    });
    features.count() + commands.sum::<usize>()
}

fn candidates(policy: &Policy, log: &Log, found: &Replay) -> Vec<(String, Column)> {
    let signals = policy.signals.iter().enumerate();
    let mut list: Vec<_> = signals
        .map(|(index, signal)| (signal.name.clone(), Column::Signal(index)))
        .collect();
    for (index, ([action, duty, previous], done)) in done_names(policy).into_iter().zip(&log.done).enumerate() {
        list.extend(
            done.previous_duty
                .as_ref()
                .map(|_| (previous, Column::PreviousDuty(index))),
        );
        list.extend(done.duty.as_ref().map(|_| (duty, Column::Duty(index))));
        let actions = done.actions.as_ref().filter(|_| !done.read_off);
        list.extend(actions.map(|_| (action, Column::Action(index))));
    }
    // an observation is judged by itself, unless the duties were worked out from it
    let outputs = found.commands();
    let sources = outputs.iter().filter_map(|output| output.duties);
    let derived: Vec<&str> = sources
        .filter(|duties| duties.derived)
        .map(|duties| duties.source.as_str())
        .collect();
    let features = policy.features.iter().enumerate();
    let derived = features.filter(|(_, feature)| derived.contains(&feature.name.as_str()));
    list.extend(derived.map(|(index, feature)| (feature.name.clone(), Column::Observation(index))));
    list
}

impl Log {
    /// The log with each value of a column a row earlier. The last row of an episode has none then, and is not compared.
    fn earlier(&self, column: Column) -> Self {
        let mut moved = self.clone();
        let goes_on = |row: usize| self.begins.get(row + 1) == Some(&false);
        moved.unsaid = (0..self.rows()).map(|row| !goes_on(row)).collect();
        let from = |row: usize| if goes_on(row) { row + 1 } else { row };
        match column {
            Column::Signal(index) => {
                for (row, samples) in moved.samples.iter_mut().enumerate() {
                    let next: Option<Sample> = self.samples.get(from(row)).and_then(|next| next.get(index)).copied();
                    if let (Some(sample), Some(next)) = (samples.get_mut(index), next) {
                        *sample = next;
                    }
                }
            }
            Column::Observation(index) => {
                if let Some(Some(values)) = moved.observed.get_mut(index) {
                    shift(values, from);
                }
            }
            Column::Action(index) => {
                if let Some(values) = moved.done.get_mut(index).and_then(|done| done.actions.as_mut()) {
                    shift(values, from);
                }
            }
            Column::Duty(index) => {
                let done = moved.done.get_mut(index);
                if let Some(done) = done {
                    let read_off = done.read_off;
                    done.duty.iter_mut().for_each(|values| shift(values, from));
                    let actions = done.actions.iter_mut().filter(|_| read_off);
                    actions.for_each(|values| shift(values, from));
                }
            }
            Column::PreviousDuty(index) => {
                if let Some(values) = moved.done.get_mut(index).and_then(|done| done.previous_duty.as_mut()) {
                    shift(values, from);
                }
            }
        }
        moved
    }
}

/// Each value from the row that `from` says.
fn shift<T: Copy>(values: &mut [T], from: impl Fn(usize) -> usize) {
    for row in 0..values.len() {
        if let Some(next) = values.get(from(row)).copied() {
            values[row] = next;
        }
    }
}
