//! What held-out records say against an explanation.

use crate::attribute::{Attribution, SURE};
use crate::doubts::Doubt;
use crate::drive::Model;
use crate::fit::{Fit, State};
use crate::gain::{self, MUCH_WORSE, Pair, Shift};
use crate::held_table;
use crate::left_open::NOISE_ALONE;
use crate::level::{ACCURACY, threshold};
use crate::noise;
use crate::problem::{Problem, dot};
use crate::record::{CHANNEL_NAMES, CHANNELS, LOAD_CURRENT, QUANTITIES, Record};
use crate::words::si;

/// Correlation of neighbours from which on an error is more than noise: a coarser range of the scope or a wild sample leaves none,
/// and an error that makes a mean square of 2.5 out of one of 1 leaves 1.5 / 2.5 where it is smooth. Half of that.
const RELATED: f64 = 0.3;

/// What the law of a part's curve may be off by where no fit has been, as a share of what the part does: another law is met within 3 % of the
/// capacitance where records have been (`tests/ceramic.rs`), and a blind case left 1.2 % of the error beyond.
const OF_CURVE: f64 = 0.03;

/// A held-out record of which a model leaves so many times the squares that the model as given leaves is no record of a sensor that has shifted. A
/// convention, above what noise and the edges' trim move.
const GROWN: f64 = 1.25;

/// What kind of causes was found.
#[derive(Debug, Clone, Copy, Default)]
pub struct Of {
    /// One is the curve of a part.
    pub curve: bool,
    /// One is a gain or an offset of the sensor of a channel.
    pub sensors: [bool; CHANNELS],
}

impl Of {
    /// The causes of a fit.
    pub fn fit(attribution: &Attribution, fit: &Fit) -> Self {
        let candidates = || fit.causes.iter().map(|cause| &attribution.candidates[*cause]);
        let scale = |n: usize| ["gain", "offset"].map(|what| format!("sensors.{}.{what}", QUANTITIES[n]));
        Of {
            curve: candidates().any(|candidate| candidate.is_curve()),
            sensors: std::array::from_fn(|n| candidates().any(|candidate| candidate.changes(&scale(n)))),
        }
    }
}

/// The held-out records with the model as given and with `state`, if there are any.
pub fn held(problem: &Problem, heldout: &[Record], base: &Model, state: &State, trim: f64) -> Option<Pair> {
    (!heldout.is_empty()).then(|| gain::hold(heldout, base, &state.model, problem.sigma, trim))
}

/// What speaks against causes that end at `at`, one doubt for each record: channels in which the extended model leaves much more than in the
/// training records, though none of it is the same throughout, as a sensor that has shifted would leave. What was found does not hold there.
/// A sensor that was found to be off may not shift, either: what stood for it in the training records is then no number of that sensor.
pub fn against(pair: &Pair, training: &Problem, at: &State, found: &Of) -> Vec<Doubt> {
    let accuracy = if found.curve { OF_CURVE } else { ACCURACY };
    let shifts = pair.shifts(training, at);
    let is_more = |shift: &&Shift| {
        let (index, n) = (shift.index, shift.number);
        // the current that is the load says nothing about the converter
        if n == LOAD_CURRENT && pair.problem.records[index].metered.is_some() {
            return false;
        }
        let before = noise::left(&noise::channel(&pair.problem, &pair.before.residual, index, n));
        let after = noise::left(&noise::channel(&pair.problem, &pair.after.residual, index, n));
        if shift.throughout {
            return found.sensors[n] && after.square > accuracy * accuracy * before.square;
        }
        // a simulator that is off by its accuracy leaves that share of what was there, in squares, as in `shape`
        let usual = after.square / (shift.ratio * shift.ratio);
        after.lag1.abs() > RELATED && after.square > MUCH_WORSE * usual + accuracy * accuracy * before.square
    };
    let more: Vec<&Shift> = shifts.iter().filter(is_more).collect();
    let of_records = more.chunk_by(|one, other| one.index == other.index).map(|of_record| {
        let channels = of_record.iter().map(|shift| shift.number).collect();
        Doubt::HeldOut(channels, not_there(of_record))
    });
    let spoilt = held_table::spoilt(pair).into_iter();
    let spoilt = spoilt.map(|(channels, words)| Doubt::HeldOut(channels, words));
    let mut list: Vec<Doubt> = of_records.chain(points(pair)).chain(spoilt).collect();
    if list.is_empty() {
        list.extend(grown(pair, "with these causes"));
    }
    list
}

