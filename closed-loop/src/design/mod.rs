//! An observer and a law of control from a plant's nominal values (`docs/reference/policy-file.md`, Observers).
//!
//! ```text
//!  plant ─► Model: T/L, T/C ─► steady Kalman filter ─► gains of [[observer]]
//!                          └─► double pole ─────────► base of [actions]
//! ```

mod current;
mod kalman;
mod text;

use plant::{Parameters, Rectifier};
use toml_input::Message;

use crate::faults::Error;

pub use current::CurrentLaw;
pub use kalman::{Filter, Model, Noise};
pub use text::rounded;

/// What is asked beside the plant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wanted {
    /// Voltage to hold, V.
    pub v_ref: f64,
    /// Largest load current, A.
    pub load: f64,
    /// Standard deviation of the measured output voltage, V; that of the plant's sensor unless given.
    pub noise: Option<f64>,
    /// What the model may be wrong by in a period, as standard deviations; [`Noise::usual`] unless given.
    pub model: Option<[f64; 3]>,
    /// Double pole of the law, 0 to 1: how much of an error is left after a period.
    pub pole: f64,
}

/// An observer and a law for a plant.
#[derive(Debug, Clone, PartialEq)]
pub struct Design {
    /// Voltage to hold, V.
    pub v_ref: f64,
    /// Largest load current, A.
    pub load: f64,
    /// Source voltage, V.
    pub v_in: f64,
    /// Inductance, H.
    pub inductance: f64,
    /// Capacitance, F.
    pub capacitance: f64,
    /// Control period, s.
    pub period: f64,
    /// Periods from a measurement to its duty, 0 or 1.
    pub compute_delay: u32,
    /// The current stops at 0 A.
    pub has_diode: bool,
    /// The observer's filter.
    pub filter: Filter,
    /// What it was designed for.
    pub noise: Noise,
    /// Double pole of the law.
    pub pole: f64,
    /// Duty per ampere of surplus current.
    pub by_current: f64,
    /// Duty per volt of error.
    pub by_voltage: f64,
    /// How far the current at the sampling instant lies below its mean, A.
    pub half_ripple: f64,
    /// How much farther per volt of bias, A/V: losses want a larger duty, and so another ripple.
    pub ripple_by_bias: f64,
}

impl Design {
    /// Designs for the nominal values of a plant: its losses stay unknown to both.
    ///
    /// # Errors
    /// If the plant is no buck converter, cannot hold the voltage, delays its duty by more than a period, or has neither noise
    /// nor steps in its sensor of the output voltage and none is given.
    pub fn new(plant: &Parameters, wanted: Wanted) -> Result<Self, Error> {
        plant.require_buck("an observer")?;
        let converter = &plant.converter;
        let Wanted { v_ref, pole, .. } = wanted;
        if !(v_ref > 0.0 && v_ref < converter.v_in) {
            let message = Message::new("a buck converter cannot hold this voltage");
            return Err(message
                .found(format!("{v_ref} V of {} V", converter.v_in))
                .expected("more than 0 and less than v_in")
                .into());
        }
        if !(wanted.load > 0.0 && wanted.load.is_finite()) {
            let message = Message::new("the largest load current is no current").found(format!("{} A", wanted.load));
            return Err(message.expected("more than 0 A").into());
        }
        if !(0.0..1.0).contains(&pole) {
            let message = Message::new("this pole makes no law").found(format!("{pole}"));
            return Err(message.expected("0 (as fast as can be) to less than 1").into());
        }
        let compute_delay = match plant.pwm.duty_delay {
            delay @ 0..=1 => delay,
            delay => {
                let message = Message::new("the duty waits longer than an observer can look ahead");
                return Err(message
                    .found(format!("pwm.duty_delay = {delay}"))
                    .expected("0 or 1 period")
                    .into());
            }
        };
        let model = Model::new(plant.t_sw(), converter.inductance, converter.capacitance);
        let noise = noise(plant, wanted)?;
        let filter = model.filter(&noise)?;
        let (by_current, by_voltage) = law(&model, converter.v_in, pole);
        let resting = v_ref / converter.v_in;
        Ok(Self {
            v_ref,
            load: wanted.load,
            v_in: converter.v_in,
            inductance: converter.inductance,
            capacitance: converter.capacitance,
            period: plant.t_sw(),
            compute_delay,
            has_diode: converter.rectifier == Rectifier::Diode,
            filter,
            noise,
            pole,
            by_current,
            by_voltage,
            half_ripple: 0.5 * v_ref * (1.0 - resting) * model.by_inductance,
            // of the model's half ripple `(V (d - d^2/2) - v/2 + b/2) T/L` at rest, where `V d = v - b`, by b at b = 0
            ripple_by_bias: (resting - 0.5) * model.by_inductance,
        })
    }
}

fn noise(plant: &Parameters, wanted: Wanted) -> Result<Noise, Error> {
    let sensor = &plant.sensors.v_out;
    // a rounding to steps is spread evenly over one: its variance is a twelfth of the square
    let measured = wanted
        .noise
        .unwrap_or_else(|| (sensor.noise.powi(2) + sensor.lsb.powi(2) / 12.0).sqrt());
    let process = wanted.model.unwrap_or_else(|| Noise::usual(plant));
    let all = [measured, process[0], process[1], process[2]];
    if measured > 0.0 && all.iter().all(|x| x.is_finite() && *x >= 0.0) && process.iter().any(|x| *x > 0.0) {
        return Ok(Noise { process, measured });
    }
    let message = Message::new("no filter without noise");
    Err(message
        .found(format!(
            "{measured} V in the measurement, {process:?} A, V, V in the model"
        ))
        .expected("noise of the measurement, and of one state of the model at least")
        .hint("noise or lsb in [sensors.v_out] of the plant, or --noise")
        .into())
}

/// Duty per ampere and per volt that put both poles of current and voltage where `pole` is.
///
/// With the capacitor current x and the voltage error e, a period of the duty change u adds `b u` to x and
/// `a (x + b u / 2)` to e, where `b = V T/L` and `a = T/C`; the feedback of the voltage on the current is left to the law.
fn law(model: &Model, v_in: f64, pole: f64) -> (f64, f64) {
    let (b, a) = (v_in * model.by_inductance, model.by_capacitance);
    let q = 1.0 - pole;
    let by_voltage = q * q / (a * b);
    let by_current = (2.0 * q - 0.5 * a * b * by_voltage) / b;
    (by_current, by_voltage)
}
