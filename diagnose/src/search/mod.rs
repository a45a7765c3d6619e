//! The search for a set of causes: forward with several leaders, exchange, backward, and what would do as well.

mod edges;
mod fewer;
mod forms;
mod pairs;
mod replaced;
mod singles;
pub(crate) mod sought;
mod spoilt;
mod starts;
mod valleys;
mod weigh;

pub(crate) use spoilt::WithoutChannel;
pub(crate) use starts::Known;

use crate::causes::Search;
use crate::doubts;
use crate::fit::{FINE, Fit, Fitter, State};
use crate::level::{ACCURACY, threshold};
use crate::noise;
use crate::normal::solve;
use crate::parallel;
use crate::problem::dot;
use crate::progress::{self, Listener};
use crate::small;

/// An explanation within this of the best is as good, in chi-square: three standard deviations of one parameter ...
pub(crate) const TIE: f64 = 9.0;
/// ... or within this share of what the cause explains: twice the accuracy, squared.
pub(crate) const TIE_SHARE: f64 = 4.0 * ACCURACY * ACCURACY;
/// What is this many times as far off may come within it when its fit is brought to an end. Rough fits stop at a gain of 0.5 a
/// step; the factor trades time for a rival that a rough fit leaves far off. A convention.
const NEAR: f64 = 5.0;
/// A candidate is fitted if it explains this share of the most that one explains, and this much, both at first order. Conventions
/// that trade time for candidates that grow with nonlinearity: 6 is less than half of what a cause must gain in the end
/// ([`crate::level::THRESHOLD`]).
const FOLLOWED: f64 = 0.2;
const LEAST_FOLLOWED: f64 = 6.0;
/// A cause gives way to another that is better by this, in chi-square with the price of parameters. Above the 0.5 at which a rough
/// fit stops, so that two fits of one optimum never change places for ever; below any tie. A convention.
const SWAP: f64 = 2.0;
/// Starts of one cause that are followed. What looks best at first order is not always where the fit ends best, and each more
/// costs a fit. A convention.
const BEGUN: usize = 2;
/// Candidates that are fitted after a linear look at all. A convention: each costs a fit.
const LOOKED_AT: usize = 5;
/// Further sets that are tried as the start of a larger one, and candidates that are fitted beside each. Conventions: they bound
/// the time of the search, six fits beside the leader's five.
const LEADERS: usize = 2;
const LOOKED_AT_BY_LEADERS: usize = 3;

/// Share of what a fit at its limits explains that one within them has to explain to be followed in its place. A convention: what is true
/// explains about as much as what imitates it.
const MOST_OF_FIRST: f64 = 0.7;

/// Candidates that are tried in the place of a cause, to find a better one. A convention: each costs a fit.
const MOST_EXCHANGED: usize = 3;

/// Fits between two looks at the budget: two cores have work, and a fit with a cable takes seconds. A convention, whatever the cores: what is
/// found must not hang on them.
const AT_ONCE: usize = 2;

/// Looks between two looks at the budget. A look at a counter, of which many steps are tried, costs as much as a fit. A convention.
const LOOKS_AT_ONCE: usize = 8;

/// Chi-squares nearer than this are the same: half of what ends the settling of initial states.
pub(crate) const ALIKE: f64 = 0.01;

/// Fits sets of causes.
pub(crate) struct Searcher<'a> {
    /// Fits one set.
    pub fitter: Fitter<'a>,
    /// Hears how far it is.
    pub say: Listener<'a>,
    /// What its looks share.
    pub known: Known,
}

/// A fitted set, and the sensitivities of its parameters where it ends.
struct Set<'a> {
    causes: &'a [usize],
    values: &'a [f64],
    columns: &'a [Vec<f64>],
}

impl<'a> Set<'a> {
    const NONE: Set<'static> = Set {
        causes: &[],
        values: &[],
        columns: &[],
    };

    fn of(fit: &'a Fit, columns: &'a [Vec<f64>]) -> Self {
        Set {
            causes: &fit.causes,
            values: &fit.values,
            columns,
        }
    }
}

