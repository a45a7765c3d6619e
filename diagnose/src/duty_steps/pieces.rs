//! Stretches of counts per period that round every duty of the records to the same count: what they make of a record changes smoothly within.
//!
//! ```text
//! counts   8 ──┬───┬┬────┬─── ...      each end is where one of the duties goes over to the next count
//! ```

use super::{counted, up};
use crate::causes::Cut;

/// How far apart numbers of counts are looked at where there are more stretches than can be: half a count of the duty moves by less than a tenth.
const APART: f64 = 0.1;
/// A stretch narrower than this is none: duties of four digits do not tell such counts apart.
const NARROWEST: f64 = 1e-4;
/// What is tried of a stretch lies so far inside of its ends, as a share of it: at the very end a duty may be rounded either way.
const INSIDE: f64 = 0.05;

/// A stretch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Piece {
    /// Fewest counts.
    pub low: f64,
    /// Most counts.
    pub high: f64,
}

impl Piece {
    /// Numbers of counts in it, [`APART`] from each other at most.
    pub fn within(&self) -> impl Iterator<Item = f64> {
        let (low, width) = (self.low, self.high - self.low);
        let count = (width / APART).ceil().max(1.0);
        (0..count as usize).map(move |n| low + width * (n as f64 + 0.5) / count)
    }

    /// Numbers of counts to begin with: `best`, and near both ends.
    pub fn tried(&self, best: f64) -> [f64; 3] {
        let inside = INSIDE * (self.high - self.low);
        [best, self.low + inside, self.high - inside]
    }
}

/// All stretches of a range of counts for these duties.
pub(super) fn all(duties: &[f64], [fewest, most]: [f64; 2], cut: Cut) -> Vec<Piece> {
    // a duty d goes over to the next count where d counts + up is whole
    let up = up(cut);
    let mut ends = vec![fewest, most];
    for duty in duties.iter().filter(|duty| **duty > 0.0) {
        let first = (duty * fewest + up).ceil();
        let count = (duty * most + up - first).max(-1.0) as i64;
        ends.extend((0..=count).map(|n| (first + n as f64 - up) / duty));
    }
    ends.sort_by(f64::total_cmp);
    let pairs = ends.windows(2).filter(|pair| pair[1] - pair[0] > NARROWEST);
    pairs
        .map(|pair| Piece {
            low: pair[0],
            high: pair[1],
        })
        .collect()
}

/// Stretches of a grid of counts, for duties so many that next to nothing is alike from one number to the next.
pub(super) fn apart(duties: &[f64], [fewest, most]: [f64; 2], cut: Cut) -> Vec<Piece> {
    let mut list: Vec<Piece> = Vec::new();
    let is_alike = |a: f64, b: f64| {
        duties
            .iter()
            .all(|duty| counted(*duty, a, cut) == counted(*duty, b, cut))
    };
    for n in 0..=((most - fewest) / APART) as usize {
        let counts = fewest + n as f64 * APART;
        match list.last_mut() {
            Some(last) if is_alike(last.high, counts) => last.high = counts,
            _ => list.push(Piece {
                low: counts,
                high: counts,
            }),
        }
    }
    list
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn within_a_stretch_every_duty_keeps_its_count_and_beyond_its_end_one_does_not() {
        let duties = [0.5642, 0.8117, 0.8401, 0.8497, 0.8589];
        for cut in [Cut::Nearest, Cut::Below] {
            let pieces = all(&duties, [8.0, 200.0], cut);
            let counts = |at: f64| duties.map(|duty| counted(duty, at, cut));
            for pair in pieces.windows(2) {
                let [_, near_low, near_high] = pair[0].tried(0.0);
                assert!(
                    pair[0].within().all(|at| counts(at) == counts(near_low)),
                    "{:?}",
                    pair[0]
                );
                assert_eq!(counts(near_low), counts(near_high), "{:?}", pair[0]);
                assert_ne!(counts(near_high), counts(pair[1].tried(0.0)[1]), "{:?}", pair[0]);
            }
            // narrower than the grid of the other
            assert!(pieces.iter().filter(|piece| piece.high - piece.low < APART).count() > 100);
        }
        // 105.3525 counts: half a count above 89 at one duty, and just below 91 at another
        let holds = |piece: &&Piece| piece.low < 105.3525 && 105.3525 < piece.high;
        let found = all(&duties, [8.0, 200.0], Cut::Nearest);
        let found = found.iter().find(holds).unwrap();
        assert!(found.high - found.low < 0.05, "{found:?}");
    }
}
