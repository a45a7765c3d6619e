//! The checked policy: what holds from here on needs no second check.
//!
//! A [`Policy`] comes from [`crate::check`] only. All numbers are binary64 as written in the contract; each stage
//! that needs another format rounds once, as `docs/reference/numeric-contract.md` says.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::Serialize;

use crate::activation::Activation;
pub use crate::filter::Filter;
pub use crate::head::{Action, Continuous, Factor, Gain, Head, Pair, Residual, Schedule, Source, Squash, Still};
pub use crate::interval::Interval;
use crate::known_answers;
pub use crate::known_answers::{Golden, OutputAnswers};
pub use crate::observer::{Circuit, Estimate, Gains, Hold, InputVoltage, Observer, OnTime};
pub use crate::output::{DutyPath, Output};

/// Number format in which the whole controller computes (`docs/reference/numeric-contract.md`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum NumericFormat {
    /// IEEE 754 binary32, fixed order, never contracted.
    F32,
    /// As `F32`, but every product of the network is added with one rounding (fused multiply-add).
    F32Fma,
    /// IEEE 754 binary64, fixed order, never contracted; the weights are the binary32 numbers of the file.
    F64,
    /// Integer network: 16-bit weights and activations, 32-bit accumulators; binary32 around it.
    I16,
    /// Integer network: 8-bit weights, 16-bit activations, 32-bit accumulators; binary32 around it.
    I8,
}

impl NumericFormat {
    /// All formats.
    pub const ALL: [NumericFormat; 5] = [
        NumericFormat::F32,
        NumericFormat::F32Fma,
        NumericFormat::F64,
        NumericFormat::I16,
        NumericFormat::I8,
    ];

    /// Whether the network runs in integers.
    #[must_use]
    pub fn is_integer(self) -> bool {
        self.weight_limit().is_some()
    }

    /// Name in `policy.toml` and on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            NumericFormat::F32 => "f32",
            NumericFormat::F32Fma => "f32-fma",
            NumericFormat::F64 => "f64",
            NumericFormat::I16 => "i16",
            NumericFormat::I8 => "i8",
        }
    }

    /// The format of that name.
    #[must_use]
    pub fn find(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|format| format.name() == name)
    }

    /// Largest magnitude of a weight of the integer network; `None` for the others.
    #[must_use]
    pub fn weight_limit(self) -> Option<i32> {
        match self {
            NumericFormat::F32 | NumericFormat::F32Fma | NumericFormat::F64 => None,
            NumericFormat::I16 => Some(32_767),
            NumericFormat::I8 => Some(127),
        }
    }

    /// Format of everything that is not an integer network: measurement, state, observation, command.
    #[must_use]
    pub fn scalar(self) -> Scalar {
        match self {
            NumericFormat::F64 => Scalar::F64,
            NumericFormat::F32 | NumericFormat::F32Fma | NumericFormat::I16 | NumericFormat::I8 => Scalar::F32,
        }
    }
}

/// Floating-point format of the numbers around the network (`docs/reference/numeric-contract.md`); how it rounds is in
/// [`crate::rounding`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scalar {
    /// IEEE 754 binary32.
    F32,
    /// IEEE 754 binary64.
    F64,
}

impl Scalar {
    /// Words of 32 bits in a number. Two follow each other with the low one first.
    #[must_use]
    pub fn words(self) -> usize {
        match self {
            Scalar::F32 => 1,
            Scalar::F64 => 2,
        }
    }
}

