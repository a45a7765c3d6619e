//! `policyc design`

use closed_loop::design::{Design, Wanted};
use plant::Parameters;
use toml_input::Message;

use crate::arguments;
use crate::failure::Failure;
use crate::outcome::Outcome;
use crate::output;
use crate::talk;

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
    let sensor = &plant.sensors.v_out;
    let is_unknown = options.noise.is_none() && sensor.noise == 0.0 && sensor.lsb == 0.0;
    let assumed = is_unknown.then(|| Wanted::assumed_noise(options.v_ref));
    let wanted = Wanted {
        v_ref: options.v_ref,
        load: options.load,
        noise: assumed.as_ref().map(|(noise, _)| *noise).or(options.noise),
        model,
        pole: options.pole,
    };
    let design = Design::new(&plant, wanted).map_err(|faults| faults.in_file(&options.plant))?;
    output::say(design.contract().trim_end())?;
    if let Some((_, words)) = assumed {
        talk::note(&words);
    }
    Ok(Outcome::Done)
}
