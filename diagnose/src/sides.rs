//! Rows that were sampled at the switching edge at the start of the period, some of them behind it.
//!
//! ```text
//! v_out   ─╮  ╭──         the diode's current begins or ends: a leap by ESR times the inductor current
//!          │  │
//!          ╰──╯
//! row      ○  ●           before the edge, as the model takes it; behind it, by a nanosecond
//! ```
//! A converter that samples at the start of the period samples before the switch acts, and the model does so. A trigger that hesitates by some
//! nanoseconds shows the other value in single rows, or in every second one. Other edges are dealt with before there is a model
//! ([`crate::record`]): there most rows are apart from the edge, and no convention says which side is meant.

use plant::{Carrier, Topology};

use crate::drive::simulate;
use crate::fit::State;
use crate::ideal::{self, Ideal};
use crate::median::median;
use crate::problem::Problem;
use crate::record::Record;
use crate::record::edges::NEAR;

/// Most that one bend of what the model leaves counts, in leaps: a step of the load that the model has elsewhere bends as well, and farther.
const MOST: f64 = 1.5;
/// What a row behind the edge costs, in leaps: where all rows are behind it nothing bends, and then the model's side is as good as the other.
// a run of rows saves two bends of a leap at either end: one of up to 200 rows is told from none
const ROW: f64 = 0.02;
/// The middle bend has to be below this: else noise looks like a leap.
// of normal noise the middle of second differences is 1.65 standard deviations: a leap has eight of them
const QUIET: f64 = 0.2;
/// What has to be saved: a row there and back bends by four leaps.
const SAVED: f64 = 3.0;
/// ... and by each change of sides, in leaps: noise that bends like one is told into long runs, whose ends save little.
// of 150 to 400 rows of noise alone, up to 0.13 leaps, each change saves 0.2 to 0.4; single or alternating rows beside noise up to 0.1 save 1.27 and more
const SAVED_BY_EACH: f64 = 0.8;

/// Takes rows behind the edge out of the records, and says so; `state` is that of the model as given.
/// Whether there were any.
pub fn leave_out(problem: &mut Problem, state: &State) -> bool {
    let mut any = false;
    for index in 0..problem.records.len() {
        let rows = behind(problem, state, index);
        let record = &mut problem.records[index];
        if rows.is_empty() {
            continue;
        }
        // the inductor's current leaps, too, where its core has losses, and the input's voltage where its source has a resistance
        for channel in &mut record.measured {
            rows.iter().for_each(|row| channel[*row] = f64::NAN);
        }
        record.repairs.push(format!(
            "{} of {} rows show v_out behind the edge of the switch at the start of the period, the others before it: what they show is left out",
            rows.len(),
            record.rows()
        ));
        any = true;
    }
    any
}

/// Whether the output leaps at the start of the period, where the record is sampled; upwards with 1, downwards with -1.
fn direction(record: &Record, state: &State) -> Option<f64> {
    let plant = &state.model.plant;
    let at_start = record.phase < NEAR || record.phase > 1.0 - NEAR;
    let leaps = plant.converter.topology != Topology::Buck && plant.capacitor.esr > 0.0;
    let over_time = record.dense && !record.settled;
    (at_start && leaps && over_time).then_some(())?;
    match plant.pwm.carrier {
        // the switch turns on: the output loses the current of the inductor
        Carrier::Trailing => Some(-1.0),
        Carrier::Leading => Some(1.0),
        Carrier::Centre => None,
    }
}

/// By how much rows at the edge may differ in a channel, in its unit, where nobody knows their sides; nothing where the record is not sampled
/// there. A leap below the noise is not told row by row, and yet draws lines: sides follow each other in a beat of the clocks.
pub(crate) fn unsure_leap(problem: &Problem, state: &State, index: usize, n: usize) -> Option<f64> {
    let record = &problem.records[index];
    direction(record, state)?;
    let ideal = Ideal::of(record, &state.model.plant);
    let v = problem.bases.v;
    let currents = (0..record.rows()).map(|row| {
        let drawn = ideal::drawn(&record.load[row], v);
        ideal.inductor(drawn, record.duty[row]) + ideal.half(record.duty[row])
    });
    let leap = state.model.plant.capacitor.esr * median(currents);
    // what a resistor draws leaps as the voltage does
    match n {
        0 => Some(leap),
        2 => Some(leap * median(record.load.iter().map(|load| load.conductance))),
        _ => None,
    }
}