/// A trained controller, whole: signals, features, network, actions, mapping, limits.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Policy {
    /// Identifier used in file and symbol names: `[a-z][a-z0-9_]{0,30}`, no keyword of C or Rust.
    pub name: String,
    /// Control period T in seconds.
    pub sample_period: f64,
    /// Format of all arithmetic.
    pub numeric_format: NumericFormat,
    /// Compile-time constants usable in feature sources (already folded into them), kept for reports.
    pub parameters: BTreeMap<String, f64>,
    /// Measured signals in the order of the measurement struct.
    pub signals: Vec<Signal>,
    /// Models of the converter that run beside it; their estimates stand beside the signals in sources.
    pub observers: Vec<Observer>,
    /// Observation in network input order.
    pub features: Vec<Feature>,
    /// Dense layers, first to last; `layers[0].inputs == features.len()`.
    pub layers: Vec<Layer>,
    /// What the outputs of the last layer mean.
    pub head: Head,
    /// Duty ratio mapping, if any; `None` of several outputs, which have their own ([`Policy::paths`]).
    pub mapping: Option<Mapping>,
    /// Limits of the commanded duty; of several outputs those of the first ([`Policy::paths`] has all).
    pub limits: Limits,
    /// What happens without a usable measurement; of several outputs the duty is that of the first.
    pub fallback: Fallback,
    /// Known answers from the trainer.
    pub golden: Option<Golden>,
    /// SHA-256 of the parts, over canonical content (not over file bytes).
    pub digests: Digests,
    /// What was converted, skipped or inferred while reading, as sentences for the user.
    pub notes: Vec<String>,
    /// Every file that was read, the contract first; for rebuild tracking.
    pub files: Vec<PathBuf>,
}

impl Policy {
    /// Outputs of the network: values of the last layer.
    #[must_use]
    pub fn outputs(&self) -> usize {
        self.head.outputs()
    }

    /// Whether the source of a feature or of the head, or an observer reads this.
    #[must_use]
    pub fn reads(&self, input: Input) -> bool {
        let observed = |observer: &Observer| match input {
            Input::PreviousCommand => true,
            Input::OutputCommand(index) => observer.output == index,
            Input::Signal(index) => observer.signals().any(|own| own == index),
            Input::PreviousDuty | Input::Estimate(..) | Input::OutputDuty(_) => false,
        };
        let features = self.features.iter().map(|feature| &feature.source);
        let mut sources = features.chain(self.head.sources().map(|source| &source.tree));
        sources.any(|source| source.reads(input)) || self.observers.iter().any(observed)
    }

    /// The law of a residual head or a gain schedule without what the network adds to it, as a policy of its own; `None` of another
    /// head, and of a base that reads nothing measured, such as `previous_duty`: on its own that is a constant and no law.
    #[must_use]
    pub fn law_alone(&self) -> Option<Self> {
        let base = match &self.head {
            Head::Residual(head) => &head.base.tree,
            Head::Schedule(head) => &head.base.tree,
            Head::Choice(_) | Head::Continuous(_) | Head::Several(_) => return None,
        };
        let signals = (0..self.signals.len()).map(Input::Signal);
        let estimates = (0..self.observers.len())
            .flat_map(|observer| Estimate::ALL.map(|estimate| Input::Estimate(observer, estimate)));
        let mut measured = signals.chain(estimates);
        if !measured.any(|input| base.reads(input)) {
            return None;
        }
        let mut law = self.clone();
        law.actions_mut().iter_mut().for_each(|action| action.duty = 0.0);
        if let Head::Schedule(head) = &mut law.head {
            let none = Some(Interval { low: 0.0, high: 0.0 });
            head.gains.iter_mut().for_each(|gain| gain.limits = none);
        }
        Some(law)
    }

    /// How far a trainer's Q value may be off by rounding, as a share of the largest |Q| of its observation.
    #[must_use]
    pub fn golden_tolerance(&self) -> f64 {
        (self.golden.as_ref()).map_or(known_answers::TOLERANCE, |golden| golden.tolerance)
    }

    /// The discrete actions; none where the head makes no choice.
    #[must_use]
    pub fn actions(&self) -> &[Action] {
        self.head.actions()
    }

