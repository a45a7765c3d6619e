//! `policyc design`

use closed_loop::design::{Design, Wanted};
use plant::Parameters;
use toml_input::Message;

use crate::arguments;
use crate::failure::Failure;
use crate::outcome::Outcome;
use crate::output;

/// Prints the lines.
pub fn run(options: &arguments::Design) -> Result<Outcome, Failure> {
    let plant = Parameters::nominal_from_file(options.plant.as_path())?.0;
    let model = match options.model_noise.as_deref() {
        None => None,
        Some(&[current, voltage, bias]) => Some([current, voltage, bias]),
        Some(other) => {
            let message = Message::new("--model-noise wants three numbers");
            return Err(message
                .found(format!("{}", other.len()))
                .expected("A,V,V: current, voltage, bias")
                .into());
        }
    };
    let design = Design::new(
        &plant,
        Wanted {
            v_ref: options.v_ref,
            load: options.load,
            noise: options.noise,
            model,
            pole: options.pole,
        },
    )?;
    output::say(design.contract().trim_end())?;
    Ok(Outcome::Done)
}
