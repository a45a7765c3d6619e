//! A converter that runs: from sampling instant to sampling instant.

use serde::{Deserialize, Serialize};

use toml_input::Faults;

use crate::catalogue;
use crate::check::check;
use crate::effects::duty_delay::{self, Queue};
use crate::effects::empirical::Correction;
use crate::effects::node_capacitance::{Edge, Node};
use crate::effects::{dcr, duty_offset, duty_quantisation, heating, load_setting, minimum_on_time};
use crate::entry::Way;
use crate::full::{Full, Path, States, beside};
use crate::gates::{Gate, GateTiming, Gates};
use crate::legs::Legs;
use crate::parameters::{Model, Parameters};
use crate::plain::{Drive, Plain, Track};
use crate::rate::Pace;
use crate::sensing::{Memory, Sensing, array};
use crate::signals::{Load, Sample, Signals};

/// A converter with its state. Times count in control periods, which are switching periods.
#[derive(Debug, Clone)]
pub struct Plant {
    pub(crate) parameters: Parameters,
    /// Share of the period by which every pulse is longer ([`Plant::lengthen`]).
    longer: f64,
    pub(crate) t_sw: f64,
    pub(crate) plain: Plain,
    pub(crate) legs: Legs,
    pub(crate) full: Full,
    pub(crate) timing: GateTiming,
    pub(crate) node: Node,
    pub(crate) sensing: Sensing,
    correction: Correction,
    pace: Pace,
    /// How it has to be computed.
    pub(crate) way: Way,
    pub(crate) state: PlantState,
    /// Steps of an integrator since it was made.
    steps: u64,
}

/// Everything about a plant that changes; restoring it continues to the bit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PlantState {
    pub(crate) x: States,
    pub(crate) path: Path,
    pub(crate) time: f64,
    pub(crate) gates: Gates,
    #[serde(default)]
    pub(crate) edge: Edge,
    pub(crate) queue: Queue,
    pub(crate) applied: f64,
    #[serde(default)]
    /// The duty behind the low-pass of `effects::empirical`.
    pub(crate) slow: f64,
    pub(crate) memory: Memory,
    pub(crate) sample: Sample,
    /// The steady current from which the winding is warm, A.
    #[serde(default)]
    pub(crate) warm: f64,
}

impl Plant {
    /// A plant at rest: no voltage, no current.
    ///
    /// # Errors
    /// All parameters outside their allowed range, and effects that lack a partner.
    pub fn new(parameters: &Parameters) -> Result<Self, Faults> {
        check(parameters)?;
        let p = parameters;
        let (timing, sensing) = (GateTiming::new(p), Sensing::new(p));
        let mut plant = Plant {
            t_sw: p.t_sw(),
            plain: plain(p),
            legs: Legs::new(p),
            full: Full::new(p),
            correction: Correction::new(p),
            pace: Pace::Fine,
            way: catalogue::way(p),
            timing,
            node: Node::new(p),
            sensing,
            parameters: p.clone(),
            longer: 0.0,
            steps: 0,
            state: PlantState {
                x: States::default(),
                path: Path::OPEN,
                time: 0.0,
                gates: Gates::default(),
                edge: Edge::default(),
                queue: Queue::default(),
                applied: 0.0,
                slow: 0.0,
                memory: Memory::new(p.sensors.seed, [0.0; 4]),
                sample: Sample::default(),
                warm: 0.0,
            },
        };
        plant.reset_at(0.0, 0.0, &Load::default());
        Ok(plant)
    }

    /// What the plant is made of.
    #[must_use]
    pub fn parameters(&self) -> &Parameters {
        &self.parameters
    }

    /// The control period, s.
    #[must_use]
    pub fn t_sample(&self) -> f64 {
        self.t_sw
    }

    /// Steps that an integrator has taken since the plant was made: what its simulation took time for, beside its periods. A circuit of inductor and
    /// capacitor alone needs none.
    #[must_use]
    pub fn steps_taken(&self) -> u64 {
        self.steps
    }

    /// The latest sample.
    #[must_use]
    pub fn sample(&self) -> Sample {
        self.state.sample
    }

    /// What the sensors showed at the latest sampling instant.
    #[must_use]
    pub fn measured(&self) -> Signals {
        self.state.sample.measured
    }

