//! The resistors of a load box, which need not be what is printed on them.
//!
//! A table says what is printed (`r_load`), row by row. Resistors of 5 or 10 % are each off by something else, so that no one factor mends them:
//! a resistor has a factor of its own, in all records in which it is set. It is no number of the converter, and stands in no plant file.

use plant::Load;

use crate::attribute::Attribution;
use crate::record::Record;
use crate::words::si;

/// Most resistors with factors of their own: beyond that a load is a decade or a rheostat, whose errors are no few numbers.
pub const MOST: usize = 4;
/// Two conductances this near, as a share, are one resistor: what is left of its printed digits.
const SAME: f64 = 1e-6;

/// A resistor of the load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resistor {
    /// What the table says, S.
    pub printed: f64,
    /// Real over printed conductance, 1.
    pub factor: f64,
}

impl Resistor {
    fn is(&self, conductance: f64) -> bool {
        (conductance - self.printed).abs() <= SAME * self.printed
    }
}

/// The resistors between which the records step, the largest conductance first; none where there is only one, more than [`MOST`], or a load that a
/// meter has shown, which is what it is.
#[must_use]
pub fn printed(records: &[Record]) -> Vec<Resistor> {
    let mut list: Vec<Resistor> = Vec::new();
    let set = records.iter().filter(|record| record.metered.is_none());
    for load in set
        .flat_map(|record| &record.load)
        .filter(|load| load.conductance > 0.0)
    {
        if list.iter().all(|known| !known.is(load.conductance)) {
            list.push(Resistor {
                printed: load.conductance,
                factor: 1.0,
            });
        }
        if list.len() > MOST {
            return Vec::new();
        }
    }
    // what a capture holds is computed without the records' loads
    let is_captured = records.iter().any(|record| record.capture.is_some());
    if list.len() < 2 || is_captured {
        return Vec::new();
    }
    list.sort_by(|a, b| b.printed.total_cmp(&a.printed));
    list
}

/// Whether a resistor is another than what is printed on it.
#[must_use]
pub fn are_off(resistors: &[Resistor]) -> bool {
    resistors.iter().any(|one| one.factor != 1.0)
}

/// What the loads really are.
pub fn apply(resistors: &[Resistor], loads: &mut [Load]) {
    for load in loads.iter_mut().filter(|load| load.conductance > 0.0) {
        if let Some(own) = resistors.iter().find(|one| one.is(load.conductance)) {
            load.conductance *= own.factor;
        }
    }
}

/// What to say where each resistor has a value of its own.
#[must_use]
pub fn note(attribution: &Attribution) -> Option<String> {
    let resistors = &attribution.state().model.resistors;
    are_off(resistors).then(|| {
        let ohm = |conductance: f64| si(conductance.recip(), "ohm");
        let each = resistors.iter().enumerate().map(|(n, one)| {
            format!(
                "resistor_{} is the one of {}, really {}",
                n + 1,
                ohm(one.printed),
                ohm(one.printed * one.factor)
            )
        });
        format!(
            "the resistors of the load are not what r_load says: {}; correct that column, since no plant file holds them. What else the load \
             always draws is a part of each",
            each.collect::<Vec<_>>().join(", ")
        )
    })
}

#[cfg(test)]
mod tests {
    use plant::Load;

    use super::{Resistor, apply};

    #[test]
    fn each_resistor_has_its_own_factor_and_no_other_load_has_one() {
        let resistors = [(0.1, 1.05), (0.05, 0.9)].map(|(printed, factor)| Resistor { printed, factor });
        let mut loads = [
            Load::resistor(10.0),
            Load::resistor(20.0),
            Load::resistor(15.0),
            Load::current(0.1),
        ];
        apply(&resistors, &mut loads);
        let found = loads.map(|load| load.conductance);
        let expected = [0.105, 0.045, 1.0 / 15.0, 0.0];
        assert!(
            found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12),
            "{found:?}"
        );
        assert_eq!(loads[3].current, 0.1);
    }
}
