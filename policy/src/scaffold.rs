//! The text of a new contract for a file of weights. What a wrong guess would make a wrong answer says TODO. What has a
//! default that is right or harmless has it, marked with `check`: a contract is read line by line once, and not written.

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
pub fn new_contract(weights: impl Into<FileName>, contract: &Path) -> Result<String, Faults> {
    let name: FileName = weights.into();
    let mut faults = Sink::new();
    let bytes = faults.keep(name.read(MAX_WEIGHT_BYTES).map_err(|message| name.fault(message)));
    let outline = bytes.and_then(|bytes| {
        let name = name.clone();
        outline(&Binary { name, bytes }, &mut faults)
    });
    let seen = faults.keep(seen_from(contract, &name.path).map_err(|message| name.fault(message)));
    let golden = name.with_file_name("golden.safetensors").is_file();
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
    // where there is no file system there is no working folder, and every path is from the root
    let absolute = std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned());
    let parts: Vec<Component<'_>> = absolute.components().collect();
    let existing = |count: usize| parts[..count].iter().collect::<PathBuf>().canonicalize().ok();
    let (count, real) = (1..=parts.len())
        .rev()
        .find_map(|count| Some((count, existing(count)?)))
        .unwrap_or_default();
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
    /// Whether its observations were drawn from the bounds of the training, and not recorded.
    pub is_drawn: bool,
    /// The entry `continuous` of `[actions]`, where the command is known to be a number.
    pub continuous: Option<String>,
    /// The entries of `gains` in `[actions]`, where the outputs are the gains of a law.
    pub gains: Vec<String>,
    /// What each of several outputs is; none where there is one.
    pub several: Vec<DraftOutput>,
    /// Least and largest duty that the network can command, where that is known.
    pub duties: Option<(f64, f64)>,
    /// Lines about the whole, without `#`.
    pub about: Vec<String>,
    /// What is known of each input; may be shorter than `inputs`.
    pub features: Vec<DraftFeature>,
}

/// What is known of one of several outputs.
#[derive(Debug, Clone, Default)]
pub struct DraftOutput {
    /// The line of its actions.
    pub actions: String,
    /// Least and largest duty, where that is known.
    pub duties: Option<(f64, f64)>,
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
    let is_law = !draft.gains.is_empty();
    let has_several = !draft.several.is_empty();
    let answers = match outputs {
        _ if is_law => format!("{outputs} gains of a law"),
        _ if has_several => format!("{outputs} outputs for {} duties", draft.several.len()),
        1 => "one output".to_owned(),
        _ => format!("{outputs} actions"),
    };
    let mut text = format!(
        "# Contract of a trained policy: {inputs} inputs, {answers}.\n\
         # Replace every \"TODO\"; until then `policyc inspect` names those that are left. What says `check` is a default to\n\
         # look at. Units are SI.\n"
    );
    for line in &draft.about {
        let _ = writeln!(text, "# {line}");
    }
    text += HEAD;
    for input in 0..*inputs {
        text += &feature(input, draft.features.get(input));
    }
    text += "]\n";
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
    text += &golden(draft, folder);
    if has_several {
        return text + &several(&draft.several);
    }
    text += &match is_law {
        true => law(&draft.gains),
        false => actions(draft.continuous.as_deref(), *outputs),
    };
    text + &protection(draft.duties)
}

/// The golden answers, as a comment where there are none.
fn golden(draft: &Draft, folder: &str) -> String {
    let beside = if draft.golden { "" } else { "# " };
    let golden = toml::Value::String(format!("{folder}golden.safetensors"));
    let answers = match draft.outputs {
        _ if !draft.gains.is_empty() => "output [n, gains]",
        // names of the outputs are the user's: the last layer alone outlives a change of them
        _ if !draft.several.is_empty() => "output [n, columns of the last layer]",
        1 => "output [n], duty [n]",
        _ => "q [n, actions] or action [n] or both",
    };
    let mut text = format!("{beside}golden = {golden}   # obs [n, inputs], {answers} from the trainer\n");
    if draft.is_drawn {
        // a drawn row is no evidence that a feature is wrong: bounds of a training reach beyond what sensors show
        text += "golden_outside = 0.95           # they were drawn from the bounds: those that the sensors cannot show are left out\n";
    }
    text
}

/// The outputs, each with limits and fallback, and what all share.
fn several(outputs: &[DraftOutput]) -> String {
    let mut text = "\n# One [[output]] for each duty, in the order of the columns of the last layer. A source calls the duty of the step before\n\
                    # u0_previous_duty, and what left the controller u0_previous_command.\n"
        .to_owned();
    for (index, output) in outputs.iter().enumerate() {
        let (low, high) = output.duties.unwrap_or((0.0, 1.0));
        let limits = format!("duty = [{low:?}, {high:?}]");
        let _ = write!(
            text,
            "\n[[output]]\nname = \"u{index}\"                  # check: a-z, 0-9, _; a constant of the code is called so\n\
             [output.actions]\n{}\n\
             [output.limits]\n{limits:<28} # check: smallest and largest duty the hardware may see\n\
             [output.fallback]\nduty = 0.0                   # check: commanded without a usable measurement\n\
             # [output.mapping]\n# file = \"drm.toml\"\n# load_current = \"i_out\"\n",
            output.actions
        );
    }
    text + "\n[fallback]\nhold = 3                     # check: bad samples bridged with the last good one, for all outputs\n"
}

