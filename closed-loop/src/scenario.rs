//! Load steps in closed loop, and what is measured on them. The controller is any `FnMut(&Sample) -> duty`.
//!
//! All voltages are the true ones at the sampling instants; the ripple between them is reported apart. The instant of the
//! load step matters: right behind a sampling instant the controller learns of it a whole period later, and a controller
//! that dithers meets it with a shifted current. So a load step is repeated at several instants, each one whole period
//! and a fraction later than the one before, and the worst counts.

use plant::{Load, Sample};
use serde::Serialize;

use crate::chatter::Chatter;
use crate::environment::{Environment, LoadPath, Start};
use crate::faults::Error;
pub use crate::lead::{Lead, survey, survey_all};
use crate::load_step::{LoadKind, LoadStep};

/// Half width of the band that settling refers to, V: half a percent of the reference, the 0.5 V of the paper's 100 V.
#[must_use]
pub fn settled_band(v_ref: f64) -> f64 {
    v_ref / 200.0
}

/// Load steps to be run.
#[derive(Debug, Clone, PartialEq)]
pub struct Task {
    /// Constant power before and after, W.
    pub load_steps: Vec<[f64; 2]>,
    /// Instants per load step: instant k comes k periods and k/instants of a period after the lead.
    pub instants: usize,
    /// Sampling instants per load step, one control period after the other; the first is instant 0.
    pub sampling_instants: usize,
    /// Control periods before the first instant.
    pub lead: usize,
    /// Control periods after each step.
    pub after: usize,
    /// The last of them, over which the tail is measured.
    pub tail: usize,
}

impl Default for Task {
    /// The paper's six load steps, 24 instants, 30 ms before and after.
    fn default() -> Self {
        let pairs = [500.0, 800.0, 1000.0];
        let up = pairs.iter().map(|&power| [200.0, power]);
        let down = pairs.iter().map(|&power| [power, 200.0]);
        Self {
            load_steps: up.chain(down).collect(),
            instants: 24,
            sampling_instants: 6,
            lead: 300,
            after: 300,
            tail: 100,
        }
    }
}

/// What is measured on one load step.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Metrics {
    /// Largest |e| after the step, V; after a step of the reference the overshoot.
    pub deviation: f64,
    /// Half width of the band that settling refers to, V ([`settled_band`]).
    pub band: f64,
    /// From the step to the last sample outside the band, s; 0 if none is.
    pub settling: f64,
    /// |mean e| over the tail, V.
    pub tail_mean: f64,
    /// Largest |e| over the tail, V.
    pub tail_max: f64,
    /// Largest |e| over as long a stretch before the step, V.
    pub pre_error: f64,
    /// Mean peak-to-peak voltage of a control period in the tail, V: switching ripple and what dithering adds.
    pub ripple: f64,
    /// What the controller does over the tail, where nothing happens.
    #[serde(flatten)]
    pub chatter: Chatter,
}

impl Metrics {
    /// Figure by figure the larger.
    #[must_use]
    pub fn worst(self, other: Self) -> Self {
        Self {
            deviation: self.deviation.max(other.deviation),
            band: self.band.max(other.band),
            settling: self.settling.max(other.settling),
            tail_mean: self.tail_mean.max(other.tail_mean),
            tail_max: self.tail_max.max(other.tail_max),
            pre_error: self.pre_error.max(other.pre_error),
            ripple: self.ripple.max(other.ripple),
            chatter: self.chatter.worst(other.chatter),
        }
    }

    /// Whether the run ended inside the band.
    #[must_use]
    pub fn is_settled(&self) -> bool {
        self.tail_max <= self.band
    }
}

/// One load step over all its instants.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Finding {
    /// What the two values of the load step are.
    pub kind: LoadKind,
    /// Load before and after, in the unit of its kind: W, A or ohm.
    pub load_step: [f64; 2],
    /// Voltage of the source before and after, V, if it is the source that steps.
    pub source_step: Option<[f64; 2]>,
    /// Voltage to hold before and after, V, if it is the reference that steps.
    pub reference_step: Option<[f64; 2]>,
    /// The worst of the sampling instants, figure by figure.
    pub at_sample: Metrics,
    /// The worst of all instants, figure by figure.
    pub worst: Metrics,
}

impl Finding {
    /// Of a load step that has not been run yet.
    #[must_use]
    pub fn new(step: LoadStep) -> Self {
        Self {
            kind: step.kind,
            load_step: step.values,
            source_step: step.source,
            reference_step: step.reference,
            at_sample: Metrics::default(),
            worst: Metrics::default(),
        }
    }

