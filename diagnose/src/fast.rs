//! Lines in what a model leaves, up to half the sampling rate: dither, limit cycles, what a sampler folds down.
//!
//! ```text
//! residual ─ periodogram ─ colour taken out ─ over the median of its neighbours ─ the largest against what chance gives
//! ```
//! A filter lets nothing so fast through, so no cause of the circuit makes it, and none is bent by it: what was found holds beside it. Second
//! differences, from which the noise is estimated, see such a line as noise, and it hides itself below a noise that it makes.
//!
//! Real noise is coloured. Its colour is an autoregression of a few poles, fitted to a periodogram whose lines were cut off: a broad
//! resonance is no line, and a line is no resonance. The floor is local for what that leaves, and the level counts what the floor itself is unsure
//! by: a ratio of two sums that are exponential and Gamma distributed.

use std::f64::consts::{LN_2, PI, TAU};

use crate::fit::State;
use crate::level::ACCURACY;
use crate::noise::{self, channel};
use crate::problem::Problem;
use crate::record::{CHANNEL_NAMES, CHANNEL_UNITS, CHANNELS};
use crate::shape::Structure;
use crate::sides;
use crate::words::si;

/// Lowest frequency, over the sampling rate: slower structure shows in means of ten rows (`shape`).
const LOWEST: f64 = 0.04;
/// And so many times what the filter rings at: a ring that ends is wide. Below it a line has to go on through the whole record.
const ABOVE_RING: f64 = 2.0;
/// Stretches in which such a line is looked for, and the share of its amplitude, in its own phase, that each has at least: a ring begins
/// anew at each step, and three of four stretches hold its phase by chance once in hundreds.
const STRETCHES: usize = 4;
const GOES_ON: f64 = 0.5;
/// Chance that a channel of a healthy record shows a line, and again that it shows one at a whole part of the rate. Four channels of a
/// record are looked at, so that one in 250 records does.
const CHANCE: f64 = 5e-4;
/// Fewest rows: of fewer neither floor nor colour is known at all.
const FEWEST: usize = 48;
/// A power at half the rate has one degree of freedom and others have two: 17 and 10 are passed once in 25000.
const OF_HALF: f64 = 1.7;
/// Neighbours that make the floor, at least and at most, in steps of the record's own resolution, and those next to a line that do not.
const NEIGHBOURS: [usize; 2] = [24, 120];
const GUARD: usize = 3;
/// Poles of the colour: more would follow the periodogram's own scatter.
const POLES: usize = 4;
/// A periodogram is cut off at this many times its neighbours for the colour: noise passes it once in 150 places.
const CUT: f64 = 5.0;
/// A smaller line is not worth a word, in standard deviations: in a record of 5000 rows a tenth would be seen.
const LEAST: f64 = 0.25;
/// Lines named in one channel: more are the harmonics of one.
const MOST: usize = 2;

/// A line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Peak {
    /// Over the sampling rate.
    pub frequency: f64,
    /// Amplitude, in the unit of the values.
    pub amplitude: f64,
    /// Power over that of the noise at its frequency.
    pub ratio: f64,
}

/// Periods from row to row, if all rows that count stand so far apart; nothing if they do not, or the record has no rows in time.
fn apart(values: &[f64]) -> Option<(usize, usize)> {
    let rows: Vec<usize> = (0..values.len()).filter(|row| values[*row] != 0.0).collect();
    let first = *rows.first()?;
    let step = rows.windows(2).map(|pair| pair[1] - pair[0]).min()?;
    rows.iter()
        .all(|row| (row - first) % step == 0)
        .then_some((first, step))
}

