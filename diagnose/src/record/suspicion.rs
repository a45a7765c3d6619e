//! Signals whose size says that they are not what their column is called, or not in its unit.

use plant::Parameters;
use toml_input::Message;

use super::{CHANNEL_UNITS, CHANNELS, Record};
use crate::problem::median;

/// A signal this many times larger or smaller than the model's is in another unit: units are a thousand apart, percent a hundred,
/// and operating points of one converter less than ten. About the geometric mean of ten and a hundred.
const OTHER_UNIT: f64 = 30.0;
/// Two signals are exchanged if each is this far from its own size and (conventions: no bench is 60 % off its model in two signals at
/// once, and one that is 30 % off is no longer near) ...
const FAR: f64 = 1.6;
/// ... this near to the other's.
const NEAR: f64 = 1.3;
/// Duties and currents below this are too small to judge by: a ratio of two of them would be one of offsets. A
/// convention.
const LEAST: f64 = 0.02;

/// What is wrong with a record, as far as sizes tell.
pub fn of(record: &Record, parameters: &Parameters, labels: &[String; CHANNELS]) -> Vec<Message> {
    let sizes = sizes(record, parameters);
    let known: Vec<(usize, f64, f64)> = (0..CHANNELS)
        .filter_map(|n| Some((n, sizes[n]?, typical(&record.measured[n])?)))
        .collect();
    for (n, (a, size_a, found_a)) in known.iter().enumerate() {
        for (b, size_b, found_b) in &known[n + 1..] {
            let apart = ratio(*found_a, *size_a) > FAR && ratio(*found_b, *size_b) > FAR;
            if apart && ratio(*found_a, *size_b) < NEAR && ratio(*found_b, *size_a) < NEAR {
                let (a, b) = (&labels[*a], &labels[*b]);
                let message = Message::new(format!("the columns {a} and {b} look exchanged"));
                let found = format!("{a} around {}, {b} around {}", shown(*found_a), shown(*found_b));
                let expected = format!("about {} and {}", shown(*size_a), shown(*size_b));
                return vec![
                    message
                        .found(found)
                        .expected(expected)
                        .hint("name them the right way in the header, or by a map: --map v_out=COLUMN,..."),
                ];
            }
        }
    }
    let off = known
        .iter()
        .filter(|(_, size, found)| ratio(*found, *size) > OTHER_UNIT);
    let message = |(n, size, found): &(usize, f64, f64)| {
        let (name, unit) = (&labels[*n], CHANNEL_UNITS[*n]);
        Message::new(format!("{name} is not in {unit}, or not of this converter"))
            .found(format!("around {}", shown(*found)))
            .expected(format!("around {} {unit} by the model", shown(*size)))
            .hint(format!(
                "a unit may follow the name: `{name} [m{unit}]`; or give scale = ... in the map file"
            ))
    };
    off.map(message).collect()
}

/// What the model has on average: nothing where that is too small or unknown.
fn sizes(record: &Record, parameters: &Parameters) -> [Option<f64>; CHANNELS] {
    let v_in = parameters.converter.v_in * record.v_in_ratio;
    let duty = typical(&record.duty).filter(|duty| *duty > LEAST);
    let v_o = duty.map(|duty| duty * v_in);
    let drawn = v_o.and_then(|v| {
        let each: Vec<f64> = record
            .load
            .iter()
            .map(|l| l.current + l.conductance * v + l.power / v)
            .collect();
        typical(&each).filter(|i| *i > LEAST)
    });
    [v_o, drawn, drawn, Some(v_in)]
}

/// The middle size of a signal; nothing if it is empty or 0.
pub fn typical(values: &[f64]) -> Option<f64> {
    let sizes: Vec<f64> = values.iter().filter(|v| v.is_finite()).map(|v| v.abs()).collect();
    let middle = if sizes.is_empty() { 0.0 } else { median(sizes) };
    (middle > 0.0).then_some(middle)
}

fn ratio(a: f64, b: f64) -> f64 {
    (a / b).max(b / a)
}

fn shown(value: f64) -> String {
    report::quantity(value, "", 3)
}
