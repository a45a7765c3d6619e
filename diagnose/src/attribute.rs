//! Which causes explain the discrepancy: one, then more by forward and backward steps, with everything that explains it
//! as well beside them.

use crate::basis::Basis;
use crate::causes::{Candidate, candidates};
use crate::clocks;
use crate::fit::{FINE, Fit, Fitter, ROUGH, State};
use crate::in_front;
use crate::inside::Inside;
use crate::instants;
use crate::level::threshold;
use crate::noise;
use crate::parallel;
use crate::problem::{Problem, dot};
use crate::progress::{Listener, Progress};
use crate::record::Record;
use crate::search::{Known, Searcher, gained};
use crate::shape::structures;
use crate::small;
use crate::unseen::is_there;

/// Evidence over its threshold where something is in the records that no cause makes: twice as many standard deviations.
pub const SURE: f64 = 4.0;

/// What was found.
#[derive(Debug, Clone)]
pub struct Attribution {
    /// The candidates.
    pub candidates: Vec<Candidate>,
    /// The model as given.
    pub null: State,
    /// Every cause alone.
    pub singles: Vec<Fit>,
    /// The leading explanation; nothing if none is needed.
    pub best: Option<Fit>,
    /// For each of its causes, what may stand in its place.
    pub rivals: Vec<Vec<Fit>>,
    /// Evidence of each of its causes: chi-square lost without it.
    pub evidence: Vec<f64>,
    /// Scatter over that of independent noise.
    pub inflation: f64,
    /// What the initial states explain.
    pub basis: Basis,
}

/// Finds the causes. `say` hears how far it is. Where load steps turn out to be inside a period, the problem that comes back has
/// their instants free.
#[must_use]
pub fn attribute(problem: Problem, null: State, say: Listener<'_>) -> (Problem, Attribution) {
    if crate::balance::broken(&problem).is_some() || small::is_disordered(&problem, &null) {
        // no cause mends them: a search would take its longest and find nothing
        return without_search(problem, null);
    }
    let candidates = sought(&problem);
    let basis = problem.basis(&null.model, &null.starts, &null.residual);
    let begun_at = problem.work.rows();
    let search = searcher(&problem, &candidates, &basis, &null, say);
    let singles = search.singles("each cause alone");
    problem.work.singles_are_done(begun_at);
    let (read, mut known) = (in_front::read(&search, &singles), search.known);
    let (problem, null, singles) = match read {
        Some(read) => {
            known = Known::default();
            read
        }
        None => (problem, null, singles),
    };
    let (problem, singles) = match clocks::refined(&searcher(&problem, &candidates, &basis, &null, say), &singles) {
        Some(read) => {
            known = Known::default();
            read
        }
        None => (problem, singles),
    };
    let search = Searcher {
        known,
        ..searcher(&problem, &candidates, &basis, &null, say)
    };
    // beside what no cause has come near to within the budget, instants help none
    let inside = (problem.work.goes_on())
        .then(|| Inside::needed(&search, &singles))
        .flatten();
    let Some(inside) = inside else {
        let found = search.grow(&singles);
        let attribution = completed(&search, singles, found);
        return (problem, attribution);
    };
    // two causes at once leave behind every load step what instants take up in part: where those do not do all of it, causes are first
    let is_alone = inside.leaves_nothing(&search);
    let listed = (!is_alone && (search.has_a_pair() || !inside.has_a_pair(&search))).then(|| search.grow(&singles));
    let Some(found) = listed else {
        return beside_instants(&search, singles, inside, (is_alone, None));
    };
    let left = found.0.as_ref().filter(|fit| leaves_structure(&search, fit));
    let beside = left.and_then(|fit| Inside::beside(&search, fit));
    let is_done = found.0.is_some() && left.is_none() || beside.is_none() && inside.ends_at_limits();
    if is_done {
        let attribution = completed(&search, singles, found);
        return (problem, attribution);
    }
    beside_instants(&search, singles, beside.unwrap_or(inside), (false, Some(found)))
}

/// Causes and their evidence.
type Found = (Option<Fit>, Vec<f64>);

