//! Signals that reach the end of their instrument's range.

use super::channels::FEWEST;
use crate::flicker::digit;
use crate::noise::scatter;

/// Rows at one extreme value: chance puts two or three of a noisy signal there.
const ROWS: usize = 6;
/// Of which so many follow each other.
const RUN: usize = 4;
/// A signal that moves by less than this many times its noise has no range to leave.
const MOVES: f64 = 8.0;

/// The extreme value at which a signal is cut off, and how many rows are there. `step` is that of its numbers: where it is as coarse as the
/// noise, equal values are the rule.
pub fn at(values: &[f64], step: f64) -> Option<(f64, usize)> {
    let known: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    let noise = scatter(&known, |_| true);
    let (low, high) = known
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
    if known.len() < FEWEST || noise.is_nan() || noise < 2.0 * step || high - low < MOVES * noise {
        return None;
    }
    // one that goes between a few digits has its middle at an end
    if digit(&known) > 0.0 {
        return None;
    }
    [high, low].into_iter().find_map(|end| {
        let is_end: Vec<bool> = known.iter().map(|v| *v == end).collect();
        let count = is_end.iter().filter(|end| **end).count();
        let run = is_end.split(|end| !end).map(<[bool]>::len).max().unwrap_or(0);
        (count >= ROWS && run >= RUN).then_some((end, count))
    })
}
