//! Load steps inside a switching period.
//!
//! ```text
//! sample      ○         ○         ○         ○       a row each period
//! load   ─────────────────┐
//!                         └───────────────────      stepped here, on the bench
//! column ─────────────────────────┐
//!                                 └───────────      says so from this row on
//! ```
//! A bench steps its load when it likes, and a table shows only between which rows. Where the model steps it a part of a period too
//! late or too early, the output capacitor is off by the charge of that time, and rings. So the instant of a step may be an
//! unknown of no interest, as initial states are: it is estimated beside every fit, and what it explains is projected out. A delay
//! of all steps by the same time could also be a cause, so instants are free only in records that need it.

use crate::basis::{Basis, FARTHEST};
use crate::drive::{FREE_APART, Model};
use crate::fit::State;
use crate::flicker;
use crate::left_out::TELLING;
use crate::level::threshold;
use crate::noise;
use crate::parallel;
use crate::problem::{Problem, Starts, dot};
use crate::record::{CHANNELS, Record};
use crate::slopes::LoadStep;

/// Steps closer to where the record has them are where the record has them: of about that size (5 us at 10 kHz, .1 V at 150 uF)
/// is what two simulators of one load step differ by.
const NEGLIGIBLE: f64 = 0.05;
/// Chi-square that a free instant must be worth beside a cause: twice the logarithm of how many instants two periods hold that a
/// record tells apart (some 60, each three hundredths of a period wide).
pub(crate) const PRICE: f64 = 8.0;
/// Most free steps of a record: each is one more simulation in a round of sensitivities. A convention for time.
const MOST: usize = 64;
/// Rows between two free steps at least: each lies up to a period to either side, and the one is over before the other.
const CLOSEST: usize = 3;
/// Instants that are looked at first, to either side: the fit then finds its way within an eighth of a period.
const LOOKS: i32 = 8;

/// The channel that shows the load itself, and the rows around a free step in which it may leap.
// two rows: a free step lies up to a period (`FARTHEST`) to either side, and the samples another
const LOAD_SENSOR: usize = 2;
const LEAPS_BEFORE: usize = 2;
const LEAPS_BEHIND: usize = 2;

/// Load steps whose instant could be estimated: with nothing else of the load near, inside a stretch.
fn steps(record: &Record) -> Vec<LoadStep> {
    if record.settled || !record.dense {
        return Vec::new();
    }
    let all = flicker::steps(&record.load);
    let apart = |one: &LoadStep, other: &LoadStep| one.first.abs_diff(other.last).min(other.first.abs_diff(one.last));
    let alone = |step: &LoadStep, least: usize| all.iter().all(|other| other == step || apart(step, other) >= least);
    let inside = |step: &LoadStep| {
        let mut segments = record.segments.iter();
        segments.any(|s| s.start + FREE_APART <= step.first && step.last + TELLING <= s.end)
    };
    let mut free: Vec<LoadStep> = (all.iter().copied())
        .filter(|step| alone(step, CLOSEST) && inside(step))
        .take(MOST)
        .collect();
    // what is not free has to be farther off, and each that is not for that has to be so, too
    loop {
        let fixed: Vec<LoadStep> = all.iter().copied().filter(|step| !free.contains(step)).collect();
        let count = free.len();
        free.retain(|step| fixed.iter().all(|other| apart(step, other) >= 2 * FREE_APART));
        if free.len() == count {
            return free;
        }
    }
}

/// The problem with free instants in the records that are much better with them, and where the model of `at` then stands; nothing
/// where none is.
pub(crate) fn freed(problem: &Problem, at: &State, inflation: f64) -> Option<(Problem, State)> {
    let all: Vec<Vec<LoadStep>> = problem.records.iter().map(steps).collect();
    let tried = free(problem, &all)?;
    let state = scanned(&tried, &at.model, &at.starts);
    // what the steps of one record leave where the table has them is no noise of another's
    let inflation = inflation.min(noise::inflation(&tried, &state.residual));
    let needs = |index: usize| {
        let gain = chi2_of(&tried, &at.residual, index) - chi2_of(&tried, &state.residual, index);
        let moved = state.starts.late[index].iter().any(|late| late.abs() > NEGLIGIBLE);
        moved && gain >= threshold(all[index].len(), inflation)
    };
    let kept = all.iter().enumerate();
    let kept: Vec<Vec<LoadStep>> = kept
        .map(|(index, steps)| if needs(index) { steps.clone() } else { Vec::new() })
        .collect();
    if kept == all {
        return Some((tried, state));
    }
    let freed = free(problem, &kept)?;
    let state = scanned(&freed, &at.model, &at.starts);
    Some((freed, state))
}

