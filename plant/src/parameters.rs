//! What a converter is made of, as plain data. [`crate::effects`] says what each parameter means and which values it may
//! take.
//!
//! A field that is 0 (a gain that is 1) is an effect that is absent.

use serde::{Deserialize, Serialize};

/// A buck converter with its modulator, load and sensors.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Parameters {
    /// The circuit the paper writes down.
    pub converter: Converter,
    /// When the switch is told to turn on and off.
    pub pwm: Pwm,
    /// What the inductor does beyond L.
    pub inductor: Inductor,
    /// What the output capacitor does beyond C.
    pub capacitor: Capacitor,
    /// The two halves of the leg.
    pub switch: Switch,
    /// What feeds the converter.
    pub source: Source,
    /// What the load does with its setting.
    pub load: LoadBox,
    /// The wires to the load.
    pub cable: Cable,
    /// What the controller sees.
    pub sensors: Sensors,
}

impl Parameters {
    /// The loss-free buck with a diode rectifier.
    ///
    /// `v_in` V, `inductance` H, `capacitance` F, `f_sw` Hz.
    #[must_use]
    pub fn ideal(v_in: f64, inductance: f64, capacitance: f64, f_sw: f64) -> Self {
        let converter = Converter {
            v_in,
            inductance,
            capacitance,
            f_sw,
            ..Converter::default()
        };
        Parameters {
            converter,
            ..Parameters::default()
        }
    }

    /// The paper's converter with the 150 uF of its Table I.
    #[must_use]
    pub fn paper_table() -> Self {
        Self::ideal(200.0, 2e-3, 150e-6, 10e3)
    }

    /// The paper's converter with the 1.5 mF of its authors' published model.
    #[must_use]
    pub fn paper_model() -> Self {
        Self::ideal(200.0, 2e-3, 1.5e-3, 10e3)
    }

    /// The switching period, s.
    #[must_use]
    pub fn t_sw(&self) -> f64 {
        1.0 / self.converter.f_sw
    }
}

/// How the converter is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Model {
    /// Every switching interval, with ripple and DCM.
    #[default]
    Switched,
    /// Mean values over the period, the paper's equation 2; CCM only.
    Averaged,
}

/// What carries the inductor current while the switch is off.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Rectifier {
    /// A diode: DCM at light load.
    #[default]
    Diode,
    /// A second switch with a body diode.
    Synchronous,
}

/// Where in the period the on-interval lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Carrier {
    /// On-interval first: the trailing edge is modulated.
    #[default]
    Trailing,
    /// On-interval last: the leading edge is modulated.
    Leading,
    /// On-interval in the middle.
    Centre,
}

/// What becomes of a pulse shorter than the minimum on-time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ShortPulse {
    /// It is left out.
    #[default]
    Drop,
    /// It is lengthened to the minimum, unless the duty is 0.
    Extend,
}

/// The circuit the paper writes down.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Converter {
    /// Switched or averaged.
    pub model: Model,
    /// Diode or second switch.
    pub rectifier: Rectifier,
    /// Source voltage, V.
    pub v_in: f64,
    /// Inductance at no current, H.
    pub inductance: f64,
    /// Capacitance at no voltage, F.
    pub capacitance: f64,
    /// Switching and control frequency, Hz.
    pub f_sw: f64,
}

impl Default for Converter {
    fn default() -> Self {
        Converter {
            model: Model::Switched,
            rectifier: Rectifier::Diode,
            v_in: 200.0,
            inductance: 2e-3,
            capacitance: 1.5e-3,
            f_sw: 10e3,
        }
    }
}

/// When the switch is told to turn on and off, and when the controller samples.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Pwm {
    /// Where in the period the on-interval lies.
    pub carrier: Carrier,
    /// Sampling instant as a fraction of the PWM period, 0 to below 1.
    pub sampling_phase: f64,
    /// Whole periods a duty waits beyond the next start of a period.
    pub duty_delay: u32,
    /// Step of the duty, 1; 0 for none.
    pub duty_lsb: f64,
    /// Shortest pulse of the switch, s.
    pub min_on_time: f64,
    /// What becomes of a shorter pulse.
    pub short_pulse: ShortPulse,
}

/// What the inductor does beyond L.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Inductor {
    /// Winding resistance, ohm.
    pub dcr: f64,
    /// Share of the inductance that is lost far above `i_sat`, 1.
    pub saturation: f64,
    /// Current at which half of that share is lost, A.
    pub i_sat: f64,
    /// Conductance across the inductance that stands for the core loss, S.
    pub core_conductance: f64,
}

