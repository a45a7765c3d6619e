//! What is left swings as the filter does.

use super::{OF_EXCESS, behind_steps, burst, kicks};
use crate::fast;
use crate::fit::State;
use crate::ideal::Ideal;
use crate::noise::channel;
use crate::problem::{Problem, dot};
use crate::record::{LOAD_CURRENT, Record};
use crate::spectrum::strongest_line_of;
use plant::Load;

/// A swing is missing in the other state where that holds less than one over this of the square that it should. Its frequency and damping are
/// the filter's to about a third, as is the ratio of both swings: its square to twice. A convention above it.
const MISSED: f64 = 9.0;
/// Times as much right behind the steps as later, from which on steps begin what swings: noise of 100 rows reaches 1.3.
const DIES: f64 = 1.6;
/// Share of the filter's frequency to either side that counts as about it.
const ABOUT: f64 = 0.5;
/// A trembling holds this share of what is left: more than half.
const OF_TREMBLING: f64 = 0.6;

/// What is said of a channel that swings as the filter does.
pub(super) fn words(
    problem: &Problem,
    state: &State,
    (index, n): (usize, usize),
    (values, excess): (&[f64], f64),
) -> Option<String> {
    let share = 100.0 * trembling(problem, values, excess)?;
    let about = format!("at about the frequency at which the filter swings ({share:.0} % of what is not noise)");
    Some(if dies_away(&problem.records[index], values) {
        format!("a swing {about}, largest behind steps of duty and load")
    } else if is_missing_elsewhere(problem, state, (index, n)) {
        let other = if n == 0 { "inductor current" } else { "output voltage" };
        format!(
            "a trembling {about}, which the {other} has not: its instrument shows what the converter does not do, as one that sticks does"
        )
    } else {
        format!(
            "a trembling {about}, without steps before it: something acts on the converter that is in no column, be it edges that jitter, lost \
             pulses, or a load or a source that moves"
        )
    })
}

/// Whether most of what is left in a channel swings as the filter does, all the time and at no one frequency: something kicks the converter
/// itself, and its instrument is as good as others.
#[must_use]
pub(crate) fn is_kicked(problem: &Problem, state: &State, (index, n): (usize, usize)) -> bool {
    let (record, values) = (&problem.records[index], channel(problem, &state.residual, index, n));
    let total: f64 = values.iter().map(|v| v * v).sum();
    let count = values.iter().filter(|v| **v != 0.0).count() as f64;
    let excess = total - count;
    let of_line = |share: f64| share * total / excess;
    excess > 0.0
        && burst(&values, total).is_none()
        && behind_steps(problem, record, &values, excess).is_none()
        && kicks(record, &values, excess).is_none()
        && !dies_away(record, &values)
        && trembling(problem, &values, excess).is_some()
        && strongest_line_of(problem, &state.residual, (index, n)).is_none_or(|line| of_line(line.share) < OF_EXCESS)
}

/// Whether a channel's swing is missing in the other state, where it would be seen: inductor and capacitor hand on the same energy, so that
/// a swing of the current is one of the voltage times sqrt(L / C), in every topology; and what the load draws follows the voltage at its
/// conductance. Then an instrument shows what the converter does not do, say one that sticks while the current rings.
pub(crate) fn is_missing_elsewhere(problem: &Problem, state: &State, (index, n): (usize, usize)) -> bool {
    let converter = &state.model.plant.converter;
    let impedance = (converter.inductance / converter.capacitance).sqrt();
    let (other, by) = match n {
        0 => (1, impedance.recip()),
        1 => (0, impedance),
        // a load of constant current has none: then no voltage is behind its swing
        LOAD_CURRENT => (0, conductance(&problem.records[index]).recip()),
        _ => return false,
    };
    let mean_square = |one: usize| {
        let values = channel(problem, &state.residual, index, one);
        let count = values.iter().filter(|value| **value != 0.0).count();
        dot(&values, &values) / count.max(1) as f64
    };
    let expected = (mean_square(n) - 1.0).max(0.0) * (problem.sigma[n] * by / problem.sigma[other]).powi(2);
    problem.sigma[other].is_finite() && expected > MISSED * mean_square(other)
}

/// The mean conductance of a record's load for small changes of its voltage, S: constant power draws less where it is higher.
fn conductance(record: &Record) -> f64 {
    let of = |(load, v): (&Load, &f64)| (load.conductance - load.power / (v * v)).abs();
    let rows = record.load.iter().zip(&record.measured[0]);
    let all: Vec<f64> = rows.map(of).filter(|slope| slope.is_finite()).collect();
    all.iter().sum::<f64>() / all.len().max(1) as f64
}

/// Whether what swings is larger in the rows right behind steps of duty and load than in as many that are farther from them.
fn dies_away(record: &Record, values: &[f64]) -> bool {
    let mut since = None;
    let mut rows: Vec<(usize, f64)> = Vec::new();
    for (row, value) in values.iter().enumerate() {
        let is_step = row > 0 && !record.is_same_point(row, row - 1);
        since = if is_step { Some(0) } else { since.map(|n: usize| n + 1) };
        rows.extend(since.filter(|_| *value != 0.0).map(|n| (n, value * value - 1.0)));
    }
    rows.sort_by_key(|(since, _)| *since);
    let (near, far) = rows.split_at(rows.len() / 2);
    let sum = |part: &[(usize, f64)]| part.iter().map(|(_, excess)| excess).sum::<f64>();
    sum(near) > DIES * sum(far).max(f64::MIN_POSITIVE)
}

/// The share of what is left that lies about the frequency of the filter, if that is most of it.
fn trembling(problem: &Problem, values: &[f64], excess: f64) -> Option<f64> {
    let own = Ideal::at(&problem.base.plant, 1.0).swing().recip();
    let near = fast::band(values, own * (1.0 - ABOUT), own * (1.0 + ABOUT));
    // white noise of this band, of power 1, is in it
    let count = values.iter().filter(|v| **v != 0.0).count() as f64;
    // the band is 2 ABOUT own of the half of the rate that there is
    let share = (near - 4.0 * ABOUT * own * count).max(0.0) / excess;
    (share > OF_TREMBLING && own * (values.len() as f64) > 4.0).then_some(share.min(1.0))
}
