//! Noise of few values: what their own scatter does not tell is bounded by what meters are known to do.

use super::{channel, scatter};
use crate::drive::sensors;
use crate::flicker;
use crate::median::median;
use crate::problem::Problem;
use crate::record::Record;

/// Most noise of settled points, as a share of the signal: poor meters have 0.5 %. The noise of a table is read off its rows, and
/// without a bound rows in disorder would show themselves as noise.
const POOR_METER: f64 = 5e-3;
/// Least noise where next to nothing tells it: that of a good meter.
const GOOD_METER: f64 = 2e-3;
/// A range is at most so many times what is usually read: one wild point is no range.
const WIDEST_RANGE: f64 = 3.0;
/// The channels of currents.
const CURRENTS: std::ops::RangeInclusive<usize> = 1..=2;
/// Fewer values than this show their noise so badly that a cause would be named by chance.
const FEW: f64 = 50.0;
/// Standard error of the noise of n values, as a share, times sqrt n (second differences).
const UNSURE: f64 = 1.6;

/// What the plant file states of a channel: noise, and the step of its converter; 0 if it states none.
fn stated(problem: &Problem, n: usize) -> (f64, f64) {
    let mut plant = problem.base.plant.clone();
    let sensor = &sensors(&mut plant)[n];
    (sensor.noise, sensor.lsb)
}

/// The step of a meter that shows one value: as the plant file states it, or the last digit written.
pub(super) fn digit(problem: &Problem, record: &Record, n: usize) -> f64 {
    stated(problem, n).1.max(record.resolution[n])
}

/// The most noise of a channel, of size `scale`.
pub(super) fn most(problem: &Problem, n: usize, scale: f64) -> f64 {
    let mut records = problem
        .records
        .iter()
        .filter(|r| r.measured[n].iter().any(|v| v.is_finite()));
    match records.all(|record| record.settled && !record.repeated) {
        // who states a larger noise has a poorer meter
        true => of_meter(problem, n, scale).max(stated(problem, n).0),
        false => f64::INFINITY,
    }
}

/// What a poor meter is off by. A shunt or a clamp is rated for the largest current, and is off by a share of that range as well as of
/// what it reads: a share of the reading alone finds faults at light load.
fn of_meter(problem: &Problem, n: usize, scale: f64) -> f64 {
    if !CURRENTS.contains(&n) {
        return POOR_METER * scale;
    }
    let shown = || {
        let all = problem.records.iter().flat_map(|record| &record.measured[n]);
        all.copied().filter(|v| v.is_finite()).map(f64::abs)
    };
    let reading = median(shown());
    let range = shown().fold(0.0, f64::max).min(WIDEST_RANGE * reading);
    POOR_METER * scale.max(reading + range)
}

/// Share of what few settled points leave beside any losses that their noise has at least, whatever their differences from row to row say: the
/// smaller ones of a score may be a third of the rest by chance.
const OF_REST: f64 = 0.5;

/// Least noise of `count` settled points that leave `beside` beside any losses.
pub(super) fn of_order(beside: f64, count: usize) -> f64 {
    if (count as f64) < FEW { OF_REST * beside } else { 0.0 }
}

/// How much more the noise of few values may be than it shows.
pub(super) fn unsure(problem: &Problem, n: usize) -> f64 {
    let records = problem.records.iter().filter(|record| !record.repeated);
    let count = records
        .flat_map(|record| &record.measured[n])
        .filter(|v| v.is_finite())
        .count();
    if count > 0 { of_count(count as f64) } else { 1.0 }
}

fn of_count(count: f64) -> f64 {
    if count < FEW { 1.0 + UNSURE / count.sqrt() } else { 1.0 }
}

/// Root of the count of second differences over the 5 % point of chi-square with as many degrees of freedom: noise is smaller than so many times what one,
/// two ... of them show in nineteen tables of twenty. One alone is next to nothing by chance.
const DIFFERENCES: [f64; 4] = [15.95, 4.41, 2.92, 2.37];

fn of_differences(count: usize) -> f64 {
    let known = DIFFERENCES.get(count.saturating_sub(1)).copied();
    known.unwrap_or_else(|| of_count(count as f64 + 2.0))
}

/// Noise of a channel of which a handful of points are known: no less than that of a good meter, and as much more as they scatter, up to
/// what a poor one has.
pub(super) fn of_fewest(problem: &Problem, residual: &[f64], n: usize, scale: f64) -> f64 {
    let least = (GOOD_METER * scale).max(stated(problem, n).0);
    let shown = |index: usize| {
        let values = channel(problem, residual, index, n).into_iter();
        let values: Vec<f64> = values.filter(|v| *v != 0.0).collect();
        scatter_of(&values) * problem.sigma[n] * of_differences(values.len().saturating_sub(2))
    };
    let most = of_meter(problem, n, scale).max(least);
    let seen = (0..problem.records.len()).map(shown).filter(|seen| seen.is_finite());
    seen.fold(least, f64::max).min(most)
}

/// Standard deviation of noise by the second differences of the fewest values; not a number if there are not three.
fn scatter_of(values: &[f64]) -> f64 {
    let usual = scatter(values, |_| true);
    if usual.is_finite() || values.len() < 3 {
        return usual;
    }
    let second = values.windows(3).map(|w| (w[0] - 2.0 * w[1] + w[2]).powi(2));
    // a second difference has six times the variance
    (second.sum::<f64>() / (values.len() - 2) as f64 / 6.0).sqrt()
}

/// A meter that flickers between digits is off by the same in all rows: the standard deviation that leaves their mean no more than two of
/// its own to see that by. 0 for any other channel.
pub(super) fn rounded(problem: &Problem, n: usize) -> f64 {
    let in_time = problem.records.iter().filter(|record| !record.settled);
    let biased = in_time.map(|record| {
        let count = record.measured[n].iter().filter(|v| v.is_finite()).count() as f64;
        0.5 * count.sqrt() * flicker::bias(&record.measured[n])
    });
    biased.fold(0.0, f64::max)
}

/// A meter of settled points that shows a few values again and again lies on steps as far apart as these: no less than rounding to them
/// is its noise. 0 for any other channel.
pub(super) fn steps(problem: &Problem, n: usize) -> f64 {
    let of = |record: &Record| {
        let shown = record.measured[n].iter().copied().filter(|v| v.is_finite());
        let mut shown: Vec<f64> = shown.collect();
        let rows = shown.len();
        shown.sort_by(f64::total_cmp);
        shown.dedup();
        let gaps = shown.windows(2).map(|pair| pair[1] - pair[0]);
        match 2 * shown.len() <= rows {
            true => gaps.fold(f64::INFINITY, f64::min),
            false => f64::INFINITY,
        }
    };
    let settled = problem
        .records
        .iter()
        .filter(|record| record.settled && !record.repeated);
    let step = settled.map(of).filter(|step| step.is_finite()).fold(0.0, f64::max);
    // step / sqrt 12: the standard deviation of rounding
    step / 12f64.sqrt()
}
