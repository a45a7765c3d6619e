//! The text of a new contract for a file of weights: the counts are filled in, everything else says TODO, because
//! weights do not say it and a guess would go unnoticed.

use std::fmt::Write;
use std::path::{Component, Path, PathBuf};

use toml_input::{FileName, Message, Sink};

use crate::activation::Activation;
use crate::catalogue;
use crate::faults::Faults;
use crate::limits::MAX_WEIGHT_BYTES;
use crate::raw::Binary;
use crate::weights::outline;

/// Text of a commented contract for the network in `weights`, to be written to `contract`, whose folder need not exist
/// yet; nothing is written here.
///
/// Numbers of features and duties follow from the network. Every value that the weights do not tell is the text
/// `"TODO"`, which [`crate::check`] refuses by name.
///
/// # Errors
/// If the file is not a sound safetensors file or holds no single chain of dense layers, or a contract cannot hold its
/// path.
pub fn new_contract(weights: &Path, contract: &Path) -> Result<String, Faults> {
    let name = FileName::new(weights);
    let mut faults = Sink::new();
    let bytes = faults.keep(name.read(MAX_WEIGHT_BYTES).map_err(|message| name.fault(message)));
    let outline = bytes.and_then(|bytes| {
        let name = name.clone();
        outline(&Binary { name, bytes }, &mut faults)
    });
    let seen = faults.keep(seen_from(contract, weights).map_err(|message| name.fault(message)));
    let golden = weights.with_file_name("golden.safetensors").is_file();
    let text = outline.zip(seen).map(|(outline, weights)| {
        draft(&Draft {
            weights,
            inputs: outline.inputs,
            outputs: outline.outputs,
            chains: outline.chains,
            hidden: outline.hidden,
            bias: outline.bias,
            golden,
            ..Draft::default()
        })
    });
    faults
        .conclude(text, || name.fault(catalogue::incomplete()))
        .map_err(|faults| Faults {
            faults,
            files: vec![name.path.clone()],
            skeleton: Box::default(),
        })
}

/// How a contract names a file: from the contract's folder, with `/` on every system; the whole path where there is no
/// way from one to the other.
///
/// # Errors
/// If there is none, or TOML cannot hold it.
pub fn seen_from(contract: &Path, file: &Path) -> Result<String, Message> {
    // `.` also where the path is a name alone, whose parent is empty
    let folder = |path: &Path| Path::new(".").join(path.parent().unwrap_or(Path::new("")));
    // the file itself may be a link: its name counts, not what it leads to
    let (to, from) = (resolved(&folder(file)), resolved(&folder(contract)));
    let (Some(to), Some(from), Some(name)) = (to, from, file.file_name()) else {
        return Err(Message::new("the way from the contract to this file cannot be told"));
    };
    let shared = to
        .components()
        .zip(from.components())
        .take_while(|(a, b)| a == b)
        .count();
    let path: PathBuf = if shared == 0 {
        to
    } else {
        let up = from.components().skip(shared).map(|_| Component::ParentDir);
        up.chain(to.components().skip(shared)).collect()
    };
    let path = path.join(name);
    let Some(text) = path.to_str() else {
        return Err(Message::new("a contract cannot hold this path")
            .found(path.to_string_lossy())
            .expected("a path in UTF-8, as TOML is")
            .hint("rename the file or its folders"));
    };
    Ok(text.replace(std::path::MAIN_SEPARATOR, "/"))
}

/// A folder without links and `..`, as far as it exists; the rest of the path, which is still to be made, by its text.
fn resolved(folder: &Path) -> Option<PathBuf> {
    let absolute = std::path::absolute(folder).ok()?;
    let parts: Vec<Component<'_>> = absolute.components().collect();
    let existing = |count: usize| parts[..count].iter().collect::<PathBuf>().canonicalize().ok();
    let (count, real) = (1..=parts.len())
        .rev()
        .find_map(|count| Some((count, existing(count)?)))?;
    Some(parts[count..].iter().fold(real, |mut path, part| {
        match part {
            Component::ParentDir => drop(path.pop()),
            part => path.push(part),
        }
        path
    }))
}

/// What is known of a network for which a contract is to be written.
#[derive(Debug, Clone, Default)]
pub struct Draft {
    /// Path of the weights as the contract names it: [`seen_from`].
    pub weights: String,
    /// Network inputs.
    pub inputs: usize,
    /// Actions.
    pub outputs: usize,
    /// Layer names, first to last, of each chain that could be meant.
    pub chains: Vec<String>,
    /// Whether there is a hidden layer.
    pub hidden: bool,
    /// Whether any layer has a bias.
    pub bias: bool,
    /// The activations behind the hidden layers as TOML: `"relu"`, or a list.
    pub activation: Option<String>,
    /// Whether `golden.safetensors` lies beside the weights.
    pub golden: bool,
    /// The entry `continuous` of `[actions]`, where the command is known to be a number.
    pub continuous: Option<String>,
    /// Lines about the whole, without `#`.
    pub about: Vec<String>,
    /// What is known of each input; may be shorter than `inputs`.
    pub features: Vec<DraftFeature>,
}

