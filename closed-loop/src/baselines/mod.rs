//! Classical controllers on the same signals, the measured ones, as a scale for a policy.
//!
//! The gains scale by formula with the plant's L, C, T and the time from a sample to its duty. The constants in the formulas of [`Pid`] and
//! [`Cascade`] were found by random search for little deviation and settling time on the paper's plants and load steps, so
//! these two are tuned to what they are shown on; [`FeedForward`] and [`Deadbeat`] follow from the circuit, but for how fast
//! they learn its losses.
//!
//! A boost and a buck-boost have the same inner loops: what a duty does to the current follows from the circuit. Their output
//! answers the wrong way at first, by a zero in the right half-plane at `D'^2 R/L` (boost) or `D'^2 R/(D L)` (buck-boost;
//! Erickson and Maksimovic, Fundamentals of Power Electronics, table 8.2), so whatever regulates the voltage stays at
//! [`OF_ZERO`] of it.

mod cascade;
mod deadbeat;
mod feed_forward;
mod observed;
mod pid;

use std::fmt;

use plant::{Carrier, Model, Parameters, Sample, Signals, Topology};
use toml_input::Message;

use crate::faults::Error;
use crate::part;

pub use cascade::Cascade;
pub use deadbeat::Deadbeat;
pub use feed_forward::FeedForward;
pub use observed::observed;
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
    /// The converter.
    pub topology: Topology,
    /// Where the on-interval lies; none of an averaged plant, whose current has no ripple.
    pub carrier: Option<Carrier>,
    /// Sampling instant as a share of the PWM period.
    pub phase: f64,
    /// Largest load current, A; a buck's design does without.
    pub i_out: f64,
}

/// Share of the zero in the right half-plane at which a voltage loop may cross over.
// at a fifth it costs 11 degrees of phase; the regulator of `plant::settle` takes the same
pub const OF_ZERO: f64 = 0.2;
/// Crossover over resonance of L and C from which on the converter looks like the double integrator that `Pid` is made for.
// below, the loop gain falls through 1 on the resonance, where nothing damps a load of constant power
const ABOVE_RESONANCE: f64 = 2.0;
/// Largest duty of a converter whose output receives nothing at 1, as in `plant::settle`.
const MOST: f64 = 0.95;

impl Design {
    /// Reads the nominal values off a plant.
    #[must_use]
    pub fn new(parameters: &Parameters, v_ref: f64, i_out: f64) -> Self {
        let converter = &parameters.converter;
        Self {
            topology: converter.topology,
            carrier: (converter.model == Model::Switched).then_some(parameters.pwm.carrier),
            phase: parameters.pwm.sampling_phase,
            i_out,
            l: converter.inductance,
            c: converter.capacitance,
            t: parameters.t_sw(),
            v_in: converter.v_in,
            v_ref,
            delay: parameters.pwm.duty_delay as usize,
        }
    }

    /// How far the sampled current lies below its mean over the period, A.
    pub(crate) fn below_mean(&self) -> f64 {
        // also where the duty at rest is 0 or 1, which has no ripple to divide
        if self.phase == 0.0 {
            return self.below_at_start();
        }
        let rest = self.rest();
        let on = self.on(rest, 0.0, self.phase);
        // up by the whole ripple while the switch is on, down again for the others
        let risen = match self.carrier {
            Some(_) => 2.0 * (on / rest - (self.phase - on) / (1.0 - rest)),
            None => 0.0,
        };
        self.below_at_start() - risen * self.half_ripple()
    }

    /// The same where a PWM period starts, A.
    pub(crate) fn below_at_start(&self) -> f64 {
        match self.carrier {
            Some(Carrier::Trailing) => self.half_ripple(),
            Some(Carrier::Leading) => -self.half_ripple(),
            Some(Carrier::Centre) | None => 0.0,
        }
    }

    /// How long the switch is on under `duty` between two instants of a period, shares of it.
    pub(crate) fn on(&self, duty: f64, from: f64, to: f64) -> f64 {
        match self.carrier {
            Some(carrier) => part::on(carrier, duty, from, to),
            None => duty * (to - from),
        }
    }

