//! Counters that round the few duties of the records as another one does.

use super::gains::Gains;
use super::{FEWEST, MOST, goes_along, pieces};
use crate::basis::Basis;
use crate::causes::Cut;
use crate::fit::State;
use crate::problem::Problem;

/// Levels of the duty up to which others are sought: each counter has a chance of one in several to round a level alike, so that of the ten thousand
/// there are none does at more.
const FEW: usize = 16;

/// A counter that does as well as the one that was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Alike {
    /// Its step, 1.
    pub step: f64,
    /// How it rounds.
    pub cut: Cut,
    /// From which step to which the duties are rounded in this way.
    pub reach: [f64; 2],
}

/// Counters with which chi-square rises by less than `cost` over that of the counter `known`, in counts per period, at which `from` ends: of each
/// stretch that rounds the duties in one way its middle, and what lies next to its ends. What the causes `beside` move follows. The smallest
/// step first.
pub(crate) fn alike(
    problem: &Problem,
    basis: &Basis,
    (from, beside): (&State, &[Vec<f64>]),
    known: (f64, Cut),
    cost: f64,
) -> Vec<Alike> {
    if super::levels(problem).len() > FEW {
        return Vec::new();
    }
    let gains = Gains::new(problem, basis, (from, beside), known.1);
    let own: Vec<f64> = gains.moves_of(known.0, known.1).collect();
    let is_alike = |Alike { step, cut, .. }: &Alike| {
        let counts = step.recip();
        let by: Vec<f64> = (gains.moves_of(counts, *cut).zip(&own))
            .map(|(moved, own)| moved - own)
            .collect();
        !goes_along(gains.levels(), counts) && gains.rises(&by).is_some_and(|rise| rise < cost)
    };
    let of = |cut: Cut| {
        let all = pieces::all(gains.levels(), [FEWEST, MOST], cut);
        all.into_iter().map(move |piece| (piece, cut))
    };
    let all = [Cut::Nearest, Cut::Below].into_iter().flat_map(of);
    let tried = all.flat_map(|(piece, cut)| {
        let middle = 0.5 * (piece.low + piece.high);
        piece.tried(middle).map(|counts| Alike {
            step: counts.recip(),
            cut,
            reach: [piece.high.recip(), piece.low.recip()],
        })
    });
    let mut all: Vec<Alike> = tried.filter(is_alike).collect();
    all.sort_by(|a, b| a.step.total_cmp(&b.step));
    all
}
