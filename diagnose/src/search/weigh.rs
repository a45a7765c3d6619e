//! Whether a fit is worth what it has more than another.

use super::{LOOKS_AT_ONCE, Searcher};
use crate::causes::Search;
use crate::fit::{Fit, State};
use crate::level::{ACCURACY, threshold};
use crate::parallel;
use crate::problem::{axpy, dot};
use crate::shape::structures;
use crate::work::Work;

/// A search ends with two causes where they leave this mean square over that of the noise, and this share of what there was: a third of
/// the error. Where two causes are hidden the best two leave next to nothing; three are never hidden. Conventions.
const HOPELESS: f64 = 10.0;
const STILL_THERE: f64 = 0.1;

/// It ends as well where the last cause left this share of the squares, and this mean square over that of the noise, ten times it in size:
/// of two causes the second takes nearly all that the first has left, and one that only imitates what is left takes about half of it.
const ADDED_LITTLE: f64 = 0.3;
const FAR_OFF: f64 = 100.0;

/// A search ends where all candidates together, as many as there are, leave this share of the squares at first order, and this mean square
/// over that of the noise: two more causes do not what forty cannot. A cause whose response bends leaves less than half of it in its
/// tangents at the starts.
const OUT_OF_REACH: f64 = 0.5;
const WELL_ABOVE: f64 = 4.0;
/// Of a direction at most this share of the length may be in those before it, or it is rounding.
const NEW: f64 = 1e-5;

/// A part's curve is none of the plant's law: this share of what it takes may be left, and is no second cause. A powder core of another
/// law left 0.7 % of what it did, in which an inductance of the capacitor was seen. A convention above it.
const OF_CURVE: f64 = 0.02;