fn law(gains: &[String]) -> String {
    let rows: String = gains
        .iter()
        .enumerate()
        .map(|(output, gain)| format!("  {gain},   # g{output}\n"))
        .collect();
    format!(
        "\n[actions]                    # the outputs y are the gains of one law: duty = base + g0 * source + g1 * source + ...\n\
         # base = \"v_ref / 200\"       # what stands in front; 0 if it is left out\n\
         # Each gain is scale * squash(y) + offset, and with limits = [lo, hi] cut off there. In the place of source also\n\
         # feature = \"x0\": a feature behind its filters, such as an integrator; without either the gain is added as it is.\n\
         gains = [\n{rows}]\n"
    )
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
            let mut text = format!(
                "\n[actions]                    # duty ratio of each network output, 0 to 1, action 0 to {}\nduties = [",
                outputs.saturating_sub(1)
            );
            // as many as a line of the rest holds
            for (output, row) in (0..outputs).collect::<Vec<_>>().chunks(12).enumerate() {
                text += if output == 0 { "" } else { ",\n          " };
                text += &vec!["\"TODO\""; row.len()].join(", ");
            }
            text + "]\n# base = \"previous_duty\"      # instead of `duties`: each output changes the duty before by its offset, -1 to 1\n\
                    # offsets = []                # or another law in signals, parameters and estimates that it is added to\n"
        }
    }
}

/// One row of the observation.
fn feature(input: usize, known: Option<&DraftFeature>) -> String {
    let mut row = format!("  {{ name = \"x{input}\", source = \"TODO\"");
    match known.and_then(|feature| feature.affine) {
        Some((scale, offset)) => drop(write!(row, ", scale = {scale:?}, offset = {offset:?}")),
        None if known.is_some_and(|feature| feature.is_open) => row += ", scale = \"TODO\", offset = \"TODO\"",
        None => {}
    }
    let mut who = String::new();
    if let Some((low, high, says)) = known.and_then(|feature| feature.clip.as_ref()) {
        let _ = write!(row, ", clip = [{low:?}, {high:?}]");
        who = format!("; clip: {says}");
    }
    format!("{row} }},   # network input {input}{who}\n")
}

/// `[limits]` and `[fallback]`, with the ends of the command where they are known.
fn protection(duties: Option<(f64, f64)>) -> String {
    let (low, high) = duties.unwrap_or((0.0, 1.0));
    let limits = format!("duty = [{low:?}, {high:?}]");
    format!(
        "{MAPPING}
[limits]
{limits:<28} # check: smallest and largest duty the hardware may see
# slew = 0.01                # largest change per sample period
# soft_start = {{ from = 0.1, steps = 1000 }}
# initial_duty = 0.5         # duty before the first step, for previous_duty and slew; otherwise the fallback duty

[fallback]
duty = 0.0                   # check: commanded without a usable measurement; in a synchronous leg 0 keeps the lower switch on
hold = 3                     # check: bad samples bridged with the last good one
"
    )
}

const HEAD: &str = "\
name = \"controller\"          # check: a-z, 0-9, _; files and symbols begin with it
sample_period = \"TODO\"       # s: control period
# parameters = { v_ref = 100.0 }   # constants for the sources below

# What the firmware measures, one row each: { name = \"v_out\", unit = \"V\", range = [0.0, 250.0] }. A sample outside of its range is
# no plausible one, and the last good one is held. With adc = { gain = 0.0625, offset = 0.0 } it arrives as an ADC code.
# The names are yours; `simulate` closes the loop with those that it knows: v_out, i_l, i_out, v_in.
signal = [
  { name = \"TODO\", unit = \"TODO\", range = [\"TODO\", \"TODO\"] },
]

# The observation, one row for each network input, in the order of the training.
#   source         affine in signals, parameters, previous_duty, previous_command: \"v_ref - v_out\"
#   filters        first to last: [{ delay = 1 }]; also { integrator = { min = -1.0, max = 1.0 } }, { moving_average = 4 },
#                  { low_pass = { time_constant = 1e-3 } }, { filtered_derivative = { cutoff = 500.0 } },
#                  \"backward_difference\": (x - the sample before) / sample_period; not divided in your training: scale times sample_period
#   scale, offset  normalisation of the training: scale * x + offset, 1 and 0 where they are not given
#   clip           then: [-1.0, 1.0]
feature = [
";

const MAPPING: &str = "
# Duty ratio mapping from simulation to the bench, if one was measured:
# [mapping]
# file = \"drm.toml\"
# load_current = \"i_out\"
";
