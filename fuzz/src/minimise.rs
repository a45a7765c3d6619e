//! Makes an input shorter as long as the fault stays the same.

use std::time::{Duration, Instant};

/// Readings of one input at most.
const MOST_TRIES: usize = 4_000;
/// A fault that takes its time is worth fewer tries.
const LONGEST: Duration = Duration::from_secs(20);

/// The shortest input that was found for which `is_same` still holds.
pub fn minimise(input: &[u8], mut is_same: impl FnMut(&[u8]) -> bool) -> Vec<u8> {
    let mut best = input.to_vec();
    let started = Instant::now();
    let mut tries = 0;
    let mut chunk = best.len().div_ceil(2);
    while chunk > 0 {
        let mut at = 0;
        let mut shrunk = false;
        while at < best.len() {
            if tries >= MOST_TRIES || started.elapsed() > LONGEST {
                return best;
            }
            tries += 1;
            let mut shorter = best.clone();
            shorter.drain(at..(at + chunk).min(best.len()));
            if is_same(&shorter) {
                best = shorter;
                shrunk = true;
            } else {
                at += chunk;
            }
        }
        // what could not go before may go now
        if !shrunk || chunk > 1 {
            chunk /= 2;
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::minimise;

    #[test]
    fn what_does_not_matter_is_left_out() {
        let input = b"some words around a needle in hay";
        let found = minimise(input, |bytes| bytes.windows(6).any(|window| window == b"needle"));
        assert_eq!(found, b"needle");
    }
}