/// The causes beside free instants, which leave nothing but noise alone or beside one if `is_alone`; `listed` are those that were found without.
fn beside_instants(
    search: &Searcher<'_>,
    singles: Vec<Fit>,
    mut inside: Inside,
    (is_alone, listed): (bool, Option<Found>),
) -> (Problem, Attribution) {
    (search.say)(Progress::Stage("load steps inside a period"));
    if listed.is_some() {
        inside.problem.work = inside.problem.work.of_part();
    }
    let pairs = std::mem::take(&mut inside.pairs);
    let free = Searcher {
        known: Known::with(pairs.into_inner()),
        ..inside.searcher(search)
    };
    let problem = || search.fitter.problem.clone();
    if free.is_out_of_reach(&inside.state, &|_| false) {
        // the instants take up a part of what no cause explains: beside them nothing is found either
        let leading = || search.leading(&singles).map(|fit| search.backward(fit));
        let found = listed.or_else(leading).unwrap_or((None, Vec::new()));
        let attribution = completed(search, singles, found);
        return (problem(), attribution);
    }
    // what takes two causes is not found by each alone
    let unmoved = |cause| free.fitter.unmoved(cause, 0.0);
    let mut free_singles = match is_alone {
        true => free.singles("load steps inside a period: each cause alone"),
        false => (0..singles.len()).map(unmoved).collect(),
    };
    for (place, fit) in &inside.leaders {
        if fit.state.chi2 < free_singles[*place].state.chi2 {
            free_singles[*place] = fit.clone();
        }
    }
    let begun: Vec<Fit> = free_singles.iter().chain(&inside.set).cloned().collect();
    let mut found = free.grow(&begun);
    if found.0.is_none() && !is_alone && search.fitter.problem.work.goes_on() {
        // what leads where the table has the steps may do nothing beside free ones, and another cause all
        free_singles = free.singles("load steps inside a period: each cause alone");
        found = free.grow(&free_singles);
    }
    // two causes together may have looked like instants, as long as one of them was missing; rivals take the longest, and are sought once
    let as_listed = found.0.as_ref().map(|best| search.refitted(best));
    match (as_listed, &found.0) {
        (Some(listed), Some(best))
            if instants::chi2(&inside.problem, &listed.state.residual)
                < best.state.chi2 + threshold(instants::count(&inside.problem), free.inflation(best)) =>
        {
            let attribution = completed(search, singles, search.backward(listed));
            (problem(), attribution)
        }
        _ => {
            // what may stand in the place of one cause was fitted where the steps are as the table has them
            if !is_alone && found.0.as_ref().is_some_and(|best| best.causes.len() == 1) {
                free_singles = free.singles("load steps inside a period: each cause alone");
            }
            let attribution = completed(&free, free_singles, found);
            drop(free);
            (inside.problem, attribution)
        }
    }
}

/// The model as given, of which it is known that no cause mends it.
#[must_use]
pub fn without_search(problem: Problem, null: State) -> (Problem, Attribution) {
    let candidates = sought(&problem);
    let basis = problem.basis(&null.model, &null.starts, &null.residual);
    let search = searcher(&problem, &candidates, &basis, &null, &|_| ());
    let unmoved = (0..candidates.len()).map(|cause| search.fitter.unmoved(cause, 0.0));
    let attribution = completed(&search, unmoved.collect(), (None, Vec::new()));
    (problem, attribution)
}

/// What settled points alone show of a winding.
const WARMS: &str = "inductor.heating";

/// The causes that may be: those that change nothing of what is certain, and no load or meter that no record has. Those could do nothing but
/// change the integration. Nor forms that settled points cannot tell from simpler ones.
fn sought(problem: &Problem) -> Vec<Candidate> {
    let mut list = candidates(&problem.base, &problem.bases);
    // a capture is a settled point that shows its period
    let shows = |record: &Record| !record.settled || record.capture.is_some();
    let has_a_course = problem.records.iter().any(shows);
    // a record over time is as warm at its end as where it began
    let has_points = problem
        .records
        .iter()
        .any(|record| record.settled && record.capture.is_none());
    list.retain(|candidate| {
        is_there(problem, candidate)
            && !candidate.changes(&problem.base.certain)
            && (has_a_course || !candidate.form.is_of_a_course)
            && (has_points || !candidate.changes(&[WARMS.to_owned()]))
    });
    let span = |record: &Record| {
        record
            .time
            .last()
            .zip(record.time.first())
            .map_or(0.0, |(to, from)| to - from)
    };
    let longest = problem
        .records
        .iter()
        .filter(|record| !record.settled)
        .map(span)
        .fold(0.0, f64::max);
    if longest > 0.0 && problem.base.plant.source.ripple == 0.0 {
        list.iter_mut().for_each(|candidate| candidate.turns_in(longest));
    }
    list
}

pub(crate) fn searcher<'a>(
    problem: &'a Problem,
    candidates: &'a [Candidate],
    basis: &'a Basis,
    null: &'a State,
    say: Listener<'a>,
) -> Searcher<'a> {
    Searcher {
        say,
        known: Known::default(),
        fitter: Fitter {
            problem,
            candidates,
            basis,
            null,
            effort: ROUGH,
        },
    }
}

