//! What is drawn from random bits.

/// A source of random bits, and what is drawn from them.
pub trait Random {
    /// The next 64 bits.
    fn bits(&mut self) -> u64;

    /// Uniform over `[0, 1)`, a multiple of 2^-53.
    #[inline]
    fn unit(&mut self) -> f64 {
        // 53 bits are what a binary64 holds: conversion and product are exact, so every machine draws the same number
        (self.bits() >> 11) as f64 * (1.0 / (1_u64 << 53) as f64)
    }

    /// Uniform over `[low, high)`; `low` if they are equal.
    #[inline]
    fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Uniform over `0..count` by Lemire's multiplication; 0 if `count` is 0. The bias is below count / 2^64.
    #[inline]
    fn below(&mut self, count: usize) -> usize {
        // not `%`, whose bias is as small but which divides; u128 holds every product
        ((u128::from(self.bits()) * count as u128) >> 64) as usize
    }

    /// True once in `n` on average.
    fn one_in(&mut self, n: usize) -> bool {
        self.below(n) == 0
    }

    /// Any element; `default` of an empty slice.
    fn pick<T: Copy>(&mut self, items: &[T], default: T) -> T {
        items.get(self.below(items.len())).copied().unwrap_or(default)
    }

    /// About normal, mean 0 and variance 1, at three draws of bits.
    ///
    /// The number of ones among 128 random bits, smoothed by a triangle of width 2: integers alone, so that every machine
    /// draws the same. Skewness 0, excess kurtosis -0.016, range +-11 sigma.
    #[inline]
    fn normal(&mut self) -> f64 {
        const PER_SIGMA: f64 = 0.176_318_129_815_27; // 1 / sqrt(128 / 4 + 1 / 6)
        // 128 coins have the variance 128 / 4, and the triangle between the whole numbers adds 1 / 6
        let ones = self.bits().count_ones() + self.bits().count_ones();
        let fraction = self.bits();
        // both callers leave 32 bits: the conversion cannot fail
        let half = |bits: u64| f64::from(u32::try_from(bits).unwrap_or(0)) * (1.0 / 4_294_967_296.0);
        let triangle = half(fraction >> 32) + half(fraction & 0xffff_ffff) - 1.0;
        (f64::from(ones) - 64.0 + triangle) * PER_SIGMA
    }

    /// About normal, mean 0 and variance 1, but never beyond 6: the sum of twelve uniform numbers.
    ///
    /// Its tails are thinner than those of [`Random::normal`] (excess kurtosis -0.1) and it costs twelve draws. Traces of a
    /// verification take it, whose streams stay as they are.
    fn sum_of_twelve(&mut self) -> f64 {
        // twelve, because one has the variance 1 / 12; their mean is 6
        (0..12).map(|_| self.unit()).sum::<f64>() - 6.0
    }
}

#[cfg(test)]
mod tests {
    use crate::{Random, SplitMix, Xoshiro};

    #[test]
    fn indices_and_units_fill_their_ranges_evenly() {
        let mut random = Xoshiro::stream(1, 2);
        let mut counts = [0_usize; 12];
        let mut sum = 0.0;
        for _ in 0..120_000 {
            counts[random.below(12)] += 1;
            let u = random.unit();
            assert!((0.0..1.0).contains(&u));
            sum += u;
        }
        // standard deviation of a count: 96
        assert!(counts.iter().all(|&n| (9_600..10_400).contains(&n)), "{counts:?}");
        assert!((sum / 120_000.0 - 0.5).abs() < 0.005);
        assert_eq!(random.below(0), 0);
        assert_eq!(random.uniform(3.0, 3.0), 3.0);
    }

    #[test]
    fn ranges_are_kept() {
        let mut random = SplitMix::new(1);
        for _ in 0..10_000 {
            assert!((-2.0..3.0).contains(&random.uniform(-2.0, 3.0)));
            assert!(random.below(7) < 7);
        }
        assert_eq!(random.below(0), 0);
        assert_eq!(random.pick(&[], 9), 9);
    }

    /// First four moments over `n` draws.
    fn moments(n: u32, mut draw: impl FnMut() -> f64) -> [f64; 4] {
        let mut moments = [0.0; 4];
        for _ in 0..n {
            let x = draw();
            for (k, moment) in moments.iter_mut().enumerate() {
                *moment += x.powi(k as i32 + 1) / f64::from(n);
            }
        }
        moments
    }

    #[test]
    fn normal_numbers_have_the_moments_they_state() {
        let (mut xoshiro, mut split_mix) = (Xoshiro::new(1), SplitMix::new(1));
        for (moments, fourth) in [
            (moments(400_000, || xoshiro.normal()), 2.984),
            (moments(400_000, || split_mix.sum_of_twelve()), 2.9),
        ] {
            let expected = [(0.0, 0.006), (1.0, 0.01), (0.0, 0.03), (fourth, 0.06)];
            for (found, (expected, bound)) in moments.iter().zip(expected) {
                assert!((found - expected).abs() < bound, "{moments:?}");
            }
        }
    }
}
