//! Sets with another cause in the place of one: what is better, and what does as well.

use super::{AT_ONCE, FOLLOWED, NEAR, Searcher, Set, TIE, TIE_SHARE, top, without};
use crate::fit::Fit;
use crate::progress;

/// Candidates that are tried as rivals of a cause beside others. A convention: each costs a fit.
const MOST_RIVALS: usize = 8;
/// The cause that both switches in proportion are almost.
const WINDING: &str = "dcr";

impl Searcher<'_> {
    /// Fits of the set with other causes in the place of one: those that are `chosen` of what gains a share of the most at first order, where
    /// the kept ones alone end. As rivals, the first of which was begun at so many rows, they are bounded.
    pub(super) fn replacements(
        &self,
        fit: &Fit,
        member: usize,
        chosen: impl Fn(Vec<(f64, usize)>) -> Vec<usize>,
        (stage, begun_at): (&str, Option<u64>),
    ) -> Vec<Fit> {
        let kept = without(&fit.causes, member);
        let kept = self.with_fewer(&kept, &self.values_of(fit, &kept), &fit.state);
        let columns = self.sensitivities(&kept.causes, &kept.state);
        let set = Set::of(&kept, &columns);
        let looks = self.looks(&set, &self.others(&fit.causes), &kept.state);
        let most = looks.iter().map(|look| look.0).fold(0.0, f64::max);
        let looks = looks.into_iter().filter(|look| look.0 > FOLLOWED * most).collect();
        self.within(begun_at, &chosen(looks), stage, |cause| {
            self.added(&set, *cause, &kept.state)
        })
    }

    /// Those of `all` that may still be tried, where the first rival was begun at so many rows; all where none was.
    fn within<T: Sync, R: Send>(
        &self,
        begun_at: Option<u64>,
        all: &[T],
        stage: &str,
        tried: impl Fn(&T) -> R + Sync,
    ) -> Vec<R> {
        let mut list = Vec::new();
        for some in all.chunks(AT_ONCE) {
            if begun_at.is_some_and(|begun_at| !self.fitter.problem.work.may_seek_rivals(begun_at)) {
                break;
            }
            list.extend(progress::map(self.say, stage, some, &tried));
        }
        list
    }

    /// Of each cause the form that gains most and the one of fewest parameters: a cause with many forms would take the places of the others, and its
    /// larger forms that of the one that does the same with a single number.
    fn of_each_cause(&self, mut looks: Vec<(f64, usize)>) -> Vec<(f64, usize)> {
        let parameters = |cause: usize| self.fitter.candidates[cause].own.len();
        looks.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let is_kept = |(place, (_, cause)): &(usize, &(f64, usize))| {
            let same = || looks.iter().enumerate().filter(|(_, other)| self.same(other.1, *cause));
            let first = same().map(|(n, _)| n).next();
            let fewest = same().min_by_key(|(_, other)| parameters(other.1)).map(|(n, _)| n);
            first == Some(*place) || fewest == Some(*place)
        };
        looks
            .iter()
            .enumerate()
            .filter(is_kept)
            .map(|(_, look)| *look)
            .collect()
    }

    /// What may stand in the place of `own`, and of one that moves the edges all others that do: the trim takes its place where it is left out, so that
    /// nothing shows at first order.
    fn with_others_of_edges(&self, own: usize, mut chosen: Vec<usize>) -> Vec<usize> {
        let is_of_edges = |cause: usize| self.fitter.candidates[cause].is_of_edges();
        if is_of_edges(own) {
            let others = self.others(&[own]).into_iter();
            let more: Vec<usize> = others
                .filter(|cause| is_of_edges(*cause) && !chosen.contains(cause))
                .collect();
            chosen.extend(more);
        }
        chosen
    }

    /// What may stand in the place of `own`, and of a winding both switches in proportion: beside others they are not tried for themselves, since they are
    /// almost the winding. So they tie with it.
    fn with_both_switches(&self, own: usize, mut chosen: Vec<usize>) -> Vec<usize> {
        if self.id(own) == WINDING {
            let both = |cause: &usize| self.fitter.candidates[*cause].is_in_proportion();
            chosen.extend((0..self.fitter.candidates.len()).filter(both));
        }
        chosen
    }

    /// For each cause of a set, what explains the data as well in its place.
    pub fn rivals(&self, best: &Fit, evidence: &[f64], singles: &[Fit]) -> Vec<Vec<Fit>> {
        let begun_at = Some(self.fitter.problem.work.rows());
        let members = best.causes.iter().enumerate();
        members
            .map(|(member, own)| {
                let tolerance = (TIE * self.inflation(best)).max(TIE_SHARE * evidence[member]);
                let mut all = match best.causes.len() {
                    1 => singles.to_vec(),
                    _ => Vec::new(),
                };
                // a cause that ended better than alone did so from elsewhere, and from there its rivals may end better as well
                let is_met = |fit: &Fit| fit.causes == best.causes && fit.state.chi2 <= best.state.chi2 + tolerance;
                if !all.iter().any(is_met) {
                    let chosen = |looks| {
                        let usual = top(self.of_each_cause(looks), MOST_RIVALS);
                        self.with_both_switches(*own, self.with_others_of_edges(*own, usual))
                    };
                    let stage = format!("rivals of {}", self.id(*own));
                    all.extend(self.replacements(best, member, chosen, (&stage, begun_at)));
                }
                let is_rival = |fit: &Fit| {
                    let other = fit.causes.last().is_some_and(|cause| !self.same(*cause, *own));
                    // the trim takes over what such a cause leaves, and is more than it may
                    let is_left_to_edges = self.asks_for_edges(&fit.state) && !self.asks_for_edges(&best.state);
                    other
                        && !is_left_to_edges
                        && !self.has_nothing(fit)
                        && fit.state.chi2 <= best.state.chi2 + tolerance
                };
                let near = |fit: &Fit| fit.state.chi2 <= best.state.chi2 + NEAR * tolerance;
                let all: Vec<Fit> = all.into_iter().filter(near).collect();
                let stage = format!("rivals of {}, those that come near", self.id(*own));
                let all = self.within(begun_at, &all, &stage, |fit| self.polished(fit));
                let mut list: Vec<Fit> = all.into_iter().filter(is_rival).collect();
                list.sort_by(|a, b| a.state.chi2.total_cmp(&b.state.chi2));
                let mut seen = Vec::new();
                list.retain(|fit| {
                    let number = fit.causes.last().map(|cause| self.number(*cause));
                    let new = !seen.contains(&number);
                    seen.push(number);
                    new
                });
                list
            })
            .collect()
    }
}
