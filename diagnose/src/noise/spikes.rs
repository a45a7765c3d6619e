//! Single wild rows: a wrong bit, a lost byte, a cable that was touched.

use super::channel;
use crate::median::median;
use crate::problem::Problem;
use crate::record::{CHANNEL_NAMES, CHANNELS};

/// An outlier differs from its neighbours by more than this many standard deviations beyond their own spread. Normal noise does
/// so in one row of 1e15, at half of it in one of 1e6; at double, a wrong bit of 16 steps of the noise would pass.
const FAR: f64 = 8.0;
/// An outlier.
#[derive(Debug, Clone, PartialEq)]
pub struct Outlier {
    /// Which record.
    pub record: usize,
    /// Which row.
    pub row: usize,
    /// Which channel.
    pub channel: usize,
}

/// Rows that leap out of the measured signal and of the residual alike.
#[must_use]
pub fn outliers(problem: &Problem, residual: &[f64]) -> Vec<Outlier> {
    let mut found = Vec::new();
    for (index, record) in problem.records.iter().enumerate().filter(|(_, r)| !r.settled) {
        for n in 0..CHANNELS {
            let left = channel(problem, residual, index, n);
            let raw: Vec<f64> = record.measured[n].iter().map(|v| v / problem.sigma[n]).collect();
            let rows = wild_rows(&left, &raw).into_iter();
            found.extend(rows.map(|row| Outlier {
                record: index,
                row,
                channel: n,
            }));
        }
    }
    found
}

/// Rows that leap out of what a model leaves, and out of what was `raw`ly measured: what leaps in the signal alone the model explains, what leaps
/// in the residual alone it brings. Where the signal swings as far as it leaps, the model itself is asked whether it brings the leap.
fn wild_rows(left: &[f64], raw: &[f64]) -> Vec<usize> {
    let shown: Vec<f64> = raw.iter().zip(left).map(|(raw, left)| raw - left).collect();
    let (wild_left, wild_raw) = (wild(left), wild(raw));
    let is_wild = |row: &usize| {
        let row = *row;
        let is_brought = || brings(&shown, left, &wild_left, row);
        // spikes among the first rows bend the initial state to them, and the model rings where the signal rests
        let leaps_at_rest = || leaps_over(raw, &wild_raw, row) && !brings(&shown, raw, &wild_raw, row);
        leaps(left, row) && (leaps(raw, row) || leaps_off_curve(raw, row))
            || leaps_over(left, &wild_left, row) && (leaps_over(raw, &wild_raw, row) || !is_brought())
            || leaps_beside_bend(left, &shown, row)
            || leaps_in_a_pair(left, row) && (leaps_in_a_pair(raw, row) || !is_brought())
            || leaps_at_rest()
    };
    (2..left.len().saturating_sub(2)).filter(is_wild).collect()
}

/// Whether a row lies apart from its neighbours, beyond their own spread.
fn leaps(values: &[f64], row: usize) -> bool {
    let near = [values[row - 2], values[row - 1], values[row + 1], values[row + 2]];
    let (low, high) = near
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
    let apart = (values[row] - high).max(low - values[row]);
    near.iter().all(|v| v.is_finite()) && apart > FAR + (high - low)
}

/// Of two wild rows beside each other each hides the other, and has to leap this many times as far as one alone: an event of the converter may
/// last two rows.
const OF_A_PAIR: f64 = 4.0;

/// Whether a row and one beside it both lie apart from the two rows before and the two behind them.
fn leaps_in_a_pair(values: &[f64], row: usize) -> bool {
    let at = |by: isize| row.checked_add_signed(by).and_then(|row| values.get(row).copied());
    let pair = |other: isize| {
        let (before, after) = (other.min(0), other.max(0));
        let near: Option<Vec<f64>> = [before - 2, before - 1, after + 1, after + 2]
            .into_iter()
            .map(at)
            .collect();
        let near = near.filter(|near| near.iter().all(|v| v.is_finite()));
        near.zip(at(other)).is_some_and(|(near, other)| {
            let ends = (f64::INFINITY, f64::NEG_INFINITY);
            let (low, high) = near.iter().fold(ends, |(low, high), v| (low.min(*v), high.max(*v)));
            let is_apart = |v: f64| (v - high).max(low - v) > OF_A_PAIR * (FAR + high - low);
            is_apart(values[row]) && is_apart(other)
        })
    };
    pair(-1) || pair(1)
}

/// Rows to either side whose median a wild row is far from: three wild rows of seven do not move it.
const BESIDE: usize = 3;

