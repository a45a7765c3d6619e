//! Whether load steps lie inside a switching period, or only look as if they did while a cause is missing.

use std::cell::OnceCell;

use crate::attribute::searcher;
use crate::basis::Basis;
use crate::fit::{Fit, State};
use crate::instants;
use crate::noise;
use crate::problem::Problem;
use crate::search::{Searcher, TIE};
use crate::shape::structures;

/// Causes that are fitted with free instants from where they fit without. As many as are fitted after a linear look in the search: a
/// convention.
const LEADERS: usize = 5;

/// Causes whose first steps leave this many times what the best leaves are not fitted further. First steps come within some percent of the end. A
/// convention.
const NEAR_THE_BEST: f64 = 2.0;

/// Share of the free instants that may end where they may go no further. Those of a bench lie anywhere in a period, a twentieth of them within its
/// last twentieth; where a cause is missing most run to an end. A convention between.
const MOST_AT_LIMITS: f64 = 0.25;

/// Records whose load steps are freed.
pub(crate) struct Inside {
    /// The problem with free instants.
    pub problem: Problem,
    /// The model as given with free instants.
    null: State,
    /// Where they fit best so far.
    pub state: State,
    /// What initial states and instants explain. The model as given may be so far off that its instants run away: this is where they fit.
    basis: Basis,
    /// The causes that lead where the steps are as the table has them, fitted beside free instants: place among the candidates, and fit.
    pub leaders: Vec<(usize, Fit)>,
    /// Several causes that were found there, fitted as well.
    pub set: Option<Fit>,
    /// Two causes at once, once somebody has asked for them.
    pub pairs: OnceCell<Vec<Fit>>,
}

impl Inside {
    /// The problem with free instants of load steps, if no single cause does what they do.
    pub(crate) fn needed(search: &Searcher<'_>, singles: &[Fit]) -> Option<Self> {
        let (problem, state) = freed(search, singles)?;
        let mut inside = Self::of(search, problem, state);
        inside.leaders = inside.led_by(search, singles);
        Some(inside)
    }

    /// The same beside a set of causes that leaves something, if free instants take up much of that and end within a period.
    pub(crate) fn beside(search: &Searcher<'_>, fit: &Fit) -> Option<Self> {
        let (problem, state) = instants::freed(search.fitter.problem, &fit.state, search.inflation(fit))?;
        let mut inside = Self::of(search, problem, state);
        inside.set = Some(
            inside
                .searcher(search)
                .fitter
                .from(&fit.causes, &fit.values, &inside.state),
        );
        if inside.ends_at_limits() {
            return None;
        }
        inside.leaders = inside.of_edges(search);
        Some(inside)
    }

    fn of(search: &Searcher<'_>, problem: Problem, state: State) -> Self {
        let given = search.fitter.null;
        Inside {
            null: instants::scanned(&problem, &given.model, &given.starts),
            basis: problem.basis(&state.model, &state.starts, &state.residual),
            state,
            problem,
            leaders: Vec::new(),
            set: None,
            pairs: OnceCell::new(),
        }
    }

    /// Searches beside the free instants as `search` does without.
    pub(crate) fn searcher<'a>(&'a self, search: &Searcher<'a>) -> Searcher<'a> {
        searcher(
            &self.problem,
            search.fitter.candidates,
            &self.basis,
            &self.null,
            search.say,
        )
    }