    /// For a checkpoint.
    #[must_use]
    pub fn state(&self) -> &PlantState {
        &self.state
    }

    /// Continues from a checkpoint of a plant with the same parameters.
    pub fn restore(&mut self, state: &PlantState) {
        self.warm_from(state.warm);
        self.state = *state;
    }

    /// Gives the winding the resistance that it has behind a long time at `current` A.
    pub(crate) fn warm_from(&mut self, current: f64) {
        if self.parameters.inductor.heating == 0.0 || current == self.state.warm {
            return;
        }
        let warm = heating::warmed(&self.parameters, current);
        (self.plain, self.legs, self.full) = (plain(&warm), Legs::new(&warm), Full::new(&warm));
        self.full.set_pace(self.pace);
        self.state.warm = current;
    }

    /// Mean current of the inductor where the load draws `drawn` A and `duty` is in force.
    pub(crate) fn steady_current(&self, drawn: f64, duty: f64) -> f64 {
        let topology = self.parameters.converter.topology;
        let give = topology.on().1 * duty + topology.off().1 * (1.0 - duty);
        // an output that receives nothing says nothing of the current
        if give > 0.0 { drawn / give } else { 0.0 }
    }

    /// Puts the plant to a sampling instant with `v_out` V and `i_l` A under `load`; delayed duties are those that would
    /// hold the voltage, delayed sensors show it. Time starts at 0, the noise goes on.
    pub fn reset_at(&mut self, v_out: f64, i_l: f64, load: &Load) -> Sample {
        let drawn = load_setting::drawn(&self.parameters.load, load);
        let converter = &self.parameters.converter;
        let duty = converter.topology.duty(converter.v_in, v_out);
        let current = self.plain.load_current(&drawn, v_out);
        self.warm_from(self.steady_current(current, duty));
        let x = self.initial(v_out, i_l, &drawn, duty);
        let edge = self.node.behind(self.is_on(duty));
        let state = &mut self.state;
        state.x = x;
        state.path = Path::OPEN;
        state.time = 0.0;
        state.queue = Queue::filled(duty);
        state.applied = duty;
        state.slow = duty;
        state.gates = Gates::default();
        // sampled inside a PWM period, what is left of that period belongs to the duty in force
        if self.parameters.pwm.sampling_phase > 0.0 {
            state.gates.plan(&self.timing, duty);
        }
        state.edge = edge;
        let signals = Signals {
            v_out,
            i_l,
            i_out: self.plain.load_current(&drawn, v_out),
            v_in: self.parameters.converter.v_in,
        };
        state.memory.refill(array(&signals));
        self.finish(signals, Track::at(i_l, v_out))
    }

    /// The states of a circuit without ripple around `v_out` V and `i_l` A, where `duty` is in force.
    fn initial(&self, v_out: f64, i_l: f64, drawn: &Load, duty: f64) -> States {
        let give = match self.parameters.converter.model {
            Model::Averaged => self.legs.averaged(duty).give,
            Model::Switched => self.legs.steady(self.is_on(duty)).give,
        };
        self.full.initial(v_out, i_l, drawn, give)
    }

    /// Whether the switch is on at the sampling instant where `duty` is in force.
    fn is_on(&self, duty: f64) -> bool {
        self.timing.is_on_before(duty, self.parameters.pwm.sampling_phase)
    }

    /// [`Plant::reset_at`] in the middle of a run: `commanded` are the duties given before, the latest last. The one in
    /// force and those that wait are taken from its end; where it is too short they are as after [`Plant::reset_at`]. What
    /// remembers duties behind those has them as if the first had been held for ever; [`Plant::looks_back`] are enough.
    pub fn reset_within(&mut self, v_out: f64, i_l: f64, load: &Load, commanded: &[f64]) -> Sample {
        let sample = self.reset_at(v_out, i_l, load);
        let waits = self.parameters.pwm.duty_delay as usize;
        let (before, last) = commanded.split_at(commanded.len().saturating_sub(waits + 1));
        if last.len() > waits {
            self.state.slow = commanded[0];
        }
        for duty in before {
            self.correction.follow(*duty, &mut self.state.slow);
        }
        for (n, duty) in last.iter().enumerate() {
            let slow = self.state.slow;
            self.state.applied = self.modulate(*duty);
            // what the queue gives back before it has passed on a commanded duty acted in no period
            if n < waits {
                self.state.slow = slow;
            }
        }
        if self.parameters.pwm.sampling_phase > 0.0 {
            self.state.gates.plan(&self.timing, self.state.applied);
        }
        // which switch is on at the sampling instant the duty in force decides, and with it what of the output voltage is the ESR's
        let drawn = load_setting::drawn(&self.parameters.load, load);
        self.state.x = self.initial(v_out, i_l, &drawn, self.state.applied);
        self.state.edge = self.node.behind(self.is_on(self.state.applied));
        sample
    }

