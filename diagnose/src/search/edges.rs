//! Causes that move the edges of the gate, beside the trim that stands for edges in every fit.

use super::{Searcher, Set};
use crate::fit::{Fit, State};
use crate::parallel;

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

    /// Where the edges do more than edges can: a cause that moves them in their place, its values and the state without what they did. Beside
    /// a trim the tangent of such a cause is all but its own, and what the two differ by is their curvature: a fit from the model's own
    /// value finds no way.
    pub(super) fn in_place_of_edges(&self, cause: usize, from: &State) -> Vec<(Vec<f64>, State)> {
        let candidate = &self.fitter.candidates[cause];
        let ([own], [[low, high, _]]) = (&candidate.own[..], &candidate.ranges[..]) else {
            return Vec::new();
        };
        if !candidate.is_of_edges() || !self.asks_for_edges(from) {
            return Vec::new();
        }
        let mut without = from.clone();
        let duty = std::mem::take(&mut without.starts.trim);
        // which way a late edge moves the duty depends on the leg and on the sign of its current
        let by = match candidate.form.knobs[0].unit() == "s" {
            true => vec![
                duty * self.fitter.problem.bases.t_sw,
                -duty * self.fitter.problem.bases.t_sw,
            ],
            false => vec![duty],
        };
        let values = by.into_iter().map(|by| own + by);
        let inside = values.filter(|value| (*low..=*high).contains(value));
        inside.map(|value| (vec![value], without.clone())).collect()
    }
}
