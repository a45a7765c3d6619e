//! An observer and a law of control from a plant's nominal values (`docs/reference/policy-file.md`, Observers).
//!
//! ```text
//!  plant ─► Nominal ─► Model: T/L, T/C ─► steady Kalman filter ─► gains of [[observer]]
//!                 ├─► double pole of a buck ───────────────────► base of [actions]
//!                 └─► current, below the zero in the right half-plane ─► base of another converter
//! ```

mod current;
mod kalman;
mod nominal;
mod text;

use plant::{Carrier, Model as ModelOfPlant, Parameters, Topology};
use toml_input::Message;

use crate::faults::Error;

pub use current::CurrentLaw;
pub use kalman::{Filter, Model, Noise};
pub use nominal::Nominal;
pub use text::rounded;

use text::short;

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
    /// Pole of the law, 0 to 1: how much of an error is left after a period. Both poles of a buck are there; in a boost or a
    /// buck-boost it is that of the current, and the voltage is paced by the zero in the right half-plane.
    pub pole: Option<f64>,
}

/// Steps of an assumed converter: 12 bits, which every microcontroller with a PWM timer has.
pub const STEPS: f64 = 4096.0;

/// Standard deviation of a measurement with steps of `lsb` and this noise before them.
// a rounding to steps is spread evenly over one: its variance is a twelfth of the square
#[must_use]
pub fn measured(lsb: f64, noise: f64) -> f64 {
    (noise.powi(2) + lsb.powi(2) / 12.0).sqrt()
}

impl Wanted {
    /// Noise of the measured output voltage where nothing is known of it, V, and what to say of it: a converter of 12 bits that
    /// reaches half as far again as the voltage, with one step of noise.
    #[must_use]
    pub fn assumed_noise(v_ref: f64) -> (f64, String) {
        let step = 1.5 * v_ref / STEPS;
        let noise = measured(step, step);
        let words = format!(
            "the plant file has neither noise nor lsb in [sensors.v_out]: a converter of 12 bits up to {:.3} V with one step of noise is \
             assumed, {noise:.3e} V; --noise says another",
            1.5 * v_ref
        );
        (noise, words)
    }
}

/// Double pole of a buck's law.
// of .3, .4, .5 and .6 the one whose law, with L and C 15 % low, stayed within 7 % of the limit on the four
// examples/plants/buck-*.toml: .4 exceeds it by 23 % on one of them, .6 by 13 %
const POLE: f64 = 0.5;
/// Pole of the current in the law of a boost or a buck-boost.
// of 0, .3 and .5, with L and C 15 % low: 0 drives an estimate that is wrong too far (a buck-boost deviates by 2 to 3 % more), and
// .5 gives away 7 % on a boost whose current rises within a period
const CURRENT_POLE: f64 = 0.3;
/// The same where full effort takes more than [`LONG_EFFORT`] control periods.
// while it lasts the output says little of the current, and parts that are not those of the print make an error that grows with it. On
// examples/plants/buck-boost-12-24.toml, worst of L and C 15 % low, as printed and 15 % high, each over its own limit: 1.20 at .3,
// 1.16 at .5, 1.19 at .6. Of 3,600 laws with other gains of observer and law, found by a random search, none was below 1.14
const SLOW_CURRENT_POLE: f64 = 0.5;
/// Control periods in which the source alone raises the current to that of the largest load.
const LONG_EFFORT: f64 = 3.0;

/// An observer and a law for a plant.
#[derive(Debug, Clone, PartialEq)]
pub struct Design {
    /// What it is made for.
    pub nominal: Nominal,
    /// When in a period the switch is on.
    pub carrier: Carrier,
    /// The observer's filter.
    pub filter: Filter,
    /// What it was designed for.
    pub noise: Noise,
    /// Pole of the law.
    pub pole: f64,
    /// Duty per ampere of surplus current: what charges the capacitor.
    pub by_current: f64,
    /// Duty per volt of error.
    pub by_voltage: f64,
    /// How much farther below its mean the sampled current of a buck lies per volt of bias, A/V: losses want a larger duty, and so
    /// another ripple.
    pub ripple_by_bias: f64,
}

