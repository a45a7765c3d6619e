//! Which terms, and what they are worth where they were not fitted.
//!
//! ```text
//! worth a set of terms fitted without a fold, and judged in it; every fold once
//! path  one term after the other: of those that gain most in the fit to all rows the one that is worth most
//! prune from the shortest length that is about as good as the best, terms without which it stays so
//! ```
//!
//! Rows that are left out choose the length and what is pruned, and all rows rank the sets: the error that is told is too good by that
//! choice. Only held-out records, which come later, have seen none of it.
//!
//! All of it is free run: from the first row of a record to the last the model sees duties and loads, and no measurement.

use crate::causes::Candidate;
use crate::drive::Model;
use crate::fit::{Fit, Fitter, QUICK, ROUGH, State};
use crate::noise;
use crate::parallel;
use crate::problem::Problem;
use crate::record::CHANNELS;

/// Most coefficients: few enough to be looked through. A convention; with the real record of one converter the left-out error stands
/// from the third to the seventh.
pub const MOST_TERMS: usize = 7;
/// Terms of those that gain most in the fit that are judged by what is left out, for each place of the path.
const TRIED: usize = 4;
/// Parts that are left out, each once; a record alone is cut into as many.
const FOLDS: usize = 5;
/// A longer path has to lower the left-out error by this share: the folds are few, and their error scatters by more.
const ABOUT: f64 = 0.03;
/// Rows of records, as (record, first, behind the last).
pub type Fold = Vec<(usize, usize, usize)>;

/// What is left out: whole records where there are three, else stretches of them.
pub fn folds(problem: &Problem) -> Vec<Fold> {
    let records = &problem.records;
    if records.len() >= 3 {
        let count = FOLDS.min(records.len());
        let of = |fold: usize| (0..records.len()).filter(move |n| n % count == fold);
        return (0..count)
            .map(|fold| of(fold).map(|n| (n, 0, records[n].rows())).collect())
            .collect();
    }
    let parts = FOLDS.div_ceil(records.len().max(1));
    let cut = |(n, rows): (usize, usize)| (0..parts).map(move |k| vec![(n, k * rows / parts, (k + 1) * rows / parts)]);
    let rows = records.iter().map(crate::record::Record::rows);
    rows.enumerate().flat_map(cut).collect()
}

/// A length of the path.
#[derive(Debug, Clone)]
pub struct Chosen {
    /// Fitted to all rows.
    pub fit: Fit,
    /// Left-out error over the noise, root mean square.
    pub error: f64,
    /// The same of each channel; 0 where nothing was measured.
    pub channels: [f64; CHANNELS],
}

/// Sums of squares over the noise in `fold`, by channel, and how many values.
fn left_in(problem: &Problem, state: &State, fold: &Fold) -> [(f64, f64); CHANNELS] {
    std::array::from_fn(|n| {
        let mut sum = (0.0, 0.0);
        for (record, from, to) in fold {
            for value in &noise::channel(problem, &state.residual, *record, n)[*from..*to] {
                sum.0 += value * value;
                sum.1 += f64::from(u8::from(*value != 0.0));
            }
        }
        sum
    })
}

fn errors(sums: &[[(f64, f64); CHANNELS]]) -> (f64, [f64; CHANNELS]) {
    let mean = |list: &mut dyn Iterator<Item = (f64, f64)>| {
        let (square, count) = list.fold((0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1));
        (square / f64::max(count, 1.0)).sqrt()
    };
    (
        mean(&mut sums.iter().flatten().copied()),
        std::array::from_fn(|n| mean(&mut sums.iter().map(|fold| fold[n]))),
    )
}

/// The error of `state` in all folds, as [`Chosen`] counts it.
pub fn without(problem: &Problem, state: &State, folds: &[Fold]) -> (f64, [f64; CHANNELS]) {
    let sums: Vec<_> = folds.iter().map(|fold| left_in(problem, state, fold)).collect();
    errors(&sums)
}

/// A part of the records with what initial states explain there.
struct Rest {
    problem: Problem,
    null: State,
    basis: crate::basis::Basis,
}

impl Rest {
    fn of(problem: &Problem, null: &State, fold: &Fold) -> Self {
        let mut problem = problem.clone();
        for (record, from, to) in fold {
            for channel in &mut problem.masked[*record] {
                channel[*from..*to].fill(true);
            }
        }
        let null = State::at(&problem, &null.model, null.starts.clone());
        Rest {
            basis: problem.basis(&null.model, &null.starts, &null.residual),
            null,
            problem,
        }
    }

