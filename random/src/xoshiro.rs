//! xoshiro256++ (Blackman and Vigna 2018): four words of state that can be stored.

use crate::{Random, SplitMix};

/// xoshiro256++, seeded through SplitMix64.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Xoshiro {
    state: [u64; 4],
}

impl Xoshiro {
    /// Starts the sequence of `seed`; stream 0 of it.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self::stream(seed, 0)
    }

    /// Stream `stream` of a seed: what one stream is asked for does not move the others.
    #[must_use]
    pub fn stream(seed: u64, stream: u64) -> Self {
        // 2^64 over the root of x^4 = x + 1, made odd: the seeds of neighbouring streams lie far apart
        let mut seeds = SplitMix::new(seed ^ stream.wrapping_mul(0xD1B5_4A32_D192_ED03));
        Self {
            // never four zeros, at which the generator would stay: SplitMix gives each word once in 2^64
            state: std::array::from_fn(|_| seeds.bits()),
        }
    }

    /// The four words that [`Xoshiro::from_state`] takes.
    #[must_use]
    pub fn state(&self) -> [u64; 4] {
        self.state
    }

    /// The generator as it was.
    #[must_use]
    pub fn from_state(state: [u64; 4]) -> Self {
        Self { state }
    }
}

impl Random for Xoshiro {
    #[inline]
    fn bits(&mut self) -> u64 {
        let s = &mut self.state;
        // 23, 17 and 45 belong to the published generator
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
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sequence_is_that_of_the_published_generator() {
        // first outputs of xoshiro256++ from state 1, 2, 3, 4 (reference implementation in C, also in rand_xoshiro)
        let mut random = Xoshiro::from_state([1, 2, 3, 4]);
        let expected = [41_943_041, 58_720_359, 3_588_806_011_781_223, 3_591_011_842_654_386];
        assert_eq!(std::array::from_fn::<u64, 4, _>(|_| random.bits()), expected);
    }

    #[test]
    fn streams_of_one_seed_differ_and_a_state_continues() {
        let (mut a, mut b) = (Xoshiro::stream(7, 0), Xoshiro::stream(7, 1));
        assert_ne!(a.bits(), b.bits());
        let mut copy = Xoshiro::from_state(a.state());
        assert_eq!(copy.bits(), a.bits());
        assert_eq!(Xoshiro::new(7), Xoshiro::stream(7, 0));
    }
}
