//! The steady state in which the plant runs, from its voltage or from its duty.
//!
//! - `settle` finds the duty of a voltage: a regulator is run until nothing moves any more.
//! - `rest` finds the state of a duty: Newton's method on the map `f` of one period, `(f' - 1) step = x - f(x)`. The
//!   slopes `f'` are differences of runs from nudged states.

use crate::full::{STATES, States};
use crate::parameters::Parameters;
use crate::plant::{Plant, PlantState};
use crate::signals::{Load, Sample, Signals};

/// How [`Plant::settle`] ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settled {
    /// The duty that holds the voltage.
    pub duty: f64,
    /// Whether voltage and duty came to rest, to 1e-9 of the voltage.
    pub converged: bool,
    /// Periods it took.
    pub periods: u32,
}

/// How [`Plant::rest_within`] ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rest {
    /// The last sample.
    pub sample: Sample,
    /// Whether the plant repeats itself.
    pub rests: bool,
    /// Periods that were run at most.
    pub periods: u32,
}

/// A slow current-mode regulator: holds a voltage also under a load that is unstable in open loop.
#[derive(Debug, Clone, Copy)]
pub struct Regulator {
    v_out: f64,
    /// What a duty of 1 adds to the voltage at the inductor, V.
    span: f64,
    /// Share of the current that the output receives.
    give: f64,
    /// Share of a voltage error that a period corrects.
    pace: f64,
    most: f64,
    slowness: f64,
    /// Current per voltage error, S.
    g: f64,
    /// Voltage per current error, ohm.
    k: f64,
    integral: f64,
}

impl Regulator {
    /// Holds `v_out` V at a converter with these parameters, from the signals it has now.
    #[must_use]
    pub fn new(p: &Parameters, v_out: f64, now: &Signals) -> Self {
        let (v_in, l, c) = (p.converter.v_in, p.converter.inductance, p.converter.capacitance);
        let topology = p.converter.topology;
        let (on, off) = (topology.on(), topology.off());
        let duty = topology.duty(v_in, v_out);
        let (span, level) = (
            (on.0 - off.0) * v_in - (on.1 - off.1) * v_out,
            off.1 * v_out - off.0 * v_in,
        );
        let give = on.1 * duty + off.1 * (1.0 - duty);
        let slowness = f64::from(1 + p.pwm.duty_delay) + p.pwm.sampling_phase;
        let t = p.t_sw();
        // conductance that corrects a voltage error in about ten periods, gain that corrects a current in about four
        let pace = match on.1 == off.1 {
            true => 0.1,
            // more duty first takes current from the output: a zero in the right half-plane at give span / (L i_l), with
            // i_l = i_out / give. The loop stays at a fifth of it
            false => 0.1_f64.min(0.2 * t * give * give * span / (l * now.i_out.abs())),
        };
        let g = pace / slowness * c / t;
        let k = 0.25 / slowness * l / t;
        Regulator {
            v_out,
            span,
            give,
            pace,
            // an output that receives nothing cannot be held; only the buck's does at a duty of 1
            most: if on.1 > 0.0 { 1.0 } else { 0.95 },
            slowness,
            g,
            k,
            // without a voltage error the first duty is then that of the converter without losses
            integral: level - k * (now.i_out / give - now.i_l),
        }
    }

    /// The duty for the next period, 0..1.
    pub fn duty(&mut self, now: &Signals) -> f64 {
        let (g, k) = (self.g, self.k);
        let error = self.v_out - now.v_out;
        // the integral time is that of the voltage loop. Against wind-up it stays near what the leg can give;
        // wider than 0..v_in, since the proportional part is added to it
        self.integral = (self.integral + self.pace * k * g * error / self.slowness).clamp(-self.span, 2.0 * self.span);
        let wanted = self.integral + k * ((g * error + now.i_out) / self.give - now.i_l);
        (wanted / self.span).clamp(0.0, self.most)
    }
}

