//! What a feature looks back at, and how far from rest its filters may stand still.
//!
//! A filter in binary32 does not settle at its input: it stops where its next step is smaller than half a unit in the last place.

use policy::{Feature, Filter};

use crate::domain::Memory;

/// Smallest number of binary32.
const LEAST_32: f64 = 1.401_298_464_324_817e-45;
/// Roundings of the few operations of one step of a filter, its coefficient's included.
const STEP: f64 = 4.0;

/// What a feature looks at.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Past {
    /// Samples that it looks back.
    pub delay: usize,
    /// It is 0 at rest.
    pub is_difference: bool,
    /// How far from its input it may rest, in roundings of the input's magnitude.
    pub roundings: f64,
    /// The same, absolute.
    pub remains: f64,
}

impl Past {
    /// `None` if the feature depends on a history.
    pub fn of(feature: &Feature, period: f64, memory: Memory) -> Option<Self> {
        let mut past = Self::default();
        for filter in &feature.filters {
            match (filter, memory) {
                (Filter::Delay { samples }, Memory::Free) => past.delay += samples,
                // settled: all samples are equal, so a delay changes nothing and a difference is 0
                (Filter::Delay { .. }, Memory::Settled) => {}
                (Filter::BackwardDifference, Memory::Settled) => past.is_difference = true,
                // p y1 is y1 where (1 - p) y1 is less than half of the least number: above it the product is always smaller
                (Filter::FilteredDerivative { time_constant }, Memory::Settled) => {
                    past.is_difference = true;
                    past.remains += LEAST_32 * (time_constant / period + 1.0);
                }
                // y + k (x - y) is y where k |x - y| is less than half a unit of y, at most one rounding of it
                (Filter::LowPass { time_constant }, Memory::Settled) => {
                    past.roundings += time_constant / period + 1.0 + STEP;
                }
                // the i-th of n sums rounds i times the input, and 1/n of all is the mean
                (Filter::MovingAverage { samples }, Memory::Settled) => {
                    past.roundings += 0.5 * (*samples as f64 + 1.0) + STEP;
                }
                _ => return None,
            }
        }
        Some(past)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use policy::{Expr, Input, Interval};

    use super::*;

    const PERIOD: f64 = 1e-4;

    fn roundings(filter: Filter) -> f64 {
        let feature = Feature {
            name: "x".to_owned(),
            source: Expr::Input(Input::Signal(0)),
            source_text: "x".to_owned(),
            filters: vec![filter],
            scale: 1.0,
            offset: 0.0,
            clip: None,
            bound: Interval { low: 0.0, high: 1.0 },
        };
        Past::of(&feature, PERIOD, Memory::Settled).unwrap().roundings
    }

    /// Roundings of 2^-24 of the input between it and where the filter of the contract's section 4 rests.
    fn rest(k: f32, start: f32, x: f32) -> f64 {
        let mut y = start;
        loop {
            let next = y + k * (x - y);
            if next == y {
                return f64::from((x - y).abs()) / f64::from(x) * 16_777_216.0;
            }
            y = next;
        }
    }

    #[test]
    fn a_slow_low_pass_rests_within_what_is_said_and_far_from_a_few_roundings() {
        for periods in [0.5, 10.0, 100.0, 1000.0, 10_000.0] {
            let said = roundings(Filter::LowPass {
                time_constant: periods * PERIOD,
            });
            let k = (1.0 / (periods + 1.0)) as f32;
            let seen = [1.0_f32, 1.0001, 1.37, 1.999_999]
                .into_iter()
                .flat_map(|x| [rest(k, 0.0, x), rest(k, 3.0, x)])
                .fold(0.0, f64::max);
            assert!(seen <= said, "{periods}: {seen} of {said}");
            assert!(
                periods < 1000.0 || seen > 500.0,
                "{periods}: {seen}, which 64 would not hold"
            );
        }
    }

    #[test]
    fn a_long_moving_average_rests_within_what_is_said() {
        for samples in [2_usize, 7, 256] {
            let said = roundings(Filter::MovingAverage { samples });
            for step in 0..1000 {
                let x = 1.0 + step as f32 * 9.99e-4;
                let sum = (1..samples).fold(x, |sum, _| sum + x);
                let mean = sum * (1.0 / samples as f64) as f32;
                let seen = f64::from((mean - x).abs()) / f64::from(x) * 16_777_216.0;
                assert!(seen <= said, "{samples} of {x}: {seen} of {said}");
            }
        }
    }
}
