//! What no controller can beat: the smallest deviation and the shortest settling time that any sequence of duties reaches.
//!
//! The converter rests at `v_ref`, switching steadily, when the load steps. A controller that knows everything from the
//! first sampling instant on which the step shows then plays many sequences: full effort for whole and broken periods, and
//! from there the time-optimal way to rest ([`TimeOptimal`]), also by way of the far edge of the settling band. The best of
//! them counts, figure by figure.
//!
//! More duty at a boost or a buck-boost first takes current from the output. Its smallest deviation needs another way than its
//! shortest settling: full effort until the current holds the voltage, and not a moment longer.
//!
//! The circuit is the plain one: source, switches with resistances and forward voltages, L with its resistance, C, load,
//! bleed, and the delay of the duty; of a buck the series resistance of its capacitor as well, whose voltage jumps with the load
//! whatever is done. Everything else a plant file may have is left out. The way to rest is planned without that resistance: it
//! damps, and what is planned from the capacitor's voltage period by period arrives all the same.

use plant::{Load, Model, Parameters, Plant, Sample, Topology};
use serde::Serialize;
use toml_input::Message;

use crate::doubtful::doubts;
use crate::faults::Error;
use crate::load_step::LoadStep;
use crate::part::Part;
use crate::scenario::settled_band;
use crate::time_optimal::{Target, TimeOptimal};

/// The smallest figures that can be reached; each may need another sequence of duties.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Bound {
    /// Largest |e| at the sampling instants after the step, V.
    pub deviation: f64,
    /// Largest error to the side of the step (dip where the load rises, else overshoot), between the samples too, V.
    pub extreme: f64,
    /// From the step to the last sample outside the settling band, s.
    pub settling: f64,
}

/// The limits of one load step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Limit {
    /// Half width of the band that settling refers to, V ([`settled_band`]).
    pub band: f64,
    /// Load step at a sampling instant, which shows it.
    pub at_sample: Bound,
    /// Load step at the worst of the instants that are tried.
    pub worst: Bound,
    /// Load step just behind a sampling instant.
    pub behind: Bound,
}

/// What may be done about a load step, and with what.
#[derive(Debug, Clone)]
pub struct Question {
    from: Load,
    to: Load,
    v_ref: f64,
    range: [f64; 2],
    /// At rest under the load before.
    resting: Plant,
    duty: f64,
    target: Target,
    planner: TimeOptimal,
    /// Series resistance of the capacitor, ohm.
    esr: f64,
    /// From a sample inside of a PWM period to its end.
    rest_of_period: Option<Part>,
    /// For converters whose output answers the wrong way at first.
    hold: Option<Hold>,
}

/// Holds the voltage where it is: the least of a way back to rest.
///
/// The time-optimal way goes on with full effort, and the output with its wrong answer, for as long as that saves time. The
/// smallest deviation is had by ending the effort as soon as the current holds the voltage. What is back at `v_ref` some day
/// has to have a little more current; holding is what that tends to.
#[derive(Debug, Clone, Copy)]
struct Hold {
    duty: f64,
    /// Duty per ampere that takes a period to correct it.
    by_current: f64,
    topology: Topology,
    v_in: f64,
    load: Load,
}

/// A sequence of duties that is tried.
#[derive(Debug, Clone, Copy)]
struct Strategy<'a> {
    /// How it goes on behind the effort, unless as fast as can be.
    hold: Option<&'a Hold>,
    /// Periods of full effort; the last one may be broken.
    effort: f64,
    /// How far beyond `v_ref` to aim until the voltage is within the settling band, V.
    beyond: f64,
}

/// Just behind a sampling instant, in periods.
// 0.1 ns at 10 kHz: as good as at the instant for the plant, and behind it for the controller
const BEHIND: f64 = 1e-6;
/// Broken periods of full effort.
// parts of one period: how finely the effort is cut. A convention: the tests hold from 1 on, in a third of the time
const PARTS: usize = 16;
/// ... and of a long effort this share: an inductor that needs hundreds of periods would else take minutes. From 8 periods on.
const FINEST: f64 = 1.0 / 128.0;
/// Aims beyond `v_ref` for the settling time, as shares of the settling band.
// the last one is just inside of the band
const AIMS: [f64; 6] = [0.0, 0.2, 0.4, 0.6, 0.8, 0.94];
/// Periods that are looked at.
// as long as a scenario looks by default: 30 ms at 10 kHz
const HORIZON: usize = 300;
/// Periods at rest after which nothing more can come.
// outlasts the duties that are under way, one or two; the tests of the limit already hold with a single one
const AT_REST: usize = 6;