fn behind(problem: &Problem, state: &State, index: usize) -> Vec<usize> {
    let record = &problem.records[index];
    let Some(direction) = direction(record, state) else {
        return Vec::new();
    };
    let shown = simulate(&state.model, record, &state.starts.of(index));
    let esr = state.model.plant.capacitor.esr;
    let left: Vec<f64> = (record.measured[0].iter().zip(&shown))
        .map(|(measured, [v_out, ..])| measured - v_out)
        .collect();
    let leaps: Vec<f64> = shown.iter().map(|[_, i_l, ..]| direction * esr * i_l).collect();
    let typical = median(leaps.iter().map(|leap| leap.abs()));
    let (behind, saved) = told(&left, &leaps, typical);
    let middle =
        median((2..left.len()).map(|row| bend(&left, &leaps, row, [row - 2, row - 1, row].map(|n| behind[n]))));
    let changes = behind.windows(2).filter(|pair| pair[0] != pair[1]).count();
    // in this form a NaN is no leap
    if !(saved >= SAVED.max(SAVED_BY_EACH * changes as f64) && middle < QUIET * typical) {
        return Vec::new();
    }
    behind
        .iter()
        .enumerate()
        .filter_map(|(row, is_behind)| is_behind.then_some(row))
        .collect()
}

/// How far three rows in a row are from a line, if these of them are behind the edge.
fn bend(left: &[f64], leaps: &[f64], row: usize, behind: [bool; 3]) -> f64 {
    let at = |n: usize| left[row - 2 + n] - if behind[n] { leaps[row - 2 + n] } else { 0.0 };
    (at(0) - 2.0 * at(1) + at(2)).abs()
}

/// Which rows are behind the edge, so that what is left bends least, and what that saves in leaps, all in all.
// the shortest way through pairs of rows (Viterbi): a leap that was missed does not turn round all rows behind it
fn told(left: &[f64], leaps: &[f64], typical: f64) -> (Vec<bool>, f64) {
    let rows = left.len();
    let cost = |row: usize, behind: [bool; 3]| {
        let bend = bend(left, leaps, row, behind) / typical;
        // rows without a value bend nothing
        let bend = if bend.is_finite() { bend.min(MOST) } else { 0.0 };
        bend + if behind[2] { ROW } else { 0.0 }
    };
    // of a pair of rows: the first and the second, as bits
    let sides = |pair: usize| [pair & 2 != 0, pair & 1 != 0];
    let mut costs = [0.0, ROW, ROW, 2.0 * ROW];
    let mut ways: Vec<[usize; 4]> = Vec::with_capacity(rows);
    let mut as_given = 0.0;
    for row in 2..rows {
        as_given += cost(row, [false; 3]);
        let mut way = [0; 4];
        let next: [f64; 4] = std::array::from_fn(|pair| {
            let [middle, last] = sides(pair);
            let from = |first: usize| {
                let before = first << 1 | usize::from(middle);
                (before, costs[before] + cost(row, [first == 1, middle, last]))
            };
            let (none, one) = (from(0), from(1));
            let best = if one.1 < none.1 { one } else { none };
            way[pair] = best.0;
            best.1
        });
        costs = next;
        ways.push(way);
    }
    let mut pair = (0..4).min_by(|a, b| costs[*a].total_cmp(&costs[*b])).unwrap_or(0);
    let saved = as_given - costs[pair];
    let mut behind = vec![false; rows];
    for row in (0..rows).rev() {
        let [middle, last] = sides(pair);
        behind[row] = last;
        match row.checked_sub(2).and_then(|n| ways.get(n)) {
            Some(way) => pair = way[pair],
            None => {
                if let Some(first) = row.checked_sub(1) {
                    behind[first] = middle;
                }
                break;
            }
        }
    }
    (behind, saved)
}
