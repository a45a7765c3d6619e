//! What each row of a record would show at rest, without losses: its size, before any simulation.

use plant::{Carrier, Parameters};

use super::Record;
use crate::ideal::Ideal;
use crate::median::median;

/// Mean values and ripple of a period, ideal converter, continuous conduction.
#[derive(Debug, Clone, Copy)]
struct Steady {
    /// Voltage that the duty makes, V.
    v: f64,
    /// Mean current that the load draws at it, A.
    drawn: f64,
    /// Mean current of the inductor, A.
    inductor: f64,
    /// Half of the inductor current's ripple, A.
    half: f64,
    /// Where in the ripple it is sampled: -1 in the valley, 1 at the peak.
    place: f64,
}

/// How a channel's rows lie beside what is expected of them.
#[derive(Debug, Clone, Copy)]
pub struct Beside {
    /// Median of shown over expected.
    pub times: f64,
    /// The same over the mean of the period: what a current would be expected to be if the instant of sampling were another.
    pub times_mean: f64,
    /// Median of what is expected, in the channel's unit.
    pub expected: f64,
    /// Median distance to what any instant of sampling would show, as a share of the mean: over the rows before the first step where
    /// the record begins at rest, else over all of them. Behind a step a current may swing by more than its mean.
    pub apart: f64,
    /// Median of the ripple at the instant of sampling as a share of what is expected there.
    pub ripple: f64,
}

/// Fewest rows before the first step that say how the record begins. A convention.
const BEGINNING: usize = 5;
/// Share of its mean within which a signal at rest stays, noise and all. A convention: a swing that matters here is larger.
const AT_REST: f64 = 0.2;

/// Rows before the first change of duty or load, if the channel rests there.
fn resting(record: &Record, channel: usize) -> Option<usize> {
    let (duty, load, shown) = (&record.duty, &record.load, &record.measured[channel]);
    // a load that was measured has noise
    let near = |a: f64, b: f64| (a - b).abs() <= 0.5 * AT_REST * b.abs();
    let is_same = |n: &usize| {
        let (now, first) = (&load[*n], &load[0]);
        let loads = near(now.conductance, first.conductance) && near(now.current, first.current);
        duty[*n] == duty[0] && loads && near(now.power, first.power)
    };
    let count = (0..record.rows()).take_while(is_same).count();
    if record.settled || count < BEGINNING {
        return None;
    }
    let known = || shown[..count].iter().copied().filter(|value| value.is_finite());
    let (low, high) = known().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
        (low.min(x), high.max(x))
    });
    (high - low < AT_REST * median(known()).abs()).then_some(count)
}

/// The channel beside its expectation; nothing without rows that have both.
pub fn beside(record: &Record, parameters: &Parameters, channel: usize) -> Option<Beside> {
    let resting = resting(record, channel);
    let mut at_rest = Vec::new();
    let rows: Vec<[f64; 5]> = record.measured[channel]
        .iter()
        .enumerate()
        .filter_map(|(row, &shown)| {
            let steady = Steady::of(record, parameters, row)?;
            let v_in = parameters.converter.v_in * record.v_in_ratio;
            let (expected, mean, half) = match channel {
                0 => (steady.v, steady.v, 0.0),
                1 => (
                    steady.inductor + steady.place * steady.half,
                    steady.inductor,
                    steady.half,
                ),
                2 => (steady.drawn, steady.drawn, 0.0),
                _ => (v_in, v_in, 0.0),
            };
            let apart = (shown.abs() - mean).abs() - half;
            let known = shown.is_finite() && shown != 0.0 && expected > 0.0;
            let ripple = (expected - mean).abs() / expected;
            if known && resting.is_some_and(|count| row < count) {
                at_rest.push(apart.max(0.0) / mean);
            }
            known.then(|| {
                [
                    shown.abs() / expected,
                    shown.abs() / mean,
                    expected,
                    apart.max(0.0) / mean,
                    ripple,
                ]
            })
        })
        .collect();
    let middle = |cell: usize| median(rows.iter().map(|row| row[cell]));
    (!rows.is_empty()).then(|| Beside {
        times: middle(0),
        times_mean: middle(1),
        expected: middle(2),
        apart: match at_rest.is_empty() {
            true => middle(3),
            false => median(at_rest.iter().copied()),
        },
        ripple: middle(4),
    })
}

impl Steady {
    fn of(record: &Record, parameters: &Parameters, row: usize) -> Option<Self> {
        let (d, load) = (record.duty[row], record.load[row]);
        let ideal = Ideal::of(record, parameters);
        let v = ideal.volts(d);
        let drawn = load.conductance * v + load.current + load.power / v;
        let half = match record.settled {
            // meters of settled points show means
            true => 0.0,
            false => ideal.half(d),
        };
        let place = place(parameters.pwm.carrier, d, record.phase);
        let inductor = ideal.inductor(drawn, d);
        (v > 0.0 && inductor.is_finite()).then_some(Self {
            v,
            drawn,
            inductor,
            half,
            place,
        })
    }
}

/// Place in the triangle of the current: -1 where the switch turns on, 1 where it turns off.
fn place(carrier: Carrier, duty: f64, phase: f64) -> f64 {
    let on = match carrier {
        Carrier::Trailing => 0.0,
        Carrier::Leading => 1.0 - duty,
        Carrier::Centre => 0.5 * (1.0 - duty),
    };
    let since = (phase - on).rem_euclid(1.0);
    match since < duty {
        true => 2.0 * since / duty - 1.0,
        false => 1.0 - 2.0 * (since - duty) / (1.0 - duty),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_valley_is_where_the_switch_turns_on_and_the_peak_where_it_turns_off() {
        for (carrier, on) in [
            (Carrier::Trailing, 0.0),
            (Carrier::Leading, 0.7),
            (Carrier::Centre, 0.35),
        ] {
            let at = |since: f64| place(carrier, 0.3, (on + since) % 1.0);
            for (since, expected) in [(0.0, -1.0), (0.15, 0.0), (0.3, 1.0), (0.65, 0.0)] {
                assert!(
                    (at(since) - expected).abs() < 1e-9,
                    "{carrier:?} {since}: {}",
                    at(since)
                );
            }
        }
    }
}
