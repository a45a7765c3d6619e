//! At which frequencies the errors of a record lie.

use std::f64::consts::TAU;

use report::{Axis, Chart, Colour, Panel, ReportError, Series, Svg};

use super::colours::{EXTENDED, MODEL};
use crate::fit::State;
use crate::noise::channel;
use crate::problem::{LOST, Problem};
use crate::record::{CHANNEL_NAMES, CHANNEL_UNITS};

/// Rows of a stretch that is transformed: two thirds of what a picture has pixels for. Longer records are cut, half over each other,
/// and their powers averaged (Welch 1967), so that no line falls between two frequencies.
const STRETCH: usize = 512;
/// Fewest rows with a spectrum worth a look.
const FEWEST: usize = 64;

/// Amplitude of a sine that would leave this power, over frequency, before and after; nothing for points without a common rate.
pub(super) fn picture(
    problem: &Problem,
    states: &[(&str, &State, Colour)],
    record: usize,
    channels: &[usize],
) -> Option<Result<Svg, ReportError>> {
    let one = &problem.records[record];
    if one.rows() < FEWEST || (one.settled && !one.repeated) {
        return None;
    }
    let spacing = (one.time[one.rows() - 1] - one.time[0]) / (one.rows() - 1) as f64;
    let is_even = one
        .time
        .windows(2)
        .all(|pair| ((pair[1] - pair[0]) / spacing - 1.0).abs() < 0.01);
    if !is_even {
        return None;
    }
    let mut chart = Chart::new(
        format!("Spectrum of what is left of {}", one.name),
        Axis::new("frequency").unit("Hz"),
    );
    let mut is_empty = true;
    for &n in channels {
        let axis = Axis::new(format!("amplitude in {}", CHANNEL_NAMES[n])).unit(CHANNEL_UNITS[n]);
        let mut panel = Panel::new(axis).height(110.0);
        for &(name, state, colour) in states {
            let errors: Vec<f64> = channel(problem, &state.residual, record, n)
                .into_iter()
                .map(|v| if v == LOST { 0.0 } else { v * problem.sigma[n] })
                .collect();
            if !errors.iter().all(|v| v.is_finite()) {
                continue;
            }
            is_empty = false;
            let (frequency, amplitude) = amplitudes(&errors, spacing);
            panel = panel.series(Series::line(name, frequency, amplitude).colour(colour));
        }
        chart = chart.panel(panel);
    }
    (!is_empty).then(|| chart.svg())
}

/// The models of a picture.
pub(super) fn models<'a>(
    before: &'a State,
    after: &'a State,
    second: Option<&'a str>,
) -> Vec<(&'a str, &'a State, Colour)> {
    let first = ("model", before, MODEL);
    std::iter::once(first)
        .chain(second.map(|name| (name, after, EXTENDED)))
        .collect()
}

/// Frequencies in Hz and amplitudes in the unit of `values`, `spacing` seconds apart.
fn amplitudes(values: &[f64], spacing: f64) -> (Vec<f64>, Vec<f64>) {
    let length = values.len().min(STRETCH);
    // from the crate libm, whose bits are the same on every machine
    let turn: Vec<(f64, f64)> = (0..length)
        .map(|k| TAU * k as f64 / length as f64)
        .map(|angle| (libm::cos(angle), libm::sin(angle)))
        .collect();
    // Hann: a line leaks into its neighbours alone
    let window: Vec<f64> = turn.iter().map(|(cosine, _)| 0.5 - 0.5 * cosine).collect();
    let weight: f64 = window.iter().sum();
    let mut power = vec![0.0; length / 2 + 1];
    let starts: Vec<usize> = (0..=values.len() - length).step_by((length / 2).max(1)).collect();
    for start in &starts {
        let stretch = &values[*start..start + length];
        for (k, power) in power.iter_mut().enumerate() {
            let (mut real, mut imaginary) = (0.0, 0.0);
            for (n, (value, window)) in stretch.iter().zip(&window).enumerate() {
                let (cosine, sine) = turn[k * n % length];
                real += value * window * cosine;
                imaginary += value * window * sine;
            }
            *power += real * real + imaginary * imaginary;
        }
    }
    let amplitude = |power: &f64| 2.0 * (power / starts.len() as f64).sqrt() / weight;
    let frequency = |k: usize| k as f64 / (length as f64 * spacing);
    // the mean stands in the table
    let first = 1;
    (
        (first..power.len()).map(frequency).collect(),
        power[first..].iter().map(amplitude).collect(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sine_has_its_amplitude_at_its_frequency() {
        // 40 periods in 512 rows of 10 us: 7812.5 Hz
        let values: Vec<f64> = (0..1500)
            .map(|n| 0.3 * libm::sin(TAU * 40.0 * f64::from(n) / 512.0))
            .collect();
        let (frequency, amplitude) = amplitudes(&values, 1e-5);
        let (at, most) = amplitude
            .iter()
            .enumerate()
            .fold((0, 0.0), |best, (n, a)| if *a > best.1 { (n, *a) } else { best });
        assert!((frequency[at] - 7812.5).abs() < 1e-6, "{}", frequency[at]);
        assert!((most - 0.3).abs() < 1e-9, "{most}");
    }
}
