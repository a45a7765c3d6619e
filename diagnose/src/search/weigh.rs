//! Whether a fit is worth what it has more than another.

use super::{Searcher, Set};
use crate::fit::{Fit, State};
use crate::level::{ACCURACY, threshold};
use crate::parallel;
use crate::shape::structures;

/// A search ends with two causes where they leave this mean square over that of the noise, and this share of what there was: a third of
/// the error. Where two causes are hidden the best two leave next to nothing; three are never hidden. Conventions.
const HOPELESS: f64 = 10.0;
const STILL_THERE: f64 = 0.1;

impl Searcher<'_> {
    /// Whether a fit says what the edges of the gate do, where without it they would do more than edges can: the trim that stands beside
    /// every fit takes a dead time as its own, at a price so small that the dead time would gain too little.
    pub(super) fn stands_for_edges(&self, without: &State, fit: &Fit) -> bool {
        let moves_edges = fit
            .causes
            .iter()
            .any(|cause| self.fitter.candidates[*cause].is_of_edges());
        moves_edges && self.asks_for_edges(without) && !self.asks_for_edges(&fit.state) && fit.state.chi2 < without.chi2
    }

    /// Whether the edges of the gate do more than edges can.
    pub(super) fn asks_for_edges(&self, state: &State) -> bool {
        let f_sw = self.fitter.problem.base.plant.converter.f_sw;
        state.starts.trim_of_nobody(f_sw).is_some()
    }

    /// Where the edges do more than edges can: the fit with each cause that moves them.
    pub(super) fn with_edges(&self, best: &Fit) -> Vec<Fit> {
        if !self.asks_for_edges(&best.state) {
            return Vec::new();
        }
        let columns = self.sensitivities(&best.causes, &best.state);
        let set = Set::of(best, &columns);
        let all = self.others(&best.causes);
        let edges: Vec<usize> = (all.into_iter())
            .filter(|cause| self.fitter.candidates[*cause].is_of_edges())
            .collect();
        parallel::map(&edges, |cause| self.added(&set, *cause, &best.state))
    }

    /// How much structure a fit leaves.
    pub(super) fn structure(&self, fit: &Fit) -> f64 {
        let left = structures(self.fitter.problem, self.fitter.null, &fit.state, 1.0);
        left.iter().map(|one| one.slow.max(one.mean_square) - 1.0).sum()
    }

    /// Whether a larger set is worth its parameters: more than noise would gain, and more than the model's accuracy could
    /// make it gain, unless it is that which takes away structure.
    pub(super) fn is_worth(&self, smaller: &Fit, larger: &Fit) -> bool {
        let gain = smaller.state.chi2 - larger.state.chi2;
        let more = larger.values.len().saturating_sub(smaller.values.len());
        let explained = self.fitter.null.chi2 - larger.state.chi2;
        gain >= threshold(more, self.inflation(larger))
            && (gain >= ACCURACY * ACCURACY * explained || self.structure(larger) < 0.5 * self.structure(smaller))
    }

    /// Whether two causes and more leave most of the error: a third repairs no such thing, and each costs as long as all before.
    pub(super) fn is_hopeless(&self, fit: &Fit) -> bool {
        let count = self.fitter.problem.count().max(1) as f64;
        fit.causes.len() > 1
            && fit.state.chi2 > HOPELESS * count
            && fit.state.chi2 > STILL_THERE * self.fitter.null.chi2
    }

    /// Whether a cause beside others is so small that the difference of two simulators may look like it.
    pub(super) fn is_tiny(&self, fit: &Fit, member: usize) -> bool {
        let cause = fit.causes[member];
        self.fitter.candidates[cause].is_nothing(&self.values_of(fit, &[cause]))
    }
}