impl Searcher<'_> {
    fn id(&self, cause: usize) -> &'static str {
        self.fitter.candidates[cause].cause.id
    }

    fn search(&self, cause: usize) -> Search {
        self.fitter.candidates[cause].form.search
    }

    /// Whether the fit begins at the model's own value.
    fn begins_at_own(&self, cause: usize) -> bool {
        self.fitter.candidates[cause].form.begins_at_own()
    }

    /// Whether two candidates are forms of one cause.
    fn same(&self, one: usize, other: usize) -> bool {
        self.number(one) == self.number(other)
    }

    fn number(&self, cause: usize) -> usize {
        self.fitter.candidates[cause].number
    }

    fn names(&self, fit: &Fit) -> String {
        let names: Vec<&str> = fit.causes.iter().map(|cause| self.id(*cause)).collect();
        names.join(" + ")
    }

    /// Chi-square with a price for each parameter, to the digits that mean something: of two that do the same the one that comes first in the list leads.
    pub fn score(&self, fit: &Fit) -> f64 {
        let price = libm::log(self.fitter.problem.count() as f64);
        let score = fit.state.chi2 + price * fit.values.len() as f64;
        (score / ALIKE).round() * ALIKE
    }

    /// Scatter over that of independent noise, where a fit ends.
    pub fn inflation(&self, fit: &Fit) -> f64 {
        noise::inflation(self.fitter.problem, &fit.state.residual)
    }

    fn sort(&self, fits: &mut [Fit]) {
        fits.sort_by(|a, b| self.score(a).total_cmp(&self.score(b)));
    }

    /// Brings to the front of sorted fits the best that does not end where it may go no further, if it explains most of what the first explains of
    /// `before`: one that does is no explanation, however much it imitates, and what it is followed by imitates as well.
    fn most_tenable_first(&self, fits: &mut [Fit], before: f64) {
        let Some(most) = fits.first().map(|fit| before - fit.state.chi2) else {
            return;
        };
        let is_tenable = |fit: &Fit| !self.is_at_bound(fit) && before - fit.state.chi2 > MOST_OF_FIRST * most;
        if let Some(place) = fits.iter().position(is_tenable) {
            fits[..=place].rotate_right(1);
        }
    }

    /// Whether a cause of a set ends where it may go no further. The curve of a part may: of another law than the plant's it is the nearest.
    pub(crate) fn is_at_bound(&self, fit: &Fit) -> bool {
        let is_at = |cause: &usize| {
            let candidate = &self.fitter.candidates[*cause];
            !candidate.is_curve() && doubts::is_at_bound(candidate, &self.values_of(fit, &[*cause]))
        };
        fit.causes.iter().any(is_at)
    }

    /// `set` and `cause`, fitted from where it begins best.
    fn added(&self, set: &Set<'_>, cause: usize, from: &State) -> Fit {
        let causes = [set.causes, &[cause]].concat();
        // what looks best at first order is not always where the fit ends best
        let begins = self.begins(set, cause, from).into_iter().take(BEGUN);
        let from_own = begins.map(|(_, start)| self.fitter.from(&causes, &[set.values, &start].concat(), from));
        let edges = self.in_place_of_edges(cause, from).into_iter();
        let instead = edges.map(|(start, from)| self.fitter.from(&causes, &[set.values, &start].concat(), &from));
        let fits = from_own.chain(instead);
        let best = fits.min_by(|a, b| a.state.chi2.total_cmp(&b.state.chi2));
        best.unwrap_or_else(|| self.fitter.unmoved(cause, 0.0))
    }

    /// Forward: the cause that helps most, as long as one helps; where structure is left, from several leaders; backward:
    /// without each that no longer helps, and where structure is left with each replaced by a better one.
    pub fn grow(&self, singles: &[Fit]) -> (Option<Fit>, Vec<f64>) {
        let null = self.fitter.null;
        let most = small::most_parameters(self.fitter.problem);
        let mut leaders = singles.to_vec();
        leaders.retain(|fit| fit.values.len() <= most);
        self.sort(&mut leaders);
        self.most_tenable_first(&mut leaders, null.chi2);
        let is_enough = |fit: &&Fit| {
            null.chi2 - fit.state.chi2 >= threshold(fit.values.len(), self.inflation(fit))
                || self.stands_for_edges(null, fit)
        };
        let Some(first) = leaders
            .first()
            .filter(is_enough)
            .or_else(|| leaders.iter().find(is_enough))
        else {
            return (None, Vec::new());
        };
        let mut best = self.polished(first);
        let mut before = null.chi2;
        self.fitter.problem.work.leaves(self.share_left(&best));
        // one cause explains all but a channel: sets of two are tried in all, and no larger ones
        let mut is_spoilt = false;
        while best.causes.len() < self.fitter.problem.work.most_causes()
            && !is_spoilt
            && best.values.len() < most
            && !self.is_hopeless(&best, before)
            && self.fitter.problem.work.goes_on()
            && !self.is_out_of_reach(&best.state, &|_| false)
        {
            let mut larger = self.larger(&best, &leaders);
            if best.causes.len() == 1 && larger.iter().all(|fit| self.structure(fit) > 0.0) {
                let beside = self.beside_a_channel(&best, singles);
                is_spoilt = beside.is_some();
                larger.extend(beside.into_iter().flatten());
            }
            larger.extend(self.with_edges(&best));
            larger.retain(|fit| fit.values.len() <= most);
            self.sort(&mut larger);
            self.most_tenable_first(&mut larger, best.state.chi2);
            // a diode takes a share of the duty, too: edges are named for what the trim does where nothing else is worth a cause
            let of_edges = || larger.iter().find(|fit| self.stands_for_edges(&best.state, fit));
            let first = larger.first().filter(|fit| self.is_worth(&best, fit));
            let Some(next) = first.or_else(of_edges) else { break };
            before = best.state.chi2;
            best = self.polished(next);
            // where the edges have to do more than they can, it is another cause as well
            if !is_spoilt && self.structure(&best) > 0.0 || self.asks_for_edges(&best.state) {
                best = self.reformed(self.swapped(best));
            }
            self.fitter.problem.work.leaves(self.share_left(&best));
            leaders = larger;
        }
        best = self.without_edges(best);
        if !is_spoilt && !self.is_hopeless(&best, before) {
            best = self.reformed(best);
        }
        self.as_alone(self.backward(best), singles)
    }

    /// Sets that have a cause more than `best`, or than the `leaders` behind it.
    fn larger(&self, best: &Fit, leaders: &[Fit]) -> Vec<Fit> {
        let stage = format!("more than {}", self.names(best));
        let mut larger = match best.causes.len() {
            1 if self.structure(best) > 0.0 => self.pairs().to_vec(),
            _ => Vec::new(),
        };
        let is_found = !larger.is_empty() && self.has_a_pair();
        larger.extend(self.forward(best, LOOKED_AT, &stage));
        // two causes that resemble each other are best found from the one that explains less alone
        if !is_found && (self.structure(best) > 0.0 || larger.iter().any(|fit| self.is_worth(best, fit))) {
            for leader in self.distinct(leaders).into_iter().skip(1).take(LEADERS) {
                if !self.fitter.problem.work.goes_on() {
                    break;
                }
                let stage = format!("{} and another", self.names(leader));
                larger.extend(self.forward(leader, LOOKED_AT_BY_LEADERS, &stage));
            }
        }
        larger
    }

    /// The single cause that explains most for its parameters, brought to its end; nothing if none is worth it.
    pub fn leading(&self, singles: &[Fit]) -> Option<Fit> {
        let mut order = singles.to_vec();
        self.sort(&mut order);
        self.most_tenable_first(&mut order, self.fitter.null.chi2);
        let first = order.first()?;
        let gain = self.fitter.null.chi2 - first.state.chi2;
        (gain >= threshold(first.values.len(), self.inflation(first))).then(|| self.polished(first))
    }

    /// Places of the `count` single causes that explain most for their parameters.
    pub fn leaders(&self, singles: &[Fit], count: usize) -> Vec<usize> {
        let mut places: Vec<usize> = (0..singles.len()).collect();
        places.sort_by(|a, b| self.score(&singles[*a]).total_cmp(&self.score(&singles[*b])));
        places.truncate(count);
        places
    }

    /// A set that was found in another problem of the same records, fitted in this.
    pub fn refitted(&self, fit: &Fit) -> Fit {
        self.polished(&self.fitter.from(&fit.causes, &fit.values, self.fitter.null))
    }

    /// The fit brought to its end.
    pub(super) fn polished(&self, fit: &Fit) -> Fit {
        let fitter = Fitter {
            effort: FINE,
            ..self.fitter
        };
        let mut fine = fitter.from(&fit.causes, &fit.values, &fit.state);
        // initial states and instants by what they do here: what they did in the model as given leaves kicks where its filter rings otherwise
        fine.state = State::settle(self.fitter.problem, &fine.state.model, &fine.state.starts, None);
        let is_step = |place: &(usize, usize)| self.fitter.candidates[place.0].form.cut().is_some();
        match fitter.places(&fit.causes).iter().position(is_step) {
            Some(place) => self.counted(fine, place),
            None => fine,
        }
    }

    /// The first fit of each set of causes, whatever their forms.
    fn distinct<'f>(&self, fits: &'f [Fit]) -> Vec<&'f Fit> {
        let mut seen = Vec::new();
        let is_new = |fit: &&Fit| {
            let mut numbers: Vec<usize> = fit.causes.iter().map(|cause| self.number(*cause)).collect();
            numbers.sort_unstable();
            let new = !seen.contains(&numbers);
            seen.push(numbers);
            new
        };
        fits.iter().filter(is_new).collect()
    }

    /// Sets that are one cause larger: those of the candidates that look best at first order.
    fn forward(&self, best: &Fit, count: usize, stage: &str) -> Vec<Fit> {
        let columns = self.sensitivities(&best.causes, &best.state);
        let set = Set::of(best, &columns);
        let mut looks = Vec::new();
        for some in self.others(&best.causes).chunks(LOOKS_AT_ONCE) {
            if !looks.is_empty() && !self.fitter.problem.work.goes_on() {
                break;
            }
            looks.extend(self.looks(&set, some, &best.state));
        }
        // a nonlinear fit may gain three times what it promises at first order; less is not worth a fit
        let least = 0.3 * threshold(1, 1.0);
        let looks = looks.into_iter().filter(|(gain, _)| *gain > least).collect();
        let mut fits = Vec::new();
        for (done, some) in top(looks, count).chunks(AT_ONCE).enumerate() {
            if done > 0 && !self.fitter.problem.work.goes_on() {
                break;
            }
            fits.extend(progress::map(self.say, stage, some, |cause| {
                self.added(&set, *cause, &best.state)
            }));
        }
        fits
    }

    fn sensitivities(&self, causes: &[usize], state: &State) -> Vec<Vec<f64>> {
        causes
            .iter()
            .flat_map(|cause| self.fitter.sensitivity(*cause, state))
            .collect()
    }

    /// What each of `causes` would gain beside a set, at first order.
    fn looks(&self, set: &Set<'_>, causes: &[usize], state: &State) -> Vec<(f64, usize)> {
        parallel::map(causes, |cause| {
            let expected = self
                .begins(set, *cause, state)
                .first()
                .map_or(f64::INFINITY, |look| look.0);
            (state.chi2 - expected, *cause)
        })
    }

    /// Candidates of other causes. Beside others both switches are almost the winding, and would only take a place that another cause needs.
    fn others(&self, causes: &[usize]) -> Vec<usize> {
        let is_other = |c: &usize| {
            let is_new = causes.iter().all(|known| !self.same(*known, *c));
            is_new && !self.fitter.candidates[*c].is_in_proportion()
        };
        (0..self.fitter.candidates.len()).filter(is_other).collect()
    }

    /// The set with one cause replaced, if that is clearly better.
    fn swapped(&self, fit: Fit) -> Fit {
        let mut best = fit;
        for member in 0..best.causes.len() {
            if !self.fitter.problem.work.goes_on() {
                break;
            }
            let stage = format!("another cause for {}", self.id(best.causes[member]));
            for other in self.replacements(&best, member, |looks| top(looks, MOST_EXCHANGED), (&stage, None)) {
                if self.score(&other) < self.score(&best) - SWAP {
                    best = self.polished(&other);
                    break;
                }
            }
        }
        best
    }

    /// Whether one of the causes of a set does nothing where it ends: the set is the smaller one without it.
    fn has_nothing(&self, fit: &Fit) -> bool {
        let is_nothing = |cause: &usize| self.fitter.candidates[*cause].is_nothing(&self.values_of(fit, &[*cause]));
        fit.causes.iter().any(is_nothing)
    }

    fn values_of(&self, fit: &Fit, kept: &[usize]) -> Vec<f64> {
        let places = self.fitter.places(&fit.causes);
        let of = |(place, value): (&(usize, usize), &f64)| kept.contains(&place.0).then_some(*value);
        places.iter().zip(&fit.values).filter_map(of).collect()
    }
}