impl Question {
    /// For a plant, with duties within `range`.
    ///
    /// # Errors
    /// If the parameters are not those of a converter, or it cannot rest at `v_ref` with a duty within `range`.
    pub fn new(parameters: &Parameters, v_ref: f64, step: LoadStep, range: [f64; 2]) -> Result<Self, Error> {
        if step.keeps_load() {
            let message = Message::new(format!("no limit is computed for {step}"));
            return Err(message
                .found("the search knows one voltage of the source and one to hold")
                .into());
        }
        let parameters = plain(parameters);
        let [from, to] = step.loads();
        let rest = |load: &Load| -> Result<(Plant, f64), Error> {
            let mut plant = Plant::new(&parameters)?;
            let settled = plant.settle(v_ref, load);
            // strictly within: at an end of the range no effort is left to one side
            if settled.converged && settled.duty > range[0] && settled.duty < range[1] {
                return Ok((plant, settled.duty));
            }
            let [low, high] = range;
            let message = Message::new(format!("there is no limit for {step}"));
            let found = format!(
                "the plant does not rest at {v_ref} V with a duty within {low}..{high}; a load of constant power may not let it"
            );
            let doubt = doubts(&parameters, v_ref, &step.loads()).into_iter().next();
            Err(message.found(found).maybe_hint(doubt).into())
        };
        let (resting, duty) = rest(&from)?;
        let (after, held) = rest(&to)?;
        let esr = parameters.capacitor.esr;
        let planned = Parameters {
            capacitor: plant::Capacitor::default(),
            ..parameters.clone()
        };
        let mut rest_of_period = match parameters.pwm.sampling_phase {
            0.0 => None,
            phase => Some(Part::new(&planned, phase, 1.0)?),
        };
        let (mut v_out, mut i_l) = (within(&after.sample(), esr), after.sample().i_l);
        if let Some(part) = &mut rest_of_period {
            (v_out, i_l) = part.pass(v_out, i_l, held, &to);
        }
        let target = Target { v_out, i_l };
        let converter = &parameters.converter;
        let (topology, t) = (converter.topology, parameters.t_sw());
        let hold = Hold {
            duty: held,
            by_current: converter.inductance / t / topology.span(converter.v_in, v_ref),
            topology,
            v_in: converter.v_in,
            load: to,
        };
        Ok(Self {
            // more effort never deepens the dip of a buck
            hold: (topology != Topology::Buck).then_some(hold),
            from,
            to,
            v_ref,
            range,
            resting,
            duty,
            target,
            planner: TimeOptimal::new(&planned, v_ref, range)?,
            esr,
            rest_of_period,
        })
    }

    /// The limits over load steps at a sampling instant and at these phases of the period.
    #[must_use]
    pub fn answer(&self, phases: &[f64]) -> Limit {
        let at_sample = self.bound(0.0);
        let behind = self.bound(BEHIND);
        // the sooner behind a sampling instant, the longer the step goes unseen
        let first = phases.iter().copied().filter(|phase| *phase > 0.0).reduce(f64::min);
        let worst = first.map_or(at_sample, |phase| {
            let bound = if phase == BEHIND { behind } else { self.bound(phase) };
            Bound {
                deviation: bound.deviation.max(at_sample.deviation),
                extreme: bound.extreme.max(at_sample.extreme),
                settling: bound.settling.max(at_sample.settling),
            }
        });
        Limit {
            band: settled_band(self.v_ref),
            at_sample,
            worst,
            behind,
        }
    }

    /// The limits at a sampling instant and at the worst of all instants, which is right behind one.
    #[must_use]
    pub fn of_all_instants(&self) -> Limit {
        self.answer(&[BEHIND])
    }

