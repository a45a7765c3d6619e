//! White noise of a sensor at the sampling instant, seeded by `sensors.seed`.
//!
//! The normal numbers come from integers alone, so that every machine draws the same bits: the number of ones among 128
//! random bits, smoothed by a triangle of width 2. Skewness 0, excess kurtosis -0.016, range +-11 sigma.

use serde::{Deserialize, Serialize};

use crate::catalogue::{Effect, Field, Parameter, number};

/// Catalogue entry.
pub const EFFECT: Effect = Effect {
    name: "sensor_noise",
    meaning: "noise of a sensor",
    parameters: &[
        number!(
            sensors.v_out.noise,
            "sensors.v_out.noise",
            "V",
            "standard deviation",
            (0.0, 1e5),
            (1e-3, 0.2),
            0.0
        ),
        number!(
            sensors.i_l.noise,
            "sensors.i_l.noise",
            "A",
            "standard deviation",
            (0.0, 1e5),
            (1e-3, 0.2),
            0.0
        ),
        number!(
            sensors.i_out.noise,
            "sensors.i_out.noise",
            "A",
            "standard deviation",
            (0.0, 1e5),
            (1e-3, 0.2),
            0.0
        ),
        number!(
            sensors.v_in.noise,
            "sensors.v_in.noise",
            "V",
            "standard deviation",
            (0.0, 1e5),
            (1e-3, 0.2),
            0.0
        ),
        Parameter {
            key: "sensors.seed",
            unit: "1",
            meaning: "seed of the noise of all sensors",
            allowed: (0.0, u64::MAX as f64),
            typical: (0.0, 1e6),
            neutral: 0.0,
            field: Field::Whole(|p| p.sensors.seed, |p, value| p.sensors.seed = value),
        },
    ],
};

/// A source of normal numbers (xoshiro256++, Blackman and Vigna 2019, seeded by splitmix64).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub(crate) struct Noise([u64; 4]);

impl Noise {
    pub fn new(seed: u64) -> Self {
        let mut state = seed;
        let mut next = || {
            state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let mut z = state;
            z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            z ^ (z >> 31)
        };
        Noise([next(), next(), next(), next()])
    }

    fn bits(&mut self) -> u64 {
        let [a, b, c, d] = self.0;
        let result = a.wrapping_add(d).rotate_left(23).wrapping_add(a);
        let (mut c, mut d) = (c ^ a, d ^ b);
        let (b_next, a_next) = (b ^ c, a ^ d);
        c ^= b << 17;
        d = d.rotate_left(45);
        self.0 = [a_next, b_next, c, d];
        result
    }

    /// A number of mean 0 and variance 1.
    pub fn normal(&mut self) -> f64 {
        const PER_SIGMA: f64 = 0.176_318_129_815_27; // 1 / sqrt(128 / 4 + 1 / 6)
        let ones = self.bits().count_ones() + self.bits().count_ones();
        let fraction = self.bits();
        let half = |bits: u64| f64::from(u32::try_from(bits).unwrap_or(0)) * (1.0 / 4_294_967_296.0);
        let triangle = half(fraction >> 32) + half(fraction & 0xffff_ffff) - 1.0;
        (f64::from(ones) - 64.0 + triangle) * PER_SIGMA
    }
}

#[cfg(test)]
mod tests {
    use super::Noise;

    #[test]
    fn noise_has_the_moments_of_a_normal_number() {
        let mut noise = Noise::new(1);
        let n = 400_000;
        let mut moments = [0.0; 4];
        for _ in 0..n {
            let x = noise.normal();
            for (k, moment) in moments.iter_mut().enumerate() {
                *moment += x.powi(k as i32 + 1) / f64::from(n);
            }
        }
        for (found, (expected, bound)) in moments
            .iter()
            .zip([(0.0, 0.006), (1.0, 0.01), (0.0, 0.03), (2.984, 0.06)])
        {
            assert!((found - expected).abs() < bound, "{moments:?}");
        }
    }
}