    /// Moves the states behind a reset as those of `rest`, which end in the states `at_rest`, lie beside the ones without ripple.
    pub(crate) fn swing_as(&mut self, rest: &Sample, at_rest: &States, load: &Load) {
        let drawn = load_setting::drawn(&self.parameters.load, load);
        let without_ripple = self.initial(rest.v_out, rest.i_l, &drawn, self.state.applied);
        let [i_out, v_in] = beside::swung(&mut self.state.x, at_rest, &without_ripple);
        let Sample { v_out, i_l, .. } = self.state.sample;
        let signals = Signals {
            v_out,
            i_l,
            i_out: rest.i_out + i_out,
            v_in: rest.v_in + v_in,
        };
        self.state.memory.refill(array(&signals));
        self.finish(signals, Track::at(i_l, v_out));
    }

    /// Commanded duties that [`Plant::reset_within`] can make use of.
    #[must_use]
    pub fn looks_back(&self) -> usize {
        (duty_delay::LONGEST + 1).saturating_add(self.correction.memory())
    }

    /// After [`Plant::reset_within`]: what the sensors of output voltage, inductor current, load current and input voltage
    /// show at that instant, as far as they have a low-pass. Values that are no number leave it as it is.
    pub fn shows(&mut self, measured: [f64; 4]) {
        let all = &self.parameters.sensors;
        let sensors = [&all.v_out, &all.i_l, &all.i_out, &all.v_in];
        // a gain of 0 gives no number, which leaves the low-pass as it is
        let before = |n: usize| (measured[n] - sensors[n].offset) / sensors[n].gain;
        Full::hold_filtered(&mut self.state.x, std::array::from_fn(before));
    }

    /// After [`Plant::reset_within`]: what a load of constant power that lags draws beyond its power at that instant, A. Behind a step that
    /// nobody has seen it has not come to rest; without a lag nothing changes.
    pub fn draws_more(&mut self, current: f64) {
        self.full.draw_more(&mut self.state.x, current);
    }

    /// One control period with `duty` (commanded now, clamped to 0..1) under `load`.
    ///
    /// The duty acts from the next start of a PWM period, which is now if the plant is sampled there, plus
    /// `pwm.duty_delay` periods.
    #[inline]
    pub fn step(&mut self, duty: f64, load: &Load) -> Sample {
        let drawn = load_setting::drawn(&self.parameters.load, load);
        // `walk` gives the same bits and takes longer
        if self.way <= Way::Step {
            return self.step_fast(duty, &drawn);
        }
        self.walk(duty, &drawn, &drawn, 1.0)
    }

    /// A control period in which the load changes from `before` to `after` at the fraction `at` of the period.
    pub fn step_with_change(&mut self, duty: f64, before: &Load, after: &Load, at: f64) -> Sample {
        // a change at either end splits nothing, and `walk` would be the slower way to the same bits
        if at <= 0.0 {
            return self.step(duty, after);
        }
        if at >= 1.0 {
            return self.step(duty, before);
        }
        let draw = |load| load_setting::drawn(&self.parameters.load, load);
        let (before, after) = (draw(before), draw(after));
        self.walk(duty, &before, &after, at)
    }

    /// What the modulator makes of a commanded duty.
    #[inline(always)]
    pub(crate) fn modulate(&mut self, duty: f64) -> f64 {
        let pwm = &self.parameters.pwm;
        // not `clamp`: a duty that is NaN must not get into the state, which would never recover
        let clamped = if duty > 0.0 { duty.min(1.0) } else { 0.0 };
        let queued = self.state.queue.pass(clamped, pwm.duty_delay);
        let corrected = (self.correction).correct(queued, &mut self.state.slow, &self.state.x);
        let shifted = duty_offset::shift(corrected, pwm);
        let pulse = minimum_on_time::limit(duty_quantisation::round(shifted, pwm.duty_lsb), pwm, self.t_sw);
        if self.longer == 0.0 || pulse <= 0.0 || pulse >= 1.0 {
            return pulse;
        }
        (pulse + self.longer).clamp(0.0, 1.0)
    }

