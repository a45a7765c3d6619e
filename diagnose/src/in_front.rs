//! A `v_in` that was measured in front of what the source has, by its own meter: it stands still while the converter's input drops.
//!
//! ```text
//! in    records whose v_in the model as given explains, of a source without impedance, and whose other channels no single cause explains
//! look  the forms of a source's impedance once more, v_in being the source's own voltage
//! out   the problem read so, where one of them leaves far less than any cause did
//! ```
//!
//! Invariant: nothing is read so that a cause explains with `v_in` at the converter's input, where it is taken to be measured.

use plant::Parameters;

use crate::attribute::searcher;
use crate::causes::Candidate;
use crate::fit::{Fit, Fitter, State};
use crate::noise;
use crate::problem::Problem;
use crate::progress::Progress;
use crate::record::{CHANNEL_NAMES, V_IN};
use crate::search::Searcher;
use crate::shape::structures;

/// The cause whose forms are fitted.
const CAUSE: &str = "source_impedance";

/// The other reading has to leave this share of the error above the noise that the best cause leaves, in squares: half of its size. What a resistance
/// at another place of the loop does is left by neither. A convention.
const LEFT: f64 = 0.25;

/// Said where the records are read so.
pub const SAID: &str = "v_in stands still where the converter's input would drop: it is taken to be measured in front of the source's resistance, at the \
                        supply. A plant file's simulation shows v_in at the converter's input";

/// The problem and the model as given with the other reading, and the single causes there, if it is needed.
pub(crate) fn read(search: &Searcher<'_>, singles: &[Fit]) -> Option<(Problem, State, Vec<Fit>)> {
    let Fitter {
        problem,
        candidates,
        basis,
        null,
        ..
    } = search.fitter;
    if !may_be(problem, null, candidates) {
        return None;
    }
    let best = singles.iter().min_by(|a, b| a.state.chi2.total_cmp(&b.state.chi2))?;
    if left(search, best).is_empty() {
        return None;
    }
    let count = problem.count() as f64;
    let is_far_below = |chi2: f64| chi2 - count < LEFT * (best.state.chi2 - count);
    // what two causes leave as little of is theirs
    if search.pairs().iter().any(|fit| is_far_below(fit.state.chi2)) {
        return None;
    }
    (search.say)(Progress::Stage("a source behind where v_in is measured"));
    let mut problem = problem.clone();
    let mut null = null.clone();
    (problem.base.v_in_in_front, null.model.v_in_in_front) = (true, true);
    let places: Vec<usize> = (0..candidates.len())
        .filter(|n| candidates[*n].cause.id == CAUSE)
        .collect();
    let forms: Vec<Candidate> = places.iter().map(|n| candidates[*n].clone()).collect();
    let fits = searcher(&problem, &forms, basis, &null, search.say).singles("a source behind where v_in is measured");
    let least = fits.iter().map(|fit| fit.state.chi2).fold(f64::INFINITY, f64::min);
    if !is_far_below(least) {
        return None;
    }
    let mut singles = singles.to_vec();
    for (place, mut fit) in places.into_iter().zip(fits) {
        fit.causes = vec![place];
        singles[place] = fit;
    }
    Some((problem, null, singles))
}

/// Whether a source has no impedance in the model, and `v_in` shows nothing else.
fn may_be(problem: &Problem, null: &State, candidates: &[Candidate]) -> bool {
    let of = |p: &Parameters| [p.source.resistance, p.source.inductance, p.source.c_in];
    let is_measured = problem.sigma[V_IN].is_finite();
    let is_plain = of(&null.model.plant) == [0.0; 3];
    let is_sought = candidates.iter().any(|candidate| candidate.cause.id == CAUSE);
    let has_captures = problem.records.iter().any(|record| record.capture.is_some());
    !problem.base.v_in_in_front && is_measured && is_plain && is_sought && !has_captures && {
        let inflation = noise::inflation(problem, &null.residual);
        let left = structures(problem, null, null, inflation);
        !left.is_empty() && left.iter().all(|one| one.channel != CHANNEL_NAMES[V_IN])
    }
}

/// What a single cause leaves.
fn left(search: &Searcher<'_>, fit: &Fit) -> Vec<crate::shape::Structure> {
    let fitter = &search.fitter;
    structures(fitter.problem, fitter.null, &fit.state, search.inflation(fit))
}
