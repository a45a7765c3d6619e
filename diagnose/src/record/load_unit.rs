//! A load column in another unit, which makes every measured current look a thousand times too small. The other way round the currents are in milliamperes.

use plant::{Load, Parameters};
use toml_input::Message;

use super::Record;
use super::channels::QUANTITIES;
use super::suspicion::{OTHER_UNIT, ratio, shown, sizes, typical};
use crate::ideal::Ideal;

/// A thousand: milli and kilo.
const UNIT: f64 = 1000.0;
/// A current is the load's within this ratio: ripple at the sampling instant, losses, and what the rest of the load draws.
const NEAR: f64 = 1.6;

/// A part of the load: its quantity, its unit, and what it draws at a voltage, A.
type Part = (&'static str, &'static str, fn(&Load, f64) -> f64);

const PARTS: [Part; 3] = [
    ("r_load", "ohm", |load, v| load.conductance * v),
    ("i_load", "A", |load, _| load.current),
    ("p_load", "W", |load, v| load.power / v),
];

/// Share of samples at 0 A or below from which on a current rests where it is sampled, and shows noise: of a current that is read a thousand times too small there
/// is none but in a valley. A convention.
const RESTS: f64 = 0.2;

/// Whether an inductor's current is sampled where it rests.
fn rests(values: &[f64]) -> bool {
    let count = values.iter().filter(|value| value.is_finite()).count();
    let at_rest = values.iter().filter(|value| **value <= 0.0).count();
    at_rest as f64 > RESTS * count as f64
}

/// What is said where all measured currents are those of the load with one of its columns drawing a thousandth, and none that of the load as it is
/// written.
pub(super) fn suspected(record: &Record, parameters: &Parameters) -> Option<Message> {
    let [Some(v), _, Some(drawn), _] = sizes(record, parameters) else {
        return None;
    };
    let ideal = Ideal::of(record, parameters);
    let duty = typical(&record.duty)?;
    let currents: Vec<(usize, f64)> = [1, 2]
        .into_iter()
        .filter(|n| *n != 1 || !rests(&record.measured[1]))
        .filter_map(|n| Some((n, typical(&record.measured[n])?)))
        .collect();
    // each current over that of a load
    let over = |drawn: f64| {
        let own = |n: usize| if n == 1 { ideal.inductor(drawn, duty) } else { drawn };
        currents
            .iter()
            .map(|(n, found)| ratio(*found, own(*n)))
            .collect::<Vec<f64>>()
    };
    if currents.is_empty() || over(drawn).iter().any(|times| *times < OTHER_UNIT) {
        return None;
    }
    PARTS.iter().find_map(|(name, unit, draws)| {
        let own = typical(&record.load.iter().map(|load| draws(load, v)).collect::<Vec<_>>())?;
        if over(drawn - own + own / UNIT).iter().any(|times| *times > NEAR) {
            return None;
        }
        // a resistance that draws less is a larger one
        let prefix = if *name == "r_load" { "k" } else { "m" };
        let (n, found) = currents[0];
        let channel = QUANTITIES[n];
        Some(
            Message::new(format!("{name} is not in {unit}"))
                .found(format!("a load of about {} A", shown(drawn)))
                .expected(format!("about {} A, as {channel} shows", shown(found)))
                .hint(format!(
                    "a unit may follow the name: `{name} [{prefix}{unit}]`; or give scale = ... in the map file"
                )),
        )
    })
}