impl Searcher<'_> {
    /// How much structure a fit leaves.
    pub(crate) fn structure(&self, fit: &Fit) -> f64 {
        self.left_by(&fit.state)
    }

    fn left_by(&self, state: &State) -> f64 {
        let left = structures(self.fitter.problem, self.fitter.null, state, 1.0);
        left.iter().map(|one| one.slow.max(one.mean_square) - 1.0).sum()
    }

    /// Whether a larger set is worth its parameters: more than noise would gain, and more than the model's accuracy could
    /// make it gain, unless it is that which takes away structure.
    pub(super) fn is_worth(&self, smaller: &Fit, larger: &Fit) -> bool {
        let gain = smaller.state.chi2 - larger.state.chi2;
        let more = larger.values.len().saturating_sub(smaller.values.len());
        let explained = self.fitter.null.chi2 - larger.state.chi2;
        let mut causes = smaller.causes.iter();
        let accuracy = match causes.any(|cause| self.fitter.candidates[*cause].is_curve()) {
            true => OF_CURVE,
            false => ACCURACY,
        };
        gain >= threshold(more, self.inflation(larger))
            && (gain >= accuracy * accuracy * explained || self.structure(larger) < 0.5 * self.structure(smaller))
    }

    /// Whether two causes and more leave most of the error, or of what the causes before them left, which was `before`: a third repairs no
    /// such thing, and each costs as long as all before.
    pub(super) fn is_hopeless(&self, fit: &Fit, before: f64) -> bool {
        let count = self.fitter.problem.count().max(1) as f64;
        let leaves_much = fit.state.chi2 > HOPELESS * count && fit.state.chi2 > STILL_THERE * self.fitter.null.chi2;
        // one large cause makes all that follows small beside the model as given
        let adds_little = fit.state.chi2 > FAR_OFF * count && fit.state.chi2 > ADDED_LITTLE * before;
        fit.causes.len() > 1 && (leaves_much || adds_little)
    }

    /// Share of the squares above the noise that a fit leaves; nothing of what is no more than noise once again.
    pub(super) fn share_left(&self, fit: &Fit) -> f64 {
        let count = self.fitter.problem.count() as f64;
        let above = |chi2: f64| chi2 - 2.0 * count;
        above(fit.state.chi2).max(0.0) / above(self.fitter.null.chi2).max(f64::MIN_POSITIVE)
    }

    /// Whether all candidates together explain too little of what a state leaves for any few of them to explain it; places of the residual that
    /// are `aside` have been left out of what is to be explained.
    pub(crate) fn is_out_of_reach(&self, state: &State, aside: &(dyn Fn(usize) -> bool + Sync)) -> bool {
        let rest = |mut values: Vec<f64>| {
            let all = values.iter_mut().enumerate();
            all.filter(|(place, _)| aside(*place))
                .for_each(|(_, value)| *value = 0.0);
            values
        };
        let mut left = state.residual.clone();
        self.fitter.basis.project(&mut left);
        let mut left = rest(left);
        let count = left.iter().filter(|value| **value != 0.0).count().max(1) as f64;
        let before = dot(&left, &left);
        if before < WELL_ABOVE * count || self.left_by(state) == 0.0 {
            return false;
        }
        let Some(directions) = self.all_directions(state) else {
            return false;
        };
        let after = without(&mut left, directions.into_iter().map(rest));
        after > WELL_ABOVE * count && after > OUT_OF_REACH * before
    }

    /// Where all candidates can move the signals at first order; nothing if that takes longer than the search that it may save.
    fn all_directions(&self, from: &State) -> Option<Vec<Vec<f64>>> {
        let all: Vec<usize> = (0..self.fitter.candidates.len()).collect();
        let work = &self.fitter.problem.work;
        let begun_at = work.rows();
        let mut directions = Vec::new();
        for (done, some) in all.chunks(LOOKS_AT_ONCE).enumerate() {
            let share = (done * LOOKS_AT_ONCE) as f64 / all.len() as f64;
            if !Work::is_look_worth_it(work.rows().saturating_sub(begun_at), share) {
                return None;
            }
            directions.extend(parallel::map(some, |cause| self.directions(*cause, from)));
        }
        Some(directions.into_iter().flatten().collect())
    }

    /// Where a candidate can move the signals at first order: along its tangents, and to where its fit may begin and along those there.
    fn directions(&self, cause: usize, from: &State) -> Vec<Vec<f64>> {
        if self.search(cause) == Search::Own {
            return self.fitter.sensitivity(cause, from);
        }
        let each = self
            .starts(cause, from, &[])
            .into_iter()
            .enumerate()
            .flat_map(|(place, start)| {
                let there = self.fitter.state_at(&[cause], &start, from, 0).0;
                let mut way = from.residual.clone();
                axpy(&mut way, -1.0, &there.residual);
                self.fitter.basis.project(&mut way);
                let mut list = self.tangents(cause, place, &there).to_vec();
                list.push(way);
                list
            });
        each.collect()
    }

    /// Whether a cause beside others is so small that the difference of two simulators may look like it.
    pub(super) fn is_tiny(&self, fit: &Fit, member: usize) -> bool {
        let cause = fit.causes[member];
        self.fitter.candidates[cause].is_nothing(&self.values_of(fit, &[cause]))
    }
}

/// Takes out of `left` all that lies along `directions`; the squares that are left.
fn without(left: &mut [f64], directions: impl Iterator<Item = Vec<f64>>) -> f64 {
    let mut known: Vec<Vec<f64>> = Vec::new();
    for mut one in directions {
        let whole = dot(&one, &one).sqrt();
        for other in &known {
            let share = dot(other, &one);
            axpy(&mut one, -share, other);
        }
        let length = dot(&one, &one).sqrt();
        if !length.is_finite() || length <= NEW * whole {
            continue;
        }
        one.iter_mut().for_each(|value| *value /= length);
        let share = dot(&one, left);
        axpy(left, -share, &one);
        known.push(one);
    }
    dot(left, left)
}

#[cfg(test)]
mod tests {
    use super::without;

    #[test]
    fn what_lies_in_a_span_is_taken_out_once() {
        let mut left = vec![1.0, 2.0, 3.0];
        let span = vec![vec![1.0, 0.0, 0.0], vec![2.0, 0.0, 0.0], vec![1.0, 1.0, 0.0]];
        assert!((without(&mut left, span.into_iter()) - 9.0).abs() < 1e-12);
        assert!(left[0].abs() < 1e-12 && left[1].abs() < 1e-12);
    }
}
