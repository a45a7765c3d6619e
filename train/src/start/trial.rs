//! The observer, tried: how its law alone does on the plant, before anybody trains.

use std::path::Path;

use closed_loop::Converter;
use plant::{Parameters, Topology};

use super::base::Base;
use super::{Start, TRAINING};
use crate::contract::Contract;
use crate::faults::Error;
use crate::judge::{evaluate, overall};
use crate::score::Score;
use crate::settings::Settings;

/// How many times the usual the bias may be wrong by in a period, where the usual does not do.
// the usual was found on a converter without losses. With r ohms of them a load step of i amperes moves the bias by r i: of a buck from
// 12 V to 5 V with 39 mohm and a step of 3.6 A the law settles in .46, .26, .20, .19 ms at 1, 3.3, 10 and 33 times, and its tail is
// 2, 3, 4 and 5 mV
const FACTORS: [f64; 5] = [2.0, 4.0, 8.0, 16.0, 32.0];
/// Share of the cost that an observer which misses a limit as well may leave at most: a faster one has more noise at rest, and what it takes
/// off a deviation that another limit forbids is not worth that.
const WORTH: f64 = 0.5;
/// Double pole of a buck's law that is tried where no observer does with the usual one.
// after a load step down the diode blocks, and what the bias then believes has to be forgotten: the faster law of a buck with 150 uF
// settles in 3.6 ms where the usual one takes 3.8, and asks for no faster observer. As the usual one it would exceed limits (POLE)
const FASTER_POLE: f64 = 0.4;
/// Slower ones, where the law still misses: neither it nor its observer knows the series resistance of the capacitor, and what it takes for an
/// error of the voltage is a current.
const SLOWER_POLES: [f64; 4] = [0.6, 0.7, 0.8, 0.9];
/// The contract, in a folder of its own.
const CONTRACT: &str = "policy.toml";

impl Start {
    /// This one if its law meets the specification, else the first of [`FACTORS`] whose law does, of a buck at last the first with a
    /// faster law that does, else one whose law costs much less.
    pub(super) fn tried(self, plant: &Parameters, file: &Path) -> Result<Self, Error> {
        if !matches!(self.base, Base::Observed(_)) {
            return Ok(self);
        }
        let mut best = (self.score(plant, file)?, self);
        let usual = FACTORS.map(|factor| (factor, None));
        let is_buck = plant.converter.topology == Topology::Buck;
        let faster = is_buck.then(|| {
            std::iter::once(1.0)
                .chain(FACTORS)
                .map(|factor| (factor, Some(FASTER_POLE)))
                .chain(SLOWER_POLES.map(|pole| (1.0, Some(pole))))
        });
        for (factor, pole) in usual.into_iter().chain(faster.into_iter().flatten()) {
            if best.0.met {
                break;
            }
            let other = Self::with(plant, file, best.1.wanted, (factor, pole), Some(best.1.limits.clone()))?;
            let score = other.score(plant, file)?;
            let may_miss = pole != Some(FASTER_POLE);
            if score.met || may_miss && score.cost < WORTH * best.0.cost {
                best = (score, other);
            }
        }
        Ok(best.1)
    }

    /// How the law alone does in the evaluation of the training file.
    fn score(&self, plant: &Parameters, file: &Path) -> Result<Score, Error> {
        // through the texts that are written, because this is what a user trains with
        let settings = Settings::parse(&self.training(CONTRACT, "plant.toml"), Path::new(TRAINING))?;
        let contract = Contract::read(&file.with_file_name(CONTRACT), self.contract(), &settings.hidden)?;
        let numbers: Vec<(&str, f64)> = settings.set.iter().map(|(key, value)| (key.as_str(), *value)).collect();
        let converter = Converter::new(plant)?.with(&numbers)?;
        let Some(law) = contract.policy.law_alone() else {
            return Ok(Score { met: true, cost: 0.0 });
        };
        Ok(overall(&evaluate(&settings, &converter, &law)?))
    }
}
