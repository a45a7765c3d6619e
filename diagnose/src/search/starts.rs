//! Where the fit of a candidate begins: what the residual itself says of a line or a counter, or the starts of its entry.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, OnceLock};

use super::{Searcher, Set, TIE, gained, sought};
use crate::causes::Search;
use crate::duty_steps;
use crate::fit::{Fit, State};
use crate::parallel;
use crate::problem::dot;
use crate::spectrum;

/// Kinds of rounding that are simulated after a linear look at all. The look knows the averaged circuit only; among eight the true
/// one has to be. A convention that trades time.
const COUNTS: usize = 8;
/// First step of the refinement, counts: twice the distance of the numbers that are looked at, so that both neighbours are reached.
const COUNT_STEP: f64 = 0.2;

/// Rounds in which counts that are not whole move with the other causes: three to halve the step four times, and a bound alone.
const MOST_COUNTS: usize = 12;

/// A candidate and the place of one of its starts.
type Start = (usize, usize);

/// What the looks of a search share.
#[derive(Debug, Default)]
pub(crate) struct Known {
    /// Tangents at starts that stand in the list of causes.
    tangents: Mutex<HashMap<Start, Arc<Vec<Vec<f64>>>>>,
    /// The pairs that were fitted from the model as given.
    pub(super) pairs: OnceLock<Vec<Fit>>,
}

impl Known {
    /// With pairs that are known already.
    pub(crate) fn with(pairs: Option<Vec<Fit>>) -> Self {
        Known {
            pairs: pairs.map(OnceLock::from).unwrap_or_default(),
            ..Known::default()
        }
    }

    fn get(&self, start: &Start) -> Option<Arc<Vec<Vec<f64>>>> {
        // poisoned only by a panic, which goes on elsewhere
        self.tangents.lock().ok()?.get(start).cloned()
    }

    /// The same whichever thread comes first.
    fn keep(&self, start: Start, tangents: Vec<Vec<f64>>) -> Arc<Vec<Vec<f64>>> {
        let tangents = Arc::new(tangents);
        if let Ok(mut known) = self.tangents.lock() {
            known.insert(start, Arc::clone(&tangents));
        }
        tangents
    }
}