impl Default for Inductor {
    fn default() -> Self {
        Inductor {
            dcr: 0.0,
            saturation: 0.0,
            i_sat: 10.0,
            core_conductance: 0.0,
        }
    }
}

/// What the output capacitor does beyond C.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Capacitor {
    /// Equivalent series resistance, ohm.
    pub esr: f64,
    /// Equivalent series inductance, H.
    pub esl: f64,
    /// Share of the capacitance that is lost far above `v_half`, 1.
    pub derating: f64,
    /// Voltage at which half of that share is lost, V.
    pub v_half: f64,
}

impl Default for Capacitor {
    fn default() -> Self {
        Capacitor {
            esr: 0.0,
            esl: 0.0,
            derating: 0.0,
            v_half: 100.0,
        }
    }
}

/// The two halves of the leg.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Switch {
    /// On-resistance of the switch, ohm.
    pub r_ds_on: f64,
    /// On-resistance of the second switch of a synchronous leg, ohm.
    pub r_ds_on_low: f64,
    /// Forward voltage of the diode (of the body diodes of a synchronous leg), V.
    pub v_f: f64,
    /// Differential resistance of the diode, ohm.
    pub r_d: f64,
    /// How much later a switch is told to turn on so that both are never on, s.
    pub dead_time: f64,
    /// From the command to the current when turning on, s.
    pub turn_on_delay: f64,
    /// From the command to no current when turning off, s.
    pub turn_off_delay: f64,
}

/// What feeds the converter.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Source {
    /// Series resistance, ohm.
    pub resistance: f64,
    /// Series inductance, H; needs `c_in`.
    pub inductance: f64,
    /// Input capacitor, F.
    pub c_in: f64,
    /// Series resistance of the input capacitor, ohm.
    pub esr_in: f64,
    /// Amplitude of the line harmonic, V.
    pub ripple: f64,
    /// Frequency of the line harmonic, Hz.
    pub ripple_frequency: f64,
    /// Phase of the line harmonic at time 0, turns.
    pub ripple_phase: f64,
}

impl Default for Source {
    fn default() -> Self {
        Source {
            resistance: 0.0,
            inductance: 0.0,
            c_in: 0.0,
            esr_in: 0.0,
            ripple: 0.0,
            ripple_frequency: 100.0,
            ripple_phase: 0.0,
        }
    }
}

/// What the load does with its setting.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LoadBox {
    /// Conductance that is always there, S.
    pub bleed: f64,
    /// Time constant of the constant-power regulation, s.
    pub cpl_time_constant: f64,
    /// Voltage below which constant power becomes a resistor, V.
    pub v_fold: f64,
    /// Drawn current or power over the set one, 1.
    pub setting_gain: f64,
    /// Real conductance over the set one, 1.
    pub resistor_gain: f64,
}

impl Default for LoadBox {
    fn default() -> Self {
        LoadBox {
            bleed: 0.0,
            cpl_time_constant: 0.0,
            v_fold: 5.0,
            setting_gain: 1.0,
            resistor_gain: 1.0,
        }
    }
}

/// The wires to the load, and the capacitor at their far end.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Cable {
    /// Inductance of both wires, H; needs `capacitance`.
    pub inductance: f64,
    /// Resistance of both wires, ohm; needs `inductance`.
    pub resistance: f64,
    /// Capacitor at the load's terminals, F; needs `inductance`.
    pub capacitance: f64,
}

/// What the controller sees.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Sensors {
    /// Seed of the noise of all sensors.
    pub seed: u64,
    /// Output voltage, V.
    pub v_out: Sensor,
    /// Inductor current, A.
    pub i_l: Sensor,
    /// Load current, A.
    pub i_out: Sensor,
    /// Input voltage, V.
    pub v_in: Sensor,
}

/// One measuring chain: delay and low-pass, then gain and offset, then noise, then quantisation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Sensor {
    /// Shown over true, 1.
    pub gain: f64,
    /// Shown when the true value is 0, in the sensor's unit.
    pub offset: f64,
    /// Time constant of the low-pass, s.
    pub low_pass: f64,
    /// Age of what is shown, s; less than eight periods.
    pub delay: f64,
    /// Standard deviation of the noise, in the sensor's unit.
    pub noise: f64,
    /// Step of the converter, in the sensor's unit.
    pub lsb: f64,
}

impl Default for Sensor {
    fn default() -> Self {
        Sensor {
            gain: 1.0,
            offset: 0.0,
            low_pass: 0.0,
            delay: 0.0,
            noise: 0.0,
            lsb: 0.0,
        }
    }
}
