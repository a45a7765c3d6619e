//! What is seen at single observations, beside what is proven.

use policy::{Head, Interval};
use serde::Serialize;

use crate::Certifier;
use crate::form::Form;
use crate::network::Network;
use crate::part::Part;

/// Q values of an observation in the policy's numeric format, the duty of a continuous actor, or the gains of a gain schedule; of
/// several outputs what each has of these, one after the other. The interpreter's, so that this crate shares nothing with it.
pub type QValues<'a> = dyn Fn(&[f32]) -> Vec<f64> + 'a;

/// Differences seen at observations.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Measured {
    /// Observations looked at.
    pub observations: usize,
    /// Largest |Q in the format - real Q|, or |duty in the format - real duty|.
    pub largest_error: f64,
    /// Largest less smallest real Q value of one observation, the mean over all.
    pub mean_spread: f64,
    /// Observations whose greedy action in the format is not that of real arithmetic.
    pub changed_actions: usize,
    /// Largest real Q value less that of the action chosen in the format: what the worst change gives up.
    pub largest_loss: f64,
}

impl Certifier {
    /// Real Q values at an observation, each up to the rounding of binary64.
    #[must_use]
    pub fn real_q_values(&self, observation: &[f32]) -> Vec<Interval> {
        let real = self.real(observation);
        (0..real.len()).map(|action| real.bounds(action)).collect()
    }

    /// Greedy actions of the real network at an observation, up to ties: one for each output that makes a choice.
    pub(crate) fn real_actions(&self, observation: &[f32]) -> Vec<usize> {
        let centre = self.real(observation).centre;
        let choices = self.parts.iter().filter(|part| part.head.is_choice());
        choices.map(|part| argmax(&centre[part.columns.clone()])).collect()
    }

    fn real(&self, observation: &[f32]) -> Form {
        let mut x = Form::zeros(observation.len(), 0);
        // no symbols: one point, of which the form keeps the rounding of binary64 alone
        x.centre = observation.iter().map(|o| f64::from(*o)).collect();
        Network::real(&self.network, x)
    }

    /// Compares the format with real arithmetic at observations: what is seen of each output.
    #[must_use]
    pub fn measure<'a>(
        &self,
        observations: impl IntoIterator<Item = &'a [f32]>,
        q_values: &QValues<'_>,
    ) -> Vec<Measured> {
        let mut all = vec![Measured::default(); self.parts.len()];
        for observation in observations {
            let seen = self.look(observation, q_values);
            for ((measured, part), held) in all.iter_mut().zip(&self.parts).zip(&seen.held) {
                measured.add(part, &seen.real, held);
            }
        }
        all
    }

    /// Both networks at one observation.
    pub(crate) fn look(&self, observation: &[f32], q_values: &QValues<'_>) -> Seen {
        let mut answers = q_values(observation).into_iter();
        let held = self
            .parts
            .iter()
            .map(|part| answers.by_ref().take(part.answers()).collect());
        Seen {
            real: self.real(observation),
            held: held.collect(),
        }
    }
}

/// What both networks say at one observation.
pub(crate) struct Seen {
    pub real: Form,
    /// By output: [`QValues`].
    pub held: Vec<Vec<f64>>,
}

/// Error of the duty of a head without a choice, of real outputs and what the format makes of them; infinite if that is too
/// little. Of a gain schedule with the largest factors, for an observation does not say them.
fn duty_error(head: &Head, real: &[f64], held: &[f64]) -> Option<f64> {
    let whole = real.len() == held.len();
    let error = match head {
        // several outputs are parts, each with a head of its own
        Head::Choice(_) | Head::Residual(_) | Head::Several(_) => return None,
        _ if !whole => f64::INFINITY,
        Head::Continuous(head) => real
            .iter()
            .zip(held)
            .map(|(y, held)| (head.duty(*y) - held).abs())
            .sum(),
        Head::Schedule(head) => {
            let errors = head.gains.iter().zip(real.iter().zip(held));
            errors
                .map(|(gain, (y, held))| gain.largest_factor() * (gain.value(*y) - held).abs())
                .sum()
        }
    };
    Some(error)
}

impl Measured {
    /// Adds what is seen of one output at one observation; whether its action changes.
    pub(crate) fn add(&mut self, part: &Part, real: &Form, held: &[f64]) -> bool {
        let centre = &real.centre[part.columns.clone()];
        if let Some(error) = duty_error(&part.head, centre, held) {
            self.largest_error = self.largest_error.max(error);
            self.observations += 1;
            return false;
        }
        let errors = centre.iter().zip(held).map(|(real, held)| (real - held).abs());
        self.largest_error = errors.fold(self.largest_error, f64::max);
        let (low, high) = centre
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), q| {
                (low.min(*q), high.max(*q))
            });
        let before = self.observations as f64;
        self.mean_spread = (self.mean_spread * before + (high - low)) / (before + 1.0);
        self.observations += 1;
        // what was given up is counted in real Q: the format's own values would flatter it
        let chosen = argmax(held);
        let given_up = high - centre.get(chosen).copied().unwrap_or(high);
        self.largest_loss = self.largest_loss.max(given_up);
        // real arithmetic must prefer another action by more than binary64 can err
        let first = part.columns.start;
        let mut others = part.columns.clone().filter(|other| *other != first + chosen);
        let is_changed =
            chosen < centre.len() && others.any(|other| real.difference(None, other, first + chosen).low > 0.0);
        self.changed_actions += usize::from(is_changed);
        is_changed
    }
}

/// Lowest index among the largest values.
fn argmax(q_values: &[f64]) -> usize {
    let largest = q_values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    q_values.iter().position(|q| *q == largest).unwrap_or_default()
}
