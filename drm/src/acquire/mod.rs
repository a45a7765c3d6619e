//! Algorithm 1 of the paper: settled points over duties and loads, from a simulated converter or at a bench.

mod bench;
mod plan_csv;
mod protocol;

use std::fmt;

use plant::Load;
use toml_input::{Faults, Message, Sink};

pub use bench::Bench;
pub use protocol::{Protocol, measure};

/// What hangs at the output.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LoadSetting {
    /// ohm
    Resistor(f64),
    /// A
    Current(f64),
    /// W
    Power(f64),
}

impl LoadSetting {
    /// For the plant.
    #[must_use]
    pub fn load(self) -> Load {
        match self {
            LoadSetting::Resistor(ohm) => Load::resistor(ohm),
            LoadSetting::Current(ampere) => Load::current(ampere),
            LoadSetting::Power(watt) => Load::power(watt),
        }
    }

    /// Its current at `v_out` V, A.
    #[must_use]
    pub fn current(self, v_out: f64) -> f64 {
        match self {
            LoadSetting::Resistor(ohm) => v_out / ohm,
            LoadSetting::Current(ampere) => ampere,
            LoadSetting::Power(watt) => watt / v_out,
        }
    }
}

impl fmt::Display for LoadSetting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            LoadSetting::Resistor(ohm) => write!(f, "resistor {ohm} ohm"),
            LoadSetting::Current(ampere) => write!(f, "current {ampere} A"),
            LoadSetting::Power(watt) => write!(f, "constant power {watt} W"),
        }
    }
}

/// How a point is held while it is measured. Only duty, voltage and current count for the mapping, not what holds them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Hold {
    /// The duty stands still.
    OpenLoop,
    /// A regulator holds this voltage, V; the duty is its mean.
    ClosedLoop(f64),
}

impl fmt::Display for Hold {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Hold::OpenLoop => write!(f, "open loop"),
            Hold::ClosedLoop(v_out) => write!(f, "closed loop at {v_out} V"),
        }
    }
}

/// A point to be measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlanPoint {
    /// Duty ratio, 0..1. In closed loop the voltage is held that a loss-free converter has with it.
    pub duty: f64,
    /// What hangs at the output.
    pub load: LoadSetting,
    /// How the point is held.
    pub hold: Hold,
}

/// A measured point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measurement {
    /// Mean commanded duty ratio, 0..1.
    pub d_real: f64,
    /// Mean output voltage, V.
    pub v_out: f64,
    /// Mean load current, A.
    pub i_out: f64,
    /// Mean input voltage, V.
    pub v_in: f64,
    /// Standard deviation of the samples of v_out, V.
    pub v_std: f64,
    /// Whether the means stood still.
    pub settled: bool,
    /// How the point was held in the end.
    pub hold: Hold,
}

/// Points to be measured, and what is known of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Input voltage the plan was made for, V.
    pub v_in: f64,
    /// Pause after each point, s.
    pub cool_down: f64,
    /// Each point with its measurement, in the order of Algorithm 1: all duties of a load, then the next load.
    pub points: Vec<(PlanPoint, Option<Measurement>)>,
}

impl Plan {
    /// Every duty with every load.
    ///
    /// With a constant power load the open loop is unstable unless the series resistance exceeds `L P / (C V^2)`: such
    /// points are held in closed loop.
    ///
    /// # Errors
    /// If there is no duty or load, or one makes no sense.
    pub fn new(v_in: f64, duties: &[f64], loads: &[LoadSetting], cool_down: f64) -> Result<Self, Faults> {
        let mut faults = Sink::new();
        let mut require = |holds: bool, what: &str, found: f64, expected: &str| {
            if !holds {
                let message = Message::new(format!("{what} out of range")).found(found.to_string());
                faults.push(message.expected(expected));
            }
        };
        require(
            v_in > 0.0 && v_in.is_finite(),
            "the input voltage is",
            v_in,
            "greater than 0 V",
        );
        require(
            cool_down >= 0.0 && cool_down.is_finite(),
            "the cool-down is",
            cool_down,
            "0 s or more",
        );
        for duty in duties {
            require(
                *duty > 0.0 && *duty < 1.0,
                "a duty ratio is",
                *duty,
                "between 0 and 1, not percent",
            );
        }
        for load in loads {
            let (LoadSetting::Resistor(x) | LoadSetting::Current(x) | LoadSetting::Power(x)) = *load;
            require(x > 0.0 && x.is_finite(), "a load is", x, "greater than 0");
        }
        for (list, what) in [(duties.len(), "duties"), (loads.len(), "loads")] {
            if list == 0 {
                faults.push(Message::new(format!("the plan has no {what}")).expected("at least two"));
            }
        }
        faults.propagate()?;
        let point = |load: LoadSetting, duty: f64| PlanPoint {
            duty,
            load,
            hold: match load {
                // to a microvolt: it is written down and read by people
                LoadSetting::Power(_) => Hold::ClosedLoop((duty * v_in * 1e6).round() / 1e6),
                LoadSetting::Resistor(_) | LoadSetting::Current(_) => Hold::OpenLoop,
            },
        };
        let points = loads
            .iter()
            .flat_map(|load| duties.iter().map(move |duty| (point(*load, *duty), None)));
        Ok(Plan {
            v_in,
            cool_down,
            points: points.collect(),
        })
    }

    /// Number of points still to be measured.
    #[must_use]
    pub fn open(&self) -> usize {
        self.points
            .iter()
            .filter(|(_, measurement)| measurement.is_none())
            .count()
    }
}
