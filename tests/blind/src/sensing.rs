//! From true signals on the fine grid to recorded samples: low-pass, instant, gain, offset, noise, converter.

use crate::bench::{Bench, Sensors, T_SW};
use crate::experiment::Record;
use crate::netlist::T_FINE;
use crate::ngspice::Signals;
use crate::rng::Rng;

/// Names of the recorded signals, as in the CSV head.
pub const COLUMNS: [&str; 4] = ["v_o", "i_l", "i_o", "v_in"];

/// Recorded signals, one row for each period, in the order of [`COLUMNS`].
pub type Samples = Vec<[f64; 4]>;

/// What would be recorded without noise and converter.
#[must_use]
pub fn exact(bench: &Bench, record: &Record, signals: &Signals, random: &mut Rng) -> Samples {
    let s = &bench.sensors;
    let channels = [&signals.v_o, &signals.i_l, &signals.i_o].map(|channel| low_pass(channel, s.low_pass));
    let at = |row: usize, channel: &[f64]| interpolate(channel, instant(record, row, s.delay) / T_FINE);
    let [v_o, i_l, i_o] = &channels;
    let rows = 0..record.duty.len();
    let mut samples: Samples = rows
        .map(|row| {
            [
                s.v_gain * at(row, v_o) + s.v_offset,
                s.i_gain * at(row, i_l) + s.i_offset,
                at(row, i_o),
                at(row, &signals.v_in),
            ]
        })
        .collect();
    oddities(s, &mut samples, random);
    samples
}

/// When a row is sampled, s from the start of the run. A controller's own samples are not late.
fn instant(record: &Record, row: usize, late: f64) -> f64 {
    let start = (record.lead + row) as f64 * T_SW;
    match record.closed {
        true => start,
        false => start + 0.5 * T_SW + late,
    }
}

/// The duty in force in the period of each row, as far as the bench knows it: commanded, or held by the controller.
#[must_use]
pub fn duty(record: &Record, signals: &Signals) -> Vec<f64> {
    let middle = |row: usize| ((record.lead + row) as f64 + 0.5) * T_SW / T_FINE;
    match record.closed {
        true => (0..record.duty.len())
            .map(|row| interpolate(&signals.duty, middle(row)))
            .collect(),
        false => record.duty.clone(),
    }
}

/// Adds noise and rounds to the steps of the converter.
#[must_use]
pub fn recorded(bench: &Bench, exact: &Samples, random: &mut Rng) -> Samples {
    let s = &bench.sensors;
    let (v, i) = ((s.v_noise, s.v_lsb), (s.i_noise, s.i_lsb));
    let mut show = |value: f64, (noise, lsb): (f64, f64)| {
        let value = value + noise * random.normal();
        match lsb > 0.0 {
            true => (value / lsb).round() * lsb,
            false => value,
        }
    };
    let row = |row: &[f64; 4]| [show(row[0], v), show(row[1], i), show(row[2], i), show(row[3], v)];
    exact.iter().map(row).collect()
}

/// First-order lag, exact for a signal that is linear between the points.
fn low_pass(channel: &[f64], tau: f64) -> Vec<f64> {
    if tau <= 0.0 {
        return channel.to_vec();
    }
    let x = T_FINE / tau;
    let decay = libm::exp(-x);
    let (old, new) = ((1.0 - decay) / x - decay, 1.0 - (1.0 - decay) / x);
    let mut state = channel.first().copied().unwrap_or(0.0);
    let mut out = vec![state];
    for pair in channel.windows(2) {
        state = decay * state + old * pair[0] + new * pair[1];
        out.push(state);
    }
    out
}

fn interpolate(channel: &[f64], place: f64) -> f64 {
    let place = place.clamp(0.0, channel.len().saturating_sub(2) as f64);
    let index = place as usize;
    let part = place - index as f64;
    channel[index] * (1.0 - part) + channel[index + 1] * part
}

/// What no list has.
fn oddities(s: &Sensors, samples: &mut Samples, random: &mut Rng) {
    let odd = &s.odd;
    let rows = samples.len();
    // both drawn whether used or not, so that a case and its twin share all other numbers
    let (from, burst) = (rows / 4 + random.below(rows / 2), random.below(rows));
    for (row, sample) in samples.iter_mut().enumerate() {
        let x = (sample[0] - 100.0) / 10.0;
        let turns = 50.0 * row as f64 * T_SW + odd.mains_phase;
        sample[0] += odd.cubic * x * x * x + odd.mains * libm::sin(2.0 * std::f64::consts::PI * turns);
        if row >= from {
            sample[0] += odd.shift;
        }
        if (burst..burst + 8).contains(&row) {
            sample[0] += if row % 2 == 0 { odd.burst } else { -0.6 * odd.burst };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_low_pass_of_a_ramp_lags_by_its_time_constant() {
        let ramp: Vec<f64> = (0..400).map(f64::from).collect();
        let out = low_pass(&ramp, 20.0 * T_FINE);
        assert!((ramp[399] - out[399] - 20.0).abs() < 1e-6, "{}", out[399]);
    }

    #[test]
    fn interpolation_meets_the_points_and_halves_between() {
        assert_eq!(interpolate(&[1.0, 3.0, 4.0], 1.0), 3.0);
        assert_eq!(interpolate(&[1.0, 3.0, 4.0], 0.5), 2.0);
        assert_eq!(interpolate(&[1.0, 3.0, 4.0], 9.0), 3.0);
    }
}