    /// The causes that lead, fitted beside free instants from where they fit without: the first steps of all, and to the end where they come near the
    /// best.
    fn led_by(&self, search: &Searcher<'_>, singles: &[Fit]) -> Vec<(usize, Fit)> {
        let free = self.searcher(search);
        let begun = |place: usize| {
            let Fit {
                causes, values, state, ..
            } = &singles[place];
            let at = instants::scanned_in(&self.problem, &state.model, &state.starts, Some(&self.basis));
            (place, free.fitter.first_steps(causes, values, &at))
        };
        let work = &self.problem.work;
        // where the records are none of this converter these and the edges below took 15 million rows behind the end of the budget
        let leaders = search.leaders(singles, LEADERS).into_iter();
        let mut all: Vec<(usize, Fit)> = leaders.take_while(|_| work.goes_on()).map(begun).collect();
        let least = all.iter().map(|(_, fit)| fit.state.chi2).fold(f64::INFINITY, f64::min);
        for (_, fit) in all.iter_mut().filter(|(_, fit)| fit.state.chi2 < NEAR_THE_BEST * least) {
            if !work.goes_on() {
                break;
            }
            *fit = free.fitter.from(&fit.causes, &fit.values, &fit.state);
        }
        if work.goes_on() {
            all.extend(self.of_edges(search));
        }
        all
    }

    /// The causes that move the edges of the gate, where these do more than edges can beside free instants as well: where the steps are as the table
    /// has them it may not show.
    fn of_edges(&self, search: &Searcher<'_>) -> Vec<(usize, Fit)> {
        let begins = [&self.state, &self.null].into_iter();
        let from = begins.min_by(|a, b| a.chi2.total_cmp(&b.chi2));
        from.map_or_else(Vec::new, |from| self.searcher(search).of_edges(from))
    }

    /// Whether the instants leave nothing but noise, alone or beside one cause.
    pub(crate) fn leaves_nothing(&self, search: &Searcher<'_>) -> bool {
        let leaves_nothing = |state: &State| {
            let inflation = noise::inflation(&self.problem, &state.residual);
            structures(&self.problem, search.fitter.null, state, inflation).is_empty()
        };
        leaves_nothing(&self.state) || self.leaders.iter().any(|(_, fit)| leaves_nothing(&fit.state))
    }

    /// Whether two causes beside the instants leave nothing but noise.
    pub(crate) fn has_a_pair(&self, search: &Searcher<'_>) -> bool {
        let free = self.searcher(search);
        let pairs = self.pairs.get_or_init(|| free.pairs().to_vec());
        pairs.iter().any(|fit| free.structure(fit) == 0.0)
    }

    /// Whether too many of the instants end where they may go no further, beside whichever cause.
    pub(crate) fn ends_at_limits(&self) -> bool {
        let ends = |state: &State| instants::share_at_limits(&state.starts) > MOST_AT_LIMITS;
        let mut fits = self.leaders.iter().map(|(_, fit)| fit).chain(&self.set);
        ends(&self.state) && fits.all(|fit| ends(&fit.state))
    }
}

/// The problem with free instants, and where they fit best so far.
fn freed(search: &Searcher<'_>, singles: &[Fit]) -> Option<(Problem, State)> {
    let (problem, null) = (search.fitter.problem, search.fitter.null);
    let single = search.leading(singles);
    if single.as_ref().is_some_and(|fit| search.is_at_bound(fit)) {
        // a cause that ends where it may go no further is none, and imitates what instants do: they alone are as good if they leave nothing
        let inflation = noise::inflation(problem, &null.residual);
        let freed = instants::freed(problem, null, inflation);
        let leaves_nothing = |(freed, inside): &(Problem, State)| structures(freed, null, inside, inflation).is_empty();
        if let Some(found) = freed.filter(leaves_nothing) {
            return Some(found);
        }
    }
    let at = single.as_ref().map_or(null, |fit| &fit.state);
    let inflation = noise::inflation(problem, &at.residual);
    if let Some(needed) = instants::freed(problem, at, inflation) {
        return Some(needed);
    }
    let (freed, inside) = instants::freed(problem, null, inflation)?;
    // as good as the cause: then no cause is named
    let price = instants::PRICE * instants::count(&freed) as f64;
    let listed = |fit: &Fit| search.score(fit) - fit.state.chi2 + instants::chi2(&freed, &fit.state.residual);
    let is_as_good = single.is_none_or(|fit| inside.chi2 + price < listed(&fit) + TIE);
    is_as_good.then_some((freed, inside))
}