// four times the slowest point of the tests of plant and drm, 5421 periods; at 500 discontinuous points are cut short
const MOST_PERIODS: u32 = 20_000;
// two integral times of the regulator: what crosses its goal is small for a period or two only. A convention; with 1
// the tests hold as well
const AT_REST: u32 = 20;
/// Periods in which delays forget what was before.
// two more than the longest delay of a duty or a sensor
const WARM_UP: u32 = 10;
/// Periods between two attempts that did not get nearer.
// four integral times of the regulator. A convention: in the tests only points of the diagnosis need it at all
const BETWEEN: u32 = 40;
// four times the 9 steps that the slowest point of the tests takes; 5 are too few for discontinuous conduction
const MOST_NEWTON: usize = 40;
/// Periods after which a cable or a filter begins without ripple. A convention: three steps of Newton and what is run around them, where a
/// circuit in continuous conduction takes two. What comes to no rest takes all of them in every simulation of a fit.
const MOST_BESIDE: u32 = 72;
/// At rest a period moves no state by this share.
// 0.1 uV at 100 V, a thousandth of what the two integrators differ by (1e-4 V); the tests hold from 1e-13 to 1e-6
const AT_REST_1: f64 = 1e-9;
// the tests hold from 1e-10 to 1e-3: Newton corrects a coarse slope in the next step
// rounding of 1e-16 then costs the derivative 1e-10 of its value
const NUDGE: f64 = 1e-6;
/// Times that a winding is taken to be warmer. A tenth of the voltage lost in it makes each step a tenth of the one before: nine steps to 1e-9.
const MOST_WARMER: usize = 12;
/// Shares of a Newton step that are tried.
// halves, and a twentieth where the map bends sharply; the tests take all, but hold without the small ones
const SHARES: [f64; 4] = [1.0, 0.5, 0.25, 0.05];

impl Plant {
    /// Runs the plant under `load` until its sampled output voltage rests at `v_out` V, held by a [`Regulator`] on the
    /// true signals; a load that is unstable in open loop is fine. Not for a plant whose quantised duty
    /// cannot hold the voltage exactly: there it ends near it, not converged.
    pub fn settle(&mut self, v_out: f64, load: &Load) -> Settled {
        let p = self.parameters();
        let (v_in, l) = (p.converter.v_in, p.converter.inductance);
        let t = self.t_sample();
        let topology = p.converter.topology;
        let duty = topology.duty(v_in, v_out);
        let give = topology.on().1 * duty + topology.off().1 * (1.0 - duty);
        let i_out = self.reset_at(v_out, 0.0, load).i_out;
        // sampled at the start of the on-interval the current is at its valley: half the ripple below the load's
        let ripple = topology.ripple(v_in, v_out) * t / l;
        let mut sample = self.reset_at(v_out, (i_out / give - 0.5 * ripple).max(0.0), load);
        let mut regulator = Regulator::new(self.parameters(), v_out, &sample.signals());
        let (mut duty, mut rests) = (0.0, 0);
        let mut last = sample;
        for period in 1..=MOST_PERIODS {
            let error = v_out - sample.v_out;
            duty = regulator.duty(&sample.signals());
            sample = self.step(duty, load);
            // k turns the current into volts
            let moved = (sample.v_out - last.v_out).abs() + (sample.i_l - last.i_l).abs() * regulator.k;
            // 0.1 uV at 100 V. A convention: the tests hold from 1e-13 to 1e-6
            let small = 1e-9 * v_out.abs().max(1.0);
            rests = if error.abs() + moved < small { rests + 1 } else { 0 };
            last = sample;
            if rests >= AT_REST {
                return Settled {
                    duty,
                    converged: true,
                    periods: period,
                };
            }
        }
        Settled {
            duty,
            converged: false,
            periods: MOST_PERIODS,
        }
    }

    /// Runs the plant at a duty that stands still until it repeats itself, and returns that state's sample; whether it came
    /// to rest is said beside it.
    ///
    /// The state at the start of a period is sought by Newton's method on the map of a period: a filter without losses,
    /// which would ring for ever, and a load that is unstable in open loop have a steady state as well. Where there is none
    /// (ripple of the source, a duty that jumps between two steps) the plant is only run.
    pub fn rest(&mut self, duty: f64, load: &Load) -> (Sample, bool) {
        let found = self.rest_within(duty, load, u32::MAX);
        (found.sample, found.rests)
    }