/// Lines in each channel of the records over time.
#[must_use]
pub fn structures(problem: &Problem, null: &State, state: &State) -> Vec<Structure> {
    let mut found = Vec::new();
    let p = &problem.base.plant.converter;
    // what the filter rings at is no line, however fast it is
    let ring = problem.bases.t_sw / (TAU * (p.inductance * p.capacitance).sqrt());
    for (index, record) in problem.records.iter().enumerate() {
        if record.settled || record.capture.is_some() {
            continue;
        }
        for n in 0..CHANNELS {
            let (left, before) = (
                channel(problem, &state.residual, index, n),
                channel(problem, &null.residual, index, n),
            );
            let (first, step) = match record.dense {
                true => (0, 1),
                // of a slower rate the rows in between are empty
                false => match apart(&left) {
                    Some(rows) => rows,
                    None => continue,
                },
            };
            let [left, before] =
                [left, before].map(|all| all.into_iter().skip(first).step_by(step).collect::<Vec<f64>>());
            let above_ring = ABOVE_RING * ring * step as f64;
            // what is as fast as the rows themselves is folded down to anywhere
            if above_ring >= 0.5 {
                continue;
            }
            // a coarse converter leaves patterns of its own
            if record.lattice[n] > 1.5 * problem.sigma[n] {
                continue;
            }
            let mut peaks = peaks(&left, &before, LOWEST, above_ring);
            if let Some(leap) = sides::unsure_leap(problem, state, index, n) {
                peaks.retain(|peak| peak.amplitude * problem.sigma[n] > OF_LEAP * leap);
            }
            if peaks.is_empty() {
                continue;
            }
            let shown = noise::left(&left);
            let rate = 1.0 / (problem.bases.t_sw * step as f64);
            let words: Vec<String> = (peaks.iter())
                .map(|peak| words(peak, left.len(), rate, problem.sigma[n], CHANNEL_UNITS[n]))
                .collect();
            found.push(Structure {
                record: record.name.clone(),
                channel: CHANNEL_NAMES[n],
                mean_square: shown.square,
                slow: shown.slow,
                correlation: shown.lag1,
                shape: words.join(", and "),
            });
        }
    }
    found
}

/// Mains and their harmonics, Hz.
const MAINS: [f64; 6] = [50.0, 60.0, 100.0, 120.0, 150.0, 300.0];
/// Whole parts of the sampling rate that dithers and limit cycles have.
const PARTS: [(f64, &str); 6] = [
    (2.0, "second"),
    (3.0, "third"),
    (4.0, "fourth"),
    (5.0, "fifth"),
    (6.0, "sixth"),
    (8.0, "eighth"),
];

/// A line in words; `rate` is that of the rows, Hz.
fn words(peak: &Peak, rows: usize, rate: f64, sigma: f64, unit: &'static str) -> String {
    // half of what the record resolves
    let same = |other: f64| (peak.frequency - other).abs() * (rows as f64) < 0.5;
    let part = part(peak.frequency, rows);
    let mains = MAINS.iter().find(|mains| same(**mains / rate));
    let like = match (part, mains) {
        (Some(word), _) => {
            format!("the same in every {word} row: a dither, a limit cycle, a duty that goes between two counts")
        }
        (_, Some(mains)) => format!("that of mains of {mains} Hz"),
        _ => {
            "a limit cycle, or a disturbance that may lie above half the rate of the rows and is folded down".to_owned()
        }
    };
    format!(
        "a line at {:.0} Hz of {} ({:.0} times the noise at that frequency in power), {like}",
        peak.frequency * rate,
        si(peak.amplitude * sigma, unit),
        peak.ratio
    )
}

/// Largest line that two sides of an edge draw, in leaps from one to the other: that of a square wave has 2 / pi of it.
const OF_LEAP: f64 = 0.64;

/// The lines of a course from the frequency `lowest` on, those below `above_ring` only if they go on throughout; a simulator that is off by
/// its accuracy leaves that share of a line that was there `before`.
#[must_use]
pub fn peaks(values: &[f64], before: &[f64], lowest: f64, above_ring: f64) -> Vec<Peak> {
    let known = values.iter().filter(|v| **v != 0.0).count();
    // the first row of a stretch never counts, and a step leaves out a row or two
    if values.len() < FEWEST || 2 * known < values.len() {
        return Vec::new();
    }
    let raw = periodogram(values, known);
    let bins = raw.len() - 1;
    // of the record's own resolution, of which the periodogram shows each several times
    let fine = 2.0 * bins as f64 / values.len() as f64;
    let steps = values.len() / 2;
    let wide = (steps * 3 / 5).clamp(NEIGHBOURS[0], NEIGHBOURS[1]);
    let colour = colour(&raw, (fine, wide));
    let power: Vec<f64> = raw.iter().zip(&colour).map(|(power, of)| power / of).collect();
    let was = periodogram(before, known);
    let lowest = (lowest * 2.0 * bins as f64).ceil() as usize;
    let mut list: Vec<Peak> = Vec::new();
    let mut places: Vec<usize> = (lowest..=bins).collect();
    places.sort_by(|a, b| power[*b].total_cmp(&power[*a]).then(a.cmp(b)));
    // the largest few alone can pass: the floor is below all of them
    for at in places.into_iter().take(64) {
        let frequency = at as f64 / (2.0 * bins as f64);
        let is_known = |peak: &Peak| (peak.frequency - frequency).abs() * (values.len() as f64) < 3.0;
        if list.len() == MOST || list.iter().any(is_known) {
            continue;
        }
        let (floor, near) = floor(&power, at, lowest / 2, fine, wide);
        let floor = floor + ACCURACY * ACCURACY * was[at] / colour[at];
        let ratio = power[at] / floor.max(f64::MIN_POSITIVE);
        // |X|^2 / n of a sine of amplitude A is n A^2 / 4, at half the rate n A^2
        let is_half = (0.5 - frequency) * (values.len() as f64) < 0.5;
        let quarter = if is_half { 1.0 } else { 0.25 };
        let amplitude = (raw[at] / (quarter * known as f64)).sqrt();
        let least = level(values.len(), near).min(match part(frequency, values.len()) {
            Some(_) if is_half => OF_HALF * level_of_parts(near),
            Some(_) => level_of_parts(near),
            None => f64::INFINITY,
        });
        let holds = frequency > above_ring || goes_on(values, frequency);
        if ratio > least && amplitude > LEAST && holds {
            list.push(Peak {
                frequency,
                amplitude,
                ratio,
            });
        }
    }
    list
}