/// Whether a fit leaves what noise does not.
fn leaves_structure(search: &Searcher<'_>, fit: &Fit) -> bool {
    let fitter = &search.fitter;
    !structures(fitter.problem, fitter.null, &fit.state, search.inflation(fit)).is_empty()
}

/// The causes that `search` has found, and the evidence of each, with all that goes with them.
fn completed(search: &Searcher<'_>, singles: Vec<Fit>, (best, evidence): (Option<Fit>, Vec<f64>)) -> Attribution {
    let (problem, null) = (search.fitter.problem, search.fitter.null);
    let inflation = match &best {
        Some(fit) => search.inflation(fit),
        None => noise::inflation(problem, &null.residual),
    };
    let rivals = match &best {
        // what leaves structure explains nothing, and nobody asks what would explain it as well
        Some(fit) if leaves_structure(search, fit) => vec![Vec::new(); fit.causes.len()],
        Some(fit) => search.rivals(fit, &evidence, &singles),
        None => Vec::new(),
    };
    Attribution {
        null: null.clone(),
        singles,
        best,
        rivals,
        evidence,
        inflation,
        basis: search.fitter.basis.clone(),
        candidates: search.fitter.candidates.to_vec(),
    }
}

impl Attribution {
    /// To fit more.
    #[must_use]
    pub fn fitter<'a>(&'a self, problem: &'a Problem) -> Fitter<'a> {
        Fitter {
            problem,
            candidates: &self.candidates,
            basis: &self.basis,
            null: &self.null,
            effort: FINE,
        }
    }

    /// Whether all candidates together explain too little of the records without the places of the residual that are `aside`.
    pub(crate) fn is_out_of_reach(&self, problem: &Problem, aside: &(dyn Fn(usize) -> bool + Sync)) -> bool {
        let search = searcher(problem, &self.candidates, &self.basis, &self.null, &|_| ());
        search.is_out_of_reach(self.state(), aside)
    }

    /// Where the best explanation ends, or the model as given.
    #[must_use]
    pub fn state(&self) -> &State {
        self.best.as_ref().map_or(&self.null, |fit| &fit.state)
    }

    /// Share of the error above the noise that the best explanation takes away, 1.
    #[must_use]
    pub fn removed(&self, problem: &Problem) -> f64 {
        let count = problem.count().max(1) as f64;
        let above = |state: &State| (state.chi2 / count - 1.0).max(0.0);
        let before = above(&self.null);
        if before > 0.0 {
            1.0 - (above(self.state()) / before).sqrt()
        } else {
            0.0
        }
    }

    /// Whether two candidates are forms of one cause.
    #[must_use]
    pub fn same(&self, one: usize, other: usize) -> bool {
        self.candidates[one].number == self.candidates[other].number
    }

    /// Id of a candidate.
    #[must_use]
    pub fn id(&self, cause: usize) -> &'static str {
        self.candidates[cause].cause.id
    }

    /// The size a cause must have to be seen beside the explanation found: for each candidate with a smooth first
    /// parameter, the change of it that would reach the threshold, in SI.
    #[must_use]
    pub fn smallest_sizes(&self, problem: &Problem) -> Vec<(usize, f64)> {
        let fitter = self.fitter(problem);
        let state = self.state();
        let own: Vec<Vec<f64>> = match &self.best {
            Some(fit) => fit.causes.iter().flat_map(|c| fitter.sensitivity(*c, state)).collect(),
            None => Vec::new(),
        };
        let all: Vec<usize> = (0..self.candidates.len()).collect();
        let sizes = parallel::map(&all, |cause| {
            let candidate = &self.candidates[*cause];
            // in any of its forms: what is named is seen
            let taken = self
                .best
                .as_ref()
                .is_some_and(|fit| fit.causes.iter().any(|own| self.same(*own, *cause)));
            // first order says something near the model's own value only
            if taken || !candidate.form.begins_at_own() {
                return None;
            }
            let column = fitter.sensitivity(*cause, state).into_iter().next()?;
            // what the causes found can imitate would not be seen
            let seen = dot(&column, &column) - if own.is_empty() { 0.0 } else { gained(&own, &column) };
            let needed = threshold(1, self.inflation);
            // chi-square grows with the square of the size
            Some((*cause, candidate.ranges[0][2] * (needed / seen.max(1e-12)).sqrt()))
        });
        sizes.into_iter().flatten().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::threshold;

    #[test]
    fn more_parameters_and_coloured_noise_need_more() {
        assert_eq!(threshold(1, 1.0), 16.0);
        assert_eq!(threshold(3, 1.0), 24.0);
        assert_eq!(threshold(2, 3.0), 60.0);
    }
}
