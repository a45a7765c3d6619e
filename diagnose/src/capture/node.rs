//! What the switch node shows between its edges, and whether the current rests.

use super::fold::{Bins, Fold};
use super::{Level, Node, Pulse, accuracy};
use crate::exact::Exact;

/// Levels are read off the middle of an interval: edges ring at its start.
const MIDDLE: (f64, f64) = (0.25, 0.75);
/// A node late in the off-interval lies at the output voltage where no current flows, and at ground where one does: this share of the
/// way tells them apart, ...
const RESTS: f64 = 0.5;
/// ... if it is this many standard deviations of the level.
const SURE: f64 = 4.0;

/// Levels of the switch node, and whether the current rests: by the node where `v_out` is far enough from ground, else by the current.
pub(super) fn shown(
    pulse: Pulse,
    values: &[f64],
    bins: &Bins,
    v_out: f64,
    current: Option<&Fold>,
) -> Option<(Node, bool)> {
    let fold = bins.fold(values);
    let on = pulse.width.time / bins.period;
    let level = |from: f64, to: f64| {
        let within = bins
            .at
            .iter()
            .zip(&fold.value)
            .filter(|(at, v)| (from..to).contains(*at) && v.is_finite());
        let all: Vec<f64> = within.map(|(_, v)| v + fold.mean).collect();
        let value = all.iter().sum::<f64>() / all.len() as f64;
        let noise = fold.noise / (all.len() as f64 * bins.periods).sqrt();
        (!all.is_empty()).then(|| Level {
            value,
            sd: noise.hypotenuse(accuracy(value, fold.span, fold.step)),
        })
    };
    let inside = |start: f64, width: f64| level(start + MIDDLE.0 * width, start + MIDDLE.1 * width);
    let high = inside(0.0, on)?;
    let late = level(on + 0.85 * (1.0 - on), on + 0.95 * (1.0 - on))?;
    let way = RESTS * v_out;
    let rests = match current {
        Some(current) if way < SURE * late.sd => current.rests(bins.periods),
        _ => late.value > way,
    };
    Some((
        Node {
            pulse,
            on: high,
            off: inside(on, 1.0 - on).filter(|_| !rests),
            mean: Level {
                value: fold.mean,
                sd: fold.mean_sd.hypotenuse(accuracy(fold.mean, fold.span, fold.step)),
            },
        },
        rests,
    ))
}

#[cfg(test)]
mod tests {
    use super::super::At;
    use super::*;

    /// 3.3 V from 24 V: the node rests far below a fifth of the source.
    #[test]
    fn a_node_rests_at_the_output_voltage_however_low_that_is() {
        let period = 10.03e-6;
        let time: Vec<f64> = (0..800).map(|n| f64::from(n) * 1e-7).collect();
        let bins = Bins::new(&time, 1e-7, period, 0.0);
        let at = |time: f64| At { time, sd: 1e-9 };
        let pulse = Pulse {
            on: at(0.0),
            width: at(0.1 * period),
        };
        for (rest, is_rest) in [(3.3, true), (-0.5, false)] {
            let value = |t: &f64| match (t / period).rem_euclid(1.0) {
                phase if phase < 0.1 => 24.0,
                phase if phase < 0.5 => -0.5,
                _ => rest,
            };
            let values: Vec<f64> = time.iter().map(value).collect();
            let (node, rests) = shown(pulse, &values, &bins, 3.3, None).unwrap();
            assert_eq!((rests, node.off.is_none()), (is_rest, is_rest), "{rest}");
        }
    }
}
