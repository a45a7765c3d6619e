//! What is seen at single observations, beside what is proven.

use policy::{Head, Interval};
use serde::Serialize;

use crate::Certifier;
use crate::form::Form;
use crate::network::Network;

/// Q values of an observation in the policy's numeric format, the duty of a continuous actor, or the gains of a gain schedule; the interpreter's, so that this crate shares nothing with it.
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

    /// Greedy action of the real network at an observation, up to ties.
    pub(crate) fn real_action(&self, observation: &[f32]) -> usize {
        argmax(&self.real(observation).centre)
    }

    fn real(&self, observation: &[f32]) -> Form {
        let mut x = Form::zeros(observation.len(), 0);
        // no symbols: one point, of which the form keeps the rounding of binary64 alone
        x.centre = observation.iter().map(|o| f64::from(*o)).collect();
        Network::real(&self.network, x)
    }

    /// Compares the format with real arithmetic at observations.
    #[must_use]
    pub fn measure<'a>(&self, observations: impl IntoIterator<Item = &'a [f32]>, q_values: &QValues<'_>) -> Measured {
        let mut measured = Measured::default();
        for observation in observations {
            self.add(&mut measured, observation, q_values);
        }
        measured
    }

    /// Error of the duty of a head without a choice, of real outputs and what the format makes of them; infinite if that is too
    /// little. Of a gain schedule with the largest factors, for an observation does not say them.
    fn duty_error(&self, real: &[f64], held: &[f64]) -> Option<f64> {
        let whole = real.len() == held.len();
        let error = match &self.head {
            // contracts with several outputs are refused when they are read
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

    /// Adds one observation; whether its action changes.
    pub(crate) fn add(&self, measured: &mut Measured, observation: &[f32], q_values: &QValues<'_>) -> bool {
        let real = self.real(observation);
        let held = q_values(observation);
        if let Some(error) = self.duty_error(&real.centre, &held) {
            measured.largest_error = measured.largest_error.max(error);
            measured.observations += 1;
            return false;
        }
        let errors = real.centre.iter().zip(&held).map(|(real, held)| (real - held).abs());
        measured.largest_error = errors.fold(measured.largest_error, f64::max);
        let (low, high) = real
            .centre
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), q| {
                (low.min(*q), high.max(*q))
            });
        let before = measured.observations as f64;
        measured.mean_spread = (measured.mean_spread * before + (high - low)) / (before + 1.0);
        measured.observations += 1;
        // what was given up is counted in real Q: the format's own values would flatter it
        let chosen = argmax(&held);
        measured.largest_loss = measured
            .largest_loss
            .max(high - real.centre.get(chosen).copied().unwrap_or(high));
        // real arithmetic must prefer another action by more than binary64 can err
        let is_changed = (0..real.len()).any(|other| other != chosen && real.difference(None, other, chosen).low > 0.0);
        measured.changed_actions += usize::from(is_changed);
        is_changed
    }
}

/// Lowest index among the largest values.
fn argmax(q_values: &[f64]) -> usize {
    let largest = q_values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    q_values.iter().position(|q| *q == largest).unwrap_or_default()
}
