//! Commands that start from a trained network or from a converter.

use std::path::PathBuf;

use clap::Args;
use closed_loop::{LoadKind, LoadStep};

#[derive(Debug, Args)]
#[command(
    override_usage = "policyc new <WEIGHTS> [OPTIONS]\n       policyc new --plant <FILE> --v-ref <V> --loads <W,W> [--out <FILE>]"
)]
pub struct New {
    /// What the trainer saved: safetensors, a torch file (.pt, .pth), a model of stable-baselines3 (.zip), ONNX, or MAT
    #[arg(required_unless_present = "plant")]
    pub weights: Option<PathBuf>,
    /// Instead: a plant file. Writes contract, train.toml and scenario.toml for a policy that is to be trained on it: an observer
    /// and a law of control by `policyc design`, a network that adds to the law, and a specification from `policyc limit`
    #[arg(long, value_name = "FILE", conflicts_with_all = ["weights", "inside", "actions", "vecnormalize"],
        requires_all = ["v_ref", "loads"])]
    pub plant: Option<PathBuf>,
    /// With --plant: voltage to hold, V
    #[arg(long, value_name = "V", value_parser = output_voltage, allow_negative_numbers = true, requires = "plant")]
    pub v_ref: Option<f64>,
    /// With --plant: smallest and largest load, W
    #[arg(long, value_name = "W,W", value_parser = pair, allow_hyphen_values = true, requires = "plant")]
    pub loads: Option<[f64; 2]>,
    /// Contract to write, or folder for a policy.toml; must not exist yet. It names the weights as seen from its folder; those that
    /// had to be joined or folded are written beside it
    #[arg(long, value_name = "FILE", default_value = "policy.toml")]
    pub out: PathBuf,
    /// Entry of a checkpoint that holds the network, such as model_state_dict
    #[arg(long, value_name = "NAME")]
    pub inside: Option<String>,
    /// Number of actions, where the tensors do not say it: of a QR-DQN, or of two outputs. 1 is a command, which is a number
    #[arg(long, value_name = "N")]
    pub actions: Option<usize>,
    /// Which of several outputs is the duty, counted from 0; of a MultiDiscrete action space which dimension. The others are left
    /// out, and named
    #[arg(long, value_name = "N", conflicts_with = "gains")]
    pub output: Option<usize>,
    /// Columns of each of several duties in the order of the last layer, where the file does not say what its outputs are: 1 is a duty as a
    /// number, N a choice among N duties
    #[arg(long, value_name = "N,N", value_delimiter = ',', conflicts_with_all = ["gains", "output"])]
    pub outputs: Vec<usize>,
    /// The outputs are the gains of a law of control, which the contract says: `gains` in [actions]
    #[arg(long)]
    pub gains: bool,
    /// What stable-baselines3's VecNormalize saved: scale, offset and clip of the features. A vecnormalize.pkl beside the model
    /// is taken without this
    #[arg(long, value_name = "FILE")]
    pub vecnormalize: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct Design {
    /// Plant file; its nominal values are what is designed for, its sensor of the output voltage gives the noise
    pub plant: PathBuf,
    /// Voltage to hold, V
    #[arg(long, value_name = "V", value_parser = output_voltage, allow_negative_numbers = true)]
    pub v_ref: f64,
    /// Largest load current, A
    #[arg(long, value_name = "A")]
    pub load: f64,
    /// Standard deviation of the measured output voltage in V, in the place of the plant's
    #[arg(long, value_name = "V")]
    pub noise: Option<f64>,
    /// Standard deviations of what the model is wrong by in a period, A,V,V: current, voltage, bias
    #[arg(long, value_name = "A,V,V", value_delimiter = ',')]
    pub model_noise: Option<Vec<f64>>,
    /// Pole of the law: how much of an error is left after a period; 0.5 unless given. In a boost or a buck-boost it is that of
    /// the current, 0.3 unless given
    #[arg(long, value_name = "SHARE")]
    pub pole: Option<f64>,
}

#[derive(Debug, Args)]
pub struct Limit {
    /// Plant file
    pub plant: PathBuf,
    /// Voltage to hold, V
    #[arg(long, value_name = "V", value_parser = output_voltage, allow_negative_numbers = true)]
    pub v_ref: f64,
    /// Constant powers before and after a load step, W; may be given more than once, as the other two
    #[arg(long, value_name = "W,W", value_parser = pair, allow_hyphen_values = true, required_unless_present_any = ["current_step", "resistance_step"])]
    pub load_step: Vec<[f64; 2]>,
    /// Constant currents before and after, A
    #[arg(long, value_name = "A,A", value_parser = pair)]
    pub current_step: Vec<[f64; 2]>,
    /// Resistances before and after, ohm
    #[arg(long, value_name = "OHM,OHM", value_parser = pair)]
    pub resistance_step: Vec<[f64; 2]>,
    /// Smallest and largest duty
    #[arg(long, value_name = "LOW,HIGH", value_parser = pair, default_value = "0,1")]
    pub duty: [f64; 2],
}

impl Limit {
    /// All load steps.
    pub fn steps(&self) -> Vec<LoadStep> {
        let kinds = [
            (LoadKind::Power, &self.load_step),
            (LoadKind::Current, &self.current_step),
            (LoadKind::Resistance, &self.resistance_step),
        ];
        let of_kind = |(kind, pairs): (LoadKind, &Vec<[f64; 2]>)| {
            let steps = pairs.iter().map(|values| LoadStep {
                kind,
                ..LoadStep::from(*values)
            });
            steps.collect::<Vec<_>>()
        };
        kinds.into_iter().flat_map(of_kind).collect()
    }
}

/// Two numbers with a comma between them.
fn pair(text: &str) -> Result<[f64; 2], String> {
    let number = |text: &str| text.trim().parse().ok().filter(|x: &f64| x.is_finite());
    let both = text.split_once(',').and_then(|(a, b)| Some([number(a)?, number(b)?]));
    both.ok_or_else(|| "expected two numbers with a comma between them, such as 20,100".into())
}

/// A voltage to hold. That of an inverting buck-boost counts as positive.
fn output_voltage(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(volts) if volts > 0.0 && volts.is_finite() => Ok(volts),
        Ok(volts) if volts < 0.0 => Err(format!(
            "the output voltage counts as positive, of an inverting buck-boost as well: {}",
            -volts
        )),
        _ => Err("expected a voltage above 0, such as 12 or 3.3".into()),
    }
}
