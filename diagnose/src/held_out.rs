//! What held-out records say against an explanation.

use crate::doubts::Doubt;
use crate::drive::Model;
use crate::fit::State;
use crate::gain::{self, MUCH_WORSE, Pair, Shift};
use crate::held_table;
use crate::level::ACCURACY;
use crate::noise;
use crate::problem::Problem;
use crate::record::{LOAD_CURRENT, Record};

/// Correlation of neighbours from which on an error is more than noise: a coarser range of the scope or a wild sample leaves none,
/// and an error that makes a mean square of 2.5 out of one of 1 leaves 1.5 / 2.5 where it is smooth. Half of that.
const RELATED: f64 = 0.3;

/// What the law of a part's curve may be off by where no fit has been, as a share of what the part does: another law is met within 3 % of the
/// capacitance where records have been (`tests/ceramic.rs`), and a blind case left 1.2 % of the error beyond.
const OF_CURVE: f64 = 0.03;

/// The held-out records with the model as given and with `state`, if there are any.
pub fn held(problem: &Problem, heldout: &[Record], base: &Model, state: &State, trim: f64) -> Option<Pair> {
    (!heldout.is_empty()).then(|| gain::hold(heldout, base, &state.model, problem.sigma, trim))
}

/// What speaks against causes that end at `at`, one doubt for each record: channels in which the extended model leaves much more than in the
/// training records, though none of it is the same throughout, as a sensor that has shifted would leave. What was found does not hold there.
/// `of_curve` if a cause is the curve of a part.
pub fn against(pair: &Pair, training: &Problem, at: &State, of_curve: bool) -> Vec<Doubt> {
    let accuracy = if of_curve { OF_CURVE } else { ACCURACY };
    let shifts = pair.shifts(training, at);
    let is_more = |shift: &&Shift| {
        let (index, n) = (shift.index, shift.number);
        // the current that is the load says nothing about the converter
        if shift.throughout || n == LOAD_CURRENT && pair.problem.records[index].metered.is_some() {
            return false;
        }
        let before = noise::left(&noise::channel(&pair.problem, &pair.before.residual, index, n));
        let after = noise::left(&noise::channel(&pair.problem, &pair.after.residual, index, n));
        // a simulator that is off by its accuracy leaves that share of what was there, in squares, as in `shape`
        let usual = after.square / (shift.ratio * shift.ratio);
        after.lag1.abs() > RELATED && after.square > MUCH_WORSE * usual + accuracy * accuracy * before.square
    };
    let more: Vec<&Shift> = shifts.iter().filter(is_more).collect();
    let of_records = more.chunk_by(|one, other| one.index == other.index).map(|of_record| {
        let channels = of_record.iter().map(|shift| shift.number).collect();
        Doubt::HeldOut(channels, not_there(of_record))
    });
    of_records.chain(points(pair)).collect()
}

/// What tables of settled points say against any model: an error that no meter makes.
pub fn points(pair: &Pair) -> impl Iterator<Item = Doubt> {
    let far = held_table::far(pair).into_iter();
    far.map(|(channels, words)| Doubt::HeldOut(channels, words))
}

/// Said of channels of one record.
fn not_there(of_record: &[&Shift]) -> String {
    let Some(first) = of_record.first() else {
        return String::new();
    };
    let channels: Vec<&str> = of_record.iter().map(|shift| shift.channel).collect();
    let (are, up_to) = match channels.len() {
        1 => ("is", ""),
        _ => ("are", "up to "),
    };
    let ratio = of_record.iter().map(|shift| shift.ratio).fold(0.0, f64::max);
    format!(
        "{} of the held-out record {} {are} {up_to}{ratio:.1} times as far from the model with these causes as the training records: \
         they do not hold there",
        channels.join(", "),
        first.record
    )
}