/// What is known of one network input.
#[derive(Debug, Clone, Default)]
pub struct DraftFeature {
    /// `scale * x + offset`.
    pub affine: Option<(f64, f64)>,
    /// The training scaled it by numbers that nobody has said yet: not to be taken for 1 and 0.
    pub is_open: bool,
    /// Smallest and largest value that the network has seen, and who says so.
    pub clip: Option<(f64, f64, String)>,
}

/// Text of a contract to be filled in.
#[must_use]
pub fn draft(draft: &Draft) -> String {
    let Draft {
        weights,
        inputs,
        outputs,
        ..
    } = draft;
    let folder = &weights[..weights.rfind('/').map_or(0, |slash| slash + 1)];
    // TOML's own quotes and escapes: a path may hold both
    let file = toml::Value::String(weights.clone()).to_string();
    let answers = match outputs {
        1 => "one output".to_owned(),
        _ => format!("{outputs} actions"),
    };
    let mut text = format!(
        "# Contract of a trained policy: {inputs} inputs, {answers}.\n\
         # Replace every \"TODO\"; until then the check names those that are left. Units are SI.\n"
    );
    for line in &draft.about {
        let _ = writeln!(text, "# {line}");
    }
    text += HEAD;
    for input in 0..*inputs {
        let _ = write!(
            text,
            "\n# network input {input}{FEATURE}{}",
            normalisation(draft.features.get(input))
        );
    }
    let _ = write!(text, "\n[network]\nweights = {file}\n");
    if weights.starts_with("..") || Path::new(weights).is_absolute() {
        text += "# outside this folder: copy it here, or say --allow-outside to every command\n";
    }
    match draft.chains.as_slice() {
        [only] => drop(writeln!(text, "# layers found, first to last: {only}")),
        // no choice is made here: a chain that was not meant would give a controller all the same
        several => {
            text += "# more than one chain of layers fits; name the prefix of one, or list its layers:\n";
            for chain in several {
                let _ = writeln!(text, "#   {chain}");
            }
            text += "prefix = \"TODO\"\n";
        }
    }
    match &draft.activation {
        _ if !draft.hidden => {}
        Some(written) => drop(writeln!(text, "hidden_activation = {written}")),
        None => {
            let written: Vec<String> = Activation::EACH.iter().map(|each| each.written()).collect();
            let _ = writeln!(text, "hidden_activation = \"TODO\"   # {}", written.join(", "));
        }
    }
    if !draft.bias {
        text += "bias = false                 # the file holds none\n";
    }
    let beside = if draft.golden { "" } else { "# " };
    let golden = toml::Value::String(format!("{folder}golden.safetensors"));
    let _ = writeln!(
        text,
        "{beside}golden = {golden}   # obs [n, inputs], {} from the trainer",
        if *outputs == 1 {
            "output [n], duty [n]"
        } else {
            "q [n, actions], action [n]"
        }
    );
    text += &actions(draft.continuous.as_deref(), *outputs);
    text + TAIL
}

fn actions(continuous: Option<&str>, outputs: usize) -> String {
    let actor =
        "\n[actions]                    # one output, which becomes a duty: squash or clip, then scale and offset\n";
    match continuous {
        Some(entry) => format!("{actor}{entry}\n"),
        // weights do not say what stood behind them
        None if outputs == 1 => format!(
            "{actor}continuous = {{ squash = \"TODO\", scale = \"TODO\", offset = \"TODO\" }}   # or {{ clip = [lo, hi] }}: a clipped mean\n"
        ),
        None => {
            let mut text =
                "\n[actions]                    # duty ratio of each network output, 0 to 1\nduties = [\n".to_owned();
            for output in 0..outputs {
                let _ = writeln!(text, "    \"TODO\",   # action {output}");
            }
            text + "]\n"
        }
    }
}

/// Scale, offset and clip of a feature.
fn normalisation(known: Option<&DraftFeature>) -> String {
    let mut text = String::new();
    match known.and_then(|feature| feature.affine) {
        Some((scale, offset)) => drop(writeln!(text, "scale = {scale:?}\noffset = {offset:?}")),
        None if known.is_some_and(|feature| feature.is_open) => {
            text += "scale = \"TODO\"             # of the training\noffset = \"TODO\"\n";
        }
        None => text += AFFINE,
    }
    match known.and_then(|feature| feature.clip.as_ref()) {
        Some((low, high, who)) => drop(writeln!(text, "clip = [{low:?}, {high:?}]   # {who}")),
        None => text += CLIP,
    }
    text
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
source = \"TODO\"              # affine in signals, parameters, previous_duty, previous_command: v_ref - v_out
# filters = [{ delay = 1 }]  # first to last; also { integrator = { min = -1.0, max = 1.0 } }, { moving_average = 4 },
#                            # { low_pass = { time_constant = 1e-3 } }, { filtered_derivative = { cutoff = 500.0 } },
#                            # \"backward_difference\": (x - the sample before) / sample_period
";

const AFFINE: &str = "\
# scale = 1.0                # normalisation of the training: scale * x + offset, then clip
# offset = 0.0
";

const CLIP: &str = "\
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
# initial_duty = 0.5         # duty before the first step, for previous_duty and slew; otherwise the fallback duty

[fallback]
duty = \"TODO\"                # commanded without a usable measurement; in a synchronous leg 0 keeps the lower switch on
hold = \"TODO\"                # bad samples bridged with the last good one
";
