//! A model of the converter that runs beside it (contract section 2b).

use serde::Serialize;

use crate::interval::Interval;

/// Predictor of a buck converter, corrected by the measured output voltage: what it estimates can be read as a signal.
///
/// Its states are the inductor current at the sampling instant, the output voltage, and a bias in volts at the switch node
/// that stands for all losses and for a wrong input voltage. One period with the duty d, switched on first, adds
/// `(V d - v/2 + b) T/L` to the current and the charge of its mean to the voltage.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Observer {
    /// Its estimates are called `<name>_current`, `<name>_voltage` and `<name>_bias`.
    pub name: String,
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
    /// What one volt between measured and predicted output voltage corrects.
    pub gains: Gains,
    /// What the estimated current is clamped to, in A; 0 below is the diode of a buck converter.
    pub current: Interval,
    /// What the estimated output voltage is clamped to, in V: the plausible range of its signal.
    pub voltage: Interval,
    /// What the bias is clamped to, in V; 0 is inside.
    pub bias: Interval,
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

/// One of the three numbers that an observer estimates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Estimate {
    /// Inductor current at the sampling instant, A.
    Current,
    /// Output voltage, V.
    Voltage,
    /// Bias at the switch node, V.
    Bias,
}

impl Estimate {
    /// All of them, in the order of the state.
    pub const ALL: [Estimate; 3] = [Estimate::Current, Estimate::Voltage, Estimate::Bias];

    /// What stands behind the observer's name.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Estimate::Current => "current",
            Estimate::Voltage => "voltage",
            Estimate::Bias => "bias",
        }
    }

    /// Its unit.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            Estimate::Current => "A",
            Estimate::Voltage | Estimate::Bias => "V",
        }
    }
}

impl Observer {
    /// What an estimate is clamped to.
    #[must_use]
    pub fn range(&self, estimate: Estimate) -> Interval {
        match estimate {
            Estimate::Current => self.current,
            Estimate::Voltage => self.voltage,
            Estimate::Bias => self.bias,
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
        Estimate::ALL.len() + self.remembered().count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_estimate_has_the_unit_of_its_quantity() {
        let shown = Estimate::ALL.map(|estimate| format!("{} {}", estimate.word(), estimate.unit()));
        assert_eq!(shown, ["current A", "voltage V", "bias V"]);
    }
}