/// The problem with these steps free; nothing if there are none. The load sensor is not compared around them: what it shows leaps with
/// the load, so that a fit would be caught at the instants of its samples. A slope becomes a sudden step: in its middle it moves the
/// same charge, and between two periods nobody sees more of it.
fn free(problem: &Problem, steps: &[Vec<LoadStep>]) -> Option<Problem> {
    let mut freed = problem.clone();
    for ((record, masked), steps) in freed.records.iter_mut().zip(&mut freed.masked).zip(steps) {
        let phase = record.phase;
        for step in steps {
            let near = step.first.saturating_sub(LEAPS_BEFORE)..step.last + LEAPS_BEHIND;
            masked[LOAD_SENSOR]
                .get_mut(near)
                .into_iter()
                .for_each(|part| part.fill(true));
            let (old, new) = (record.load[step.first - 1], record.load[step.last]);
            for row in step.first..step.last {
                let is_old = row < step.row(phase);
                record.load[row] = if is_old { old } else { new };
                // an unsure level moves with all rows that have it
                let like = if is_old { step.first - 1 } else { step.last };
                for level in record.free_levels.iter_mut().filter(|level| level.rows.contains(&like)) {
                    level.rows = level.rows.start.min(row)..level.rows.end.max(row + 1);
                }
            }
        }
        record.free_steps = steps.iter().map(|step| step.row(phase)).collect();
    }
    (count(&freed) > 0).then_some(freed)
}

/// The problem with all load steps where the table has them.
pub(crate) fn as_listed(problem: &Problem) -> Problem {
    let mut listed = problem.clone();
    listed.records.iter_mut().for_each(|record| record.free_steps.clear());
    listed
}

/// Number of free instants.
pub(crate) fn count(problem: &Problem) -> usize {
    problem.records.iter().map(|record| record.free_steps.len()).sum()
}

/// Chi-square of a residual over what counts in `problem`.
pub(crate) fn chi2(problem: &Problem, residual: &[f64]) -> f64 {
    (0..problem.records.len())
        .map(|index| chi2_of(problem, residual, index))
        .sum()
}

fn chi2_of(problem: &Problem, residual: &[f64], index: usize) -> f64 {
    let (offset, masked) = (problem.offsets[index], &problem.masked[index]);
    let rows = residual[offset..]
        .chunks_exact(CHANNELS)
        .take(problem.records[index].rows());
    let squares = rows.enumerate().flat_map(|(row, values)| {
        let counts = move |(n, value): (usize, &f64)| if masked[n][row] { 0.0 } else { value * value };
        values.iter().enumerate().map(counts)
    });
    squares.sum()
}

/// The model with initial states and free instants fitted, instants sought over all that is possible.
pub(crate) fn scanned(problem: &Problem, model: &Model, from: &Starts) -> State {
    scanned_in(problem, model, from, None)
}

/// The same with what initial states and instants explain at a model near this one.
pub(crate) fn scanned_in(problem: &Problem, model: &Model, from: &Starts, basis: Option<&Basis>) -> State {
    let mut starts = from.clone();
    starts.late = problem.first_starts(&problem.base).late;
    let steps: Vec<(usize, usize, usize, usize)> = windows(problem);
    let most = steps.iter().map(|step| step.1 + 1).max().unwrap_or(0);
    for moved in passes(most) {
        let looks: Vec<f64> = (-LOOKS..=LOOKS)
            .map(|n| FARTHEST * f64::from(n) / f64::from(LOOKS))
            .collect();
        let tried = parallel::map(&looks, |late| {
            let mut tried = starts.clone();
            for (record, place, ..) in steps.iter().filter(|step| moved.contains(&step.1)) {
                tried.late[*record][*place] = *late;
            }
            problem.residual(model, &tried)
        });
        for (record, place, from, to) in steps.iter().filter(|step| moved.contains(&step.1)) {
            let chi2 = |residual: &Vec<f64>| dot(&residual[*from..*to], &residual[*from..*to]);
            let all = looks.iter().zip(tried.iter().map(chi2));
            if let Some((late, _)) = all.min_by(|a, b| a.1.total_cmp(&b.1)) {
                starts.late[*record][*place] = *late;
            }
        }
    }
    State::settle(problem, model, &starts, basis)
}