/// The whole part of the rate that a frequency is, within half of what the record resolves.
fn part(frequency: f64, rows: usize) -> Option<&'static str> {
    let same = |part: f64| (frequency - part.recip()).abs() * (rows as f64) < 0.5;
    PARTS.iter().find(|(part, _)| same(*part)).map(|(_, word)| *word)
}

/// Whether each stretch of a course holds the sine of a frequency as the whole does.
fn goes_on(values: &[f64], frequency: f64) -> bool {
    let sums: Vec<(f64, f64)> = (0..STRETCHES)
        .map(|n| {
            let [from, to] = [n, n + 1].map(|n| n * values.len() / STRETCHES);
            (from..to).fold((0.0, 0.0), |(re, im), row| {
                let angle = TAU * frequency * row as f64;
                (re + values[row] * libm::cos(angle), im + values[row] * libm::sin(angle))
            })
        })
        .collect();
    let (re, im) = sums.iter().fold((0.0, 0.0), |(re, im), sum| (re + sum.0, im + sum.1));
    let square = re * re + im * im;
    let least = GOES_ON / STRETCHES as f64 * square;
    sums.iter().all(|sum| sum.0 * re + sum.1 * im > least)
}

/// The ratio that noise passes with [`CHANCE`] at one of the whole parts of the rate, each of which has two maxima.
fn level_of_parts(wide: usize) -> f64 {
    let shape = LN_2 * LN_2 * wide as f64;
    shape * (libm::pow(2.0 * PARTS.len() as f64 / CHANCE, 1.0 / shape) - 1.0)
}

/// The ratio that noise of `rows` rows passes with [`CHANCE`], over a floor of `wide` neighbours.
fn level(rows: usize, wide: usize) -> f64 {
    // the median of n exponential numbers scatters as the mean of n ln(2)^2 does
    let shape = LN_2 * LN_2 * wide as f64;
    let of = |maxima: f64| shape * (libm::pow(maxima / CHANCE, 1.0 / shape) - 1.0);
    // maxima between the record's own frequencies: sqrt(pi x / 3) of them to each
    let half = 0.5 * rows as f64;
    let first = of(half * 4.0);
    of(half * (PI * first / 3.0).sqrt())
}

/// Median of the neighbours, as a mean of exponential numbers, and how many of them the record tells apart.
fn floor(power: &[f64], at: usize, lowest: usize, fine: f64, wide: usize) -> (f64, usize) {
    let (half, guard) = ((0.5 * wide as f64 * fine) as usize, (GUARD as f64 * fine) as usize);
    let last = power.len() - 1;
    // at an end the window lies to one side, and is no narrower than the narrowest
    let least = ((NEIGHBOURS[0] + 2 * GUARD) as f64 * fine) as usize;
    let (mut from, mut to) = (at.saturating_sub(half).max(lowest.min(at)), (at + half).min(last));
    if to - from < least {
        (from, to) = (from.min(last.saturating_sub(least)), to.max((from + least).min(last)));
    }
    let near: Vec<f64> = (from..=to)
        .filter(|n| n.abs_diff(at) > guard)
        .map(|n| power[n])
        .collect();
    let count = (near.len() as f64 / fine) as usize;
    (crate::median::median(near) / LN_2, count)
}

