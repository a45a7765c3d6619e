//! SplitMix64 (Steele, Lea, Flood 2014): one word of state.

use crate::Random;

/// SplitMix64. It also spreads a seed over the state of [`crate::Xoshiro`].
#[derive(Debug, Clone)]
pub struct SplitMix(u64);

impl SplitMix {
    /// Starts the sequence of `seed`.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }
}

impl Random for SplitMix {
    #[inline]
    fn bits(&mut self) -> u64 {
        // 2^64 over the golden ratio; it is odd, so the state goes through all 2^64 words before one comes again
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        // shifts and factors of the published generator, known answers of which are in the tests; another choice is
        // another stream
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sequence_of_seed_zero_is_the_published_one() {
        // first outputs of SplitMix64 with seed 0, as in the reference implementation by Vigna
        let mut random = SplitMix::new(0);
        assert_eq!(random.bits(), 0xe220_a839_7b1d_cdaf);
        assert_eq!(random.bits(), 0x6e78_9e6a_a1b9_65f4);
        assert_eq!(random.bits(), 0x06c4_5d18_8009_454f);
    }
}
