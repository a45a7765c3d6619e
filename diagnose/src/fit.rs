//! Damped least squares (Levenberg-Marquardt) of a few parameters on the switched model, initial states beside them.
//!
//! ```text
//! in    causes, first values, a state: model, initial states, residual over noise
//! step  J: change of the signals for a step of each parameter, less what initial states explain
//!       (J'J + damping) step = J' residual, then the initial states take up the rest
//! out   values, state, covariance
//! ```
//!
//! Invariant: values stay within their ranges, and chi-square only falls.

use crate::basis::Basis;
use crate::causes::{Candidate, Search};
use crate::drive::Model;
use crate::normal::Normal;
use crate::problem::{Problem, Starts, axpy, nudged};
use crate::search::sought;
use crate::work::Work;

mod state;

pub use state::State;

/// A fit that leaves more than this mean square in a record is looked at again with the initial states that it has by now, ...
// what leaves less has no structure left (`shape`), and most fits need no second look
const STILL_OFF: f64 = 1.5;
/// ... if these gain a twentieth: less is no frequency that has run away.
const RUN_AWAY: f64 = 0.95;
/// So is one whose last step of those that it may take still gains so much, what decides a tie, ...
const UNFINISHED: f64 = 9.0;
/// ... and this share of what it leaves: with what initial states explain at the model as given, steps of a supply 4 % higher left five sixths of the
/// way each time, 5 % of what was left at the end, ...
const UNFINISHED_SHARE: f64 = 0.01;
/// ... where it comes within twice the noise. A convention: what ends farther off leads nowhere in most cases, and another look is a fit.
const WITHIN: f64 = 4.0;

/// When a fit ends.
#[derive(Debug, Clone, Copy)]
pub struct Effort {
    /// Most steps.
    steps: usize,
    /// A step that gains less than this is the last.
    small_gain: f64,
}

/// To rank terms of which the best is then fitted as [`ROUGH`].
pub(crate) const QUICK: Effort = Effort {
    steps: 3,
    small_gain: 0.5,
};
/// To see whether a cause can come near: Gauss and Newton's steps bring a fit within some percent of its end, or lead nowhere.
const FIRST: Effort = Effort {
    steps: 4,
    small_gain: 0.5,
};
/// To compare: a gain of 0.5 is far below what decides anything (16 to name, 9 to tie).
pub const ROUGH: Effort = Effort {
    steps: 8,
    small_gain: 0.5,
};
/// To report: intervals end where chi-square has grown by 3.84, and 0.02 of that is half a percent.
pub const FINE: Effort = Effort {
    steps: 20,
    small_gain: 0.02,
};

/// A fitted set of causes.
#[derive(Debug, Clone)]
pub struct Fit {
    /// Indices of the candidates.
    pub causes: Vec<usize>,
    /// Values of all their parameters, in order.
    pub values: Vec<f64>,
    /// Where it ended.
    pub state: State,
    /// Covariance of the parameters for the noise assumed.
    pub covariance: Vec<Vec<f64>>,
}

/// All that a fit needs.
#[derive(Debug, Clone, Copy)]
pub struct Fitter<'a> {
    /// Records and noise.
    pub problem: &'a Problem,
    /// All candidates.
    pub candidates: &'a [Candidate],
    /// What initial states explain.
    pub basis: &'a Basis,
    /// The model without causes.
    pub null: &'a State,
    /// When fits end.
    pub effort: Effort,
}

/// A knob of a set: candidate and place in it.
pub type Place = (usize, usize);

