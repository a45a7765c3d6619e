//! The fastest way to a voltage at rest, period by period, on a model of the plant.

use plant::{Load, Parameters, Plant};

use crate::faults::Error;

/// Chooses duties that bring a converter to rest as soon as they can.
///
/// Where two duties within the range do it (deadbeat), these. Otherwise full effort, until the opposite effort from the
/// end of the period on brings the current to rest just when the voltage arrives; in between a duty found by bisection.
#[derive(Debug, Clone)]
pub struct TimeOptimal {
    model: Plant,
    range: [f64; 2],
    /// Change of current (A) and voltage (V) per duty in one period.
    current_gain: f64,
    voltage_gain: f64,
    /// C/T, S.
    charge: f64,
    rest: f64,
}

/// Where a converter is to rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Target {
    /// Sampled voltage, V.
    pub v_out: f64,
    /// Sampled inductor current, A.
    pub i_l: f64,
}

/// Periods after which an effort counts as in vain.
// more than a scenario looks at by default (300): what turns the current later never rests in time. The tests see 15
const LONGEST: usize = 400;
// down to 1e-12 of the range
const BISECTIONS: usize = 40;
// a bound for time: some runs of the tests use all of them, and with 24 all of those; where they do not do, bisection
// takes over. 8 pass the tests as well, with 4 they take more than five times as long
const NEWTON_STEPS: usize = 12;

impl TimeOptimal {
    /// On a model with these parameters, with duties within `range`. Delays and sensors are not the model's business and
    /// are left out.
    ///
    /// # Errors
    /// If the parameters are not those of a converter.
    pub fn new(parameters: &Parameters, v_ref: f64, range: [f64; 2]) -> Result<Self, Error> {
        parameters.require_buck("the time-optimal planner")?;
        let mut parameters = parameters.clone();
        parameters.pwm.duty_delay = 0;
        parameters.sensors = plant::Sensors::default();
        let converter = &parameters.converter;
        let t = parameters.t_sw();
        let current_gain = converter.v_in * t / converter.inductance;
        Ok(Self {
            range,
            current_gain,
            voltage_gain: current_gain * t / converter.capacitance,
            charge: converter.capacitance / t,
            rest: v_ref / converter.v_in,
            model: Plant::new(&parameters)?,
        })
    }

    /// Voltage and current one period after `v_out` and `i_l`.
    pub fn predict(&mut self, v_out: f64, i_l: f64, duty: f64, load: &Load) -> (f64, f64) {
        self.model.reset_at(v_out, i_l, load);
        let sample = self.model.step(duty, load);
        (sample.v_out, sample.i_l)
    }

    /// The duty to apply from `v_out` and `i_l` on.
    pub fn duty(&mut self, v_out: f64, i_l: f64, load: &Load, target: Target) -> f64 {
        if let Some(duty) = self.deadbeat(v_out, i_l, load, target) {
            return duty;
        }
        // the arrival rises with the duty, so the ends decide first whether there is anything to bisect
        let [mut low, mut high] = self.range;
        if self.arrival(v_out, i_l, high, load, target) <= target.v_out {
            return high;
        }
        if self.arrival(v_out, i_l, low, load, target) >= target.v_out {
            return low;
        }
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            if self.arrival(v_out, i_l, middle, load, target) <= target.v_out {
                low = middle;
            } else {
                high = middle;
            }
        }
        0.5 * (low + high)
    }

    /// The first of two duties after which the converter rests at the target, if they are within the range.
    fn deadbeat(&mut self, v_out: f64, i_l: f64, load: &Load, target: Target) -> Option<f64> {
        let allowed = |duty: f64| (self.range[0]..=self.range[1]).contains(&duty);
        let (a, b) = (self.current_gain, self.voltage_gain);
        let later = 1.0 - self.rest;
        // Newton from the duty at rest with the gains of the linear circuit; only DCM and load bend it
        let mut duties = [self.rest; 2];
        for _ in 0..NEWTON_STEPS {
            self.model.reset_at(v_out, i_l, load);
            self.model.step(duties[0], load);
            let end = self.model.step(duties[1], load);
            let (dv, di) = (target.v_out - end.v_out, target.i_l - end.i_l);
            // 0.1 uV at 100 V, and as little of the current that a full duty adds in a period
            if dv.abs() < 1e-9 * target.v_out && di.abs() < 1e-7 * a {
                return Some(duties[0]);
            }
            // dv = b ((1 + later) x + later y), di = a (x + y)
            let x = dv / b - later * di / a;
            duties = [duties[0] + x, duties[1] + di / a - x];
            if !duties.into_iter().all(allowed) {
                return None;
            }
        }
        None
    }

    /// The voltage at which the current comes to rest after one period with `duty` and full opposite effort from then on.
    fn arrival(&mut self, v_out: f64, i_l: f64, duty: f64, load: &Load, target: Target) -> f64 {
        self.model.reset_at(v_out, i_l, load);
        let mut sample = self.model.step(duty, load);
        let braking = sample.i_l > target.i_l;
        let effort = if braking { self.range[0] } else { self.range[1] };
        for _ in 0..LONGEST {
            let excess = sample.i_l - target.i_l;
            let next = self.model.step(effort, load);
            if (next.i_l > target.i_l) != braking {
                // the current crosses in a straight line: the charge is a triangle
                let share = excess / (excess - (next.i_l - target.i_l));
                return sample.v_out + 0.5 * share * excess / self.charge;
            }
            sample = next;
        }
        // the effort cannot turn the current: whatever is wanted, this duty goes too far
        if braking { f64::INFINITY } else { f64::NEG_INFINITY }
    }
}
