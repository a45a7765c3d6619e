//! Sets with a cause less: what each cause is needed for.

use super::{Searcher, without};
use crate::fit::{Fit, State};
use crate::level::threshold;
use crate::parallel;

impl Searcher<'_> {
    /// Some causes of a set alone, from the initial states of the model as given and from those of the `whole` set: where a current rests, or a
    /// valley bends, one of them may lead astray, and the causes that are left out would gain by that.
    pub(super) fn with_fewer(&self, kept: &[usize], values: &[f64], whole: &State) -> Fit {
        let null = self.fitter.null;
        let from_whole = State {
            model: null.model.clone(),
            ..whole.clone()
        };
        let [given, whole] = [null, &from_whole].map(|from| self.fitter.from(kept, values, from));
        if whole.state.chi2 < given.state.chi2 {
            whole
        } else {
            given
        }
    }

    /// Drops what is not needed; the evidence of what is.
    pub fn backward(&self, fit: Fit) -> (Option<Fit>, Vec<f64>) {
        let mut best = fit;
        loop {
            let members: Vec<usize> = (0..best.causes.len()).collect();
            let fewer: Vec<Option<Fit>> = parallel::map(&members, |member| {
                let kept = without(&best.causes, *member);
                let values = self.values_of(&best, &kept);
                (!kept.is_empty()).then(|| self.with_fewer(&kept, &values, &best.state))
            });
            let chi2 = |fit: &Option<Fit>| fit.as_ref().map_or(self.fitter.null.chi2, |fit| fit.state.chi2);
            let inflation = self.inflation(&best);
            let evidence = fewer.iter().enumerate().map(|(member, fit)| {
                let lost = chi2(fit) - best.state.chi2;
                let without = fit.as_ref().map_or(self.fitter.null, |fit| &fit.state);
                let parameters = self.fitter.places(&best.causes[member..=member]).len();
                match self.stands_for_edges(without, &best) {
                    // what the trim takes over in its place is more than it may
                    true => lost.max(threshold(parameters, inflation)),
                    false => lost,
                }
            });
            let evidence: Vec<f64> = evidence.collect();
            let weakest = members.iter().min_by(|a, b| evidence[**a].total_cmp(&evidence[**b]));
            let tiny = members.iter().find(|member| self.is_tiny(&best, **member));
            let Some(weakest) = tiny.or(weakest).copied() else {
                return (None, Vec::new());
            };
            let parameters = self.fitter.places(&best.causes[weakest..=weakest]).len();
            let needed = threshold(parameters, inflation);
            match (&fewer[weakest], tiny.is_some() || evidence[weakest] < needed) {
                (Some(fewer), true) => best = fewer.clone(),
                _ => return (Some(best), evidence),
            }
        }
    }

    /// A single cause that is left of several, where it ended better alone: beside the others its fit may have gone to where it does not come back from.
    pub(super) fn as_alone(&self, found: (Option<Fit>, Vec<f64>), singles: &[Fit]) -> (Option<Fit>, Vec<f64>) {
        let better = found.0.as_ref().and_then(|best| {
            let same = singles.iter().filter(|single| single.causes == best.causes);
            same.filter(|single| single.state.chi2 < best.state.chi2)
                .min_by(|a, b| a.state.chi2.total_cmp(&b.state.chi2))
        });
        let Some(better) = better else { return found };
        let best = self.polished(better);
        let evidence = self.fitter.null.chi2 - best.state.chi2;
        (Some(best), vec![evidence])
    }
}