fn without(causes: &[usize], member: usize) -> Vec<usize> {
    let mut kept = causes.to_vec();
    kept.remove(member);
    kept
}

/// What columns explain of a residual, linearly.
pub(crate) fn gained(columns: &[Vec<f64>], residual: &[f64]) -> f64 {
    let right: Vec<f64> = columns.iter().map(|column| dot(column, residual)).collect();
    let matrix: Vec<Vec<f64>> = columns
        .iter()
        .enumerate()
        .map(|(n, a)| {
            let row = columns.iter().enumerate();
            row.map(|(m, b)| dot(a, b) * if n == m { 1.0 + 1e-9 } else { 1.0 })
                .collect()
        })
        .collect();
    dot(&solve(&matrix, &right), &right)
}

fn top(mut looks: Vec<(f64, usize)>, count: usize) -> Vec<usize> {
    looks.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    looks.into_iter().take(count).map(|(_, cause)| cause).collect()
}

#[cfg(test)]
mod tests {
    use super::{gained, top, without};

    #[test]
    fn columns_gain_what_lies_in_their_span() {
        let columns = [vec![1.0, 0.0, 0.0], vec![1.0, 1.0, 0.0]];
        assert!((gained(&columns, &[1.0, 2.0, 3.0]) - 5.0).abs() < 1e-6);
        assert!((gained(&columns[..1], &[1.0, 2.0, 3.0]) - 1.0).abs() < 1e-6);
        assert_eq!(gained(&[], &[1.0, 2.0, 3.0]), 0.0);
    }

    #[test]
    fn the_best_looks_come_first_and_a_member_is_taken_out() {
        assert_eq!(top(vec![(1.0, 4), (3.0, 7), (3.0, 5), (2.0, 6)], 3), [5, 7, 6]);
        assert_eq!(without(&[4, 5, 6], 1), [4, 6]);
    }
}