/// Which steps of each record are moved at a time, of `most` in one: up to three one after the other, more all at once, and then every other one, since
/// what a step leaves has rung out by the step after the next. A look at each by itself would be most of a diagnosis.
fn passes(most: usize) -> Vec<Vec<usize>> {
    match most {
        0..=3 => (0..most).map(|nth| vec![nth]).collect(),
        _ => [1, 2, 2]
            .iter()
            .zip([0, 0, 1])
            .map(|(apart, first)| (first..most).step_by(*apart).collect())
            .collect(),
    }
}

/// Each free step: its record, its place there, and the part of the vectors that it alone shapes, up to the next step.
fn windows(problem: &Problem) -> Vec<(usize, usize, usize, usize)> {
    let mut list = Vec::new();
    for (index, record) in problem.records.iter().enumerate() {
        for (place, row) in record.free_steps.iter().enumerate() {
            let segment = record.segments.iter().find(|segment| segment.contains(row));
            let end = segment.map_or(record.rows(), |segment| segment.end);
            let next = record
                .free_steps
                .get(place + 1)
                .map_or(end, |next| end.min(next - FREE_APART.min((next - row) / 2)));
            let of = |row: usize| problem.offsets[index] + row * CHANNELS;
            list.push((index, place, of(row - FREE_APART), of(next)));
        }
    }
    list
}

/// Whether an instant ends where it may go no further.
fn is_at_limit(late: f64) -> bool {
    late.abs() > FARTHEST - NEGLIGIBLE
}

/// Share of the free instants that end where they may go no further.
pub(crate) fn share_at_limits(starts: &Starts) -> f64 {
    let all = || starts.late.iter().flatten();
    let at_limits = all().filter(|late| is_at_limit(**late)).count();
    at_limits as f64 / all().count().max(1) as f64
}

/// What is said of the load steps of a record whose instants end at their limits, if there are any. A column that is shifted moves all alike; where
/// something else is left of the record, they end at either.
fn at_limits(record: &Record, late: &[f64]) -> Option<String> {
    let ended = || late.iter().filter(|late| is_at_limit(**late));
    let count = ended().count();
    let times: Vec<String> = (late.iter().zip(&record.free_steps))
        .filter(|(late, _)| is_at_limit(**late))
        .map(|(_, row)| format!("{:.6} s", record.time[*row]))
        .collect();
    let one_way = ended().all(|late| *late > 0.0) || ended().all(|late| *late < 0.0);
    let is_shifted = count > 1 && one_way && 2 * count > late.len();
    (count > 0).then(|| {
        format!(
            "{} at the limit of one period, at t = {}: their rows may be wrong by a period and more{}",
            match count {
                1 => "1 of these load steps ends".to_owned(),
                more => format!("{more} of these load steps end"),
            },
            times.join(", "),
            if is_shifted {
                ". Is the column of the load shifted against the others?"
            } else {
                ""
            },
        )
    })
}

/// What is said of the records whose instants were estimated.
pub(crate) fn note(problem: &mut Problem, starts: &Starts) {
    for (record, late) in problem.records.iter_mut().zip(&starts.late) {
        let (low, high) = late
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), late| {
                (low.min(*late), high.max(*late))
            });
        if !late.is_empty() {
            record.repairs.push(format!(
                "{} inside a switching period, {} periods from where the table has {}",
                match late.len() {
                    1 => "1 load step is taken to lie".to_owned(),
                    more => format!("{more} load steps are taken to lie"),
                },
                match late.len() {
                    1 => format!("{low:+.2}"),
                    _ => format!("{low:+.2} to {high:+.2}"),
                },
                if late.len() == 1 { "it" } else { "them" },
            ));
            record.repairs.extend(at_limits(record, late));
        }
    }
}

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;
    use std::path::Path;

    use measured::{ColumnMap, Sheet};
    use plant::Parameters;

    use super::steps;
    use crate::record::Record;

    #[test]
    fn steps_close_to_each_other_or_to_an_end_stay_where_the_table_has_them() {
        let changes = [3, 12, 22, 24, 34, 57];
        let mut text = "t,d,v_o,i_load\n".to_owned();
        for n in 0..60 {
            let current = 5 + changes.iter().filter(|row| **row <= n).count();
            let _ = writeln!(
                text,
                "{:.5},0.5,{:.2},{current}",
                f64::from(n) * 1e-4,
                100.0 + 0.1 * f64::from(n % 3)
            );
        }
        let sheet = Sheet::parse(Path::new("run.csv"), text.into(), &Record::file_options()).unwrap();
        let record = Record::read(&sheet, &ColumnMap::default(), &Parameters::paper_table()).unwrap();
        let rows: Vec<usize> = steps(&record).iter().map(|step| step.first).collect();
        assert_eq!(rows, [12, 34]);
    }
}
