//! What a partial explanation would gain: it is no explanation, but it says how far the list of causes reaches.

use crate::drive::Model;
use crate::fit::State;
use crate::gain::{Pair, Regime};
use crate::noise;
use crate::problem::Problem;
use crate::record::{CHANNEL_NAMES, CHANNEL_UNITS, CHANNELS};
use crate::words::si;

/// Errors of one channel of one record, without and with the partial explanation.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Worth {
    /// Record.
    pub record: String,
    /// Channel.
    pub channel: &'static str,
    /// Whether the record took no part in the fit.
    pub heldout: bool,
    /// Root mean square error of the model as given.
    pub rmse_before: f64,
    /// With the partial explanation.
    pub rmse_after: f64,
    /// Standard deviation of the noise.
    pub floor: f64,
    /// Unit of the errors.
    pub unit: &'static str,
}

impl Worth {
    /// In words.
    #[must_use]
    pub fn words(&self) -> String {
        let [before, after, floor] = [self.rmse_before, self.rmse_after, self.floor].map(|value| si(value, self.unit));
        let kind = if self.heldout { "held-out" } else { "training" };
        format!(
            "{} of {} ({kind}): {before} to {after}, noise {floor}",
            self.channel, self.record
        )
    }
}

/// Of the training records, whose model as given ends at `given` and with the partial explanation at `partial`.
pub fn of_training(problem: &Problem, given: &State, partial: &State) -> Vec<Worth> {
    let mut list = Vec::new();
    for (index, record) in problem.records.iter().enumerate() {
        for n in 0..CHANNELS {
            let rms = |state: &State| {
                problem.sigma[n]
                    * noise::left(&noise::channel(problem, &state.residual, index, n))
                        .square
                        .sqrt()
            };
            let (before, after) = (rms(given), rms(partial));
            if before > 0.0 && before.is_finite() {
                list.push(Worth {
                    record: record.name.clone(),
                    channel: CHANNEL_NAMES[n],
                    heldout: false,
                    rmse_before: before,
                    rmse_after: after,
                    floor: problem.sigma[n],
                    unit: CHANNEL_UNITS[n],
                });
            }
        }
    }
    list
}

/// Of held-out records.
pub fn of_held(pair: &Pair) -> Vec<Worth> {
    let whole = pair.errors().into_iter().filter(|held| held.regime == Regime::All);
    let worth = |held: crate::gain::Held| Worth {
        record: held.record,
        channel: held.channel,
        heldout: true,
        rmse_before: held.rmse_before,
        rmse_after: held.rmse_after,
        floor: held.floor,
        unit: held.unit,
    };
    whole.map(worth).collect()
}

/// Sets what the model exactly as given leaves, of training records whose model as given ends at `given`, and of held-out records.
pub fn before(list: &mut [Worth], (problem, given): (&Problem, &State), held: Option<&Pair>) {
    let mut all = of_training(problem, given, given);
    all.extend(held.map_or_else(Vec::new, of_held));
    for worth in list {
        let own =
            |one: &&Worth| (one.heldout, one.channel, &one.record) == (worth.heldout, worth.channel, &worth.record);
        if let Some(found) = all.iter().find(own) {
            worth.rmse_before = found.rmse_before;
        }
    }
}

/// Another carrier, if the records are far better with it: this share of chi-square is left.
const LEFT: f64 = 0.3;

/// What to say of the carrier of the model at which `state` ends.
pub fn other_carrier(problem: &Problem, state: &State) -> Option<String> {
    use plant::Carrier::{Centre, Leading, Trailing};
    let words = [(Trailing, "trailing"), (Leading, "leading"), (Centre, "centre")];
    let own = state.model.plant.pwm.carrier;
    let others = words.into_iter().filter(|(carrier, _)| *carrier != own);
    let tried = others.map(|(carrier, word)| {
        let mut model: Model = state.model.clone();
        model.plant.pwm.carrier = carrier;
        (State::settle(problem, &model, &state.starts, None).chi2, word)
    });
    let (chi2, word) = tried.min_by(|a, b| a.0.total_cmp(&b.0))?;
    (chi2 < LEFT * state.chi2).then(|| {
        format!(
            "with `carrier = \"{word}\"` under [pwm] the model leaves {:.0} % of this error: is the carrier of the plant file right?",
            100.0 * (chi2 / state.chi2).sqrt()
        )
    })
}
