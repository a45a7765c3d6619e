//! The decision map: what a policy commands over two of its signals.

use interp::{Controller, Real, Sample};
use policy::{Policy, Scalar, Signal};

use crate::faults::Error;

/// What a policy commands over a plane of two signals.
#[derive(Debug, Clone, PartialEq)]
pub struct DecisionMap {
    /// Row by row, the lowest value of the second axis first: what is commanded before mapping and limits.
    pub duties: Vec<f64>,
    /// Index of the action likewise; empty of a policy that commands a number.
    pub actions: Vec<u32>,
}

/// An axis of a map: the signal's index in the contract, and the values that it takes.
pub type MapAxis = (usize, Vec<f64>);

/// The command of a controller that meets each measurement first: its filters begin with it, as after a long rest there. `at` holds the
/// values of all signals in their units; those of the two axes are replaced.
///
/// # Errors
/// If a measurement does not fit the contract.
pub fn decision_map(policy: &Policy, x: &MapAxis, y: &MapAxis, at: &[f64]) -> Result<DecisionMap, Error> {
    decision_map_of(policy, 0, x, y, at)
}

/// [`decision_map`] of the output of that index.
///
/// # Errors
/// As [`decision_map`].
pub fn decision_map_of(
    policy: &Policy,
    output: usize,
    x: &MapAxis,
    y: &MapAxis,
    at: &[f64],
) -> Result<DecisionMap, Error> {
    match policy.numeric_format.scalar() {
        Scalar::F32 => cells::<f32>(policy, output, [x, y], at),
        Scalar::F64 => cells::<f64>(policy, output, [x, y], at),
    }
}

fn cells<T: Real>(policy: &Policy, output: usize, [x, y]: [&MapAxis; 2], at: &[f64]) -> Result<DecisionMap, Error> {
    let controller = Controller::<T>::new(policy);
    let mut trace = controller.blank_trace();
    let chooses = policy.path(output).head.is_choice();
    let mut map = DecisionMap {
        duties: Vec::with_capacity(x.1.len() * y.1.len()),
        actions: Vec::new(),
    };
    for up in &y.1 {
        for along in &x.1 {
            let value = |(index, rest): (usize, &f64)| match index {
                index if index == x.0 => *along,
                index if index == y.0 => *up,
                _ => *rest,
            };
            let values = at.iter().enumerate().map(value);
            let samples: Vec<Sample> = (policy.signals.iter().zip(values))
                .map(|(signal, value)| sample(policy, signal, value))
                .collect();
            controller.eval_into(&samples, &mut trace)?;
            let decision = trace.decision(output);
            map.duties.push(decision.duty_sim.to_f64());
            if chooses {
                map.actions.push(decision.action_index);
            }
        }
    }
    Ok(map)
}

/// A value as the contract takes it.
fn sample(policy: &Policy, signal: &Signal, x: f64) -> Sample {
    match (signal.adc, policy.numeric_format.scalar()) {
        // `as` saturates; a code out of range is the controller's to judge
        (Some(adc), _) => Sample::Code(((x - adc.offset) / adc.gain).round() as i32),
        (None, Scalar::F32) => Sample::Physical(x as f32),
        (None, Scalar::F64) => Sample::Wide(x),
    }
}
