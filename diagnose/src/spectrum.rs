//! Lines in a residual.

use std::f64::consts::TAU;

use crate::median::median;
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

/// Frequencies at which a filter may swing, as shares of the sampling frequency: below, a record holds few turns; above, two rows a turn
/// are left.
const SLOWEST: f64 = 1.0 / 120.0;
const FASTEST: f64 = 0.35;
/// A swing stands out of the median of its neighbours by this, in squares: the largest of 200 exponential numbers is eight times
/// their median. More only costs the look at a filter that is none.
const STANDS_OUT: f64 = 10.0;
/// Neighbours of a frequency are within this factor: several widths of a swing that fades within two turns.
const NEIGHBOUR: f64 = 1.7;
/// Two swings are apart by this share of their frequency.
const OTHER_SWING: f64 = 0.2;
/// Swings that are looked at: behind a filter of the input that of the output may be the stronger.
const MOST_SWINGS: usize = 2;

/// Frequencies in Hz at which a channel swings behind steps, the strongest first. Changes from row to row are looked at, in which the steps
/// themselves are single rows.
#[must_use]
pub fn swings(problem: &Problem, residual: &[f64], n: usize) -> Vec<f64> {
    let mut records = Vec::new();
    for (index, _) in problem
        .records
        .iter()
        .enumerate()
        .filter(|(_, r)| !r.settled && r.dense)
    {
        let values = channel(problem, residual, index, n);
        let pairs = values
            .windows(2)
            .enumerate()
            .filter(|(_, pair)| pair[0] != 0.0 && pair[1] != 0.0);
        records.push(
            pairs
                .map(|(row, pair)| (row as f64, pair[1] - pair[0]))
                .collect::<Vec<_>>(),
        );
    }
    let longest = records.iter().map(Vec::len).max().unwrap_or(0);
    if longest < 50 {
        return Vec::new();
    }
    let step = 0.5 / longest as f64;
    let count = ((FASTEST - SLOWEST) / step) as usize;
    let powers: Vec<(f64, f64)> = (0..=count)
        .map(|k| {
            let share = SLOWEST + k as f64 * step;
            let strength = records.iter().map(|samples| {
                let (mut sine, mut cosine) = (0.0, 0.0);
                for (row, v) in samples {
                    let (s, c) = libm::sincos(TAU * share * row);
                    sine += v * s;
                    cosine += v * c;
                }
                sine * sine + cosine * cosine
            });
            (share, strength.sum())
        })
        .collect();
    // of differences white noise and steps have different spectra, both smooth: a swing stands out of its neighbours
    let mut lines: Vec<(f64, f64)> = powers
        .iter()
        .map(|(share, power)| {
            let near = powers
                .iter()
                .filter(|other| (other.0 / share).max(share / other.0) < NEIGHBOUR);
            (*share, power / median(near.map(|other| other.1)).max(f64::MIN_POSITIVE))
        })
        .collect();
    lines.retain(|line| line.1 > STANDS_OUT);
    lines.sort_by(|a, b| b.1.total_cmp(&a.1));
    let mut found: Vec<f64> = Vec::new();
    for (share, _) in lines {
        let is_other = found.iter().all(|known| (share / known - 1.0).abs() > OTHER_SWING);
        if is_other && found.len() < MOST_SWINGS {
            found.push(share);
        }
    }
    found.iter().map(|share| share / problem.bases.t_sw).collect()
}
