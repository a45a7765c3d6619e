//! Which causes explain the discrepancy: one, then more by forward and backward steps, with everything that explains it
//! as well beside them.

use crate::causes::{Candidate, Search, candidates};
use crate::fit::{Fit, Fitter, State, solve};
use crate::noise;
use crate::parallel;
use crate::problem::{Basis, Problem, dot};
use crate::spectrum;

/// Gain in chi-square that one parameter must bring. For 45 independent candidates and normal noise a false alarm in 0.3 %
/// of records by the chi-square law; not yet measured on a large set.
pub const THRESHOLD: f64 = 16.0;
/// For each further parameter.
const PER_PARAMETER: f64 = 4.0;
/// A second cause must bring at least this share of what the first one brought.
const LEAST_SHARE: f64 = 0.004;
/// An explanation within this of the best is as good, in chi-square ...
const TIE: f64 = 9.0;
/// ... or within this share of what the cause explains: two simulators agree no better.
const TIE_SHARE: f64 = 0.005;
/// A candidate is fitted if it explains this share of the most that one explains, and this much, both at first order.
const FOLLOWED: f64 = 0.2;
const LEAST_FOLLOWED: f64 = 6.0;
/// Most causes named.
const MOST: usize = 3;
/// Candidates that are fitted after a linear look at all.
const LOOKED_AT: usize = 5;

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

/// The gain that `parameters` more parameters must bring.
#[must_use]
pub fn threshold(parameters: usize, inflation: f64) -> f64 {
    (THRESHOLD + PER_PARAMETER * (parameters.max(1) - 1) as f64) * inflation
}

/// Finds the causes. `say` hears how far it is.
#[must_use]
pub fn attribute(problem: &Problem, null: State, say: &(dyn Fn(&str) + Sync)) -> Attribution {
    let candidates = candidates(&problem.base.plant, &problem.bases);
    let basis = problem.basis(&null.model, &null.starts, &null.residual);
    let fitter = Fitter {
        problem,
        candidates: &candidates,
        basis: &basis,
        null: &null,
    };
    let search = Searcher::new(fitter);
    say("each cause alone");
    let all: Vec<usize> = (0..candidates.len()).collect();
    let singles = search.singles(&all);
    let inflation = singles.iter().min_by(|a, b| a.state.chi2.total_cmp(&b.state.chi2));
    let inflation = inflation.map_or(1.0, |fit| noise::inflation(problem, &fit.state.residual));
    let search = Searcher { inflation, ..search };
    let (best, evidence) = search.grow(&singles, say);
    say("rivals");
    let rivals = best
        .as_ref()
        .map_or_else(Vec::new, |fit| search.rivals(fit, &evidence, &singles));
    Attribution {
        null: null.clone(),
        singles,
        best,
        rivals,
        evidence,
        inflation,
        basis: basis.clone(),
        candidates: candidates.clone(),
    }
}

struct Searcher<'a> {
    fitter: Fitter<'a>,
    /// Sensitivities of all candidates at the model as given.
    at_null: Vec<Vec<Vec<f64>>>,
    inflation: f64,
}

impl<'a> Searcher<'a> {
    fn new(fitter: Fitter<'a>) -> Self {
        let all: Vec<usize> = (0..fitter.candidates.len()).collect();
        let at_null = parallel::map(&all, |cause| fitter.sensitivity(*cause, fitter.null));
        Searcher {
            fitter,
            at_null,
            inflation: 1.0,
        }
    }

    /// Every candidate alone. Those that explain next to nothing at first order are not followed further.
    fn singles(&self, all: &[usize]) -> Vec<Fit> {
        let null = self.fitter.null;
        let first_order: Vec<f64> = self
            .at_null
            .iter()
            .map(|columns| gained(columns, &null.residual))
            .collect();
        let most = first_order.iter().copied().fold(0.0, f64::max);
        parallel::map(all, |cause| {
            let smooth = self.fitter.candidates[*cause].cause.search == Search::Own;
            let follow = first_order[*cause] > (FOLLOWED * most).max(LEAST_FOLLOWED);
            if smooth && !follow {
                return self.fitter.unmoved(*cause, first_order[*cause]);
            }
            self.added(&[], &[], *cause, null)
        })
    }

    fn parameters(&self, causes: &[usize]) -> usize {
        self.fitter.places(causes).len()
    }

    /// Chi-square with a price for each parameter.
    fn score(&self, fit: &Fit) -> f64 {
        let price = libm::log(self.fitter.problem.count() as f64);
        fit.state.chi2 + self.inflation * price * fit.values.len() as f64
    }