/// Held-out records that the model with `what` makes worse by more than chance, in two channels or more: what shifts between records is one sensor, and it alone.
/// One channel is enough where the model as given leaves noise alone: no shift undoes a cause.
pub fn grown(pair: &Pair, what: &str) -> Vec<Doubt> {
    let of = |(index, record): (usize, &Record)| {
        let cell = |state: &State, n: usize| {
            let values = noise::channel(&pair.problem, &state.residual, index, n);
            dot(&values, &values)
        };
        let each: Vec<(usize, f64, f64)> = (0..CHANNELS)
            .filter(|n| *n != LOAD_CURRENT || record.metered.is_none())
            .map(|n| (n, cell(&pair.before, n), cell(&pair.after, n)))
            .filter(|(_, before, after)| *before > 0.0 && *after > 0.0)
            .collect();
        let least = SURE * threshold(1, 1.0);
        let worse: Vec<usize> = (each.iter().filter(|(_, before, after)| after - before > least))
            .map(|(n, ..)| *n)
            .collect();
        let count = (0..CHANNELS)
            .flat_map(|n| noise::channel(&pair.problem, &pair.before.residual, index, n))
            .filter(|left| *left != 0.0)
            .count();
        let (before, after) = (each.iter()).fold((0.0, 0.0), |(b, a), (_, before, after)| (b + before, a + after));
        let is_it = worse.len() > 1 || !worse.is_empty() && before < NOISE_ALONE * count as f64;
        (!record.settled && is_it && after > GROWN * before).then(|| {
            let channels: Vec<&str> = worse.iter().map(|n| CHANNEL_NAMES[*n]).collect();
            let words = format!(
                "{} of the held-out record {} are further from the model {what} than from the model as given, {:.1} times all in all: they do not hold there",
                channels.join(", "),
                record.name,
                (after / before).sqrt()
            );
            Doubt::HeldOut(worse, words)
        })
    };
    pair.problem.records.iter().enumerate().filter_map(of).collect()
}

/// What tables of settled points say against any model: an error that no meter makes.
pub fn points(pair: &Pair) -> impl Iterator<Item = Doubt> {
    let far = held_table::far(pair).into_iter();
    far.map(|(channels, words)| Doubt::HeldOut(channels, words))
}

/// Said of channels of one record.
fn not_there(of_record: &[&Shift]) -> String {
    let (moved, far): (Vec<&Shift>, Vec<&Shift>) = of_record.iter().partition(|shift| shift.throughout);
    let one = |shift: &&Shift| {
        format!(
            "{} of the held-out record {} lies {} {} the model with these causes throughout: its sensor, which was found to be off, has \
             shifted between the records, or its error is another than a gain and an offset",
            shift.channel,
            shift.record,
            si(shift.mean.abs(), shift.unit),
            if shift.mean > 0.0 { "above" } else { "below" },
        )
    };
    let said = moved.iter().map(one).chain(far_off(&far));
    said.collect::<Vec<_>>().join("; ")
}

fn far_off(of_record: &[&Shift]) -> Option<String> {
    let first = of_record.first()?;
    let channels: Vec<&str> = of_record.iter().map(|shift| shift.channel).collect();
    let (are, up_to) = match channels.len() {
        1 => ("is", ""),
        _ => ("are", "up to "),
    };
    let ratio = of_record.iter().map(|shift| shift.ratio).fold(0.0, f64::max);
    Some(format!(
        "{} of the held-out record {} {are} {up_to}{ratio:.1} times as far from the model with these causes as the training records: \
         they do not hold there",
        channels.join(", "),
        first.record
    ))
}
