//! Classical controllers on the same signals, the measured ones, as a scale for a policy.
//!
//! The gains scale by formula with the plant's L, C, T and the periods of delay. The constants in the formulas of [`Pid`] and
//! [`Cascade`] were found by random search for little deviation and settling time on the paper's plants and load steps, so
//! these two are tuned to what they are shown on; [`FeedForward`] and [`Deadbeat`] follow from the circuit, but for how fast
//! they learn its losses.

mod cascade;
mod deadbeat;
mod feed_forward;
mod pid;

use std::fmt;

use plant::{Parameters, Sample, Signals};

use crate::faults::Error;

pub use cascade::Cascade;
pub use deadbeat::Deadbeat;
pub use feed_forward::FeedForward;
pub use pid::Pid;

/// Which classical controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// [`Pid`].
    Pid,
    /// [`Cascade`].
    Cascade,
    /// [`FeedForward`].
    FeedForward,
    /// [`Deadbeat`].
    Deadbeat,
}

impl Kind {
    /// All of them, from the least to the most that a controller knows.
    pub const ALL: [Kind; 4] = [Kind::Pid, Kind::Cascade, Kind::FeedForward, Kind::Deadbeat];

    /// Name in scenario files and tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Pid => "pid",
            Self::Cascade => "cascade",
            Self::FeedForward => "feed-forward",
            Self::Deadbeat => "deadbeat",
        }
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// What the designs know of a plant: nominal values, no losses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Design {
    /// Inductance, H.
    pub l: f64,
    /// Capacitance, F.
    pub c: f64,
    /// Control period, s.
    pub t: f64,
    /// Source voltage, V.
    pub v_in: f64,
    /// Voltage to hold, V.
    pub v_ref: f64,
    /// Whole periods a duty waits.
    pub delay: usize,
}

impl Design {
    /// Reads the nominal values off a plant.
    #[must_use]
    pub fn new(parameters: &Parameters, v_ref: f64) -> Self {
        let converter = &parameters.converter;
        Self {
            l: converter.inductance,
            c: converter.capacitance,
            t: parameters.t_sw(),
            v_in: converter.v_in,
            v_ref,
            delay: parameters.pwm.duty_delay as usize,
        }
    }

    /// How far the current at the valley lies below its mean over the period, A.
    fn half_ripple(&self) -> f64 {
        // half of (v_in - v_ref) d t / l with d = v_ref / v_in
        0.5 * self.v_ref * (1.0 - self.v_ref / self.v_in) * self.t / self.l
    }

    /// The duty that holds `v_ref` without losses.
    fn rest(&self) -> f64 {
        self.v_ref / self.v_in
    }
}

/// A classical controller at work.
#[derive(Debug, Clone)]
pub enum Baseline {
    /// Voltage only.
    Pid(Pid),
    /// Voltage and inductor current.
    Cascade(Cascade),
    /// Voltage, inductor current and load current.
    FeedForward(FeedForward),
    /// Voltage, inductor current, load current and a model.
    Deadbeat(Box<Deadbeat>),
}

impl Baseline {
    /// A controller designed for the plant with these parameters.
    ///
    /// # Errors
    /// If the parameters are not those of a buck converter: the designs hold for no other.
    pub fn new(kind: Kind, parameters: &Parameters, v_ref: f64) -> Result<Self, Error> {
        parameters.require_buck("a classical controller")?;
        let design = Design::new(parameters, v_ref);
        Ok(match kind {
            Kind::Pid => Self::Pid(Pid::new(&design)),
            Kind::Cascade => Self::Cascade(Cascade::new(&design)),
            Kind::FeedForward => Self::FeedForward(FeedForward::new(&design)),
            Kind::Deadbeat => Self::Deadbeat(Box::new(Deadbeat::new(parameters, v_ref)?)),
        })
    }

    /// The duty to command on a sample, 0..1; only what the sensors show is used.
    pub fn step(&mut self, sample: &Sample) -> f64 {
        self.control(&sample.measured)
    }

    /// The duty to command on a measurement, 0..1.
    pub fn control(&mut self, measured: &Signals) -> f64 {
        match self {
            Self::Pid(controller) => controller.step(measured),
            Self::Cascade(controller) => controller.step(measured),
            Self::FeedForward(controller) => controller.step(measured),
            Self::Deadbeat(controller) => controller.step(measured),
        }
    }
}