    /// `causes` and `cause`, fitted from `values`, and from where `cause` alone starts.
    fn added(&self, causes: &[usize], values: &[f64], cause: usize, from: &State) -> Fit {
        let alone = match self.fitter.candidates[cause].cause.id {
            "input_ripple" => self.ripple(cause, from),
            _ => self.fitter.single(cause, from),
        };
        if causes.is_empty() {
            return alone;
        }
        let set = [causes, &[cause]].concat();
        let start = [values, &alone.values].concat();
        self.fitter.from(&set, &start, &alone.state)
    }

    /// A line harmonic starts from the strongest line of the residual.
    fn ripple(&self, cause: usize, from: &State) -> Fit {
        let line = spectrum::strongest_line(self.fitter.problem, &from.residual, 3)
            .or_else(|| spectrum::strongest_line(self.fitter.problem, &from.residual, 0));
        let start = line.map_or([0.0, 100.0, 0.0], |line| [line.amplitude, line.frequency, line.phase]);
        self.fitter.from(&[cause], &start, from)
    }

    /// Forward: the cause that helps most, as long as one helps; backward: without each that no longer helps, and with
    /// each replaced by a better one.
    fn grow(&self, singles: &[Fit], say: &(dyn Fn(&str) + Sync)) -> (Option<Fit>, Vec<f64>) {
        let null = self.fitter.null;
        let Some(first) = singles.iter().min_by(|a, b| self.score(a).total_cmp(&self.score(b))) else {
            return (None, Vec::new());
        };
        let gain = null.chi2 - first.state.chi2;
        if gain < threshold(first.values.len(), self.inflation) {
            return (None, vec![]);
        }
        let mut best = first.clone();
        while best.causes.len() < MOST {
            say("combinations");
            let Some(next) = self.forward(&best) else { break };
            let next = self.swapped(next);
            let (added, before) = (next.values.len() as i64 - best.values.len() as i64, best.state.chi2);
            let gain = before - next.state.chi2;
            let least = LEAST_SHARE * (null.chi2 - next.state.chi2);
            let needed = threshold(usize::try_from(added).unwrap_or(1), self.inflation).max(least);
            if gain < needed {
                break;
            }
            best = next;
        }
        self.backward(best)
    }

    fn forward(&self, best: &Fit) -> Option<Fit> {
        let own: Vec<Vec<f64>> = best
            .causes
            .iter()
            .flat_map(|c| self.fitter.sensitivity(*c, &best.state))
            .collect();
        let others = self.others(&best.causes);
        let looks = parallel::map(&others, |cause| {
            let candidate = &self.fitter.candidates[*cause];
            if candidate.cause.search != Search::Own {
                return (best.state.chi2 - self.fitter.look(*cause, &best.state), *cause);
            }
            let mut columns = own.clone();
            columns.extend(self.fitter.sensitivity(*cause, &best.state));
            (gained(&columns, &best.state.residual), *cause)
        });
        let fits = parallel::map(&top(looks, LOOKED_AT), |cause| {
            self.added(&best.causes, &best.values, *cause, &best.state)
        });
        fits.into_iter().min_by(|a, b| self.score(a).total_cmp(&self.score(b)))
    }

    /// Candidates of other ids.
    fn others(&self, causes: &[usize]) -> Vec<usize> {
        let id = |c: &usize| self.fitter.candidates[*c].cause.id;
        let all = 0..self.fitter.candidates.len();
        all.filter(|c| causes.iter().all(|known| id(known) != id(c))).collect()
    }

    /// The set with one cause replaced, if that is clearly better.
    fn swapped(&self, fit: Fit) -> Fit {
        let mut best = fit;
        for member in 0..best.causes.len() {
            for other in self.replacements(&best, member, 3) {
                if self.score(&other) < self.score(&best) - 2.0 * self.inflation {
                    best = other;
                    break;
                }
            }
        }
        best
    }

    /// Fits of the set with other causes in the place of one: those that look best linearly.
    fn replacements(&self, fit: &Fit, member: usize, count: usize) -> Vec<Fit> {
        let kept: Vec<usize> = fit
            .causes
            .iter()
            .enumerate()
            .filter(|(n, _)| *n != member)
            .map(|(_, c)| *c)
            .collect();
        let columns: Vec<Vec<f64>> = kept.iter().flat_map(|c| self.at_null[*c].clone()).collect();
        let looks = self
            .others(&fit.causes)
            .into_iter()
            .map(|cause| {
                let mut columns = columns.clone();
                columns.extend(self.at_null[cause].clone());
                (gained(&columns, &self.fitter.null.residual), cause)
            })
            .collect();
        let values = self.values_of(fit, &kept);
        parallel::map(&top(looks, count), |cause| {
            let start = self.fitter.from(&kept, &values, self.fitter.null);
            self.added(&kept, &start.values, *cause, &start.state)
        })
    }

