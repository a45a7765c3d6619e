//! The bench that is measured: circuit, modulator and sensors, with everything that may be wrong about them.
//!
//! SI units throughout. [`Bench::nominal`] is what `plant.toml` says; 0 (a gain: 1) is "absent".

/// Switching period, s.
pub const T_SW: f64 = 1e-4;

/// Everything between the commanded duty and the recorded numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Bench {
    /// Power stage, source and load.
    pub circuit: Circuit,
    /// From commanded duty to gate edges.
    pub modulator: Modulator,
    /// From true signals to recorded ones.
    pub sensors: Sensors,
}

/// Power stage, source and load.
#[derive(Debug, Clone, PartialEq)]
pub struct Circuit {
    /// Source voltage, V.
    pub v_in: f64,
    /// Inductance at no current, H.
    pub inductance: f64,
    /// Capacitance at no voltage, F.
    pub capacitance: f64,
    /// On-resistance of the switch, ohm.
    pub r_ds_on: f64,
    /// Forward voltage of the diode, V.
    pub v_f: f64,
    /// Differential resistance of the diode, ohm.
    pub r_d: f64,
    /// Winding resistance, ohm.
    pub dcr: f64,
    /// Series resistance of the capacitor, ohm.
    pub esr: f64,
    /// Series inductance of the capacitor, H.
    pub esl: f64,
    /// Share of the inductance lost far above `i_sat`.
    pub saturation: f64,
    /// Current at which half of that share is lost, A.
    pub i_sat: f64,
    /// Share of the capacitance lost far above `v_half`.
    pub derating: f64,
    /// Voltage at which half of that share is lost, V.
    pub v_half: f64,
    /// Series resistance of the source, ohm.
    pub source_resistance: f64,
    /// Time constant of the constant-power regulation, s.
    pub cpl_time_constant: f64,
    /// Voltage below which constant power becomes a resistor, V.
    pub v_fold: f64,
    /// Drawn over set current and power.
    pub load_gain: f64,
    /// What no list has.
    pub odd: OddCircuit,
}

/// Effects of the circuit that are on nobody's list.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct OddCircuit {
    /// Capacitance at the switch node, F: the diode takes over late at low current.
    pub switch_node_capacitance: f64,
    /// Magnetising current that follows the sign of the inductor's voltage, A.
    pub hysteresis_current: f64,
    /// Winding resistance added in the course of a record, ohm.
    pub drift_resistance: f64,
    /// Time constant of that heating, s.
    pub drift_time: f64,
    /// Capacitance that charges slowly (dielectric absorption), as a share of the capacitance.
    pub absorption: f64,
    /// Resistance in front of it, ohm.
    pub absorption_resistance: f64,
    /// Share of the inductance that eddy currents short.
    pub eddy_share: f64,
    /// Resistance across that share, ohm.
    pub eddy_resistance: f64,
    /// Inductance of the wires to the load, H, with `cable_capacitance` behind it.
    pub cable_inductance: f64,
    /// Capacitance at the load's terminals, F.
    pub cable_capacitance: f64,
    /// Amplitude of a line harmonic of the source, V.
    pub line_ripple: f64,
    /// Its frequency, Hz.
    pub line_frequency: f64,
}

/// From commanded duty to gate edges.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Modulator {
    /// How much later the switch is told to turn on, s.
    pub dead_time: f64,
    /// From the command to the current when turning on, s.
    pub turn_on_delay: f64,
    /// Whole periods that a duty waits.
    pub duty_delay: f64,
    /// Step of the duty.
    pub duty_lsb: f64,
    /// Standard deviation of each edge for 1 A of set load, s. On nobody's list.
    pub jitter_per_ampere: f64,
    /// Probability that a pulse is missing. On nobody's list.
    pub missing: f64,
}

/// From true signals to recorded ones.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensors {
    /// Gain and offset (V, A) of output voltage and inductor current.
    pub v_gain: f64,
    /// V
    pub v_offset: f64,
    /// Shown over true.
    pub i_gain: f64,
    /// A
    pub i_offset: f64,
    /// Time constant of the low-pass of output voltage and both currents, s.
    pub low_pass: f64,
    /// How much later than stamped all channels are sampled, s; negative for earlier.
    pub delay: f64,
    /// Step of the voltages, V.
    pub v_lsb: f64,
    /// Step of the currents, A.
    pub i_lsb: f64,
    /// Standard deviation of the voltages' noise, V.
    pub v_noise: f64,
    /// Standard deviation of the currents' noise, A.
    pub i_noise: f64,
    /// What no list has.
    pub odd: OddSensors,
}

/// Effects of the voltage sensor that are on nobody's list.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct OddSensors {
    /// Error at 10 V from 100 V, growing with the cube, V.
    pub cubic: f64,
    /// Amplitude of a line frequency that is picked up, V.
    pub mains: f64,
    /// Phase of it at the start, turns.
    pub mains_phase: f64,
    /// Jump of the shown voltage within a record, V.
    pub shift: f64,
    /// Size of wrong samples in a burst, V.
    pub burst: f64,
}

impl Bench {
    /// What both sides agree on: the text of [`PLANT`].
    #[must_use]
    pub fn nominal() -> Self {
        let circuit = Circuit {
            v_in: 200.0,
            inductance: 2e-3,
            capacitance: 150e-6,
            r_ds_on: 0.05,
            v_f: 0.8,
            r_d: 0.02,
            dcr: 0.1,
            esr: 0.03,
            esl: 0.0,
            saturation: 0.0,
            i_sat: 10.0,
            derating: 0.0,
            v_half: 100.0,
            source_resistance: 0.0,
            cpl_time_constant: 50e-6,
            v_fold: 5.0,
            load_gain: 1.0,
            odd: OddCircuit::default(),
        };
        let sensors = Sensors {
            v_gain: 1.0,
            v_offset: 0.0,
            i_gain: 1.0,
            i_offset: 0.0,
            low_pass: 10e-6,
            delay: 0.0,
            v_lsb: 0.0,
            i_lsb: 0.0,
            v_noise: 0.1,
            i_noise: 0.05,
            odd: OddSensors::default(),
        };
        Self {
            circuit,
            modulator: Modulator::default(),
            sensors,
        }
    }
}

/// The nominal bench as the plant file that a diagnosis starts from.
pub const PLANT: &str = include_str!("../../../examples/blind/plant.toml");