    /// [`Plant::rest`] that gives up after `most` periods or some tens more, and tells how many it has run.
    pub fn rest_within(&mut self, duty: f64, load: &Load, most: u32) -> Rest {
        let mut found = self.rest_as_warm(duty, load, most);
        if self.parameters().inductor.heating == 0.0 {
            return found;
        }
        // a point that stands still warms its winding, which moves the point: by less each time
        for _ in 0..MOST_WARMER {
            let before = self.state().warm;
            let current = self.steady_current(found.sample.i_out, self.state().applied);
            if !found.rests || (current - before).abs() < AT_REST_1 * (1.0 + current.abs()) {
                break;
            }
            self.warm_from(current);
            let again = self.rest_as_warm(duty, load, most);
            found = Rest {
                periods: found.periods.saturating_add(again.periods),
                ..again
            };
        }
        found
    }

    /// [`Plant::rest_within`] with a winding that stays as warm as it is.
    fn rest_as_warm(&mut self, duty: f64, load: &Load, most: u32) -> Rest {
        // a duty that stands still has no rate, however it was reached
        self.state.slow = duty;
        self.run(WARM_UP, duty, load);
        let mut periods = WARM_UP;
        for _ in 0..MOST_NEWTON {
            if periods >= most {
                break;
            }
            let before = *self.state();
            let (after, distance) = self.moved(duty, load);
            if distance < AT_REST_1 {
                // Newton moves states only; queues and delayed sensors follow by running
                let sample = self.run(WARM_UP, duty, load);
                return Rest {
                    sample,
                    rests: true,
                    periods: periods + 1 + WARM_UP,
                };
            }
            let mut jacobian = [[0.0; STATES]; STATES];
            for (n, line) in jacobian.iter_mut().enumerate() {
                // of a part that is not there
                line[n] = 1.0;
            }
            periods += 1;
            for column in 0..STATES {
                if !self.full.moves(column) {
                    continue;
                }
                periods += 1;
                let mut nudged = before;
                let step = NUDGE * (1.0 + nudged.x[column].abs());
                nudged.x[column] += step;
                self.restore(&nudged);
                self.step(duty, load);
                for (row, line) in jacobian.iter_mut().enumerate() {
                    line[column] = (self.state().x[row] - after[row]) / step;
                }
            }
            let mut right: States = std::array::from_fn(|n| before.x[n] - after[n]);
            for (n, line) in jacobian.iter_mut().enumerate() {
                line[n] -= 1.0;
            }
            eliminate(&mut jacobian, &mut right);
            periods += SHARES.len() as u32;
            if !self.improve(&before, &right, distance, duty, load) {
                self.restore(&before);
                self.run(BETWEEN, duty, load);
                periods += BETWEEN;
            }
        }
        let mut sample = self.run(1, duty, load);
        // where Newton finds nothing there is mostly no rest: a quarter is a convention, no test needs more than one
        let end = most.min(periods.saturating_add(MOST_PERIODS / 4));
        while periods < end {
            let now = self.step(duty, load);
            periods += 1;
            let moved = (now.v_out - sample.v_out).abs() + (now.i_l - sample.i_l).abs();
            sample = now;
            if moved < AT_REST_1 * (1.0 + now.v_out.abs()) {
                return Rest {
                    sample,
                    rests: true,
                    periods,
                };
            }
        }
        Rest {
            sample,
            rests: false,
            periods,
        }
    }

    /// After [`Plant::reset_within`] under `load`: lets a cable, the capacitor at its end and an input filter swing as they do where the plant
    /// rests at `duty`, around the output voltage and the inductor's current given. Those two say nothing of the others, which begin without
    /// ripple else, and ring for a while. A plant without such parts stays as it is, and so does one that does not come to rest. The periods that it
    /// took.
    pub fn swing_beside(&mut self, duty: f64, load: &Load) -> u32 {
        if !self.full.has_states_beside() || self.parameters().source.ripple > 0.0 {
            return 0;
        }
        let began = *self.state();
        let rest = self.rest_within(duty, load, MOST_BESIDE);
        let at_rest = self.state().x;
        self.restore(&began);
        if rest.rests {
            self.swing_as(&rest.sample, &at_rest, load);
        }
        rest.periods
    }

    fn run(&mut self, periods: u32, duty: f64, load: &Load) -> Sample {
        (0..periods).fold(self.sample(), |_, _| self.step(duty, load))
    }

