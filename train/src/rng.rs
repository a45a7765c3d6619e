//! The random numbers of a training: small, deterministic, the same on every machine, storable.

/// xoshiro256++ (Blackman and Vigna, 2018), seeded through SplitMix64.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Rng {
    state: [u64; 4],
}

impl Rng {
    /// Stream `stream` of a seed: what one stream is asked for does not move the others.
    #[must_use]
    pub fn new(seed: u64, stream: u64) -> Self {
        let mut x = seed ^ stream.wrapping_mul(0xD1B5_4A32_D192_ED03);
        let state = std::array::from_fn(|_| {
            x = x.wrapping_add(0x9E37_79B9_7F4A_7C15);
            let mut z = x;
            z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
            z ^ (z >> 31)
        });
        Self { state }
    }

    /// The four words that [`Rng::from_state`] takes.
    #[must_use]
    pub fn state(&self) -> [u64; 4] {
        self.state
    }

    /// The generator as it was.
    #[must_use]
    pub fn from_state(state: [u64; 4]) -> Self {
        Self { state }
    }

    /// The next 64 bits.
    pub fn bits(&mut self) -> u64 {
        let s = &mut self.state;
        let result = s[0].wrapping_add(s[3]).rotate_left(23).wrapping_add(s[0]);
        let t = s[1] << 17;
        s[2] ^= s[0];
        s[3] ^= s[1];
        s[1] ^= s[2];
        s[0] ^= s[3];
        s[2] ^= t;
        s[3] = s[3].rotate_left(45);
        result
    }

    /// Uniform over [0, 1), a multiple of 2^-53.
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 * (1.0 / (1_u64 << 53) as f64)
    }

    /// Uniform over [low, high); `low` if they are equal.
    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Uniform over 0..count by Lemire's multiplication; 0 if `count` is 0. The bias is below count / 2^64.
    pub fn index(&mut self, count: usize) -> usize {
        ((u128::from(self.bits()) * count as u128) >> 64) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sequence_is_that_of_the_published_generator() {
        // first outputs of xoshiro256++ from state 1, 2, 3, 4 (reference implementation in C, also in rand_xoshiro)
        let mut rng = Rng::from_state([1, 2, 3, 4]);
        let expected = [41_943_041, 58_720_359, 3_588_806_011_781_223, 3_591_011_842_654_386];
        assert_eq!(std::array::from_fn::<u64, 4, _>(|_| rng.bits()), expected);
    }

    #[test]
    fn streams_of_one_seed_differ_and_a_state_continues() {
        let (mut a, mut b) = (Rng::new(7, 0), Rng::new(7, 1));
        assert_ne!(a.bits(), b.bits());
        let mut copy = Rng::from_state(a.state());
        assert_eq!(copy.bits(), a.bits());
    }

    #[test]
    fn indices_and_units_fill_their_ranges_evenly() {
        let mut rng = Rng::new(1, 2);
        let mut counts = [0_usize; 12];
        let mut sum = 0.0;
        for _ in 0..120_000 {
            counts[rng.index(12)] += 1;
            let u = rng.unit();
            assert!((0.0..1.0).contains(&u));
            sum += u;
        }
        // standard deviation of a count: 96
        assert!(counts.iter().all(|&n| (9_600..10_400).contains(&n)), "{counts:?}");
        assert!((sum / 120_000.0 - 0.5).abs() < 0.005);
        assert_eq!(rng.index(0), 0);
        assert_eq!(rng.within(3.0, 3.0), 3.0);
    }
}