    /// The limits of a load step at `phase` of a period, 0 meaning at a sampling instant that shows it.
    #[must_use]
    pub fn bound(&self, phase: f64) -> Bound {
        let mut best: Option<Bound> = None;
        let mut attempt = |strategy: Strategy<'_>| {
            let tried = self.attempt(phase, strategy);
            best = Some(best.map_or(tried, |best| Bound {
                deviation: best.deviation.min(tried.deviation),
                extreme: best.extreme.min(tried.extreme),
                settling: best.settling.min(tried.settling),
            }));
            tried
        };
        let band = settled_band(self.v_ref);
        for aim in AIMS {
            let beyond = aim * band;
            attempt(Strategy {
                hold: None,
                effort: 0.0,
                beyond,
            });
        }
        for hold in std::iter::once(None).chain(self.hold.iter().map(Some)) {
            // more full effort first helps the deviation, then the swing to the other side grows beyond it
            let mut least = f64::INFINITY;
            for effort in efforts() {
                let tried = attempt(Strategy {
                    hold,
                    effort,
                    beyond: 0.0,
                });
                least = least.min(tried.deviation);
                // clearly past the least, in share and in bands; a convention, the tests hold with a share of 1.0 as well
                if tried.deviation > 1.2 * least + 0.2 * band {
                    break;
                }
            }
        }
        best.unwrap_or(Bound {
            deviation: f64::INFINITY,
            extreme: f64::INFINITY,
            settling: f64::INFINITY,
        })
    }

    /// The direction of a step: 1 where the duty must rise.
    fn direction(&self) -> f64 {
        if self.to.at(self.v_ref) >= self.from.at(self.v_ref) {
            1.0
        } else {
            -1.0
        }
    }

    fn full(&self) -> f64 {
        if self.direction() > 0.0 {
            self.range[1]
        } else {
            self.range[0]
        }
    }

    fn attempt(&self, phase: f64, strategy: Strategy<'_>) -> Bound {
        let (mut plant, mut planner) = (self.resting.clone(), self.planner.clone());
        let mut rest_of_period = self.rest_of_period.clone();
        let mut run = Run::new(self, phase);
        if phase > 0.0 {
            run.note(&plant.step_with_change(self.duty, &self.from, &self.to, phase));
        }
        let delay = plant.parameters().pwm.duty_delay as usize;
        let (mut in_force, mut pending) = (self.duty, vec![self.duty; delay]);
        let beyond = self.direction() * strategy.beyond;
        let mut entered = strategy.beyond == 0.0;
        for n in 0..HORIZON {
            let sample = plant.sample();
            // inside the band counts only once the voltage has left it: at the step it is still at `v_ref`
            entered |= n > 0 && (sample.v_out - self.v_ref).abs() < run.band && run.left;
            let share = (strategy.effort - n as f64).clamp(0.0, 1.0);
            let mut planned = || {
                let (mut v, mut i) = (within(&sample, self.esr), sample.i_l);
                if let Some(part) = &mut rest_of_period {
                    (v, i) = part.pass(v, i, in_force, &self.to);
                }
                for duty in &pending {
                    (v, i) = planner.predict(v, i, *duty, &self.to);
                }
                let aim = if entered { 0.0 } else { beyond };
                let target = Target {
                    v_out: self.target.v_out + aim,
                    ..self.target
                };
                match strategy.hold {
                    None => planner.duty(v, i, &self.to, target),
                    Some(hold) => hold.duty(v, i, target).clamp(self.range[0], self.range[1]),
                }
            };
            let duty = match share {
                // with nothing to plan: most of the periods of a large inductor
                1.0 => self.full(),
                _ => share * self.full() + (1.0 - share) * planned(),
            };
            pending.push(duty);
            in_force = pending.remove(0);
            run.note(&plant.step(duty, &self.to));
            if run.at_rest >= AT_REST {
                break;
            }
        }
        run.bound
    }
}

/// The capacitor's own voltage behind its series resistance, V; of a converter whose inductor feeds the output all the time.
fn within(sample: &Sample, esr: f64) -> f64 {
    sample.v_out - esr * (sample.i_l - sample.i_out)
}

/// Periods of full effort that are tried, up to the horizon.
fn efforts() -> impl Iterator<Item = f64> {
    let next = |effort: &f64| Some(effort + (1.0 / PARTS as f64).max(FINEST * effort));
    std::iter::successors(Some(1.0 / PARTS as f64), next).take_while(|effort| *effort < HORIZON as f64)
}

/// The inductor current that holds `v_out` V under a load in continuous conduction without losses, A.
fn holding(topology: Topology, v_in: f64, v_out: f64, load: &Load) -> f64 {
    load.at(v_out) / topology.give(topology.duty(v_in, v_out))
}

impl Hold {
    fn duty(&self, v_out: f64, i_l: f64, target: Target) -> f64 {
        let holding = |v_out| holding(self.topology, self.v_in, v_out, &self.load);
        let more = holding(v_out) - holding(target.v_out);
        self.duty + self.by_current * (target.i_l + more - i_l)
    }
}

/// What is seen of one attempt.
struct Run {
    v_ref: f64,
    /// 1 where the voltage dips.
    direction: f64,
    t: f64,
    phase: f64,
    periods: usize,
    at_rest: usize,
    /// Half width of the settling band, V.
    band: f64,
    /// The voltage has been outside of it.
    left: bool,
    bound: Bound,
}

impl Run {
    fn new(question: &Question, phase: f64) -> Self {
        let bound = Bound {
            deviation: 0.0,
            extreme: 0.0,
            settling: 0.0,
        };
        Self {
            v_ref: question.v_ref,
            direction: question.direction(),
            t: question.resting.t_sample(),
            phase,
            periods: 0,
            at_rest: 0,
            band: settled_band(question.v_ref),
            left: false,
            bound,
        }
    }