impl Fitter<'_> {
    /// The parameters of a set of causes.
    #[must_use]
    pub fn places(&self, causes: &[usize]) -> Vec<Place> {
        let of = |c: &usize| (0..self.candidates[*c].own.len()).map(|k| (*c, k)).collect::<Vec<_>>();
        causes.iter().flat_map(of).collect()
    }

    /// Lowest and highest value and step of a parameter.
    #[must_use]
    pub fn range(&self, place: Place) -> [f64; 3] {
        self.candidates[place.0].ranges[place.1]
    }

    fn set(&self, model: &mut Model, place: Place, value: f64) {
        self.candidates[place.0].form.knobs[place.1].set(model, value);
    }

    /// Whether a parameter is varied continuously.
    #[must_use]
    pub fn is_smooth(&self, place: Place) -> bool {
        self.candidates[place.0].form.is_smooth() || place.1 > 0
    }

    /// Where the fit of a candidate may begin.
    #[must_use]
    pub fn starts(&self, cause: usize) -> Vec<Vec<f64>> {
        let candidate = &self.candidates[cause];
        match candidate.form.search {
            Search::Own => vec![candidate.own.clone()],
            Search::OwnOr(list) => [vec![candidate.own.clone()], candidate.in_steps(list)].concat(),
            Search::From(list) => candidate.in_steps(list),
            // read off the residual by the search
            Search::Line | Search::Counter(_) | Search::Swing => Vec::new(),
            Search::Knee => sought::knees(self.problem),
            Search::Scan(list) => list.iter().map(|n| vec![n * candidate.ranges[0][2]]).collect(),
        }
    }

    /// The candidate at the model's own values, as far as nothing speaks for more; it would gain `first_order`.
    #[must_use]
    pub fn unmoved(&self, cause: usize, first_order: f64) -> Fit {
        let values = self.candidates[cause].own.clone();
        let mut state = self.null.clone();
        // not simulated: only to be ranked among those that were fitted
        state.chi2 -= first_order.max(0.0);
        Fit {
            causes: vec![cause],
            covariance: vec![vec![0.0; values.len()]; values.len()],
            values,
            state,
        }
    }

    /// The model with these values, initial states fitted in `rounds`.
    pub(crate) fn state_at(&self, causes: &[usize], values: &[f64], from: &State, rounds: usize) -> (State, Vec<f64>) {
        let mut model = from.model.clone();
        let mut values = values.to_vec();
        for (place, value) in self.places(causes).iter().zip(&mut values) {
            let [low, high, _] = self.range(*place);
            *value = value.clamp(low, high);
            self.set(&mut model, *place, *value);
        }
        let state = State::settle_in(self.problem, &model, &from.starts, Some(self.basis), rounds);
        (state, values)
    }

    /// Fits a set from given values.
    #[must_use]
    pub fn from(&self, causes: &[usize], values: &[f64], from: &State) -> Fit {
        self.holding(causes, values, from, None)
    }

    /// [`Fitter::from`] with one parameter held at its value.
    #[must_use]
    pub fn holding(&self, causes: &[usize], values: &[f64], from: &State, held: Option<usize>) -> Fit {
        let mut rows = 0;
        let (fit, is_over) = self.in_basis(causes, values, from, held, &mut rows);
        if is_over && !self.problem.leaves_more(&fit.state.residual, STILL_OFF) {
            return fit;
        }
        // initial states ring as the filter does: where the fit has moved its frequency, what they explain is something else by now
        let State {
            model,
            starts,
            residual,
            chi2,
            ..
        } = &fit.state;
        let own = self.problem.basis(model, starts, residual);
        let settle = |starts: &Starts| State::settle_in(self.problem, model, starts, Some(&own), 2);
        // those of the model as given may be too far off for a step from there, or where the current rests and nothing shows the way: the records' own
        // beginnings are another place
        let begun = Starts {
            states: self.problem.first_starts(model).states,
            ..starts.clone()
        };
        let (settled, _) = self.problem.nearer_of_each(settle(starts), &settle(&begun));
        if is_over && settled.chi2 > RUN_AWAY * chi2 {
            return fit;
        }
        let there = Fitter { basis: &own, ..*self };
        let (again, _) = there.in_basis(causes, &fit.values, &settled, held, &mut rows);
        if again.state.chi2 < fit.state.chi2 { again } else { fit }
    }

    /// The first steps of a fit, without the second look of [`Fitter::holding`].
    pub(crate) fn first_steps(&self, causes: &[usize], values: &[f64], from: &State) -> Fit {
        let fitter = Fitter { effort: FIRST, ..*self };
        fitter.in_basis(causes, values, from, None, &mut 0).0
    }

    /// A fit with what initial states explain at the model as given, and whether it has come to its end; `rows` grows by what it takes.
    fn in_basis(
        &self,
        causes: &[usize],
        values: &[f64],
        from: &State,
        held: Option<usize>,
        rows: &mut u64,
    ) -> (Fit, bool) {
        let places = self.places(causes);
        let (mut state, mut values) = self.state_at(causes, values, from, 2);
        let smooth: Vec<usize> = (0..places.len())
            .filter(|n| held != Some(*n) && self.is_smooth(places[*n]))
            .collect();
        let mut covariance = vec![vec![0.0; places.len()]; places.len()];
        // a convention, as Marquardt's factor of ten in `improve`
        let (mut damping, mut last_gain) = (1e-3, 0.0);
        for _ in 0..self.effort.steps {
            if smooth.is_empty() || Work::is_fit_over(*rows, self.null.rows) {
                break;
            }
            let round = self.round(&places, &smooth, &state);
            *rows += round.jacobian.rows;
            // before the step: a fit that cannot improve has a covariance all the same
            round.normal.covariance(&smooth, &round.jacobian.scale, &mut covariance);
            last_gain = 0.0;
            let Some((next, moved)) = self.improve(&round, &values, &state, &mut damping, rows) else {
                break;
            };
            let gain = state.chi2 - next.chi2;
            (state, values) = (next, moved);
            last_gain = gain;
            // relative as well: of a chi-square in the millions a gain of 1 decides nothing
            if gain < self.effort.small_gain.max(1e-6 * state.chi2) {
                break;
            }
        }
        let is_far = state.chi2 > WITHIN * self.problem.count() as f64;
        let is_over = is_far || last_gain < UNFINISHED.max(UNFINISHED_SHARE * state.chi2);
        let fit = Fit {
            causes: causes.to_vec(),
            values,
            state,
            covariance,
        };
        (fit, is_over)
    }

    /// Sensitivities and normal equations at a state.
    fn round<'r>(&self, places: &'r [Place], smooth: &'r [usize], state: &State) -> Round<'r> {
        let jacobian = self.jacobian(places, smooth, state);
        Round {
            places,
            smooth,
            normal: Normal::new(&jacobian.projected, &state.residual),
            jacobian,
        }
    }

    /// Change of the simulated signals for a step of each smooth parameter, raw and without what initial states explain.
    fn jacobian(&self, places: &[Place], smooth: &[usize], state: &State) -> Jacobian {
        let mut jacobian = Jacobian::default();
        for n in smooth {
            let (candidate, knob) = places[*n];
            let knob = &self.candidates[candidate].form.knobs[knob];
            let range = self.range(places[*n]);
            let (moved, step) = nudged(&state.model, knob, &range);
            // a cable without a capacitor, or a step behind the end: where nothing can be simulated, nothing is learnt
            let (after, rows) = match Work::may_simulate(&moved, &self.problem.base) {
                true => self.problem.residual_counted(&moved, &state.starts),
                false => (state.residual.clone(), 0),
            };
            jacobian.rows += rows;
            let share = range[2] / step;
            let raw: Vec<f64> = state
                .residual
                .iter()
                .zip(&after)
                .map(|(a, b)| (a - b) * share)
                .collect();
            let mut projected = raw.clone();
            self.basis.project(&mut projected);
            // both: the step is found without what initial states explain, and they then take up the whole change
            jacobian.raw.push(raw);
            jacobian.projected.push(projected);
            jacobian.scale.push(range[2]);
        }
        jacobian
    }

    /// The next state and values, if a step leads to less chi-square; `damping` follows, and `rows` grow by what it takes.
    fn improve(
        &self,
        round: &Round<'_>,
        values: &[f64],
        state: &State,
        damping: &mut f64,
        rows: &mut u64,
    ) -> Option<(State, Vec<f64>)> {
        // each try damps ten times more: what does not descend with a step of 1e-5 does not descend
        for _ in 0..5 {
            let mut model = state.model.clone();
            let mut left = state.residual.clone();
            let moved = self.stepped(round, values, *damping);
            for (k, n) in round.smooth.iter().enumerate() {
                let place = round.places[*n];
                axpy(
                    &mut left,
                    -(moved[*n] - values[*n]) / self.range(place)[2],
                    &round.jacobian.raw[k],
                );
                self.set(&mut model, place, moved[*n]);
            }
            if !Work::may_simulate(&model, &self.problem.base) {
                *damping *= 10.0;
                continue;
            }
            let (next, taken) = state.absorbing(self.problem, &model, self.basis, &left, false);
            *rows += taken;
            if let Some(next) = next {
                // below that a step is Gauss and Newton's anyway, and damping would only take longer to come back
                *damping = (*damping * 0.1).max(1e-9);
                return Some((next, moved));
            }
            *damping *= 10.0;
        }
        None
    }

    /// Values behind a step. A parameter that would leave its range stays at the end of it, and the others take the step that is best then:
    /// the one that they take beside it outside of the range leads nowhere where two of them do nearly the same.
    fn stepped(&self, round: &Round<'_>, values: &[f64], damping: f64) -> Vec<f64> {
        let mut moved = values.to_vec();
        let mut ends: Vec<Option<f64>> = vec![None; round.smooth.len()];
        // each pass holds one more, so there are no more passes than parameters
        for _ in 0..=round.smooth.len() {
            let step = round.normal.step_beside(damping, &ends);
            let mut new = None;
            for (k, n) in round.smooth.iter().enumerate() {
                let [low, high, unit] = self.range(round.places[*n]);
                let aim = values[*n] + step[k] * unit;
                moved[*n] = aim.clamp(low, high);
                let beyond = (aim - moved[*n]).abs() / unit;
                if ends[k].is_none() && beyond > new.map_or(0.0, |(most, _)| most) {
                    new = Some((beyond, k));
                }
            }
            let Some((_, k)) = new else { break };
            let n = round.smooth[k];
            ends[k] = Some((moved[n] - values[n]) / self.range(round.places[n])[2]);
        }
        moved
    }

    /// Sensitivities of all smooth parameters at `state`, projected, in units of their steps.
    #[must_use]
    pub fn sensitivity(&self, cause: usize, state: &State) -> Vec<Vec<f64>> {
        let places = self.places(&[cause]);
        let smooth: Vec<usize> = (0..places.len()).filter(|n| self.is_smooth(places[*n])).collect();
        self.jacobian(&places, &smooth, state).projected
    }
}

/// What a step of the fit is made of.
struct Round<'a> {
    places: &'a [Place],
    /// Which of them move.
    smooth: &'a [usize],
    jacobian: Jacobian,
    normal: Normal,
}

#[derive(Default)]
struct Jacobian {
    raw: Vec<Vec<f64>>,
    projected: Vec<Vec<f64>>,
    scale: Vec<f64>,
    /// What the simulations took, in rows.
    rows: u64,
}