    /// Takes in one instant.
    pub fn add(&mut self, instant: Instant, metrics: Metrics) {
        self.worst = self.worst.worst(metrics);
        if instant.phase == 0.0 {
            self.at_sample = self.at_sample.worst(metrics);
        }
    }
}

/// One control period of a recorded run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Record {
    /// Time of the sample that the controller acted on, from the load step, s.
    pub time: f64,
    /// That sample.
    pub sample: Sample,
    /// What the controller commanded.
    pub duty: f64,
    /// Load set at that instant.
    pub load: Load,
}

/// Control periods from one question whether a run is to go on to the next.
// the question costs about as much as one of them
const BETWEEN_QUESTIONS: usize = 8;

/// A converter in closed loop with a controller, about to see a load step.
#[derive(Debug, Clone)]
pub struct Loop<E, C> {
    pub(crate) environment: E,
    controller: C,
    sample: Sample,
    load: Load,
    v_ref: f64,
    /// Sign of a step of the reference, beyond which an error is an overshoot; 0 without one.
    direction: f64,
    /// |e| of the latest samples before the step, as many as the tail has.
    pre: Vec<f64>,
    elapsed: usize,
}

impl<E: Environment, C: FnMut(&Sample) -> f64> Loop<E, C> {
    /// Starts at `v_ref` with the load's current, and with a source of `v_in` V if that is given.
    ///
    /// # Errors
    /// If the converter cannot be started.
    pub fn start(mut environment: E, controller: C, v_ref: f64, load: Load, v_in: Option<f64>) -> Result<Self, Error> {
        let source: Vec<(&str, f64)> = v_in.map(|v_in| ("converter.v_in", v_in)).into_iter().collect();
        let sample = environment.restart(&Start {
            v_out: v_ref,
            i_l: environment.holding_current(v_ref, load.at(v_ref)),
            load,
            seed: 0,
            varied: &source,
        })?;
        Ok(Self {
            environment,
            controller,
            sample,
            load,
            v_ref,
            direction: 0.0,
            pre: Vec::new(),
            elapsed: 0,
        })
    }

    /// What steps beside the load: the source right behind the sampling instant that has just been, the voltage to hold at it.
    ///
    /// # Errors
    /// If the converter's source cannot.
    pub fn disturb(&mut self, step: &LoadStep) -> Result<(), Error> {
        if let Some([before, after]) = step.reference {
            self.v_ref = after;
            self.direction = (after - before).signum();
        }
        match step.source {
            Some([_, after]) => self.environment.set_source(after),
            None => Ok(()),
        }
    }

    /// One control period; returns the voltage error behind it.
    fn period(&mut self, change: Option<(f64, Load)>) -> (f64, f64) {
        let duty = (self.controller)(&self.sample);
        let path = LoadPath {
            before: self.load,
            change,
        };
        self.sample = self.environment.step(duty, &path);
        self.load = path.end();
        self.elapsed += 1;
        (self.sample.v_out - self.v_ref, duty)
    }

    /// Runs `periods` before the step, of which the last `watched` count for the error before it.
    pub fn lead(&mut self, periods: usize, watched: usize, mut record: impl FnMut(Record)) {
        for _ in 0..periods {
            self.lead_period(None, watched, &mut record);
        }
    }

    fn lead_period(&mut self, change: Option<(f64, Load)>, watched: usize, record: &mut impl FnMut(Record)) {
        let (sample, load, time) = (self.sample, self.load, self.elapsed as f64);
        let (error, duty) = self.period(change);
        record(Record {
            time,
            sample,
            duty,
            load,
        });
        if change.is_some() {
            // the sample at its end shows the new load already: an ESR makes a step of it at once
        } else if self.pre.len() < watched.max(1) {
            self.pre.push(error.abs());
        } else {
            let oldest = self.elapsed % self.pre.len();
            self.pre[oldest] = error.abs();
        }
    }

    /// The load changes to `to` at `phase` of the coming period, 0 meaning at the sampling instant that has just been.
    /// Runs `after` periods from there; the last `tail` of them are the tail.
    ///
    /// [`Loop::last_before`] comes before it.
    pub fn measure(&mut self, to: Load, phase: f64, after: usize, tail: usize, record: impl FnMut(Record)) -> Metrics {
        self.measure_while((to, phase), after, tail, |_| true, record)
    }