    /// Share of a period from the sample to the next start, at which a duty can act first.
    pub(crate) fn wait(&self) -> f64 {
        if self.phase > 0.0 { 1.0 - self.phase } else { 0.0 }
    }

    /// Periods from a sample to its duty.
    pub(crate) fn late(&self) -> f64 {
        self.delay as f64 + self.wait()
    }

    /// Whole periods that a duty is late, begun ones too: gains that were found for these are safe.
    // between the gains without and with a period, by the share of it, the cascade sampled at .2 swings by .46 V for 30 ms
    fn begun(&self) -> usize {
        self.delay + usize::from(self.phase > 0.0)
    }

    /// How far the current at the valley lies below its mean over the period, A.
    pub(crate) fn half_ripple(&self) -> f64 {
        0.5 * self.topology.ripple(self.v_in, self.v_ref) * self.t / self.l
    }

    /// The duty that holds `v_ref` without losses.
    pub(crate) fn rest(&self) -> f64 {
        self.topology.duty(self.v_in, self.v_ref)
    }

    /// Share of the inductor's current that the output receives at rest.
    pub(crate) fn give(&self) -> f64 {
        self.topology.give(self.rest())
    }

    /// What a duty of 1 adds to the voltage at the inductor at rest, V.
    pub(crate) fn span(&self) -> f64 {
        self.topology.span(self.v_in, self.v_ref)
    }

    /// Control periods of the fastest crossover of a voltage loop at a load of `i_out` A: `1/(w T)`.
    fn periods_of_zero(&self, i_out: f64) -> f64 {
        let zero = self
            .topology
            .right_half_plane_zero(self.v_in, self.v_ref, i_out, self.l);
        1.0 / (OF_ZERO * zero * self.t)
    }

    /// Current per volt of error that a voltage loop may ask for at a load of `i_out` A, A/V: half of what is missing in as many
    /// periods as a duty takes, or what the zero leaves.
    pub(crate) fn by_voltage(&self, i_out: f64) -> f64 {
        let paced = f64::max(2.0 * (1.0 + self.late()), self.periods_of_zero(i_out));
        self.c / self.t / paced / self.give()
    }

    /// Largest duty.
    fn most(&self) -> f64 {
        match self.topology {
            Topology::Buck => 1.0,
            Topology::Boost | Topology::BuckBoost => MOST,
        }
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
    /// A controller designed for the plant with these parameters and loads up to `i_out` A.
    ///
    /// # Errors
    /// If there is no such controller for the plant: a PID controller on the voltage of a converter whose zero in the right
    /// half-plane lies near its resonance.
    pub fn new(kind: Kind, parameters: &Parameters, v_ref: f64, i_out: f64) -> Result<Self, Error> {
        let design = Design::new(parameters, v_ref, i_out);
        Ok(match kind {
            Kind::Pid => Self::Pid(Pid::new(&designed_above_resonance(design)?)),
            Kind::Cascade => Self::Cascade(Cascade::new(&design)),
            Kind::FeedForward => Self::FeedForward(FeedForward::new(&design)),
            Kind::Deadbeat => Self::Deadbeat(Box::new(Deadbeat::new(parameters, &design)?)),
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

/// The design, if a voltage loop may cross over well above the resonance.
fn designed_above_resonance(design: Design) -> Result<Design, Error> {
    let crossover = 1.0 / (design.periods_of_zero(design.i_out) * design.t);
    let resonance = design.give() / (design.l * design.c).sqrt();
    if crossover >= ABOVE_RESONANCE * resonance {
        return Ok(design);
    }
    let hertz = |angular: f64| format!("{:.3} kHz", 1e-3 * angular / std::f64::consts::TAU);
    let word = design.topology.word();
    let message = Message::new(format!(
        "a PID controller on the voltage cannot hold this {word} converter"
    ));
    let found = format!(
        "a zero in the right half-plane at {} with a load of {:.3} A, a resonance at {}",
        hertz(crossover / OF_ZERO),
        design.i_out,
        hertz(resonance)
    );
    let least = ABOVE_RESONANCE / OF_ZERO;
    Err(message
        .found(found)
        .expected(format!("a zero at {least} times the resonance at least"))
        .hint("`cascade`, `feed-forward` and `deadbeat` measure the current and do without")
        .into())
}