/// Rows that lie as far from what is around them as one of a pair has to.
fn wild(values: &[f64]) -> Vec<bool> {
    let around = |row: usize| {
        let near = row.saturating_sub(BESIDE)..(row + BESIDE + 1).min(values.len());
        median(values[near].iter().copied().filter(|v| v.is_finite()))
    };
    let is_far = |row: usize| (values[row] - around(row)).abs() > OF_A_PAIR * FAR;
    (0..values.len()).map(is_far).collect()
}

/// Whether a single wild row lies apart from the nearest two rows before and behind it that are not wild: other wild rows near it hide it. One
/// with a wild row beside it is of an event or a pair.
fn leaps_over(values: &[f64], wild: &[bool], row: usize) -> bool {
    let nearest = |rows: &mut dyn Iterator<Item = usize>| -> Vec<f64> {
        rows.take(BESIDE + 1)
            .filter(|other| !wild[*other])
            .take(2)
            .map(|other| values[other])
            .collect()
    };
    let near = [nearest(&mut (0..row).rev()), nearest(&mut (row + 1..values.len()))].concat();
    let is_single = [row.checked_sub(1), Some(row + 1)]
        .iter()
        .flatten()
        .all(|other| !wild.get(*other).copied().unwrap_or(false));
    let ends = (f64::INFINITY, f64::NEG_INFINITY);
    let (low, high) = near.iter().fold(ends, |(low, high), v| (low.min(*v), high.max(*v)));
    let apart = (values[row] - high).max(low - values[row]);
    wild[row]
        && is_single
        && near.len() == 4
        && near.iter().all(|v| v.is_finite())
        && apart > OF_A_PAIR * FAR + (high - low)
}

/// A row lies off the curve through its neighbours this many times as far as rows near it do: a signal that swings bends everywhere.
const OFF_CURVE: f64 = 4.0;

/// Distance to the cubic curve through two neighbours on each side; nothing at an end or beside a hole.
fn off_curve(values: &[f64], row: usize) -> Option<f64> {
    let at = |by: isize| row.checked_add_signed(by).and_then(|row| values.get(row).copied());
    let curve = (4.0 * (at(-1)? + at(1)?) - at(-2)? - at(2)?) / 6.0;
    Some((values[row] - curve).abs()).filter(|off| off.is_finite())
}

/// Whether a row leaps out of a signal that swings, which hides a leap in the spread of its neighbours.
fn leaps_off_curve(values: &[f64], row: usize) -> bool {
    // the curves three and four rows further on do not go through this one
    let near = [-4_isize, -3, 3, 4].map(|by| row.checked_add_signed(by).and_then(|row| off_curve(values, row)));
    let known: Vec<f64> = near.into_iter().flatten().collect();
    let usual = known.iter().copied().fold(0.0, f64::max);
    // at a step one of the neighbours lies where the row lies
    let [before, after] = [row - 1, row + 1].map(|other| values[row] - values[other]);
    let is_single =
        |off: f64| before * after > 0.0 && before.abs().min(after.abs()) > 0.5 * off && is_off_most(values, row, off);
    known.len() >= 3
        && off_curve(values, row).is_some_and(|off| off > 2.0 * FAR && off > OFF_CURVE * usual && is_single(off))
}

/// Whether a row lies `off` its curve by more than its neighbours do theirs: those go through a leap, and lie off by two thirds of it.
fn is_off_most(values: &[f64], row: usize, off: f64) -> bool {
    let beside = [row - 1, row + 1].map(|other| off_curve(values, other).unwrap_or(0.0));
    beside.iter().all(|other| *other < off)
}

/// The model bends by less than this share of a leap that it does not bring. One that steps a row late bends by half of what it leaves.
const BENDS: f64 = 0.25;

/// Whether a row leaps where the duty or the load steps: there the signal bends as sharply as it leaps, and the model alone tells the two apart. What
/// it shows is the signal without the residual.
fn leaps_beside_bend(left: &[f64], shown: &[f64], row: usize) -> bool {
    let raw = |row: usize| shown[row] + left[row];
    let [before, after] = [row - 1, row + 1].map(|other| raw(row) - raw(other));
    let is_single = |off: f64| {
        before * after > 0.0
            && before.abs().min(after.abs()) > 0.5 * off
            && is_off_most(left, row, off)
            && off_curve(shown, row).is_some_and(|bend| bend < BENDS * off)
    };
    leaps(left, row) && off_curve(left, row).is_some_and(|off| off > 2.0 * FAR && is_single(off))
}

