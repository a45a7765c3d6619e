//! Inductor currents below zero: what the lower switch has to do with them.

use plant::Rectifier;

use crate::problem::Problem;
use crate::record::Record;

/// The inductor current among the channels.
const CURRENT: usize = 1;
/// A current is below zero if it is so by more than this many standard deviations of its noise.
const SURELY: f64 = 4.0;
/// Fewest such rows that are worth a word, as a share of the record.
// a convention: less than a load step's swing takes
const SHARE: f64 = 0.01;

/// What to say of records whose inductor current flows backward.
#[must_use]
pub fn note(problem: &Problem) -> Option<String> {
    let limit = -SURELY * problem.sigma[CURRENT];
    let below = |record: &&Record| {
        let current = &record.measured[CURRENT];
        let rows = current.iter().filter(|i| **i < limit).count();
        rows >= 3 && rows as f64 >= SHARE * current.len() as f64
    };
    let records: Vec<&str> = problem
        .records
        .iter()
        .filter(below)
        .map(|record| record.name.as_str())
        .collect();
    if records.is_empty() {
        return None;
    }
    let said = match problem.base.plant.converter.rectifier {
        Rectifier::Diode => {
            "a diode carries no current backward. If the lower switch is driven, write rectifier = \"synchronous\" in [converter] of \
             the model; if not, look for an offset of the current sensor"
        }
        Rectifier::Synchronous => {
            "there a dead time adds to the duty in the place of taking from it, since the current itself turns the switching node over. \
             Rows on both sides of 0 A tell a dead time from an offset"
        }
    };
    Some(format!("i_l is below 0 A in {}: {said}", records.join(", ")))
}