    fn note(&mut self, sample: &Sample) {
        self.periods += 1;
        let error = (sample.v_out - self.v_ref).abs();
        // `f64::max` ignores a NaN: a run that diverged would look like the best one
        let error = if error.is_finite() { error } else { f64::INFINITY };
        self.bound.deviation = self.bound.deviation.max(error);
        let swing = if self.direction > 0.0 {
            self.v_ref - sample.v_min
        } else {
            sample.v_max - self.v_ref
        };
        self.bound.extreme = self
            .bound
            .extreme
            .max(if swing.is_finite() { swing } else { f64::INFINITY });
        if error > self.band {
            self.left = true;
            self.bound.settling = (self.periods as f64 - self.phase) * self.t;
        }
        // below every digit of a table; 1e-4 gives the same limits in the tests
        self.at_rest = if error < 1e-6 * self.v_ref { self.at_rest + 1 } else { 0 };
    }
}

/// Keys of the plant's numbers that are not neutral but have no part in the limit.
#[must_use]
pub fn left_out(parameters: &Parameters) -> Vec<&'static str> {
    let plain = plain(parameters);
    plant::parameters()
        .filter(|parameter| parameter.get(parameters) != parameter.get(&plain))
        .map(|parameter| parameter.key)
        .collect()
}

/// The circuit without what the limit leaves out.
fn plain(parameters: &Parameters) -> Parameters {
    let p = parameters;
    let mut plain = Parameters {
        converter: p.converter.clone(),
        ..Parameters::default()
    };
    // the averaged model has a limit of its own, `averaged`
    plain.converter.model = Model::Switched;
    plain.pwm.carrier = p.pwm.carrier;
    plain.pwm.sampling_phase = p.pwm.sampling_phase;
    plain.pwm.duty_delay = p.pwm.duty_delay;
    plain.inductor.dcr = p.inductor.dcr;
    plain.switch.r_ds_on = p.switch.r_ds_on;
    plain.switch.r_ds_on_low = p.switch.r_ds_on_low;
    plain.switch.v_f = p.switch.v_f;
    plain.switch.r_d = p.switch.r_d;
    if p.converter.topology == Topology::Buck {
        plain.capacitor.esr = p.capacitor.esr;
    }
    plain.load.bleed = p.load.bleed;
    plain.load.v_fold = p.load.v_fold;
    plain
}

/// The first extreme of the voltage error (V, as a size) under full effort from the instant of the load step on, in the
/// averaged model: a limit for a controller without sampling and modulator.
///
/// # Errors
/// If the parameters are not those of a converter.
pub fn averaged(parameters: &Parameters, v_ref: f64, step: LoadStep, range: [f64; 2]) -> Result<f64, Error> {
    let topology = parameters.converter.topology;
    let mut averaged = plain(parameters);
    averaged.converter.model = Model::Averaged;
    averaged.pwm.duty_delay = 0;
    averaged.pwm.sampling_phase = 0.0;
    let mut plant = Plant::new(&averaged)?;
    let [from, to] = step.loads();
    // before the extreme no sequence of duties gives more current than full effort, so this one run is the limit
    plant.settle(v_ref, &from);
    let rest = plant.sample();
    let mut largest = 0.0_f64;
    let up = to.at(v_ref) > rest.i_out;
    let mut last = rest;
    for _ in 0..HORIZON {
        let effort = if up { range[1] } else { range[0] };
        let sample = plant.step(effort, &to);
        if topology != Topology::Buck {
            // its voltage goes the wrong way until the current is the one that holds it, and no further
            let surplus =
                |sample: &Sample| sample.i_l - holding(topology, parameters.converter.v_in, sample.v_out, &to);
            let (before, behind) = (surplus(&last), surplus(&sample));
            if (behind > 0.0) == up {
                let share = before / (before - behind);
                // a parabola over the period, as the current that the output gets is a straight line
                let charge = parameters.converter.capacitance / parameters.t_sw();
                let bend = 0.5 * topology.give(effort) * (sample.i_l - last.i_l) / charge;
                let v = last.v_out + share * (sample.v_out - last.v_out) - bend * share * (1.0 - share);
                return Ok(largest.max(if up { v_ref - v } else { v - v_ref }));
            }
            last = sample;
        }
        let swing = if up { v_ref - sample.v_min } else { sample.v_max - v_ref };
        largest = largest.max(swing);
        // the current has overtaken the load's
        if topology == Topology::Buck && (sample.i_l > sample.i_out) == up {
            break;
        }
    }
    Ok(largest)
}