impl Design {
    /// Designs for the nominal values of a plant: its losses stay unknown to both.
    ///
    /// # Errors
    /// As of [`Nominal::new`]; and if the current is sampled at its peak, or the plant has neither noise nor steps in its sensor
    /// of the output voltage and none is given.
    pub fn new(plant: &Parameters, wanted: Wanted) -> Result<Self, Error> {
        let mut nominal = Nominal::new(plant, wanted.v_ref, wanted.load)?;
        nominal.compute_delay = compute_delay(plant, &nominal)?;
        let usual = match nominal.topology {
            Topology::Buck => POLE,
            Topology::Boost | Topology::BuckBoost if nominal.effort() > LONG_EFFORT => SLOW_CURRENT_POLE,
            Topology::Boost | Topology::BuckBoost => CURRENT_POLE,
        };
        let pole = wanted.pole.unwrap_or(usual);
        if !(0.0..1.0).contains(&pole) {
            let message = Message::new("this pole makes no law").found(format!("{pole}"));
            return Err(message.expected("0 (as fast as can be) to less than 1").into());
        }
        let carrier = plant.pwm.carrier;
        if carrier == Carrier::Leading {
            let message = Message::new("no observer is built for a switch that is on at the end of the period");
            return Err(message
                .found("pwm.carrier = \"leading\"")
                .expected("trailing or centre")
                .into());
        }
        let model = Model::new(nominal.period, nominal.inductance, nominal.capacitance, nominal.give);
        let noise = noise(plant, wanted)?;
        let filter = model.filter(&noise)?;
        let (by_current, by_voltage) = match nominal.topology {
            Topology::Buck => double_pole(&model, nominal.v_in, pole),
            Topology::Boost | Topology::BuckBoost => {
                let by_current = (1.0 - pole) * nominal.by_current();
                // the surplus is what the output receives of a current
                (by_current / nominal.give, nominal.by_voltage(by_current))
            }
        };
        let ripple_by_bias = match (nominal.topology, carrier) {
            // of the model's half ripple `(V (d - d^2/2) - v/2 + b/2) T/L` at rest, where `V d = v - b`, by b at b = 0
            (Topology::Buck, Carrier::Trailing) => (nominal.rest - 0.5) * model.by_inductance,
            _ => 0.0,
        };
        Ok(Self {
            nominal,
            carrier,
            filter,
            noise,
            pole,
            by_current,
            by_voltage,
            ripple_by_bias,
        })
    }
}

/// Periods from a sample to the one from which on the pulse that follows from it lies between two samples: what an observer calls its delay.
///
/// ```text
///  sample    ‾‾|‾‾ old ‾‾|________|‾‾ new ‾‾ sample       inside the pulse: what lies between is as long as the old one
///  ‾‾ old ‾‾|  sample  __|‾‾ new ‾‾|________ sample       behind it: the new one
/// ```
///
/// # Errors
/// If no whole number of periods says it: a duty that waits for two, or a pulse around the sample whose both edges move.
fn compute_delay(plant: &Parameters, nominal: &Nominal) -> Result<u32, Error> {
    let (phase, rest) = (plant.pwm.sampling_phase, nominal.rest);
    let message = || Message::new("no observer is built for this sampling instant");
    let found = format!("pwm.sampling_phase = {phase}, and a duty of {} at rest", short(rest));
    let later = match plant.pwm.carrier {
        _ if phase == 0.0 || plant.converter.model == ModelOfPlant::Averaged => false,
        Carrier::Trailing => phase < rest,
        Carrier::Centre if (phase - 0.5).abs() < 0.5 * rest => {
            // the new duty moves the edge before the next sample by half, and that behind it in the period after
            return Err(message()
                .found(format!("{found}: inside of a pulse that grows at both ends"))
                .expected("a sample beside the pulse")
                .hint("sample at 0, or late in the period: a `pwm.sampling_phase` above (1 + duty) / 2 costs no delay")
                .into());
        }
        Carrier::Centre => phase < 0.5,
        // refused by its own name
        Carrier::Leading => false,
    };
    match nominal.compute_delay + u32::from(later) {
        delay @ 0..=1 => Ok(delay),
        delay => Err(message()
            .found(format!(
                "{found}: with pwm.duty_delay = {} the pulse of a duty lies {delay} periods behind its sample",
                nominal.compute_delay
            ))
            .expected("at most one period")
            .hint("sample at the start of the period, or behind the pulse")
            .into()),
    }
}

fn noise(plant: &Parameters, wanted: Wanted) -> Result<Noise, Error> {
    let sensor = &plant.sensors.v_out;
    let measured = wanted.noise.unwrap_or_else(|| measured(sensor.lsb, sensor.noise));
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
fn double_pole(model: &Model, v_in: f64, pole: f64) -> (f64, f64) {
    let (b, a) = (v_in * model.by_inductance, model.by_capacitance);
    let q = 1.0 - pole;
    let by_voltage = q * q / (a * b);
    let by_current = (2.0 * q - 0.5 * a * b * by_voltage) / b;
    (by_current, by_voltage)
}
