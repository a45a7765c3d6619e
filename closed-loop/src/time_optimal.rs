//! The fastest way to a voltage at rest, period by period, on a model of the plant.

use plant::{Load, Parameters, Plant, Topology};

use crate::faults::Error;

/// Chooses duties that bring a converter to rest as soon as they can.
///
/// Full effort upwards is the largest duty in every topology, although the voltage of a boost and a buck-boost falls at first:
/// what they are short of is current, and nothing brings it sooner.
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
    topology: Topology,
}

/// Where a converter is to rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Target {
    /// Voltage at the start of a PWM period, V.
    pub v_out: f64,
    /// Inductor current there, A.
    pub i_l: f64,
}

/// Periods after which an effort counts as in vain.
// more than a scenario looks at by default (300): what turns the current later never rests in time. The tests see 15
const LONGEST: usize = 400;
// down to 1e-12 of the range
const BISECTIONS: usize = 40;
/// Change of a duty from which slopes are taken.
// rounding of 1e-14 then costs a slope 1e-8 of its value, and Newton corrects what the curvature does
const NUDGE: f64 = 1e-6;
// a bound for time: some runs of the tests use all of them, and with 24 all of those; where they do not do, bisection
// takes over. 8 pass the tests as well, with 4 they take more than five times as long
const NEWTON_STEPS: usize = 12;

impl TimeOptimal {
    /// On a model with these parameters, with duties within `range`. Voltages and currents are those at the start of a PWM
    /// period, wherever the plant is sampled; delays and sensors are left out.
    ///
    /// # Errors
    /// If the parameters are not those of a converter.
    pub fn new(parameters: &Parameters, v_ref: f64, range: [f64; 2]) -> Result<Self, Error> {
        let mut parameters = parameters.clone();
        parameters.pwm.duty_delay = 0;
        parameters.pwm.sampling_phase = 0.0;
        parameters.sensors = plant::Sensors::default();
        let converter = &parameters.converter;
        let t = parameters.t_sw();
        let topology = converter.topology;
        let current_gain = topology.span(converter.v_in, v_ref) * t / converter.inductance;
        Ok(Self {
            range,
            current_gain,
            voltage_gain: current_gain * t / converter.capacitance,
            charge: converter.capacitance / t,
            rest: topology.duty(converter.v_in, v_ref),
            topology,
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
        let range = self.range;
        let allowed = |duty: f64| (range[0]..=range[1]).contains(&duty);
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
            duties = match self.topology {
                // dv = b ((1 + later) x + later y), di = a (x + y)
                Topology::Buck => {
                    let x = dv / b - later * di / a;
                    [duties[0] + x, duties[1] + di / a - x]
                }
                _ => {
                    let [x, y] = self.newton_step(v_out, i_l, load, duties, [end.v_out, end.i_l], [dv, di])?;
                    [duties[0] + x, duties[1] + y]
                }
            };
            if !duties.into_iter().all(allowed) {
                return None;
            }
        }
        None
    }

    /// What both duties are changed by for the voltage and current still to go, `wanted`, by slopes around `end`: the share of
    /// the current that the output receives changes with the duty, so the gains are those of this state alone.
    fn newton_step(
        &mut self,
        v_out: f64,
        i_l: f64,
        load: &Load,
        duties: [f64; 2],
        end: [f64; 2],
        wanted: [f64; 2],
    ) -> Option<[f64; 2]> {
        let slope = |planner: &mut Self, which: usize| {
            let mut nudged = duties;
            // to the inside: at an end of 0..1 the duty is clamped
            let nudge = if duties[which] > 0.5 { -NUDGE } else { NUDGE };
            nudged[which] += nudge;
            planner.model.reset_at(v_out, i_l, load);
            planner.model.step(nudged[0], load);
            let moved = planner.model.step(nudged[1], load);
            [(moved.v_out - end[0]) / nudge, (moved.i_l - end[1]) / nudge]
        };
        let ([va, ia], [vb, ib]) = (slope(self, 0), slope(self, 1));
        let determinant = va * ib - vb * ia;
        let step = [
            (wanted[0] * ib - vb * wanted[1]) / determinant,
            (va * wanted[1] - wanted[0] * ia) / determinant,
        ];
        // in discontinuous conduction the current ends at 0 whatever the duties are
        step.iter().all(|x| x.is_finite()).then_some(step)
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
                if self.topology == Topology::Buck {
                    return sample.v_out + 0.5 * share * excess / self.charge;
                }
                // the voltage is a parabola over the period: its curvature is the slope of the current that the output gets
                let bend = 0.5 * self.topology.give(effort) * (next.i_l - sample.i_l) / self.charge;
                let straight = sample.v_out + share * (next.v_out - sample.v_out);
                return straight - bend * share * (1.0 - share);
            }
            sample = next;
        }
        // the effort cannot turn the current: whatever is wanted, this duty goes too far
        if braking { f64::INFINITY } else { f64::NEG_INFINITY }
    }
}