/// Spectrum of the noise by an autoregression, from 0 to half the rate, with a mean of about 1.
fn colour(raw: &[f64], (fine, wide): (f64, usize)) -> Vec<f64> {
    let bins = raw.len() - 1;
    // a line is cut off, since a resonance would be fitted to it
    let step = (fine as usize).max(1);
    let cut: Vec<f64> = (0..=bins)
        .step_by(step)
        .map(|at| raw[at].min(CUT * floor(raw, at, 0, fine, wide.min(2 * NEIGHBOURS[0])).0))
        .collect();
    let mut order = POLES;
    let lagged: Vec<f64> = (0..=order)
        .map(|lag| {
            let each = cut.iter().enumerate();
            let sum: f64 = each
                .map(|(n, p)| p * libm::cos(PI * (lag * n * step) as f64 / bins as f64))
                .sum();
            sum / cut.len() as f64
        })
        .collect();
    // Levinson's recursion
    let mut poles: Vec<f64> = Vec::new();
    let mut left = lagged[0];
    while poles.len() < order {
        let k = poles.len();
        let sum: f64 = (0..k).map(|n| poles[n] * lagged[k - n]).sum();
        let next = if left > 0.0 { (lagged[k + 1] - sum) / left } else { 1.0 };
        if next.abs() > 0.99 {
            order = k;
            break;
        }
        let mirrored: Vec<f64> = (0..k).map(|n| poles[n] - next * poles[k - 1 - n]).collect();
        poles = mirrored;
        poles.push(next);
        left *= 1.0 - next * next;
    }
    poles.truncate(order);
    (0..=bins)
        .map(|at| {
            let angle = PI * at as f64 / bins as f64;
            let (re, im) = poles.iter().enumerate().fold((1.0, 0.0), |(re, im), (n, pole)| {
                let turn = angle * (n + 1) as f64;
                (re - pole * libm::cos(turn), im + pole * libm::sin(turn))
            });
            1.0 / (re * re + im * im).max(1e-6)
        })
        .collect()
}

/// Sum of squares of a course between two frequencies, over the rate.
pub(crate) fn band(values: &[f64], low: f64, high: f64) -> f64 {
    let known = values.iter().filter(|v| **v != 0.0).count();
    if known == 0 {
        return 0.0;
    }
    let power = periodogram(values, known);
    let bins = power.len() - 1;
    let [from, to] = [low, high].map(|share| ((2.0 * share * bins as f64) as usize).min(bins));
    // a mean over all frequencies is the mean square
    power[from..=to].iter().sum::<f64>() / (bins + 1) as f64 * known as f64
}

/// Squares of the Fourier transform over the number of values, from 0 to half the rate, at least twice as fine as the record resolves.
fn periodogram(values: &[f64], known: usize) -> Vec<f64> {
    let length = (2 * values.len()).next_power_of_two();
    let mean = values.iter().sum::<f64>() / known as f64;
    let mut re: Vec<f64> = values.iter().map(|v| if *v == 0.0 { 0.0 } else { v - mean }).collect();
    re.resize(length, 0.0);
    let mut im = vec![0.0; length];
    transform(&mut re, &mut im);
    (0..=length / 2)
        .map(|n| (re[n] * re[n] + im[n] * im[n]) / known as f64)
        .collect()
}

/// Fourier transform of a power of two, in place (Cooley and Tukey).
pub(crate) fn transform(re: &mut [f64], im: &mut [f64]) {
    let n = re.len();
    let bits = n.trailing_zeros();
    for at in 0..n {
        let other = at.reverse_bits() >> (usize::BITS - bits);
        if at < other {
            re.swap(at, other);
            im.swap(at, other);
        }
    }
    let turns: Vec<(f64, f64)> = (0..n / 2)
        .map(|k| {
            let angle = -TAU * k as f64 / n as f64;
            (libm::cos(angle), libm::sin(angle))
        })
        .collect();
    let mut half = 1;
    while half < n {
        for start in (0..n).step_by(2 * half) {
            for k in 0..half {
                let (c, s) = turns[k * (n / (2 * half))];
                let (a, b) = (start + k, start + k + half);
                let (x, y) = (re[b] * c - im[b] * s, re[b] * s + im[b] * c);
                (re[b], im[b]) = (re[a] - x, im[a] - y);
                (re[a], im[a]) = (re[a] + x, im[a] + y);
            }
        }
        half *= 2;
    }
}

#[cfg(test)]
mod tests;
