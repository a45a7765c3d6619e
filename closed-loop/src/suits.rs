//! Whether a policy and a converter go together.

use std::path::Path;

use plant::{Parameters, Topology};
use policy::Policy;
use toml_input::{Fault, Message};

use crate::faults::Error;
use crate::load_step::LoadStep;

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

/// The output of `policy` that drives the plant, by its index, of the name that `file`, a scenario, or the command line says.
///
/// # Errors
/// If the policy has several and none of them is named.
pub fn driving(wanted: Option<&str>, policy: &Policy, file: &Path) -> Result<usize, Error> {
    let output = policy.chosen_output(wanted);
    output.map_err(|message| {
        let message = match policy.output_names().first().filter(|_| wanted.is_none()) {
            Some(name) => message.hint(format!(
                "output = \"{name}\" says which of them drives the plant, or --output {name}"
            )),
            None => message.maybe_hint(
                policy
                    .output_names()
                    .is_empty()
                    .then(|| "leave `output` and --output out".to_owned()),
            ),
        };
        Fault::in_file(file, message).into()
    })
}

/// Whether a load of constant power is one around `v_ref` V at this converter; `file` is where the converter was named.
///
/// # Errors
/// If it folds back to a resistor too near: it would draw another power there, without a word.
pub fn holds_power(converter: &Parameters, v_ref: f64, file: &Path) -> Result<(), Error> {
    let fold = converter.load.v_fold;
    // a dip to half of the reference is none that a load keeps its regulation through
    if fold <= 0.5 * v_ref {
        return Ok(());
    }
    let message = Message::new("the loads of constant power are resistors at this voltage")
        .found(format!(
            "load.v_fold = {fold} V, below which a load is a resistor, and v_ref = {v_ref} V"
        ))
        .expected(format!("at most half of v_ref, {} V", 0.5 * v_ref))
        .hint(format!("v_fold = {} in [load] of the plant's file", 0.25 * v_ref));
    Err(Fault::in_file(file, message).into())
}

/// Whether the loads of a scenario, which was read from `file`, can be simulated at this converter.
///
/// # Errors
/// If a resistance is too small.
pub fn draws(converter: &Parameters, load_steps: &[LoadStep], file: &Path) -> Result<(), Error> {
    for load in load_steps.iter().flat_map(LoadStep::loads) {
        plant::check_load(converter, &load).map_err(|message| Fault::in_file(file, message))?;
    }
    Ok(())
}

/// Whether the topology of a converter can make `v_ref` V; `file` is where the converter was named.
///
/// # Errors
/// If it cannot.
pub fn reaches(converter: &Parameters, v_ref: f64, file: &Path) -> Result<(), Error> {
    let (v_in, topology) = (converter.converter.v_in, converter.converter.topology);
    let (held, expected) = match topology {
        Topology::Buck => (v_ref < v_in, "less than the source"),
        Topology::Boost => (v_ref > v_in, "more than the source"),
        Topology::BuckBoost => return Ok(()),
    };
    if held {
        return Ok(());
    }
    let message = Message::new(format!("a {} converter cannot hold this voltage", topology.word()))
        .found(format!("v_ref = {v_ref} V, v_in = {v_in} V at the plant"))
        .expected(expected);
    Err(Fault::in_file(file, message).into())
}

/// Whether a policy can hold `v_ref` V at a converter; `file` is where the converter was named.
///
/// # Errors
/// If the voltage is out of reach or the control periods differ.
pub fn suits(policy: &Policy, converter: &Parameters, v_ref: f64, file: &Path) -> Result<(), Error> {
    reaches(converter, v_ref, file)?;
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

#[cfg(test)]
mod tests {
    use super::*;

    /// The default of 5 V is far below the paper's 100 V, and above a point-of-load converter's output.
    #[test]
    fn loads_that_fold_above_half_of_the_reference_are_refused() {
        let plant = Path::new("plant.toml");
        let default = Parameters::default();
        assert!(holds_power(&default, 100.0, plant).is_ok() && holds_power(&default, 10.0, plant).is_ok());
        let refused = holds_power(&default, 1.0, plant).map_err(|error| error.to_string());
        let Err(refused) = refused else { panic!("taken") };
        for part in [
            "resistors at this voltage",
            "load.v_fold = 5 V",
            "v_fold = 0.25 in [load]",
            "plant.toml",
        ] {
            assert!(refused.contains(part), "{refused}");
        }
    }
}