    /// The same, to be changed: what a test or a search does to a policy that it has checked.
    #[must_use]
    pub fn actions_mut(&mut self) -> &mut [Action] {
        match &mut self.head {
            Head::Choice(actions) => actions,
            Head::Residual(head) => &mut head.offsets,
            Head::Continuous(_) | Head::Schedule(_) | Head::Several(_) => &mut [],
        }
    }
}

/// A measured quantity.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Signal {
    /// Field name in the measurement struct.
    pub name: String,
    /// Unit as text, for reports only.
    pub unit: String,
    /// Plausible range in physical units; a sample outside is held.
    pub range: Interval,
    /// If present the sample arrives as an integer ADC code.
    pub adc: Option<Adc>,
}

/// `physical = gain * code + offset`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Adc {
    /// Unit per code.
    pub gain: f64,
    /// Physical value at code 0.
    pub offset: f64,
    /// Bits of the converter, whose codes go from 0 to 2^bits - 1; `None` if the contract does not say.
    // left out where there is none: the digests of contracts without it stay
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bits: Option<u32>,
}

/// One network input: a source through filters, then scale, offset, clip (contract sections 3 to 5).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Feature {
    /// Name, for reports and state fields.
    pub name: String,
    /// Affine expression, constants folded.
    pub source: Expr,
    /// The expression as the user wrote it.
    pub source_text: String,
    /// Filter chain, first to last.
    pub filters: Vec<Filter>,
    /// Multiplier after the filters.
    pub scale: f64,
    /// Addend after the multiplication.
    pub offset: f64,
    /// Clip of the observation.
    pub clip: Option<Interval>,
    /// Sound bound of the observation in f32 arithmetic, by interval analysis from the signals' ranges and the clip.
    pub bound: Interval,
}

/// Leaf of a source expression.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum Input {
    /// Sanitised signal by index into [`Policy::signals`].
    Signal(usize),
    /// Duty of the last chosen action, before the mapping.
    PreviousDuty,
    /// Duty that last left the controller.
    PreviousCommand,
    /// Estimate of an observer by index into [`Policy::observers`].
    Estimate(usize, Estimate),
    /// Duty of the last step before its mapping, of several outputs the one of that index.
    OutputDuty(usize),
    /// Duty that last left the controller, of several outputs the one of that index.
    OutputCommand(usize),
}

impl Input {
    /// How messages and reports call it.
    #[must_use]
    pub fn name(self, signals: &[Signal], observers: &[Observer]) -> String {
        match self {
            Input::Signal(index) => signals.get(index).map_or("?", |signal| &signal.name).to_owned(),
            Input::PreviousDuty => "previous_duty".to_owned(),
            Input::PreviousCommand => "previous_command".to_owned(),
            Input::Estimate(index, estimate) => {
                let observer = observers.get(index).map_or("?", |observer| &observer.name);
                format!("{observer}_{}", estimate.word())
            }
            // who prints them knows the outputs, too: these are for a message without them
            Input::OutputDuty(index) => format!("previous_duty of output {index}"),
            Input::OutputCommand(index) => format!("previous_command of output {index}"),
        }
    }
}

/// Affine expression with constants folded (contract section 3); evaluated exactly as the tree stands.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum Expr {
    /// A measured or remembered value.
    Input(Input),
    /// A folded constant.
    Constant(f64),
    /// Exact negation.
    Neg(Box<Expr>),
    /// Rounded sum.
    Add(Box<Expr>, Box<Expr>),
    /// Rounded difference.
    Sub(Box<Expr>, Box<Expr>),
    /// Rounded product with a constant other than 1.
    Scale(f64, Box<Expr>),
}

impl Expr {
    /// Whether it has this input anywhere.
    #[must_use]
    pub fn reads(&self, input: Input) -> bool {
        match self {
            Expr::Input(own) => *own == input,
            Expr::Constant(_) => false,
            Expr::Neg(x) | Expr::Scale(_, x) => x.reads(input),
            Expr::Add(x, y) | Expr::Sub(x, y) => x.reads(input) || y.reads(input),
        }
    }
}

