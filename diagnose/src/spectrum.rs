//! Lines in a residual.

use std::f64::consts::TAU;

use crate::noise::channel;
use crate::problem::Problem;

/// Frequencies looked at, as shares of the sampling frequency: 20 Hz, below which a record of 25 ms holds half a turn, to 2 kHz at
/// 10 kHz, above which the filter lets nothing of the source through.
const LOWEST: f64 = 2e-3;
const HIGHEST: f64 = 0.2;

/// A sine of time 0 at the record's zero time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// Frequency, Hz.
    pub frequency: f64,
    /// Amplitude in the channel's unit.
    pub amplitude: f64,
    /// Phase, turns.
    pub phase: f64,
    /// Share of the channel's residual power.
    pub share: f64,
}

/// The strongest line of one channel over all records; nothing if the channel was not measured.
#[must_use]
pub fn strongest_line(problem: &Problem, residual: &[f64], n: usize) -> Option<Line> {
    let mut samples = Vec::new();
    let (mut longest, t_sw) = (0.0f64, problem.bases.t_sw);
    for (index, record) in problem.records.iter().enumerate().filter(|(_, r)| !r.settled) {
        let values = channel(problem, residual, index, n);
        samples.extend(
            values
                .iter()
                .zip(&record.time)
                .filter(|(v, _)| **v != 0.0)
                .map(|(v, t)| (*t, *v)),
        );
        longest = longest.max(record.rows() as f64 * t_sw);
    }
    // the strongest line of white noise holds 2 ln(n / 2) / n of its power: 13 % here, and `shape::LINE` is 15 %
    if samples.len() < 50 {
        return None;
    }
    let mean = samples.iter().map(|(_, v)| v).sum::<f64>() / samples.len() as f64;
    let power: f64 = samples.iter().map(|(_, v)| (v - mean) * (v - mean)).sum();
    // a quarter of a turn over the longest record: between two frequencies a line loses at most 3 % of its amplitude
    let step = 0.25 / longest;
    let count = ((HIGHEST - LOWEST) / t_sw / step) as usize;
    let mut best: Option<(f64, f64, f64, f64)> = None;
    for k in 0..=count {
        let frequency = LOWEST / t_sw + k as f64 * step;
        let (mut sine, mut cosine) = (0.0, 0.0);
        for (t, v) in &samples {
            // sums, not a Fourier transform: rows are missing, and records have times of their own. From the crate
            // libm, whose bits are the same on every machine
            let (s, c) = (libm::sin(TAU * frequency * t), libm::cos(TAU * frequency * t));
            sine += (v - mean) * s;
            cosine += (v - mean) * c;
        }
        let strength = sine * sine + cosine * cosine;
        if best.is_none_or(|best| strength > best.0) {
            best = Some((strength, frequency, sine, cosine));
        }
    }
    let (strength, frequency, sine, cosine) = best?;
    let n_samples = samples.len() as f64;
    Some(Line {
        frequency,
        amplitude: 2.0 * strength.sqrt() / n_samples * problem.sigma[n],
        phase: libm::atan2(cosine, sine) / TAU,
        share: 2.0 * strength / n_samples / power.max(1e-300),
    })
}
