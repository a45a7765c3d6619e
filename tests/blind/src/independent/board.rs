//! What stands on the bench: power stage, gates, source, load, and physics that no plant file states.
//!
//! The numbers are those of data sheets and of a bench, not the keys of a plant file. SI units; 0 is "absent", `None` too.

use std::f64::consts::PI;

/// What the leg connects the inductor to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Topology {
    Buck,
    Boost,
    /// Inverting; the output counts as positive.
    BuckBoost,
}

/// How a value falls as it is driven: real cores and dielectrics share no one formula.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Knee {
    /// `tanh(x)^2`
    Tanh,
    /// `x^n / (1 + x^n)`
    Power(i32),
    /// `1 - exp(-x^2)`
    Gauss,
}

/// A value that falls by `share` of itself far beyond the knee `at`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fall {
    pub share: f64,
    pub at: f64,
    pub knee: Knee,
}

impl Fall {
    /// What is left at `x`, as a factor.
    pub fn left(&self, x: f64) -> f64 {
        let x = x.abs() / self.at;
        let gone = match self.knee {
            Knee::Tanh => libm::tanh(x).powi(2),
            Knee::Power(n) => {
                let y = x.powi(n);
                y / (1.0 + y)
            }
            Knee::Gauss => 1.0 - libm::exp(-x * x),
        };
        1.0 - self.share * gone
    }
}

/// Inductor, capacitor and devices.
#[derive(Debug, Clone, PartialEq)]
pub struct Stage {
    pub l: f64,
    pub l_fall: Option<Fall>,
    pub r_winding: f64,
    /// Loss current of the core per volt across it.
    pub core: f64,
    pub c: f64,
    pub c_fall: Option<Fall>,
    pub esr: f64,
    /// Buck only: elsewhere the leg interrupts the capacitor's current.
    pub esl: f64,
    pub r_main: f64,
    pub r_second: f64,
    pub v_f: f64,
    pub r_d: f64,
    pub synchronous: bool,
}

/// Where in the period the on-interval lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Carrier {
    Trailing,
    Leading,
    Centre,
}

/// From the commanded duty to edges at the leg.
#[derive(Debug, Clone, PartialEq)]
pub struct Gates {
    pub f_sw: f64,
    pub carrier: Carrier,
    /// Between the two switches, s.
    pub dead: f64,
    /// Command to current, turning on, s.
    pub rise: f64,
    /// Command to no current, turning off, s.
    pub fall: f64,
    /// Turn-on that waits for the second diode to recover, s.
    pub recovery: f64,
    /// Capacitance of the switch node that the inductor has to discharge, F.
    pub node: f64,
    pub offset: f64,
    pub lsb: f64,
    /// Whole periods that a duty waits.
    pub late: usize,
    /// Standard deviation of an edge, s.
    pub jitter: f64,
    /// Added to every duty with this amplitude and a period of so many switching periods.
    pub dither: (f64, f64),
    /// Probability that a pulse is lost.
    pub lost: f64,
}

/// What feeds the converter.
#[derive(Debug, Clone, PartialEq)]
pub struct Source {
    pub v: f64,
    pub r: f64,
    /// Of the leads; needs `c`.
    pub l: f64,
    pub c: f64,
    pub esr: f64,
    /// Amplitude, frequency and phase (turns) of a line harmonic.
    pub ripple: (f64, f64, f64),
    /// Amplitude and frequency of the limit cycle of the supply's own regulator: a triangle.
    pub hunting: (f64, f64),
}

impl Source {
    /// Voltage behind the impedance.
    pub fn volts(&self, t: f64) -> f64 {
        let (a, f, phase) = self.ripple;
        let mut v = self.v;
        if a != 0.0 {
            v += a * libm::sin(2.0 * PI * (f * t + phase));
        }
        let (a, f) = self.hunting;
        if a != 0.0 {
            let x = f * t - libm::floor(f * t);
            v += a * (1.0 - 4.0 * (x - 0.5).abs());
        }
        v
    }
}

/// Wires to the load, with the capacitor at its terminals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cable {
    pub l: f64,
    pub r: f64,
    pub c: f64,
}

/// The load that answers to a set value.
#[derive(Debug, Clone, PartialEq)]
pub struct Sink {
    /// Drawn over set current and power.
    pub gain: f64,
    /// Real over set conductance.
    pub resistor: f64,
    pub bleed: f64,
    /// Time constant of constant power; 0 is at once.
    pub tau: f64,
    /// Below this voltage constant power is a resistor.
    pub fold: f64,
    /// Time constant L/R of the resistor; 0 is none.
    pub inductive: f64,
    pub cable: Option<Cable>,
}

/// Physics that no plant file states.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Odd {
    /// Rise of all copper and channel resistance when warm, as a share, and the time constant of it.
    pub heating: (f64, f64),
    /// Magnetising current that follows the sign of the inductor's voltage, A.
    pub hysteresis: f64,
    /// Share of the capacitance behind a slow resistance, and its time constant.
    pub absorption: (f64, f64),
    /// Share of the inductance that eddy currents short, and the time constant of it.
    pub eddy: (f64, f64),
    /// Loss current at one volt across the core, growing with the square of the voltage, A/V^2.
    pub core_square: f64,
}

/// A board with everything around it.
#[derive(Debug, Clone, PartialEq)]
pub struct Board {
    pub topology: Topology,
    pub stage: Stage,
    pub gates: Gates,
    pub source: Source,
    pub sink: Sink,
    pub odd: Odd,
}

/// What is set at the load.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Load {
    /// Conductance, S.
    pub g: f64,
    /// Constant current, A.
    pub i: f64,
    /// Constant power, W.
    pub p: f64,
}

impl Board {
    /// Switching period, s.
    pub fn t_sw(&self) -> f64 {
        1.0 / self.gates.f_sw
    }

    /// Ideal ratio of the voltages in continuous conduction.
    pub fn ratio(&self, duty: f64) -> f64 {
        match self.topology {
            Topology::Buck => duty,
            Topology::Boost => 1.0 / (1.0 - duty),
            Topology::BuckBoost => duty / (1.0 - duty),
        }
    }
}
