//! What goes into a plant and what comes out.

use serde::{Deserialize, Serialize};

/// What is set at the load; the three act side by side.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Load {
    /// Resistive part, S.
    pub conductance: f64,
    /// Constant current, A.
    pub current: f64,
    /// Constant power, W; resistive below `load.v_fold`.
    pub power: f64,
}

impl Load {
    /// A resistor of `resistance` ohm.
    #[must_use]
    pub fn resistor(resistance: f64) -> Self {
        Load {
            conductance: 1.0 / resistance,
            ..Load::default()
        }
    }

    /// A sink of `current` A.
    #[must_use]
    pub fn current(current: f64) -> Self {
        Load {
            current,
            ..Load::default()
        }
    }

    /// A constant power load of `power` W.
    #[must_use]
    pub fn power(power: f64) -> Self {
        Load {
            power,
            ..Load::default()
        }
    }

    /// What it draws at `v_out` V, A; a constant power well above the voltage at which it folds back.
    #[must_use]
    pub fn at(&self, v_out: f64) -> f64 {
        self.conductance * v_out + self.current + self.power / v_out
    }
}

/// The four signals of a converter at one instant.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Signals {
    /// Output voltage at the converter's terminals, V.
    pub v_out: f64,
    /// Current through the inductor, A.
    pub i_l: f64,
    /// Current out of the converter's terminals, A.
    pub i_out: f64,
    /// Voltage at the switch's input, V.
    pub v_in: f64,
}

/// One control period: what is true at its end, and what happened in it.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Sample {
    /// Output voltage at the sampling instant, V.
    pub v_out: f64,
    /// Inductor current at the sampling instant, A.
    pub i_l: f64,
    /// Load current at the sampling instant, A.
    pub i_out: f64,
    /// Input voltage at the sampling instant, V.
    pub v_in: f64,
    /// Lowest output voltage since the sample before, V.
    pub v_min: f64,
    /// Highest output voltage since the sample before, V.
    pub v_max: f64,
    /// Lowest inductor current since the sample before, A.
    pub i_min: f64,
    /// Highest inductor current since the sample before, A.
    pub i_max: f64,
    /// Whether the inductor current rested at 0 for a while (DCM).
    pub discontinuous: bool,
    /// What the sensors show.
    pub measured: Signals,
}

impl Sample {
    /// The true signals.
    #[must_use]
    pub fn signals(&self) -> Signals {
        Signals {
            v_out: self.v_out,
            i_l: self.i_l,
            i_out: self.i_out,
            v_in: self.v_in,
        }
    }
}