    /// The state after a period, and how far it is from that before.
    fn moved(&mut self, duty: f64, load: &Load) -> (States, f64) {
        let before = self.state().x;
        self.step(duty, load);
        let after = self.state().x;
        let share = |(a, b): (&f64, &f64)| (a - b).abs() / (1.0 + b.abs());
        (after, after.iter().zip(&before).map(share).fold(0.0, f64::max))
    }

    /// Takes as much of a Newton step as brings the plant nearer to rest; `false` if none does.
    fn improve(&mut self, before: &PlantState, step: &States, distance: f64, duty: f64, load: &Load) -> bool {
        for share in SHARES {
            let mut tried = *before;
            for (x, change) in tried.x.iter_mut().zip(step) {
                *x += share * change;
            }
            self.restore(&tried);
            let next = self.moved(duty, load).1;
            if next < distance {
                return true;
            }
        }
        false
    }
}

/// Solves a small system in place; what has no equation of its own stays 0.
fn eliminate(matrix: &mut [States; STATES], right: &mut States) {
    let mut row_of = [None; STATES];
    let mut free = [true; STATES];
    for column in 0..STATES {
        // a state that the circuit does not use has an empty row and column: no pivot, and it keeps its value
        let rows = (0..STATES).filter(|row| free[*row]);
        let pivot = rows.max_by(|a, b| matrix[*a][column].abs().total_cmp(&matrix[*b][column].abs()));
        // an unused state leaves 0 here, or rounding with nothing to correct; the tests hold from 0 to 1e-6
        let Some(pivot) = pivot.filter(|row| matrix[*row][column].abs() > 1e-12) else {
            continue;
        };
        free[pivot] = false;
        row_of[column] = Some(pivot);
        let line = matrix[pivot];
        for row in (0..STATES).filter(|row| *row != pivot) {
            let factor = matrix[row][column] / line[column];
            for (cell, above) in matrix[row].iter_mut().zip(&line) {
                *cell -= factor * above;
            }
            right[row] -= factor * right[pivot];
        }
    }
    let solved = |column: usize| row_of[column].map_or(0.0, |row| right[row] / matrix[row][column]);
    *right = std::array::from_fn(solved);
}

#[cfg(test)]
mod tests {
    use crate::{Load, Parameters, Plant};

    /// Above a current that its ripple crosses the inductor keeps a twentieth of its inductance.
    #[test]
    fn a_search_for_rest_ends_where_it_is_told_to() {
        let text = "[converter]\nrectifier = \"synchronous\"\nv_in = 150.0\ninductance = 1.5e-3\ncapacitance = 6.1e-7\nf_sw = 135e3\n\
                    [inductor]\ndcr = 0.79\nsaturation = 0.95\ni_sat = 0.15623283395557594\nsteepness = 31.43364556985805\n\
                    [capacitor]\nesr = 1.3\n[switch]\nr_ds_on = 1.0\nr_ds_on_low = 2.2\nv_f = 0.74\nr_d = 0.55\ndead_time = 1.4e-7\n";
        let mut parameters = Parameters::from_toml("plant.toml".as_ref(), text).unwrap();
        parameters.sensors.v_out.low_pass = 100.0 / 135e3;
        let load = Load::resistor(1.0 / 0.00506);
        let run = |most: u32| {
            let mut plant = Plant::new(&parameters).unwrap();
            plant.reset_within(132.1, 0.6575, &load, &[0.92; 9]);
            plant.rest_within(0.92, &load, most)
        };
        let (short, long) = (run(300), run(u32::MAX));
        assert!(!short.rests && (300..400).contains(&short.periods), "{short:?}");
        assert!(long.periods > 5_000 || long.rests, "{long:?}");
        // what rests soon is the same however long it may take
        let parameters = Parameters::paper_model();
        let load = Load::resistor(20.0);
        let run = |most: u32| Plant::new(&parameters).unwrap().rest_within(0.5, &load, most);
        assert_eq!(run(300), run(u32::MAX));
        assert!(run(300).rests);
    }

