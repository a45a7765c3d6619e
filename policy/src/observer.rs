//! A model of the converter that runs beside it (contract section 2b).

use serde::Serialize;

use crate::interval::Interval;

/// Predictor of a converter, corrected by the measured output voltage: what it estimates can be read as a signal.
///
/// Its states are the inductor current at the sampling instant, the output voltage, and a bias in volts at the inductor
/// that stands for all losses and for a wrong input voltage. One period with the duty d adds the volt-seconds of the circuit,
/// over L, to the current, and to the voltage the charge of what the output receives of its mean.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Observer {
    /// Its estimates are called `<name>_current`, `<name>_voltage`, `<name>_bias` and, with a voltage to hold,
    /// `<name>_surplus`.
    pub name: String,
    /// The circuit.
    // left out where it is what it was before there was a choice, as the next two: such contracts keep their digest
    #[serde(skip_serializing_if = "Circuit::is_buck")]
    pub topology: Circuit,
    /// When in a period the switch is on.
    #[serde(skip_serializing_if = "OnTime::is_first")]
    pub carrier: OnTime,
    /// What the surplus is about; none for a buck converter.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hold: Option<Hold>,
    /// L in henry.
    pub inductance: f64,
    /// C in farad.
    pub capacitance: f64,
    /// V of the model.
    pub input_voltage: InputVoltage,
    /// Index of the output voltage in [`crate::Policy::signals`].
    pub output_voltage: usize,
    /// Index of the load current.
    pub load_current: usize,
    /// Periods, 0 or 1, from a measurement to the duty that was computed of it. With 1 the estimates are those of the instant
    /// at which that duty begins.
    pub compute_delay: u32,
    /// Which of several outputs commands the duty that drives it: index into [`crate::Policy::paths`], 0 where there is one.
    // left out where it is 0: contracts with one output keep their digest
    #[serde(skip_serializing_if = "is_first")]
    pub output: usize,
    /// What one volt between measured and predicted output voltage corrects.
    pub gains: Gains,
    /// What the estimated current is clamped to, in A; 0 below is a diode.
    pub current: Interval,
    /// What the estimated output voltage is clamped to, in V: the plausible range of its signal.
    pub voltage: Interval,
    /// What the bias is clamped to, in V; 0 is inside.
    pub bias: Interval,
}

/// The circuit of an observer's model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Circuit {
    /// The output receives the inductor's current throughout the period.
    Buck,
    /// Source and inductor in series; the output receives the current while the switch is off.
    Boost,
    /// Inverting: the inductor lies at the source while the switch is on, at the output while it is off. The output voltage
    /// counts as positive.
    BuckBoost,
}

impl Circuit {
    /// All of them, by their words in a contract.
    pub const EACH: [(&'static str, Circuit); 3] = [
        ("buck", Circuit::Buck),
        ("boost", Circuit::Boost),
        ("buck-boost", Circuit::BuckBoost),
    ];

    fn is_buck(&self) -> bool {
        *self == Circuit::Buck
    }
}

/// Serde calls it with a reference.
#[allow(clippy::trivially_copy_pass_by_ref)]
fn is_first(output: &usize) -> bool {
    *output == 0
}

/// When in a period the switch of an observer's model is on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum OnTime {
    /// At first: what is sampled is the valley of the inductor's current.
    Trailing,
    /// In the middle: what is sampled is its mean.
    Centre,
}

impl OnTime {
    /// Both, by their words in a contract.
    pub const EACH: [(&'static str, OnTime); 2] = [("trailing", OnTime::Trailing), ("centre", OnTime::Centre)];

    fn is_first(&self) -> bool {
        *self == OnTime::Trailing
    }
}

/// The voltage that a converter is to hold.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Hold {
    /// V, more than 0.
    pub voltage: f64,
    /// The output's share of the inductor's current per volt of input voltage and bias, at the duty that holds it, 1/V.
    pub share: f64,
    /// Inductor current per ampere of load at that duty without a bias, where the input voltage is a number; else 1.
    pub start: f64,
    /// What the surplus is clamped to, A.
    pub range: Interval,
}

/// Input voltage of an observer's model.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum InputVoltage {
    /// A number, V.
    Constant(f64),
    /// Index of a signal.
    Signal(usize),
}

/// Corrections per volt.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Gains {
    /// Of the current, A/V.
    pub current: f64,
    /// Of the voltage.
    pub voltage: f64,
    /// Of the bias.
    pub bias: f64,
}

/// One of the numbers that an observer estimates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Estimate {
    /// Inductor current at the sampling instant, A.
    Current,
    /// Output voltage, V.
    Voltage,
    /// Bias at the inductor, V.
    Bias,
    /// Mean current that would charge the capacitor at the duty that holds the voltage, A. It is no state: it follows from the
    /// others.
    Surplus,
}

impl Estimate {
    /// Those that are kept, in the order of the state.
    pub const STATE: [Estimate; 3] = [Estimate::Current, Estimate::Voltage, Estimate::Bias];
    /// All of them, in their order.
    pub const ALL: [Estimate; 4] = [Estimate::Current, Estimate::Voltage, Estimate::Bias, Estimate::Surplus];

    /// What stands behind the observer's name.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Estimate::Current => "current",
            Estimate::Voltage => "voltage",
            Estimate::Bias => "bias",
            Estimate::Surplus => "surplus",
        }
    }

    /// Its unit.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            Estimate::Current | Estimate::Surplus => "A",
            Estimate::Voltage | Estimate::Bias => "V",
        }
    }
}

impl Observer {
    /// What it estimates, in the order of [`Estimate::ALL`].
    pub fn estimates(&self) -> impl Iterator<Item = Estimate> {
        let count = if self.hold.is_some() { 4 } else { 3 };
        Estimate::ALL.into_iter().take(count)
    }

    /// What an estimate is clamped to; the surplus is 0 without a voltage to hold.
    #[must_use]
    pub fn range(&self, estimate: Estimate) -> Interval {
        match estimate {
            Estimate::Current => self.current,
            Estimate::Voltage => self.voltage,
            Estimate::Bias => self.bias,
            Estimate::Surplus => self.hold.map_or(Interval { low: 0.0, high: 0.0 }, |hold| hold.range),
        }
    }

    /// The signals that it reads.
    pub fn signals(&self) -> impl Iterator<Item = usize> {
        let source = match self.input_voltage {
            InputVoltage::Constant(_) => None,
            InputVoltage::Signal(index) => Some(index),
        };
        [self.output_voltage, self.load_current].into_iter().chain(source)
    }

    /// Signals of the last step that it remembers behind its estimates: without a compute delay the prediction waits for
    /// the command, so what it rests on is kept.
    pub fn remembered(&self) -> impl Iterator<Item = usize> {
        let source = match self.input_voltage {
            InputVoltage::Constant(_) => None,
            InputVoltage::Signal(index) => Some(index),
        };
        let all = [Some(self.load_current), source];
        let is_kept = self.compute_delay == 0;
        all.into_iter().flatten().filter(move |_| is_kept)
    }

    /// Words of the state (contract section 1).
    #[must_use]
    pub fn words(&self) -> usize {
        Estimate::STATE.len() + self.remembered().count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_estimate_has_the_unit_of_its_quantity() {
        let shown = Estimate::ALL.map(|estimate| format!("{} {}", estimate.word(), estimate.unit()));
        assert_eq!(shown, ["current A", "voltage V", "bias V", "surplus A"]);
    }
}
