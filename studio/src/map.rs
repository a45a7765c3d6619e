//! The decision map: the policy's duty over two of its signals.

use interp::{Controller, Real, Sample};
use policy::{Policy, Scalar};
use serde::{Deserialize, Serialize};
use toml_input::{Faults, Message};

use crate::answer::Contract;
use crate::contract::load;
use crate::session::{Reply, Session};

/// Cells along an axis at most: more than a screen shows.
const MOST_CELLS: usize = 400;

/// A map: two axes, and what the other signals are.
#[derive(Debug, Clone, Deserialize)]
pub struct Wanted {
    /// The contract.
    #[serde(flatten)]
    of: Contract,
    /// The axis to the right.
    x: Axis,
    /// The axis upwards.
    y: Axis,
    /// Every other signal by name, in its unit; one that is left out is in the middle of its range.
    #[serde(default)]
    at: Vec<(String, f64)>,
}

/// A signal and the values it takes.
#[derive(Debug, Clone, Deserialize)]
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
pub(crate) fn map(session: &Session, wanted: &Wanted) -> Result<Reply, Faults> {
    let policy = load(session, &wanted.of)?;
    let axes = [wanted.x.index(&policy)?, wanted.y.index(&policy)?];
    if axes[0] == axes[1] {
        return Err(Message::new("a map needs two signals").found(&wanted.x.signal).into());
    }
    let given = |signal: &policy::Signal| {
        let named = wanted.at.iter().find(|(name, _)| *name == signal.name);
        named.map_or(0.5 * (signal.range.low + signal.range.high), |(_, value)| *value)
    };
    let rest: Vec<f64> = policy.signals.iter().map(given).collect();
    let map = match policy.numeric_format.scalar() {
        Scalar::F32 => cells::<f32>(&policy, wanted, axes, rest)?,
        Scalar::F64 => cells::<f64>(&policy, wanted, axes, rest)?,
    };
    Reply::of(&map)
}

fn cells<T: Real>(policy: &Policy, wanted: &Wanted, axes: [usize; 2], mut at: Vec<f64>) -> Result<Map, Faults> {
    let controller = Controller::<T>::new(policy);
    let mut trace = controller.blank_trace();
    let chooses = policy.head.is_choice();
    let mut map = Map {
        duties: Vec::with_capacity(wanted.x.cells * wanted.y.cells),
        actions: Vec::new(),
    };
    for row in 0..wanted.y.cells {
        for column in 0..wanted.x.cells {
            (at[axes[0]], at[axes[1]]) = (wanted.x.centre(column), wanted.y.centre(row));
            let samples: Vec<Sample> = policy
                .signals
                .iter()
                .zip(&at)
                .map(|(signal, x)| sample(policy, signal, *x))
                .collect();
            controller.eval_into(&samples, &mut trace)?;
            map.duties.push(trace.duty_sim.to_f64());
            if chooses {
                map.actions.push(trace.action_index);
            }
        }
    }
    Ok(map)
}

/// A value as the contract takes it.
fn sample(policy: &Policy, signal: &policy::Signal, x: f64) -> Sample {
    match (signal.adc, policy.numeric_format.scalar()) {
        // `as` saturates; a code out of range is the controller's to judge
        (Some(adc), _) => Sample::Code(((x - adc.offset) / adc.gain).round() as i32),
        (None, Scalar::F32) => Sample::Physical(x as f32),
        (None, Scalar::F64) => Sample::Wide(x),
    }
}