    fn values_of(&self, fit: &Fit, kept: &[usize]) -> Vec<f64> {
        let places = self.fitter.places(&fit.causes);
        let of = |(place, value): (&(usize, usize), &f64)| kept.contains(&place.0).then_some(*value);
        places.iter().zip(&fit.values).filter_map(of).collect()
    }

    /// Drops what is not needed; the evidence of what is.
    fn backward(&self, fit: Fit) -> (Option<Fit>, Vec<f64>) {
        let mut best = fit;
        loop {
            let members: Vec<usize> = (0..best.causes.len()).collect();
            let without: Vec<Option<Fit>> = parallel::map(&members, |member| {
                let kept: Vec<usize> = best
                    .causes
                    .iter()
                    .enumerate()
                    .filter(|(n, _)| n != member)
                    .map(|(_, c)| *c)
                    .collect();
                let values = self.values_of(&best, &kept);
                (!kept.is_empty()).then(|| self.fitter.from(&kept, &values, self.fitter.null))
            });
            let chi2 = |fit: &Option<Fit>| fit.as_ref().map_or(self.fitter.null.chi2, |fit| fit.state.chi2);
            let evidence: Vec<f64> = without.iter().map(|fit| chi2(fit) - best.state.chi2).collect();
            let weakest = members.iter().min_by(|a, b| evidence[**a].total_cmp(&evidence[**b]));
            let Some(weakest) = weakest.copied() else {
                return (None, Vec::new());
            };
            let needed = threshold(self.parameters(&best.causes[weakest..=weakest]), self.inflation);
            match (&without[weakest], evidence[weakest] < needed) {
                (Some(fewer), true) => best = fewer.clone(),
                _ => return (Some(best), evidence),
            }
        }
    }

    /// For each cause of a set, what explains the data as well in its place.
    fn rivals(&self, best: &Fit, evidence: &[f64], singles: &[Fit]) -> Vec<Vec<Fit>> {
        let id = |c: &usize| self.fitter.candidates[*c].cause.id;
        let members = best.causes.iter().enumerate();
        members
            .map(|(member, own)| {
                let tolerance = (TIE * self.inflation).max(TIE_SHARE * evidence[member]);
                let all: Vec<Fit> = match best.causes.len() {
                    1 => singles.to_vec(),
                    _ => self.replacements(best, member, 8),
                };
                let is_rival = |fit: &Fit| {
                    let other = fit.causes.last().is_some_and(|c| id(c) != id(own));
                    other && fit.state.chi2 <= best.state.chi2 + tolerance
                };
                let mut list: Vec<Fit> = all.into_iter().filter(is_rival).collect();
                list.sort_by(|a, b| a.state.chi2.total_cmp(&b.state.chi2));
                let mut seen = Vec::new();
                list.retain(|fit| {
                    let name = fit.causes.last().map(id);
                    let new = !seen.contains(&name);
                    seen.push(name);
                    new
                });
                list
            })
            .collect()
    }
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

impl Attribution {
    /// To fit more.
    #[must_use]
    pub fn fitter<'a>(&'a self, problem: &'a Problem) -> Fitter<'a> {
        Fitter {
            problem,
            candidates: &self.candidates,
            basis: &self.basis,
            null: &self.null,
        }
    }

    /// Where the best explanation ends, or the model as given.
    #[must_use]
    pub fn state(&self) -> &State {
        self.best.as_ref().map_or(&self.null, |fit| &fit.state)
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
            let taken = self.best.as_ref().is_some_and(|fit| fit.causes.contains(cause));
            if taken || candidate.cause.search != Search::Own {
                return None;
            }
            let column = fitter.sensitivity(*cause, state).into_iter().next()?;
            let seen = dot(&column, &column) - if own.is_empty() { 0.0 } else { gained(&own, &column) };
            let needed = threshold(1, self.inflation);
            Some((*cause, candidate.ranges[0][2] * (needed / seen.max(1e-12)).sqrt()))
        });
        sizes.into_iter().flatten().collect()
    }
}