impl Searcher<'_> {
    /// Starts of `cause`, and the chi-square that `set` with it would have from each at first order, best first.
    pub(super) fn begins(&self, set: &Set<'_>, cause: usize, from: &State) -> Vec<(f64, Vec<f64>)> {
        if self.search(cause) == Search::Own {
            let mut columns = set.columns.to_vec();
            columns.extend(self.fitter.sensitivity(cause, from));
            let own = self.fitter.candidates[cause].own.clone();
            return vec![(from.chi2 - gained(&columns, &from.residual), own)];
        }
        let looks = self.ranked(set, cause, from, self.starts(cause, from, set.columns));
        match (looks.first(), self.search(cause)) {
            (Some((_, step)), Search::Counter(_)) => vec![self.refined(set, cause, from, step[0].recip())],
            _ => looks,
        }
    }

    /// These starts of `cause`, and the chi-square that `set` with it would have from each at first order, best first.
    pub(super) fn ranked(
        &self,
        set: &Set<'_>,
        cause: usize,
        from: &State,
        starts: Vec<Vec<f64>>,
    ) -> Vec<(f64, Vec<f64>)> {
        let looks = starts.into_iter().enumerate().map(|(place, start)| {
            let state = self.fitter.state_at(&[cause], &start, from, 0).0;
            // the initial states and the others may have to follow before it shows what it is worth
            let mut left = state.residual.clone();
            self.fitter.basis.project(&mut left);
            let mut columns = set.columns.to_vec();
            columns.extend(self.tangents(cause, place, &state).iter().cloned());
            (dot(&left, &left) - gained(&columns, &left), start)
        });
        let mut looks: Vec<_> = looks.collect();
        looks.sort_by(|a, b| a.0.total_cmp(&b.0));
        looks
    }

    /// Tangents of a candidate at the `place`th of its starts, near `state`. Those of starts that stand in the list of causes are taken beside
    /// the model as given, once for all looks of a search: other causes move them by little, and they only say where a fit begins. Cables
    /// and input capacitors, integrated in short steps, would take most of the time of a search.
    pub(super) fn tangents(&self, cause: usize, place: usize, state: &State) -> Arc<Vec<Vec<f64>>> {
        let listed = match self.search(cause) {
            Search::From(_) | Search::OwnOr(_) | Search::Knee => self.fitter.starts(cause).into_iter().nth(place),
            _ => None,
        };
        let Some(start) = listed else {
            return Arc::new(self.fitter.sensitivity(cause, state));
        };
        let known = self.known.get(&(cause, place));
        known.unwrap_or_else(|| {
            let there = self.fitter.state_at(&[cause], &start, self.fitter.null, 0).0;
            self.known.keep((cause, place), self.fitter.sensitivity(cause, &there))
        })
    }

    /// A duty counter near `counts` that fits better, and the chi-square expected with it.
    fn refined(&self, set: &Set<'_>, cause: usize, from: &State, counts: f64) -> (f64, Vec<f64>) {
        let is_bend = |counts: f64| match self.search(cause) {
            Search::Counter(_) => duty_steps::is_bend(self.fitter.problem, counts),
            _ => false,
        };
        let look = |counts: f64| {
            if is_bend(counts) {
                return f64::INFINITY;
            }
            let mut left = self.fitter.state_at(&[cause], &[counts.recip()], from, 0).0.residual;
            self.fitter.basis.project(&mut left);
            dot(&left, &left) - gained(set.columns, &left)
        };
        let (mut best, mut at, mut step) = (look(counts), counts, COUNT_STEP);
        while step > COUNT_STEP / 20.0 {
            let next = [at - step, at + step].map(|counts| (look(counts), counts));
            let next = if next[0].0 < next[1].0 { next[0] } else { next[1] };
            match next.0 < best {
                true => (best, at) = next,
                false => step *= 0.5,
            }
        }
        // counters have whole counts
        let whole = libm::round(at);
        let of_whole = look(whole);
        if of_whole < best + TIE {
            (best, at) = (of_whole, whole);
        }
        (best, vec![at.recip()])
    }

    /// Where the fit of a candidate may begin; what the residual itself tells is read off it.
    pub(super) fn starts(&self, cause: usize, from: &State, beside: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let (problem, residual) = (self.fitter.problem, &from.residual);
        match self.search(cause) {
            Search::Line => {
                let line = spectrum::strongest_line(problem, residual, 3)
                    .or_else(|| spectrum::strongest_line(problem, residual, 0));
                vec![line.map_or(vec![0.0, 100.0, 0.0], |line| {
                    vec![line.amplitude, line.frequency, line.phase]
                })]
            }
            Search::Swing => sought::swings(problem, residual, &problem.bases),
            Search::Counter(cut) => {
                let counts = duty_steps::likely(problem, self.fitter.basis, (from, beside), (cut, COUNTS));
                counts.into_iter().map(|counts| vec![counts.recip()]).collect()
            }
            _ => self.fitter.starts(cause),
        }
    }

    /// The fit with the duty counter that is best beside the other causes.
    pub(super) fn counted(&self, fit: Fit, place: usize) -> Fit {
        let counts = fit.values[place].recip();
        let whole = libm::round(counts);
        let mut tried = vec![
            whole,
            whole - 1.0,
            whole + 1.0,
            counts - COUNT_STEP,
            counts + COUNT_STEP,
        ];
        tried.retain(|counts| !duty_steps::is_bend(self.fitter.problem, *counts));
        let fits = parallel::map(&tried, |counts| {
            let mut values = fit.values.clone();
            values[place] = counts.recip();
            self.fitter.from(&fit.causes, &values, &fit.state)
        });
        // counters have whole counts
        let is_whole = |fit: &Fit| {
            let counts = fit.values[place].recip();
            (counts - libm::round(counts)).abs() < 1e-9 * counts
        };
        let score = |fit: &Fit| fit.state.chi2 - if is_whole(fit) { TIE } else { 0.0 };
        let better = |best: Fit, other: Fit| if score(&other) < score(&best) { other } else { best };
        let mut best = fits.into_iter().fold(fit, better);
        // one that has none was looked for where the other causes were then: it moves with them, by shares of a count
        let mut step = 0.5 * COUNT_STEP;
        for _ in 0..MOST_COUNTS {
            if is_whole(&best) || step < COUNT_STEP / 20.0 || !self.fitter.problem.work.goes_on() {
                break;
            }
            let at = best.values[place].recip();
            let fits = parallel::map(&[at - step, at + step], |counts| {
                let mut values = best.values.clone();
                values[place] = counts.recip();
                self.fitter.from(&best.causes, &values, &best.state)
            });
            let before = score(&best);
            best = fits.into_iter().fold(best, better);
            if score(&best) >= before {
                step *= 0.5;
            }
        }
        best
    }
}
