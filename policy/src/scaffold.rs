//! The text of a new contract for a file of weights: the counts are filled in, everything else says TODO, because
//! weights do not say it and a guess would go unnoticed.

use std::fmt::Write;
use std::path::Path;

use toml_input::{Fault, FileName};

use crate::faults::Faults;
use crate::limits::MAX_WEIGHT_BYTES;
use crate::raw::Binary;
use crate::weights::{Outline, outline};

/// Text of a commented `policy.toml` for the network in `weights`, to be written beside it.
///
/// Numbers of features and duties follow from the network. Every value that the weights do not tell is the text
/// `"TODO"`, which [`crate::check`] refuses by name.
///
/// # Errors
/// If the file is not a sound safetensors file or holds no single chain of dense layers.
pub fn new_contract(weights: &Path) -> Result<String, Faults> {
    let name = FileName::new(weights);
    let mut faults: Vec<Fault> = Vec::new();
    let outline = name
        .read(MAX_WEIGHT_BYTES)
        .map_err(|message| faults.push(name.fault(message)))
        .ok()
        .and_then(|bytes| {
            outline(
                &Binary {
                    name: name.clone(),
                    bytes,
                },
                &mut faults,
            )
        });
    match outline {
        Some(outline) => Ok(text(weights, &outline)),
        None => Err(Faults {
            list: faults,
            files: vec![name.path],
            name: None,
            signals: Vec::new(),
        }),
    }
}

fn text(weights: &Path, outline: &Outline) -> String {
    let file = weights
        .file_name()
        .map(|name| name.to_string_lossy().into_owned())
        .unwrap_or_default();
    let file = toml::Value::String(file).to_string();
    let Outline {
        inputs,
        outputs,
        chains,
        ..
    } = outline;
    let mut text = format!(
        "# Contract of a trained policy: {inputs} inputs, {outputs} actions.\n\
         # Replace every \"TODO\"; until then the check names those that are left. Units are SI.\n"
    );
    text += HEAD;
    for input in 0..*inputs {
        let _ = write!(text, "\n# network input {input}{FEATURE}");
    }
    let _ = write!(text, "\n[network]\nweights = {file}\n");
    match chains.as_slice() {
        [only] => drop(writeln!(text, "# layers found, first to last: {only}")),
        several => {
            text += "# more than one chain of layers fits; name the prefix of one, or list its layers:\n";
            for chain in several {
                let _ = writeln!(text, "#   {chain}");
            }
            text += "prefix = \"TODO\"\n";
        }
    }
    if outline.hidden {
        text += "hidden_activation = \"TODO\"   # \"relu\", \"tanh\", \"identity\" or { leaky_relu = 0.01 }\n";
    }
    if !outline.bias {
        text += "bias = false                 # the file holds none\n";
    }
    text += "# golden = \"golden.safetensors\"   # obs [n, inputs], q [n, actions], action [n] from the trainer\n";
    text += "\n[actions]                    # duty ratio of each network output, 0 to 1\nduties = [\n";
    for output in 0..*outputs {
        let _ = writeln!(text, "    \"TODO\",   # action {output}");
    }
    text += "]\n";
    text + TAIL
}

const HEAD: &str = "\
name = \"TODO\"                # a-z, 0-9, _: files and symbols begin with it
sample_period = \"TODO\"       # s: control period

# Constants for use in the features:
# [parameters]
# v_ref = 100.0

# One [[signal]] per measured quantity.
[[signal]]
name = \"TODO\"                # such as v_out
unit = \"TODO\"                # such as V
range = [\"TODO\", \"TODO\"]     # plausible; a sample outside is held
# adc = { gain = 0.0625, offset = 0.0 }   # if it arrives as an ADC code

# The observation, one [[feature]] per network input, in the order of the training.
";

const FEATURE: &str = "
[[feature]]
name = \"TODO\"
source = \"TODO\"              # affine in signals and parameters, such as v_ref - v_out
# filters = [{ delay = 1 }]  # first to last
# scale = 1.0                # normalisation of the training: scale * x + offset, then clip
# offset = 0.0
# clip = [-1.0, 1.0]
";

const TAIL: &str = "
# Duty ratio mapping from simulation to the bench, if one was measured:
# [mapping]
# file = \"drm.toml\"
# load_current = \"i_out\"

[limits]
duty = [\"TODO\", \"TODO\"]      # smallest and largest duty the hardware may see
# slew = 0.01                # largest change per sample period
# soft_start = { from = 0.1, steps = 1000 }
# initial_duty = 0.5         # otherwise the fallback duty

[fallback]
duty = \"TODO\"                # commanded without a usable measurement
hold = \"TODO\"                # bad samples bridged with the last good one
";
