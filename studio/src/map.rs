//! The decision map: the policy's duty over two of its signals.

use closed_loop::{DecisionMap, decision_map_of, driving};
use policy::Policy;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use toml_input::{Faults, Message};

use crate::answer::Contract;
use crate::contract::load;
use crate::session::{Reply, Session, Tell, read};

/// Cells along an axis at most: more than a screen shows.
const MOST_CELLS: usize = 400;

/// A map: two axes, and what the other signals are.
#[derive(Deserialize)]
struct Wanted {
    /// The axis to the right.
    x: Axis,
    /// The axis upwards.
    y: Axis,
    /// Every other signal by name, in its unit; one that is left out is in the middle of its range.
    #[serde(default)]
    at: Vec<(String, f64)>,
}

/// A signal and the values it takes.
#[derive(Deserialize)]
struct Axis {
    signal: String,
    low: f64,
    high: f64,
    cells: usize,
}

impl Axis {
    /// The centre of a cell.
    fn centre(&self, cell: usize) -> f64 {
        self.low + (self.high - self.low) * (cell as f64 + 0.5) / self.cells as f64
    }

    /// The signal's index.
    fn index(&self, policy: &Policy) -> Result<usize, Faults> {
        let message = |text: &str| Faults::from(Message::new(text).found(&self.signal));
        if !(1..=MOST_CELLS).contains(&self.cells) || self.low.partial_cmp(&self.high) != Some(std::cmp::Ordering::Less)
        {
            return Err(message("an axis of a map goes up, in at least one cell"));
        }
        let found = policy.signals.iter().position(|signal| signal.name == self.signal);
        found.ok_or_else(|| message("the contract has no signal of this name"))
    }
}

#[derive(Serialize)]
struct Map {
    /// Row by row, the lowest y first: what the policy commands before mapping and limits.
    duties: Vec<f64>,
    /// Index of the action likewise; empty of a policy that commands a number.
    actions: Vec<u32>,
}

/// The command of a controller that meets each measurement first: its filters begin with it, as after a long rest there.
pub(crate) fn map(session: &Session, request: &Value, _: Tell) -> Result<Reply, Faults> {
    let (of, wanted) = (read::<Contract>(request)?, read::<Wanted>(request)?);
    let policy = load(session, &of)?;
    let output = driving(of.output.as_deref(), &policy, of.contract.as_ref())?;
    let axes = [wanted.x.index(&policy)?, wanted.y.index(&policy)?];
    if axes[0] == axes[1] {
        return Err(Message::new("a map needs two signals").found(&wanted.x.signal).into());
    }
    let given = |signal: &policy::Signal| {
        let named = wanted.at.iter().find(|(name, _)| *name == signal.name);
        named.map_or(0.5 * (signal.range.low + signal.range.high), |(_, value)| *value)
    };
    let rest: Vec<f64> = policy.signals.iter().map(given).collect();
    let axis = |index: usize, axis: &Axis| (index, (0..axis.cells).map(|cell| axis.centre(cell)).collect());
    let [x, y] = [axis(axes[0], &wanted.x), axis(axes[1], &wanted.y)];
    let DecisionMap { duties, actions } = decision_map_of(&policy, output, &x, &y, &rest)?;
    Reply::of(&Map { duties, actions })
}
