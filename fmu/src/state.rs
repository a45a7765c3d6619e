//! What changes from period to period, as data: a copy repeats it in an instance of its own, a checkpoint holds it.

use plant::{Parameters, Signals, Surroundings};
use serde::{Deserialize, Serialize};

/// What an instance was told, in order.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) enum Order {
    /// An input, by its place among the inputs, was set.
    Set(u8, f64),
    /// The initialisation ended.
    Start,
    /// It went on from this time for this long, s.
    Step(f64, f64),
}

/// A run from its start.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct State {
    pub parameters: Parameters,
    /// Output voltage in V and inductor current in A that were asked for.
    pub initial: [f64; 2],
    pub surroundings: Surroundings,
    /// Source voltage that was set last, V.
    pub v_in: f64,
    /// Control periods since the start.
    pub periods: u64,
    /// True signals at the latest instant.
    pub signals: Signals,
    /// What each input was set to last.
    pub held: [Option<f64>; 6],
    pub orders: Vec<Order>,
}