    fn fitter<'a>(&'a self, candidates: &'a [Candidate]) -> Fitter<'a> {
        Fitter {
            problem: &self.problem,
            candidates,
            basis: &self.basis,
            null: &self.null,
            effort: ROUGH,
        }
    }
}

fn extended(fitter: &Fitter<'_>, from: &Fit, term: usize) -> Fit {
    let causes: Vec<usize> = from.causes.iter().copied().chain([term]).collect();
    let values: Vec<f64> = from.values.iter().copied().chain([0.0]).collect();
    fitter.from(&causes, &values, &from.state)
}

/// The best length of the path, if any term can be fitted.
pub fn chosen(problem: &Problem, null: &State, candidates: &[Candidate], folds: &[Fold]) -> Option<Chosen> {
    let whole = Rest::of(problem, null, &Fold::new());
    let fitter = whole.fitter(candidates);
    let rests = parallel::map(folds, |fold| Rest::of(problem, null, fold));
    let mut fit = Fit {
        causes: Vec::new(),
        values: Vec::new(),
        state: whole.null.clone(),
        covariance: Vec::new(),
    };
    let worth = |fit: &Fit| {
        let places: Vec<usize> = (0..folds.len()).collect();
        let sums = parallel::map(&places, |n| {
            let own = rests[*n]
                .fitter(candidates)
                .from(&fit.causes, &fit.values, &rests[*n].null);
            left_in(problem, &judged(problem, &own.state.model, null), &folds[*n])
        });
        let (error, channels) = errors(&sums);
        Chosen {
            fit: fit.clone(),
            error,
            channels,
        }
    };
    let mut path: Vec<Chosen> = Vec::new();
    let begun_at = problem.work.rows();
    while fit.causes.len() < MOST_TERMS && problem.work.may_add_a_term(begun_at) {
        // all of them are fitted: at first order a product of two signals hides behind what the fit already holds
        let terms: Vec<usize> = (0..candidates.len()).filter(|n| !fit.causes.contains(n)).collect();
        let quick = Fitter {
            effort: QUICK,
            ..fitter
        };
        let tried = parallel::map(&terms, |term| extended(&quick, &fit, *term));
        let mut ranked: Vec<Fit> = tried
            .into_iter()
            .filter(|next| next.state.chi2 < fit.state.chi2)
            .collect();
        ranked.sort_by(|a, b| a.state.chi2.total_cmp(&b.state.chi2));
        ranked.truncate(TRIED);
        let judged = ranked
            .iter()
            .map(|next| worth(&fitter.from(&next.causes, &next.values, &next.state)));
        let Some(next) = judged.min_by(|a, b| a.error.total_cmp(&b.error)) else {
            break;
        };
        fit = next.fit.clone();
        path.push(next);
        if gains_no_more(&path) {
            break;
        }
    }
    let best = path.iter().map(|one| one.error).fold(f64::INFINITY, f64::min);
    let enough = (1.0 + ABOUT) * best;
    let mut chosen = path.into_iter().find(|one| one.error <= enough)?;
    while chosen.fit.causes.len() > 1 {
        // what came first may not be needed beside what came later: out goes what stands least above its standard deviation
        let (mut causes, mut values) = (chosen.fit.causes.clone(), chosen.fit.values.clone());
        let certainty = |n: usize| values[n] * values[n] / chosen.fit.covariance[n][n].max(f64::MIN_POSITIVE);
        let least = (0..values.len()).min_by(|a, b| certainty(*a).total_cmp(&certainty(*b)));
        let Some(out) = least else { break };
        causes.remove(out);
        values.remove(out);
        let one = worth(&fitter.from(&causes, &values, &whole.null));
        if one.error > enough {
            break;
        }
        chosen = one;
    }
    Some(chosen)
}

/// Whether the last two terms have not lowered the left-out error by what a longer path has to: a third that needs both of them beside it is not waited
/// for.
fn gains_no_more(path: &[Chosen]) -> bool {
    let least = |some: &[Chosen]| some.iter().map(|one| one.error).fold(f64::INFINITY, f64::min);
    let before = path.len().saturating_sub(2);
    before > 0 && least(&path[before..]) > (1.0 - ABOUT) * least(&path[..before])
}

/// All rows at `model`; the initial states are those that fit it best, two numbers a record, and nothing else has seen the rows left out.
fn judged(problem: &Problem, model: &Model, null: &State) -> State {
    State::settle(problem, model, &null.starts, None)
}