/// Whether the model may bring what leaps in the residual, or in the signal: it bends there, or near it, by more than a share of the leap.
fn brings(shown: &[f64], values: &[f64], wild: &[bool], row: usize) -> bool {
    let near = row.saturating_sub(BESIDE)..(row + BESIDE + 1).min(values.len());
    let calm = near.clone().filter(|other| !wild[*other]).map(|other| values[other]);
    let leap = (values[row] - median(calm.filter(|v| v.is_finite()))).abs();
    let bends = |other: usize| off_curve(shown, other).is_some_and(|bend| bend > BENDS * leap);
    !leap.is_finite() || near.into_iter().any(bends)
}

/// Outliers that one sentence lists; a reader looks at no more.
const LISTED: usize = 3;

/// What is said of outliers.
#[must_use]
pub fn spikes(problem: &Problem, outliers: &[Outlier]) -> Option<String> {
    let place = |one: &Outlier| {
        let record = &problem.records[one.record];
        format!(
            "{} of {} at t = {:.6} s",
            CHANNEL_NAMES[one.channel], record.name, record.time[one.row]
        )
    };
    let listed: Vec<String> = outliers.iter().take(LISTED).map(place).collect();
    let more = match outliers.len().saturating_sub(LISTED) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    (!outliers.is_empty()).then(|| format!("spikes of single rows are left out: {}{more}", listed.join(", ")))
}

#[cfg(test)]
mod tests {
    use super::super::tests::normal;
    use super::{leaps_beside_bend, leaps_in_a_pair, leaps_off_curve, leaps_over, wild, wild_rows};

    #[test]
    fn a_spike_on_a_swing_is_seen_and_a_step_or_a_swing_is_none() {
        let mut state = 7;
        let swing: Vec<f64> = (0..200)
            .map(|n| 100.0 * (f64::from(n) * 0.3).sin() + normal(&mut state))
            .collect();
        let mut spiked = swing.clone();
        spiked[93] += 60.0;
        let step: Vec<f64> = (0..200)
            .map(|n| if n < 77 { 0.0 } else { 80.0 } + normal(&mut state))
            .collect();
        let seen = |values: &[f64]| {
            (2..198)
                .filter(|row| leaps_off_curve(values, *row))
                .collect::<Vec<usize>>()
        };
        assert_eq!(seen(&spiked), [93]);
        assert!(seen(&swing).is_empty() && seen(&step).is_empty());
    }

    #[test]
    fn a_spike_where_the_signal_bends_is_seen_and_a_model_that_steps_a_row_late_brings_none() {
        let mut state = 5;
        // a current that turns at row 60, as where a duty steps
        let shown: Vec<f64> = (0..120).map(|n: i32| -30.0 * f64::from((n - 60).abs())).collect();
        let mut left: Vec<f64> = (0..120).map(|_| normal(&mut state)).collect();
        left[61] += 110.0;
        let seen = |left: &[f64], shown: &[f64]| {
            (2..118)
                .filter(|row| leaps_beside_bend(left, shown, *row))
                .collect::<Vec<usize>>()
        };
        assert_eq!(seen(&left, &shown), [61]);
        // measured at 60, shown at 61
        let step = |n: i32| if n < 61 { 0.0 } else { 200.0 };
        let late: Vec<f64> = (0..120).map(step).collect();
        let own: Vec<f64> = (0..120).map(|n| step(n + 1) - step(n) + normal(&mut state)).collect();
        assert!(seen(&own, &late).is_empty());
        // a model that kicks where the converter does not
        let mut kicked = shown.clone();
        kicked[61] += 110.0;
        let own: Vec<f64> = shown
            .iter()
            .zip(&kicked)
            .map(|(a, b)| a - b + normal(&mut state))
            .collect();
        assert!(seen(&own, &kicked).is_empty());
    }

