//! Faults of a bench that are no causes of a model, seen before any fit: rows beside each other that are not of one period, two channels
//! exchanged, records at another source, a held-out record that is a training record again.
//!
//! Each other way of reading a record is simulated once with the model as it is. A reading that leaves a small part of the error
//! is named, and nobody is kept from the diagnosis: a delay on the list of causes may look like a shift.

use crate::drive::Model;
use crate::fit::State;
use crate::ideal::{self, Ideal};
use crate::median::median;
use crate::parallel;
use crate::problem::{Problem, duty_accuracy};
use crate::record::{CHANNEL_NAMES, CHANNELS, Record};

/// Farthest shift that is tried, rows.
const FARTHEST: isize = 4;
/// A reading is named if it leaves this share of chi-square (nearly half of the error), ...
const LEFT: f64 = 0.2;
/// ... where the record as it is leaves this mean square over the noise: below it there is nothing to mend.
const WRONG: f64 = 4.0;
/// Sources of two records that differ by this share were set so: losses differ by less, and so do supplies.
const OTHER_SOURCE: f64 = 0.06;
/// Smallest duty that a source voltage is read off.
// a convention: below it a millivolt of the output is 20 of the source
const LEAST_DUTY: f64 = 0.05;

/// Another way to read a record.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Reading {
    /// What was measured belongs so many rows earlier.
    Shifted(isize),
    /// Two channels the other way round.
    Exchanged(usize, usize),
}

impl Reading {
    fn of(self, record: &Record) -> Record {
        let mut record = record.clone();
        match self {
            Reading::Shifted(by) => {
                for values in &mut record.measured {
                    let old = std::mem::take(values);
                    let at = |row: usize| row.checked_add_signed(by).and_then(|from| old.get(from).copied());
                    *values = (0..old.len()).map(|row| at(row).unwrap_or(f64::NAN)).collect();
                }
            }
            Reading::Exchanged(a, b) => record.measured.swap(a, b),
        }
        record
    }

    fn words(self, record: &Record) -> String {
        let name = &record.name;
        match self {
            Reading::Shifted(by) => {
                let rows = if by.abs() == 1 { "row" } else { "rows" };
                let (late, way) = if by > 0 { ("late", "up") } else { ("early", "down") };
                let by = by.abs();
                format!(
                    "{name}: what was measured looks shifted by {by} {rows} against duty and load, {late}: if a trigger or a buffer of the \
                     logger did it, move the measured columns {by} {rows} {way} in the file"
                )
            }
            Reading::Exchanged(a, b) => {
                let [a, b] = [a, b].map(|n| CHANNEL_NAMES[n]);
                format!("{name}: the columns {a} and {b} look exchanged; if so: --map {a}={b},{b}={a}")
            }
        }
    }
}

/// What the training records look like in another reading; `null` is the model as it is.
pub fn readings(problem: &Problem, null: &State) -> Vec<String> {
    let all: Vec<usize> = (0..problem.records.len())
        .filter(|n| !problem.records[*n].settled)
        .collect();
    let best = parallel::map(&all, |index| best_reading(problem, &null.model, *index));
    let named = best
        .into_iter()
        .zip(&all)
        .filter_map(|(reading, index)| Some(reading?.words(&problem.records[*index])));
    named.collect()
}

fn best_reading(problem: &Problem, model: &Model, index: usize) -> Option<Reading> {
    let record = &problem.records[index];
    let mean_square = |record: Record| {
        let mut alone = problem.clone();
        (alone.offsets, alone.masked) = (vec![0], vec![problem.masked[index].clone()]);
        alone.records = vec![record];
        let state = State::settle(&alone, model, &alone.first_starts(), None);
        state.chi2 / alone.count().max(1) as f64
    };
    let as_it_is = mean_square(record.clone());
    if as_it_is < WRONG {
        return None;
    }
    let has = |n: usize| record.measured[n].iter().any(|v| v.is_finite());
    let shifts = (-FARTHEST..=FARTHEST).filter(|by| *by != 0).map(Reading::Shifted);
    let pairs = [(1, 2), (0, 3)].into_iter().filter(|(a, b)| has(*a) && has(*b));
    let tried: Vec<Reading> = shifts.chain(pairs.map(|(a, b)| Reading::Exchanged(a, b))).collect();
    let found = tried
        .into_iter()
        .map(|reading| (mean_square(reading.of(record)), reading));
    let (left, reading) = found.min_by(|a, b| a.0.total_cmp(&b.0))?;
    (left < LEFT * as_it_is).then_some(reading)
}

/// Source voltage that a record's voltages and duties show, without the losses that all records share; nothing if the current may rest.
fn shown_source(record: &Record, model: &Model) -> Option<f64> {
    let p = &model.plant.converter;
    let ideal = Ideal::at(&model.plant, 1.0);
    // a trim of the edges moves the duty by as much: by a twentieth of it, less than another source is told by
    let least = (20.0 * duty_accuracy(p.f_sw)).max(LEAST_DUTY);
    let rows = (0..record.rows()).filter_map(|row| {
        let (v, d, load) = (record.measured[0][row], record.duty[row], &record.load[row]);
        let drawn = ideal::drawn(load, v);
        let losses = model.plant.inductor.dcr * ideal.inductor(drawn, d) + model.plant.switch.v_f * (1.0 - d);
        // at a duty of 1 a boost holds no voltage
        let is_told = v.is_finite() && ideal.never_rests(drawn, d) && (least..1.0 - least).contains(&d);
        is_told.then(|| ideal.source(v, d, losses))
    });
    let rows: Vec<f64> = rows.collect();
    (2 * rows.len() > record.rows())
        .then(|| median(rows))
        .filter(|v| v.is_finite())
}

/// Records that seem to come from another source than the training records.
pub fn sources(train: &[Record], held: &[Record], model: &Model) -> Vec<String> {
    let shown = |record: &Record| Some(shown_source(record, model)? / record.v_in_ratio);
    let usual = median(train.iter().filter_map(shown));
    let odd = |record: &Record| {
        let ratio = shown(record)? / usual;
        // a record that has its own source voltage needs no word
        ((ratio - 1.0).abs() > OTHER_SOURCE && record.v_in_ratio == 1.0).then(|| {
            let v_in = format!("{:.4}", model.plant.converter.v_in * ratio).trim_end_matches('0').trim_end_matches('.').to_owned();
            format!(
                "{0}: looks like a source of about {v_in} V, {1:+.0} % beside the training records'; if it was set so, say it in a map file: \
                 [records.{0}] constants = {{ v_in = {v_in} }}",
                record.name,
                100.0 * (ratio - 1.0)
            )
        })
    };
    train.iter().chain(held).filter_map(odd).collect()
}

/// Held-out records that are training records again: both names.
#[must_use]
pub fn repeated<'a>(train: &'a [Record], held: &'a [Record]) -> Vec<(&'a str, &'a str)> {
    let is_same = |a: &Record, b: &Record| {
        let alike = |a: &[f64], b: &[f64]| {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a == b || a.is_nan() && b.is_nan())
        };
        alike(&a.duty, &b.duty) && (0..CHANNELS).all(|n| alike(&a.measured[n], &b.measured[n]))
    };
    let of = |held: &'a Record| {
        let known = train.iter().find(|train| is_same(train, held))?;
        Some((held.name.as_str(), known.name.as_str()))
    };
    held.iter().filter_map(of).collect()
}
