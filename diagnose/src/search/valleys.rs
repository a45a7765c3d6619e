//! The best single cause begun once more in other valleys: what swings within few rows looks alike at several frequencies.

use super::{Searcher, gained, sought};
use crate::causes::Search;
use crate::fit::{Fit, State};
use crate::parallel;
use crate::problem::dot;

/// Numbers of a cause from which on one of them may be lost while the others are still wrong.
const MANY: usize = 3;
/// Ratio of such a number to the next that is looked at: a swing of twenty turns is missed by 5 % of its frequency, which is 10 % of an inductance.
const RATIO: f64 = 1.1;
/// Valleys that are followed. A convention: each costs a fit.
const VALLEYS: usize = 3;
/// Share of the squares that such a cause leaves at most. A convention: a tenth of what there was.
const NEARLY_ALL: f64 = 0.1;

impl Searcher<'_> {
    /// The best single cause where it takes nearly all, if another valley of it is deeper. What leads to a capacitor and swings with it does so within
    /// few rows: a fit goes past its inductance while the capacitance is still wrong, and above half of the rows' rate there is another frequency
    /// that looks alike.
    pub(super) fn begun_once_more(&self, fits: &[Fit]) -> Option<(usize, Fit)> {
        let (cause, best) = fits
            .iter()
            .enumerate()
            .min_by(|a, b| a.1.state.chi2.total_cmp(&b.1.state.chi2))?;
        if best.state.chi2 > NEARLY_ALL * self.fitter.null.chi2 || !self.fitter.problem.work.goes_on() {
            return None;
        }
        // a resistance may have come further than the filter behind it, from where that began
        let is_filter = |other: &usize| self.search(*other) == Search::Swing && self.same(*other, cause);
        let filter = (0..fits.len()).find(|other| is_filter(other) && *other != cause && self.structure(best) > 0.0);
        let cause = filter.unwrap_or(cause);
        let starts = self.valleys(cause, &fits[cause], best.values[0]);
        let from = self.beginning_as(cause, &fits[cause]);
        let begun = parallel::map(&starts, |values| self.fitter.from(&[cause], values, &from));
        let found = begun.into_iter().min_by(|a, b| a.state.chi2.total_cmp(&b.state.chi2))?;
        (found.state.chi2 < fits[cause].state.chi2).then_some((cause, found))
    }

    /// Starts in the deepest valleys, the numbers that make none as found; of an input filter beside the source's `resistance`.
    fn valleys(&self, cause: usize, best: &Fit, resistance: f64) -> Vec<Vec<f64>> {
        let bases = &self.fitter.problem.bases;
        let (places, making) = match self.search(cause) {
            Search::From(_) if best.values.len() >= MANY => (self.along_the_first(cause, best), 0..1),
            // what swings slowly and leaves nothing has no other valley
            Search::Swing if sought::is_fast(&best.values, bases) || self.structure(best) > 0.0 => {
                (sought::filters_at_any(resistance, RATIO, bases), 1..3)
            }
            _ => return Vec::new(),
        };
        // the others follow, in the directions that they have where the fit ended: of a capacitor these are the same beside any inductance
        let all = self.fitter.sensitivity(cause, &best.state).into_iter().enumerate();
        let others: Vec<Vec<f64>> = all
            .filter(|(number, _)| !making.contains(number))
            .map(|(_, column)| column)
            .collect();
        let from = self.beginning_as(cause, best);
        let looked = |start: &Vec<f64>| {
            let mut left = self.fitter.state_at(&[cause], start, &from, 0).0.residual;
            self.fitter.basis.project(&mut left);
            dot(&left, &left) - gained(&others, &left)
        };
        let looks = parallel::map(&places, |starts| {
            let each = starts.iter().map(|start| (looked(start), start.clone()));
            each.min_by(|a, b| a.0.total_cmp(&b.0))
        });
        let looks: Vec<(f64, Vec<f64>)> = looks.into_iter().flatten().collect();
        let is_below = |at: usize, beside: Option<usize>| {
            let other = beside.and_then(|beside| looks.get(beside));
            other.is_none_or(|other| looks[at].0 < other.0)
        };
        let mut lowest: Vec<usize> = (0..looks.len())
            .filter(|at| is_below(*at, at.checked_sub(1)) && is_below(*at, Some(at + 1)))
            .collect();
        lowest.sort_by(|a, b| looks[*a].0.total_cmp(&looks[*b].0));
        lowest.truncate(VALLEYS);
        lowest.into_iter().map(|at| looks[at].1.clone()).collect()
    }

    /// The model as given with the initial states of a fit of a cable: where it takes nearly all they are nearer to those of its other valleys. An input
    /// filter is begun anew from a resistance.
    fn beginning_as(&self, cause: usize, fit: &Fit) -> State {
        let starts = match self.search(cause) {
            Search::Swing => self.fitter.null.starts.clone(),
            _ => fit.state.starts.clone(),
        };
        State {
            starts,
            ..self.fitter.null.clone()
        }
    }

    /// Values of a set with its first number anywhere in its decades; none if that may be 0.
    fn along_the_first(&self, cause: usize, best: &Fit) -> Vec<Vec<Vec<f64>>> {
        let [low, high, _] = self.fitter.candidates[cause].ranges[0];
        if low <= 0.0 {
            return Vec::new();
        }
        let count = (libm::log(high / low) / libm::log(RATIO)) as i32;
        let with = |n: i32| vec![[&[low * RATIO.powi(n)], &best.values[1..]].concat()];
        (0..=count).map(with).collect()
    }
}
