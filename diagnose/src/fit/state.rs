//! Initial states beside a model: where each record begins so that it fits best.

use crate::basis::{Basis, Moving};
use crate::drive::Model;
use crate::problem::{Problem, Starts, dot};

/// A step that gains less than this ends the settling of initial states: a five-hundredth of what
/// decides a tie (9).
const SMALL_GAIN: f64 = 0.02;

/// A place in the space of models with the initial states that fit best.
#[derive(Debug, Clone)]
pub struct State {
    /// The model.
    pub model: Model,
    /// Initial states.
    pub starts: Starts,
    /// Measured minus simulated over noise.
    pub residual: Vec<f64>,
    /// Sum of its squares.
    pub chi2: f64,
    /// What simulating it took, in rows.
    pub(crate) rows: u64,
}

impl State {
    /// The model with the initial states fitted.
    #[must_use]
    pub fn settle(problem: &Problem, model: &Model, starts: &Starts, basis: Option<&Basis>) -> Self {
        Self::settle_in(problem, model, starts, basis, 4)
    }

    /// The same in at most `rounds` steps.
    pub(super) fn settle_in(
        problem: &Problem,
        model: &Model,
        starts: &Starts,
        basis: Option<&Basis>,
        rounds: usize,
    ) -> Self {
        let mut state = Self::at(problem, model, starts.clone());
        for _ in 0..rounds {
            let own;
            let basis = match basis {
                Some(basis) => basis,
                None => {
                    own = problem.basis(model, &state.starts, &state.residual);
                    &own
                }
            };
            let (next, _) = state.absorbing(problem, model, basis, &state.residual, true);
            let Some(next) = next else { break };
            let gain = state.chi2 - next.chi2;
            state = next;
            if gain < SMALL_GAIN {
                break;
            }
        }
        state
    }

    /// A step of the initial states to where they explain most of `left`, with what it took in rows; none where it costs. They are linear only near
    /// themselves: a record in which the whole step costs takes the one without the current and, where the model `stays`, none.
    pub(super) fn absorbing(
        &self,
        problem: &Problem,
        model: &Model,
        basis: &Basis,
        left: &[f64],
        stays: bool,
    ) -> (Option<State>, u64) {
        let mut rows = 0;
        let mut nearest = stays.then(|| self.clone());
        for moving in Moving::EACH {
            let mut starts = self.starts.clone();
            basis.absorb(left, &mut starts, moving);
            let next = Self::at(problem, model, starts);
            rows += next.rows;
            let costs = stays && problem.is_worse_in_some(&next, self);
            if next.chi2 < self.chi2 && !costs {
                return (Some(next), rows);
            }
            let (mixed, taken) = match nearest {
                // the trim acts in all records, and is that of the better one
                Some(known) if known.chi2 < next.chi2 => problem.nearer_of_each(known, &next),
                Some(known) => problem.nearer_of_each(next, &known),
                None => (next, 0),
            };
            nearest = Some(mixed);
            rows += taken;
        }
        (nearest.filter(|state| state.chi2 < self.chi2), rows)
    }

    pub(crate) fn at(problem: &Problem, model: &Model, starts: Starts) -> Self {
        let (residual, rows) = problem.residual_counted(model, &starts);
        State {
            model: model.clone(),
            rows,
            chi2: dot(&residual, &residual),
            starts,
            residual,
        }
    }
}
