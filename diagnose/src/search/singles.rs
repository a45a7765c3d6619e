//! Every candidate alone: a look at first order, the first steps of a fit, and the end of those that lead or come near.

use super::{BEGUN, FOLLOWED, LEAST_FOLLOWED, NEAR, Searcher, Set, TIE_SHARE, gained, sought};
use crate::causes::Search;
use crate::fit::Fit;
use crate::parallel;
use crate::progress;

/// Single causes whose fit is brought to its end after its first steps, whatever they leave: twice the leaders that anything asks for.
/// What is behind them leads nothing. A convention.
const BROUGHT_TO_AN_END: usize = 10;
/// Mean square over that of the noise from which on the best single cause leaves structure for sure, in `shape` from 2.5 on.
const STILL_FAR: f64 = 4.0;

/// ... and from which on there is something left that a filter behind a resistance may explain: of a hundred rows noise alone is a quarter above its
/// mean once in a hundred records.
const STILL_OFF: f64 = 1.25;

/// Share of the resistance that fits alone which an input filter behind it has at least: alone it does what the capacitor's resistance does, too,
/// which in filters of blind cases took up to .61 of it. A convention below that.
const KEPT: f64 = 0.2;

impl Searcher<'_> {
    /// Every candidate alone. Those that explain next to nothing at first order are not followed further.
    pub fn singles(&self, stage: &str) -> Vec<Fit> {
        let null = self.fitter.null;
        let all: Vec<usize> = (0..self.fitter.candidates.len()).collect();
        let first_order = parallel::map(&all, |cause| match self.search(*cause) {
            Search::OwnOr(_) | Search::Knee | Search::Swing => {
                let best = self.begins(&Set::NONE, *cause, null).into_iter().next();
                best.map_or(0.0, |(expected, _)| null.chi2 - expected)
            }
            _ => gained(&self.fitter.sensitivity(*cause, null), &null.residual),
        });
        let most = first_order.iter().copied().fold(0.0, f64::max);
        let sees_edges = self.sees_edges(null);
        // a filter or a fall that is read off the records is far from its end, and promises little there
        let is_followed = |cause: usize| match self.search(cause) {
            _ if sees_edges && self.fitter.candidates[cause].is_of_edges() => true,
            Search::Knee | Search::Swing => first_order[cause] != 0.0,
            _ => !self.begins_at_own(cause) || first_order[cause] > (FOLLOWED * most).max(LEAST_FOLLOWED),
        };
        let looked = progress::map(self.say, stage, &all, |cause| match is_followed(*cause) {
            true => self.looked_at(*cause),
            false => self.fitter.unmoved(*cause, first_order[*cause]),
        });
        let near = self.near_the_best(&looked);
        let mut fits = progress::map(self.say, &format!("{stage}, those that come near"), &all, |cause| {
            let fit = &looked[*cause];
            if !is_followed(*cause) || !near.contains(cause) {
                return fit.clone();
            }
            let further = self.fitter.from(&fit.causes, &fit.values, &fit.state);
            if further.state.chi2 < fit.state.chi2 {
                further
            } else {
                fit.clone()
            }
        });
        for cause in all.into_iter().filter(|cause| self.search(*cause) == Search::Swing) {
            if let Some(better) = self.behind_resistance(cause, &fits) {
                fits[cause] = better;
            }
        }
        if let Some((cause, better)) = self.begun_once_more(&fits) {
            fits[cause] = better;
        }
        fits
    }

    /// An input filter from the resistance that fits without one, and from what swings beside it, where that is better: what the resistance
    /// alone does may hide the swing. Where it does little, or all there is to do, there is no filter to be sought.
    fn behind_resistance(&self, cause: usize, fits: &[Fit]) -> Option<Fit> {
        let is_simple = |fit: &&Fit| self.same(fit.causes[0], cause) && fit.values.len() == 1 && fit.values[0] > 0.0;
        let simple = fits.iter().find(is_simple)?;
        let (null, left) = (self.fitter.null.chi2, simple.state.chi2);
        if null - left < FOLLOWED * null || left < STILL_OFF * self.fitter.problem.count() as f64 {
            return None;
        }
        let bases = &self.fitter.problem.bases;
        let mut starts = sought::swings(self.fitter.problem, &simple.state.residual, bases);
        if starts.is_empty() {
            starts = sought::damped(bases);
        }
        for start in &mut starts {
            start[0] = simple.values[0];
        }
        let begins = self
            .ranked(&Set::NONE, cause, &simple.state, starts)
            .into_iter()
            .take(BEGUN);
        let steps = begins.map(|(_, start)| self.fitter.first_steps(&[cause], &start, &simple.state));
        let best = steps.min_by(|a, b| a.state.chi2.total_cmp(&b.state.chi2))?;
        let fit = self.fitter.from(&best.causes, &best.values, &best.state);
        // it is that resistance that damps: a filter without it, whose capacitor has one, is another's form of what a switch has
        let is_behind = fit.values[0] > KEPT * simple.values[0];
        (is_behind && fit.state.chi2 < fits[cause].state.chi2).then_some(fit)
    }

    /// A candidate alone after the first steps of its fit, which show whether it can come near.
    fn looked_at(&self, cause: usize) -> Fit {
        let null = self.fitter.null;
        let begins = self.begins(&Set::NONE, cause, null).into_iter().take(BEGUN);
        let from_own = begins.map(|(_, start)| self.fitter.first_steps(&[cause], &start, null));
        let edges = self.in_place_of_edges(cause, null).into_iter();
        let fits = from_own.chain(edges.map(|(start, from)| self.fitter.first_steps(&[cause], &start, &from)));
        let best = fits.min_by(|a, b| a.state.chi2.total_cmp(&b.state.chi2));
        best.unwrap_or_else(|| self.fitter.unmoved(cause, 0.0))
    }

    /// Places of those that lead, and of those that may fit as well as the first in the end.
    fn near_the_best(&self, looked: &[Fit]) -> Vec<usize> {
        let mut places = self.leaders(looked, BROUGHT_TO_AN_END);
        let least = looked.iter().map(|fit| fit.state.chi2).fold(f64::INFINITY, f64::min);
        let explained = self.fitter.null.chi2 - least;
        // what leaves structure has no rivals
        if least > STILL_FAR * self.fitter.problem.count() as f64 {
            return places;
        }
        // as far as a rival may be off, and as much again as the best leaves for what the first steps have not reached
        let farthest = least + least.max(NEAR * TIE_SHARE * explained);
        places.extend((0..looked.len()).filter(|place| looked[*place].state.chi2 < farthest));
        places
    }
}