    #[test]
    fn spikes_two_and_three_rows_apart_are_seen_and_what_lasts_longer_is_none() {
        let mut state = 11;
        let quiet: Vec<f64> = (0..200)
            .map(|n| 20.0 * (f64::from(n) * 0.2).sin() + normal(&mut state))
            .collect();
        let mut spiked = quiet.clone();
        for (row, by) in [(60, 150.0), (62, -140.0), (65, -150.0), (120, 145.0), (123, 150.0)] {
            spiked[row] += by;
        }
        let mut moved = quiet.clone();
        for (n, value) in moved.iter_mut().enumerate().skip(50) {
            *value += if n < 130 { 300.0 } else { 0.0 };
            // three rows of something, and a kick that dies
            *value += if (90..93).contains(&n) { 200.0 } else { 0.0 };
            *value += if n > 160 {
                200.0 * (-(n as f64 - 161.0) / 4.0).exp()
            } else {
                0.0
            };
        }
        let seen = |values: &[f64]| {
            let wild = wild(values);
            (2..198)
                .filter(|row| leaps_over(values, &wild, *row))
                .collect::<Vec<usize>>()
        };
        assert_eq!(seen(&spiked), [60, 62, 65, 120, 123]);
        assert_eq!(seen(&quiet), [] as [usize; 0]);
        assert_eq!(seen(&moved), [] as [usize; 0]);
    }

    #[test]
    fn spikes_near_each_other_on_a_swing_as_large_as_they_are_seen_and_what_the_model_brings_is_none() {
        let mut state = 13;
        // 4 A of ringing, spikes of 11 A, noise of 40 mA
        let shown: Vec<f64> = (0..200)
            .map(|n| 100.0 * (f64::from(n) * 0.5).sin() * (f64::from(n) * -0.01).exp())
            .collect();
        let mut left: Vec<f64> = (0..200).map(|_| normal(&mut state)).collect();
        for (row, by) in [(40, -280.0), (42, -280.0), (80, 280.0), (81, -280.0)] {
            left[row] += by;
        }
        let raw = |left: &[f64], shown: &[f64]| -> Vec<f64> { left.iter().zip(shown).map(|(a, b)| a + b).collect() };
        assert_eq!(wild_rows(&left, &raw(&left, &shown)), [40, 42, 80, 81]);
        // a model that kicks for two rows where the converter does not
        let mut kicked = shown.clone();
        (kicked[120], kicked[121]) = (kicked[120] + 280.0, kicked[121] - 280.0);
        let own: Vec<f64> = (shown.iter().zip(&kicked))
            .map(|(a, b)| a - b + normal(&mut state))
            .collect();
        assert_eq!(wild_rows(&own, &raw(&own, &kicked)), [] as [usize; 0]);
    }

    #[test]
    fn spikes_of_a_signal_at_rest_are_seen_though_the_model_rings_for_them() {
        let mut state = 17;
        // what a fit makes of two spikes among the first rows
        let shown: Vec<f64> = (0..100)
            .map(|n| 240.0 * (f64::from(n) * 0.35).sin() * (f64::from(n) * -0.08).exp())
            .collect();
        let mut raw: Vec<f64> = (0..100).map(|_| normal(&mut state)).collect();
        (raw[5], raw[7]) = (raw[5] - 700.0, raw[7] - 700.0);
        let left: Vec<f64> = raw.iter().zip(&shown).map(|(a, b)| a - b).collect();
        assert_eq!(wild_rows(&left, &raw), [5, 7]);
        // a kick that the model has as well, a row late
        let mut kicked = shown.clone();
        (kicked[6], kicked[8]) = (kicked[6] - 700.0, kicked[8] - 700.0);
        let left: Vec<f64> = raw.iter().zip(&kicked).map(|(a, b)| a - b).collect();
        assert_eq!(wild_rows(&left, &raw), [] as [usize; 0]);
    }

    #[test]
    fn two_spikes_beside_each_other_are_seen_and_a_swing_a_step_or_a_kick_are_none() {
        let mut state = 9;
        let quiet: Vec<f64> = (0..200)
            .map(|n| 20.0 * (f64::from(n) * 0.2).sin() + normal(&mut state))
            .collect();
        let mut spiked = quiet.clone();
        (spiked[70], spiked[71]) = (spiked[70] + 150.0, spiked[71] - 120.0);
        (spiked[140], spiked[141]) = (spiked[140] - 190.0, spiked[141] - 210.0);
        let mut moved = quiet.clone();
        for (n, value) in moved.iter_mut().enumerate().skip(50) {
            // a step, and a kick that dies in some rows
            *value += 300.0
                + if n > 120 {
                    200.0 * (-(n as f64 - 121.0) / 4.0).exp()
                } else {
                    0.0
                };
        }
        let seen = |values: &[f64]| {
            (2..198)
                .filter(|row| leaps_in_a_pair(values, *row))
                .collect::<Vec<usize>>()
        };
        assert_eq!(seen(&spiked), [70, 71, 140, 141]);
        assert!(seen(&quiet).is_empty() && seen(&moved).is_empty());
    }
}