/// Dense layer `y = activation(W x + b)`.
#[derive(Debug, Clone, PartialEq)]
pub struct Layer {
    /// Tensor name without `.weight`.
    pub name: String,
    /// Number of inputs.
    pub inputs: usize,
    /// Number of outputs.
    pub outputs: usize,
    /// Row-major `[outputs][inputs]`.
    pub weights: Vec<f32>,
    /// `[outputs]`; +0 where the network has no bias.
    pub bias: Vec<f32>,
    /// Activation behind the layer; `Identity` for the last.
    pub activation: Activation,
    /// Sound bound of each output (after the activation) over the observation box, f32 rounding included.
    pub bounds: Vec<Interval>,
}

/// Duty ratio mapping `d_real = a d_sim + b i_out + c (+ r i_out d_sim)`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Mapping {
    /// Coefficients.
    pub coefficients: Coefficients,
    /// Index of the load current in [`Policy::signals`].
    pub load_current: usize,
    /// Validity range of the load current in A.
    pub valid_i_out: Interval,
    /// Validity range of d_sim.
    pub valid_d_sim: Interval,
    /// Run-time adjustment allowed for `a`.
    pub adjust_a: Interval,
    /// Run-time adjustment allowed for `b`, 1/A.
    pub adjust_b: Interval,
    /// Run-time adjustment allowed for `c`.
    pub adjust_c: Interval,
    /// Run-time adjustment allowed for `r`, 1/A; used in the four-term form only.
    pub adjust_r: Interval,
    /// The converter that `d_sim` is a duty of, where the file names one; the controller does not use it.
    #[serde(skip)]
    pub simulation: Option<Simulation>,
}

/// The simulated converter of a mapping: at `d_sim` it has the voltage that is wanted of the real one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Simulation {
    /// Input voltage, V.
    pub v_in: f64,
    /// Forward voltage of the diode, V.
    pub v_f: f64,
    /// Differential resistance of the diode, ohm.
    pub r_d: f64,
    /// On-resistance of the switch, ohm.
    pub r_on: f64,
    /// Resistance of the inductor, ohm.
    pub dcr: f64,
    /// Share of the period that the switch is on for less than commanded.
    pub lost_duty: f64,
    /// What the body diodes of a synchronous leg take in the dead times, as a mean over the period, V.
    pub v_dead: f64,
}

/// Coefficients of a mapping.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Coefficients {
    /// Gain on d_sim, > 0.
    pub a: f64,
    /// Per ampere of load current.
    pub b: f64,
    /// Constant.
    pub c: f64,
    /// Product term per ampere; `None` is the three-term form.
    pub r: Option<f64>,
}

/// Limits of the commanded duty (contract section 9).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Limits {
    /// Smallest and largest duty, 0..1.
    pub duty: Interval,
    /// Largest change per sample period, > 0.
    pub slew: Option<f64>,
    /// Rising upper limit after start and after a fallback.
    pub soft_start: Option<SoftStart>,
    /// Duty assumed before the first step, 0..1.
    pub initial_duty: f64,
}

/// Upper duty limit rising from `from` to the maximum in `steps` sample periods.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SoftStart {
    /// First upper limit, 0 <= from <= max.
    pub from: f64,
    /// Sample periods, 1 to 1e6.
    pub steps: u32,
}

/// Behaviour without a usable measurement.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Fallback {
    /// Commanded duty, 0..1; the only command that may lie outside the limits.
    pub duty: f64,
    /// K: consecutive bad steps bridged with held samples.
    pub hold: u32,
}

/// Lower-case hex SHA-256 digests of canonical content.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Digests {
    /// Of the layers' shapes, weights and biases (f32 bits, little-endian) in network order.
    pub weights: String,
    /// Of everything in `policy.toml` that changes the controller, defaults filled in; mapping and weights apart.
    pub contract: String,
    /// Of the mapping; `None` without one.
    pub mapping: Option<String>,
}