    #[test]
    fn a_filter_without_losses_has_a_steady_state() {
        let mut parameters = Parameters::paper_model();
        parameters.converter.capacitance = 150e-6;
        let mut plant = Plant::new(&parameters).unwrap();
        for (duty, load) in [
            (0.4, Load::current(5.0)),
            (0.5, Load::resistor(20.0)),
            (0.5, Load::power(800.0)),
        ] {
            let wanted = duty * 200.0;
            plant.reset_at(0.8 * wanted, 0.0, &load);
            let (sample, rests) = plant.rest(duty, &load);
            assert!(
                rests && (sample.v_out - wanted).abs() < 0.05,
                "{duty} {load:?}: {}",
                sample.v_out
            );
        }
    }

    /// How far the rows behind a reset are from those of a plant that was at rest before, V and A, with what a cable and a filter swing by and
    /// without.
    fn off_after_reset(more: &str, phase: f64) -> [f64; 2] {
        let text = format!(
            "[converter]\nrectifier = \"synchronous\"\nv_in = 12.0\ninductance = 2e-6\ncapacitance = 47e-6\nf_sw = 300e3\n\
             [pwm]\nsampling_phase = {phase}\n[inductor]\ndcr = 0.01\n[capacitor]\nesr = 0.004\n{more}"
        );
        let parameters = Parameters::from_toml("plant.toml".as_ref(), &text).unwrap();
        let load = Load::resistor(0.8);
        let mut before = Plant::new(&parameters).unwrap();
        before.reset_within(3.5, 4.0, &load, &[0.3; 9]);
        let start = (0..20_000).fold(before.sample(), |_, _| before.step(0.3, &load));
        [true, false].map(|swings| {
            let mut goes_on = before.clone();
            let mut plant = Plant::new(&parameters).unwrap();
            plant.reset_within(start.v_out, start.i_l, &load, &[0.3; 9]);
            if swings {
                assert!(plant.swing_beside(0.3, &load) > 0);
            }
            let off = |a: crate::Sample, b: crate::Sample| {
                let of = [a.v_out - b.v_out, a.i_l - b.i_l, a.i_out - b.i_out, a.v_in - b.v_in];
                of.map(f64::abs).into_iter().fold(0.0, f64::max)
            };
            let first = if swings { off(start, plant.sample()) } else { 0.0 };
            (0..40).fold(first, |most, n| {
                let duty = if n < 20 { 0.3 } else { 0.35 };
                most.max(off(goes_on.step(duty, &load), plant.step(duty, &load)))
            })
        })
    }

    #[test]
    fn a_cable_and_an_input_filter_begin_as_they_swing_at_rest() {
        let cable = "[cable]\ninductance = 60e-9\nresistance = 5e-3\ncapacitance = 22e-6\n";
        let filter = "[source]\nresistance = 0.02\ninductance = 400e-9\nc_in = 22e-6\nesr_in = 0.005\n";
        let leads = "[source]\nresistance = 0.05\nc_in = 22e-6\nesr_in = 0.005\n";
        for more in [cable, filter, leads, &format!("{cable}{filter}")] {
            for phase in [0.0, 0.4] {
                let [swinging, without] = off_after_reset(more, phase);
                assert!(
                    swinging < 1e-6 && without > 1e-3,
                    "{more} {phase}: {swinging} {without}"
                );
            }
        }
    }

    #[test]
    fn a_plant_without_states_beside_stays_as_it_was_reset() {
        let mut plant = Plant::new(&Parameters::paper_table()).unwrap();
        plant.reset_within(100.0, 5.0, &Load::resistor(20.0), &[0.5; 9]);
        let before = *plant.state();
        assert_eq!(plant.swing_beside(0.5, &Load::resistor(20.0)), 0);
        assert_eq!(*plant.state(), before);
    }

    #[test]
    fn discontinuous_points_follow_the_formula_of_the_resting_current() {
        let parameters = Parameters::paper_model();
        let (l, f, v_in) = (2e-3, 1e4, 200.0);
        let mut plant = Plant::new(&parameters).unwrap();
        for i in [0.1, 0.4] {
            let load = Load::current(i);
            let d: f64 = 0.3;
            // charge of a triangle: i = d^2 (v_in - v) v_in / (2 l f v)
            let v = v_in / (1.0 + 2.0 * l * f * i / (d * d * v_in));
            plant.reset_at(60.0, 1.0, &load);
            let (sample, rests) = plant.rest(d, &load);
            assert!(
                rests && (sample.v_out - v).abs() < 0.2,
                "{i} A: {} V, {v} V",
                sample.v_out
            );
        }
    }
}
