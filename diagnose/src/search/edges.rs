//! Causes that move the edges of the gate, beside the trim that stands for edges in every fit.

use super::{Searcher, Set};
use crate::fit::{Fit, State};
use crate::parallel;

/// Causes beside which one that moves the edges is still sought: with it they are as many as a search names.
const MOST_BESIDE_EDGES: usize = 3;

/// Standard deviations of the trim from which on the records show it.
// two bound what noise does in nineteen of twenty records; what is tried in its place for nothing costs time alone
const SEEN: f64 = 2.0;

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

    /// Whether the records show what the edges of the gate do, be it as much as edges can.
    pub(super) fn sees_edges(&self, state: &State) -> bool {
        let sd = self.fitter.basis.trim_sd().unwrap_or(f64::INFINITY);
        state.starts.trim.abs() > SEEN * sd
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

    /// A set beside which the edges still do more than edges can, with the cause that does it in their place, if one does. It is sought when nothing
    /// else is any more, budget or not: else what was found is no explanation for want of it.
    pub(super) fn without_edges(&self, best: Fit) -> Fit {
        if best.causes.len() >= MOST_BESIDE_EDGES || self.structure(&best) > 0.0 {
            return best;
        }
        let fits = self.with_edges(&best).into_iter();
        let found = fits
            .filter(|fit| self.stands_for_edges(&best.state, fit))
            .min_by(|a, b| a.state.chi2.total_cmp(&b.state.chi2));
        found.map_or(best, |fit| self.polished(&fit))
    }

    /// Where the edges do more than edges can: each cause that moves them alone, in their place, with its place among the candidates.
    pub(crate) fn of_edges(&self, from: &State) -> Vec<(usize, Fit)> {
        if !self.asks_for_edges(from) {
            return Vec::new();
        }
        let all = 0..self.fitter.candidates.len();
        let edges: Vec<usize> = all
            .filter(|cause| self.fitter.candidates[*cause].is_of_edges())
            .collect();
        parallel::map(&edges, |cause| (*cause, self.added(&Set::NONE, *cause, from)))
    }

    /// Where the edges do what the records show: a cause that moves them in their place, its values and the state without what they did. Beside
    /// a trim the tangent of such a cause is all but its own, and what the two differ by is their curvature, and where in the period a sample lies:
    /// a fit from the model's own value finds no way.
    pub(super) fn in_place_of_edges(&self, cause: usize, from: &State) -> Vec<(Vec<f64>, State)> {
        let candidate = &self.fitter.candidates[cause];
        let ([own], [[low, high, _]]) = (&candidate.own[..], &candidate.ranges[..]) else {
            return Vec::new();
        };
        if !candidate.is_of_edges() || !self.sees_edges(from) {
            return Vec::new();
        }
        let mut without = from.clone();
        let duty = std::mem::take(&mut without.starts.trim);
        // which way a late edge moves the duty depends on the leg and on the sign of its current
        let bases = &self.fitter.problem.bases;
        let topology = self.fitter.problem.base.plant.converter.topology;
        let by = match candidate.form.knobs[0].unit() {
            "s" => vec![duty * bases.t_sw, -duty * bases.t_sw],
            // half of a ramp is on-time won
            "F" => vec![2.0 * duty * bases.t_sw * bases.i / topology.span(bases.v_in, bases.v)],
            _ => vec![duty],
        };
        let values = by.into_iter().map(|by| own + by);
        let inside = values.filter(|value| (*low..=*high).contains(value));
        inside.map(|value| (vec![value], without.clone())).collect()
    }

    /// The fit with what the edges do of themselves as the own of one of its causes that moves them, if that is better: the trim costs what such a cause
    /// does not, but so little that a fit which begins with it keeps it.
    pub(crate) fn without_trim(&self, fit: Fit) -> Fit {
        let duty = fit.state.starts.trim;
        let bases = &self.fitter.problem.bases;
        let mut begun = fit.state.clone();
        begun.starts.trim = 0.0;
        let tried = self
            .fitter
            .places(&fit.causes)
            .into_iter()
            .enumerate()
            .filter(|(_, place)| {
                let candidate = &self.fitter.candidates[place.0];
                candidate.is_of_edges() && candidate.form.knobs[place.1].unit() == "s"
            });
        let tried = tried.flat_map(|(number, _)| [1.0, -1.0].map(|side| (number, side * duty * bases.t_sw)));
        let fits = tried.map(|(number, by)| {
            let mut values = fit.values.clone();
            values[number] += by;
            self.fitter.from(&fit.causes, &values, &begun)
        });
        let best = fits.min_by(|a, b| a.state.chi2.total_cmp(&b.state.chi2));
        best.filter(|other| other.state.chi2 < fit.state.chi2).unwrap_or(fit)
    }
}