    /// The same plant with steps of another length; a batch has those of [`Pace::Fine`].
    #[must_use]
    pub fn at_pace(mut self, pace: Pace) -> Self {
        self.full.set_pace(pace);
        self.pace = pace;
        self
    }

    /// Makes every pulse longer by this share of the period, shorter where it is negative, behind all that the modulator does. What a gate does by
    /// itself, to first order: `switch.turn_on_delay` and its like act the other way round where the current is negative.
    pub fn lengthen(&mut self, share: f64) {
        self.longer = share;
    }

    #[inline(always)]
    fn step_fast(&mut self, duty: f64, load: &Load) -> Sample {
        let duty = self.modulate(duty);
        let mut x = (self.state.x[0], self.state.x[1]);
        let mut track = Track::at(x.0, x.1);
        let on = duty * self.t_sw;
        if on > 0.0 {
            self.plain.advance(&mut x, &self.legs.main, load, on, &mut track);
        }
        let mut rest = self.t_sw - on;
        if self.legs.synchronous {
            if rest > 0.0 {
                self.plain.advance(&mut x, &self.legs.second, load, rest, &mut track);
            }
        } else if self.legs.starts {
            self.freewheel(&mut x, load, rest, &mut track);
        } else {
            // exactly 0 where a diode has ended the current (`Plain::leaf`), so no tolerance is needed
            if x.0 != 0.0 && rest > 0.0 {
                let drive: &Drive = if x.0 > 0.0 { &self.legs.diode } else { &self.legs.body };
                rest -= self.plain.advance(&mut x, drive, load, rest, &mut track);
            }
            if rest > 0.0 {
                self.plain.advance(&mut x, &Drive::OPEN, load, rest, &mut track);
                track.discontinuous = true;
            }
        }
        (self.state.x[0], self.state.x[1]) = x;
        self.state.time += self.t_sw;
        self.state.applied = duty;
        let signals = Signals {
            v_out: x.1,
            i_l: x.0,
            i_out: self.plain.load_current(load, x.1),
            v_in: self.parameters.converter.v_in,
        };
        self.finish(signals, track)
    }

    /// A diode leg whose current may begin by itself, with the switch off for `rest` seconds.
    #[inline(never)]
    fn freewheel(&self, x: &mut (f64, f64), load: &Load, mut rest: f64, track: &mut Track) {
        let mut next = None;
        while rest > 0.0 {
            let above = x.1 - self.parameters.converter.v_in;
            let path = next.unwrap_or_else(|| self.legs.path(Gate::Neither, x.0, above));
            let used = self.plain.advance(x, &self.legs.drive(&path), load, rest, track);
            track.discontinuous |= path.open;
            rest = if path.only != 0.0 { rest - used } else { 0.0 };
            next = self.legs.after(&path, used);
        }
    }

    /// Lets the sensors look and stores the sample.
    #[inline(always)]
    pub(crate) fn finish(&mut self, signals: Signals, track: Track) -> Sample {
        self.steps += track.steps;
        let measured = match self.sensing.ideal {
            true => signals,
            false => {
                let filtered = Full::filtered(&self.state.x);
                self.sensing.show(&mut self.state.memory, &signals, filtered)
            }
        };
        self.state.sample = Sample {
            v_out: signals.v_out,
            i_l: signals.i_l,
            i_out: signals.i_out,
            v_in: signals.v_in,
            v_min: track.v_min,
            v_max: track.v_max,
            i_min: track.i_min,
            i_max: track.i_max,
            discontinuous: track.discontinuous,
            measured,
        };
        self.state.sample
    }
}

/// The circuit of two states, with the largest resistance that a path has.
fn plain(p: &Parameters) -> Plain {
    let switch = &p.switch;
    let r = dcr::in_series(&p.inductor) + p.source.resistance + switch.r_ds_on.max(switch.r_d).max(switch.r_ds_on_low);
    Plain::new(&p.converter, r, p.load.v_fold)
}
