//! A capture: a few periods of one steady state at the rate of an oscilloscope.
//!
//! ```text
//! table ─► clean ─► edges ─► period ─► fold ─► alike ─► Capture ─┬─► plausible   sizes that no bench has
//!                   (v_sw, v_pwm)      (all samples)              ├─► estimates   L, ESR, delays, ... with intervals
//!                                                                 └─► terms       residuals of the plant's own steady state,
//!                                                                                 beside those of all other records in every fit
//! ```
//! A capture stands in the list of records as one settled row in which nothing is measured. What it says comes through `terms`
//! with its own noise: a channel of an oscilloscope and a meter of the same name have nothing in common.
//!
//! Invariant: bins count from an origin that `Origin` names; what the trigger did is nowhere else.

mod alike;
mod clean;
mod edges;
pub mod estimates;
mod fold;
pub mod left;
mod node;
mod period;
pub(crate) mod plausible;
mod read;
pub mod terms;

pub(crate) use clean::leave_out_wild;
pub use edges::At;
pub use fold::{Bins, Fold};
pub(crate) use read::{Samples, is_capture, read};

use crate::exact::Exact;
use crate::record::CHANNELS;

/// What phase 0 of the bins is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Origin {
    /// The switch node rises.
    Node,
    /// The first sample: the trigger's own.
    Free,
}

/// Rising and falling edge of a signal of two levels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pulse {
    /// Upward, s from the start of the table.
    pub on: At,
    /// How long it stays high, s.
    pub width: At,
}

/// A voltage with its standard deviation, V.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Level {
    /// V
    pub value: f64,
    /// V; instrument and noise.
    pub sd: f64,
}

/// What the switch node shows.
#[derive(Debug, Clone, PartialEq)]
pub struct Node {
    /// Its high interval.
    pub pulse: Pulse,
    /// Voltage while the switch conducts, in the middle of the interval.
    pub on: Level,
    /// Voltage while the diode or the lower switch conducts; nothing where the current rests.
    pub off: Option<Level>,
    /// Mean over whole periods.
    pub mean: Level,
}

/// A capture, folded.
#[derive(Debug, Clone, PartialEq)]
pub struct Capture {
    /// Switching period, s.
    pub period: f64,
    /// By the capture itself; else that of the model, since nothing shows it.
    pub timed: bool,
    /// Usual time between samples, s.
    pub step: f64,
    /// Bins of the period.
    pub bins: Bins,
    /// What phase 0 is.
    pub origin: Origin,
    /// Measured channels, folded.
    pub folds: [Option<Fold>; CHANNELS],
    /// Channels that show no mean: coupled through a capacitor, or cut off.
    pub ac: [bool; CHANNELS],
    /// Command of the switch at its pin.
    pub pin: Option<Pulse>,
    /// Switch node.
    pub node: Option<Node>,
    /// Mean current of the source, A.
    pub i_in: Option<Level>,
    /// The current rests for a part of the period, as far as the capture shows it.
    pub discontinuous: Option<bool>,
}

/// Accuracy of an oscilloscope: gain, as a share of the value, ...
// makers state 2 to 3 % as a limit; probes add 1 to 2 %
pub(crate) const GAIN: f64 = 0.01;
/// ... and offset, as a share of the range.
// 0.1 of 8 or 10 divisions as a limit
const OFFSET: f64 = 0.005;
/// Values that a converter of eight bits uses of its 256 in a picture that fills the screen.
const STEPS: f64 = 200.0;

/// Standard deviation of a mean value on a channel that spans `span` with steps of `quantum`.
pub(crate) fn accuracy(value: f64, span: f64, quantum: f64) -> f64 {
    (GAIN * value).hypotenuse(OFFSET * span.max(STEPS * quantum))
}

impl Capture {
    /// A mean value of a channel, if it shows one.
    pub fn mean(&self, channel: usize) -> Option<Level> {
        let fold = self.folds[channel]
            .as_ref()
            .filter(|fold| !self.ac[channel] && fold.mean.is_finite())?;
        Some(Level {
            value: fold.mean,
            sd: fold.mean_sd.hypotenuse(accuracy(fold.mean, fold.span, fold.step)),
        })
    }
}
