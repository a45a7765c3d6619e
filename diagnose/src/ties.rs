//! Explanations that share no cause with the leading one and fit as well.

use crate::attribute::Attribution;
use crate::fit::Fit;
use crate::parallel;
use crate::problem::Problem;
use crate::progress::{self, Listener};
use crate::search::gained;

/// As for rivals of one cause: chi-square within three standard deviations of one parameter, times the scatter, or this share of
/// what is explained. The share is fifty times that for rivals of one cause, since nothing of the leading pair is kept. A convention in
/// its size.
const TIE: f64 = 9.0;
const TIE_SHARE: f64 = 0.005;
/// A pair is fitted if at first order it explains this share of what the best pair explains. A
/// convention that trades time for ties that first order does not show.
const LOOKS_AS_GOOD: f64 = 0.97;
/// Pairs that are fitted at most, of settled points and of records. Settled points are quick to simulate, and ties are the rule among
/// them. Conventions for time.
const MOST_SETTLED: usize = 80;
const MOST: usize = 8;

/// Pairs of causes beside a leading pair with which they have nothing in common; the best first.
#[must_use]
pub fn other_pairs(problem: &Problem, attribution: &Attribution, say: Listener<'_>) -> Vec<Fit> {
    // rivals of each cause by itself are found in the search; pairs that share nothing with the leader are not
    let Some(best) = attribution.best.as_ref().filter(|best| best.causes.len() == 2) else {
        return Vec::new();
    };
    let fitter = attribution.fitter(problem);
    let is_own = |cause: usize| best.causes.iter().any(|own| attribution.same(*own, cause));
    let all: Vec<usize> = (0..attribution.candidates.len()).collect();
    let columns = parallel::map(&all, |cause| fitter.sensitivity(*cause, &attribution.null));
    // at first order, because some 800 pairs cannot all be fitted
    let gain_of = |a: usize, b: usize| gained(&[&columns[a][..], &columns[b][..]].concat(), &attribution.null.residual);
    let reached = gain_of(best.causes[0], best.causes[1]);
    let others: Vec<usize> = all
        .into_iter()
        .filter(|cause| !is_own(*cause) && !columns[*cause].is_empty())
        .collect();
    let mut looks = Vec::new();
    for (n, a) in others.iter().enumerate() {
        for b in &others[n + 1..] {
            let gain = gain_of(*a, *b);
            if !attribution.same(*a, *b) && gain >= LOOKS_AS_GOOD * reached {
                looks.push((gain, [*a, *b]));
            }
        }
    }
    // equal gains in the order of the list, so that the same records give the same ties
    looks.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let settled = problem.records.iter().all(|record| record.settled);
    looks.truncate(if settled { MOST_SETTLED } else { MOST });
    let explained = attribution.null.chi2 - best.state.chi2;
    // the share is of what is explained: what two simulators differ by grows with the effect
    let worst = best.state.chi2 + (TIE * attribution.inflation).max(TIE_SHARE * explained);
    let mut fits = progress::map(say, "other pairs of causes", &looks, |(_, pair)| {
        let values: Vec<f64> = pair
            .iter()
            .flat_map(|cause| attribution.candidates[*cause].own.clone())
            .collect();
        fitter.from(pair, &values, &attribution.null)
    });
    fits.retain(|fit| fit.state.chi2 <= worst);
    fits.sort_by(|a, b| a.state.chi2.total_cmp(&b.state.chi2));
    fits
}