    /// [`Loop::measure`], asked every few periods whether it is to go on. The figures so far are none of them above those of the
    /// whole run; what is told of the tail as a whole stays at 0 if the run is ended.
    pub fn measure_while(
        &mut self,
        (to, phase): (Load, f64),
        after: usize,
        tail: usize,
        mut go_on: impl FnMut(&Metrics) -> bool,
        mut record: impl FnMut(Record),
    ) -> Metrics {
        let t_sample = self.environment.t_sample();
        let mut metrics = Metrics {
            band: settled_band(self.v_ref),
            pre_error: self.pre.iter().copied().fold(0.0, f64::max),
            ..Metrics::default()
        };
        let tail = tail.clamp(1, after.max(1));
        let (mut sum, mut ripple) = (0.0, 0.0);
        let (mut duties, mut currents) = (Vec::with_capacity(tail), Vec::with_capacity(tail));
        for n in 0..after {
            let (sample, load, time) = (self.sample, self.load, self.elapsed as f64);
            let change = (n == 0 && phase > 0.0).then_some((phase, to));
            let (error, duty) = self.period(change);
            record(Record {
                time,
                sample,
                duty,
                load,
            });
            // `f64::max` ignores a NaN, so a run that diverged would look good
            let size = if error.is_finite() { error.abs() } else { f64::INFINITY };
            // on the way to another reference the error is what was asked for
            let beyond = match self.direction {
                0.0 => size,
                side if size.is_finite() => (side * error).max(0.0),
                _ => size,
            };
            metrics.deviation = metrics.deviation.max(beyond);
            if size > metrics.band {
                metrics.settling = ((n + 1) as f64 - phase) * t_sample;
            }
            if n + tail >= after {
                sum += error;
                metrics.tail_max = metrics.tail_max.max(size);
                ripple += self.sample.v_max - self.sample.v_min;
                duties.push(duty);
                currents.push(self.sample.i_l);
            }
            if (n + 1) % BETWEEN_QUESTIONS == 0 && !go_on(&metrics) {
                return metrics;
            }
        }
        metrics.tail_mean = (sum / tail as f64).abs();
        metrics.ripple = ripple / tail as f64;
        metrics.chatter = Chatter::new(&duties, &currents, self.environment.ideal_ripple(self.v_ref));
        // a mean that is NaN would vanish in `Metrics::worst`
        if metrics.deviation.is_infinite() {
            metrics.tail_mean = f64::INFINITY;
        }
        metrics
    }

    /// The last period before the step; at phase 0 the load changes at the sampling instant that ends it.
    pub fn last_before(&mut self, to: Load, phase: f64, watched: usize, mut record: impl FnMut(Record)) {
        let change = (phase == 0.0).then_some((1.0, to));
        self.lead_period(change, watched, &mut record);
    }
}

/// When a load changes: whole control periods after the lead, and a fraction of one, 0 meaning at a sampling instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Instant {
    /// Whole periods.
    pub periods: usize,
    /// 0 to below 1.
    pub phase: f64,
}

impl Task {
    /// All instants at which a load step is tried, the sampling instants first.
    #[must_use]
    pub fn all_instants(&self) -> Vec<Instant> {
        let sampling = (0..self.sampling_instants.max(1)).map(|periods| Instant { periods, phase: 0.0 });
        // from 1: the first is a sampling instant and stands above
        let others = (1..self.instants).map(|k| Instant {
            periods: k,
            phase: k as f64 / self.instants as f64,
        });
        sampling.chain(others).collect()
    }
}

/// Runs one load step at one instant from a fresh start and records every period; time 0 is the step.
///
/// # Errors
/// If the converter cannot be started, or one from outside fails.
pub fn load_step<E, C>(
    environment: E,
    controller: C,
    v_ref: f64,
    task: &Task,
    load_step: impl Into<LoadStep>,
    instant: Instant,
) -> Result<(Metrics, Vec<Record>), Error>
where
    E: Environment,
    C: FnMut(&Sample) -> f64,
{
    let t_sample = environment.t_sample();
    let step = load_step.into();
    let [from, to] = step.loads();
    let phase = step.phase(instant.phase);
    let mut run = Loop::start(
        environment,
        controller,
        step.held(v_ref)[0],
        from,
        step.source.map(|[before, _]| before),
    )?;
    let mut records = Vec::new();
    let lead = task.lead + instant.periods;
    // the last period of the lead is `last_before`, in which a step at a sampling instant takes place
    run.lead(lead - 1, task.tail, |record| records.push(record));
    run.last_before(to, phase, task.tail, |record| records.push(record));
    run.disturb(&step)?;
    let metrics = run.measure(to, phase, task.after, task.tail, |record| records.push(record));
    run.environment.failure().map_or(Ok(()), Err)?;
    let zero = lead as f64 + phase;
    for record in &mut records {
        record.time = (record.time - zero) * t_sample;
    }
    Ok((metrics, records))
}
