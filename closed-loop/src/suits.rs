//! Whether a policy and a converter go together.

use std::path::Path;

use plant::{Parameters, Topology};
use policy::Policy;
use toml_input::{Fault, Message};

use crate::faults::Error;

/// The voltage that the policy says it holds, V: its parameter `v_ref`.
#[must_use]
pub fn held_by(policy: &Policy) -> Option<f64> {
    policy.parameters.get("v_ref").copied()
}

/// The voltage to hold, V: `given` by a scenario, whose `file` it is, or by the policy.
///
/// # Errors
/// If neither scenario nor policy names one.
pub fn v_ref(given: Option<f64>, policy: &Policy, file: &Path) -> Result<f64, Error> {
    given.or(held_by(policy)).ok_or_else(|| {
        let message = Message::new("no voltage to hold");
        let message = message.hint("v_ref = 100.0, as the policy has no parameter `v_ref`");
        Fault::in_file(file, message).into()
    })
}

/// Whether a policy can hold `v_ref` V at a converter; `file` is where the converter was named.
///
/// # Errors
/// If the voltage is out of reach or the control periods differ.
pub fn suits(policy: &Policy, converter: &Parameters, v_ref: f64, file: &Path) -> Result<(), Error> {
    let (v_in, topology) = (converter.converter.v_in, converter.converter.topology);
    let held = match topology {
        Topology::Buck => v_ref < v_in,
        Topology::Boost => v_ref > v_in,
        Topology::BuckBoost => true,
    };
    if !held {
        let message = Message::new(format!("a {} converter cannot hold this voltage", topology.word()))
            .found(format!("v_ref = {v_ref} V, v_in = {v_in} V at the plant"));
        return Err(Fault::in_file(file, message).into());
    }
    let (ours, theirs) = (policy.sample_period, converter.t_sw());
    // a decimal period and 1 / f_sw may differ by rounding
    if (ours - theirs).abs() > 1e-9 * theirs {
        let message = Message::new("policy and plant have different control periods")
            .found(format!(
                "sample_period = {ours} s in the policy, {theirs} s at the plant"
            ))
            .hint("f_sw of the plant is 1 / sample_period");
        return Err(Fault::in_file(file, message).into());
    }
    Ok(())
}
