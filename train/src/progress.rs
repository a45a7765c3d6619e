//! What a training says of itself: its looks, its best policy, how it ended.

use std::fmt;

use serde::Serialize;

use crate::network::Network;
use crate::score::Score;

/// How a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Ended {
    /// The selection scenarios meet the specification.
    Met,
    /// All control periods of the budget are used.
    Budget,
    /// The flag was raised; the training can go on from its checkpoint.
    Interrupted,
}

impl fmt::Display for Ended {
    /// What a seed does: `has used its budget`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Ended::Met => "meets the specification",
            Ended::Budget => "has used its budget",
            Ended::Interrupted => "is interrupted",
        })
    }
}

/// What a training says at every look.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// Seed of the training.
    pub seed: u64,
    /// The row of the learning curve.
    pub look: Look,
    /// Best cost so far, of the networks whose cost is known.
    pub best: f64,
    /// Control periods of the budget.
    pub steps: u64,
    /// Since the start or the resumption, s.
    pub elapsed: f64,
    /// Until the budget is used, s.
    pub remaining: f64,
}

impl fmt::Display for Progress {
    /// Reward, error and how far the best policy is from the specification.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Look { reward, error, .. } = self.look;
        write!(f, "reward {reward:7.2}  |e| {error:6.3} V  best cost ")?;
        match self.best.is_finite() {
            true => write!(f, "{:.3}", self.best),
            false => f.write_str("-"),
        }
    }
}

/// A row of the learning curve: what happened since the row before.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Look {
    /// Control periods so far.
    pub step: u64,
    /// Mean reward per control period.
    pub reward: f64,
    /// Mean |e|, V.
    pub error: f64,
    /// Mean loss per update.
    pub loss: f64,
    /// Probability of a random action now.
    pub epsilon: f64,
    /// Cost on the selection scenarios ([`Score`]); a lower bound where it does not beat the best, and of a look that has just been
    /// where it may beat it.
    pub cost: f64,
}

/// The policy that did best on the selection scenarios.
#[derive(Debug, Clone, PartialEq)]
pub struct Best {
    /// Control periods after which it was found.
    pub step: u64,
    /// Of the two networks of its look the second.
    pub second: bool,
    /// How well it did.
    pub score: Score,
    /// Its network.
    pub network: Network,
}

/// Sums since the last look.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Sums {
    pub periods: u64,
    pub updates: u64,
    pub reward: f64,
    pub error: f64,
    pub loss: f64,
}
