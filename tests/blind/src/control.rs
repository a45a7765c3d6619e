//! A policy at the hidden bench: ngspice goes on period by period under a controller of ours, which sees what the bench's
//! sensors show and whose duties pass its modulator.

use closed_loop::environment::{Environment, LoadPath, Start};
use closed_loop::scenario::Task;
use closed_loop::{Agent, Error, LoadKind, LoadStep, follow};
use plant::{Sample, Signals};
use policy::Policy;
use serde::Serialize;
use spice::host::{Edge, Host, Row, Source};
use toml_input::Message;

use crate::bench::{Bench, T_SW};
use crate::experiment::Load;
use crate::netlist::{SHOWN, drawn, pulse, under_control};
use crate::rng::Rng;

/// Rise and fall time of a gate, and duration of a load step, s.
const RISE: f64 = 2e-9;
const LOAD_RISE: f64 = 100e-9;

/// Load steps that a policy is judged on, W.
const STEPS: [[f64; 2]; 4] = [[200.0, 500.0], [200.0, 800.0], [500.0, 200.0], [800.0, 200.0]];

/// A bench under control. A copy has to be started anew.
#[derive(Debug)]
pub struct HiddenConverter {
    bench: Bench,
    running: Option<Running>,
}

#[derive(Debug)]
struct Running {
    host: Host,
    random: Rng,
    /// Duties commanded and not yet in force, oldest first.
    waiting: Vec<f64>,
    /// Edges of the period that was running at the start.
    leftover: Vec<Edge>,
    load: Load,
    periods: f64,
}

impl Clone for HiddenConverter {
    fn clone(&self) -> Self {
        Self::new(&self.bench)
    }
}

impl HiddenConverter {
    /// Not started yet.
    #[must_use]
    pub fn new(bench: &Bench) -> Self {
        Self {
            bench: bench.clone(),
            running: None,
        }
    }

    /// When a sample is taken, as a share of the PWM period in which it lies.
    fn phase(&self) -> f64 {
        (0.5 + self.bench.sensors.delay / T_SW).clamp(0.0, 0.99)
    }

    fn gate(&self, duty: f64, load: &Load, start: f64, random: &mut Rng) -> Vec<Edge> {
        let lost = self.bench.modulator.missing;
        let edge = |time, level| Edge {
            source: Source::UpperGate,
            time,
            rise: RISE,
            level,
        };
        match pulse(&self.bench, duty, load, lost, random) {
            Some([on, off]) if off > on + 2.0 * RISE => vec![edge(start + on, 1.0), edge(start + off - RISE, 0.0)],
            _ => Vec::new(),
        }
    }

    fn load_edges(&self, load: &Load, time: f64) -> Vec<Edge> {
        let sources = [Source::Power, Source::Current, Source::Conductance];
        let edge = |(source, level)| Edge {
            source,
            time,
            rise: LOAD_RISE,
            level,
        };
        sources.into_iter().zip(drawn(&self.bench, load)).map(edge).collect()
    }

    fn period(&mut self, duty: f64, path: &LoadPath) -> Result<Sample, Error> {
        let Some(mut running) = self.running.take() else {
            return Err(Message::new("the converter has not been started").into());
        };
        running.waiting.push(duty.clamp(0.0, 1.0));
        let duty = running.waiting.remove(0);
        let mut edges = std::mem::take(&mut running.leftover);
        let start = (1.0 - self.phase()) * T_SW;
        edges.extend(self.gate(duty, &running.load, start, &mut running.random));
        if let Some((at, after)) = &path.change {
            running.load = plain(after);
            edges.extend(self.load_edges(&running.load, at * T_SW - LOAD_RISE));
        }
        let row = running.host.period(&edges)?;
        running.periods += 1.0;
        let sample = self.sample(&row, &mut running);
        self.running = Some(running);
        Ok(sample)
    }

    /// What is true, and what the sensors show of it.
    fn sample(&self, row: &Row, running: &mut Running) -> Sample {
        let s = &self.bench.sensors;
        let random = &mut running.random;
        let mut show = |value: f64, noise: f64, lsb: f64| {
            let value = value + noise * random.normal();
            if lsb > 0.0 { (value / lsb).round() * lsb } else { value }
        };
        let [v, i, o] = [0, 1, 2].map(|n| row.others.get(n).copied().unwrap_or(f64::NAN));
        let x = (s.v_gain * v + s.v_offset - 100.0) / 10.0;
        let turns = 50.0 * running.periods * T_SW + s.odd.mains_phase;
        let odd = s.odd.cubic * x * x * x + s.odd.mains * libm::sin(2.0 * std::f64::consts::PI * turns);
        let [v_min, v_max, i_min, i_max] = row.extremes;
        Sample {
            v_out: row.v_out,
            i_l: row.i_l,
            i_out: row.i_out,
            v_in: row.v_in,
            v_min,
            v_max,
            i_min,
            i_max,
            discontinuous: false,
            measured: Signals {
                v_out: show(s.v_gain * v + s.v_offset + odd, s.v_noise, s.v_lsb),
                i_l: show(s.i_gain * i + s.i_offset, s.i_noise, s.i_lsb),
                i_out: show(o, s.i_noise, s.i_lsb),
                v_in: show(row.v_in, s.v_noise, s.v_lsb),
            },
        }
    }
}

fn plain(load: &plant::Load) -> Load {
    Load {
        conductance: load.conductance,
        current: load.current,
        power: load.power,
    }
}

impl Environment for HiddenConverter {
    fn t_sample(&self) -> f64 {
        T_SW
    }

    fn parameter(&self, _: &str) -> Option<f64> {
        None
    }

    fn ideal_ripple(&self, v_out: f64) -> f64 {
        let circuit = &self.bench.circuit;
        v_out * (1.0 - v_out / circuit.v_in) * T_SW / circuit.inductance
    }

    fn identity(&self) -> Vec<u8> {
        format!("{:?}", self.bench).into_bytes()
    }

    fn restart(&mut self, start: &Start<'_>) -> Result<Sample, Error> {
        let load = plain(&start.load);
        let netlist = under_control(&self.bench, start.v_out, start.i_l, &load);
        let before = self.load_edges(&load, -1e-6);
        let (host, row) = Host::start(&netlist, T_SW, &before, &SHOWN)?;
        let hold = start.v_out / self.bench.circuit.v_in;
        let mut random = Rng::new(start.seed, &[7]);
        let mut running = Running {
            leftover: self.gate(hold, &load, -self.phase() * T_SW, &mut random),
            host,
            random,
            waiting: vec![hold; self.bench.modulator.duty_delay as usize],
            load,
            periods: 0.0,
        };
        let sample = self.sample(&row, &mut running);
        self.running = Some(running);
        Ok(sample)
    }

    /// Where ngspice fails the sample is not a number: a diverged run.
    fn step(&mut self, duty: f64, load: &LoadPath) -> Sample {
        self.period(duty, load).unwrap_or(Sample {
            v_out: f64::NAN,
            ..Sample::default()
        })
    }

    fn save(&self) -> Result<Vec<u8>, Error> {
        Err(Message::new("a run in ngspice cannot be saved").into())
    }

    fn load(&mut self, _: &[u8]) -> Result<(), Error> {
        Err(Message::new("a run in ngspice cannot be saved").into())
    }
}

/// True voltages of a policy at a bench, over all load steps.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Figures {
    /// Mean of |v - v_ref| from the step on, V.
    pub mean_abs: f64,
    /// |mean error| of the tail, the largest of all steps, V.
    pub tail_mean: f64,
    /// Largest error in the tail, V.
    pub tail_max: f64,
    /// Largest error after a step, V.
    pub deviation: f64,
    /// Longest time to the last sample beyond 0.5 V, s.
    pub settling: f64,
}

/// Closes the loop at a bench over the load steps of the judge.
///
/// # Errors
/// If policy and bench do not fit, or ngspice's library is missing.
pub fn close(bench: &Bench, policy: &Policy) -> Result<Figures, Error> {
    let v_ref = policy.parameters.get("v_ref").copied().unwrap_or(100.0);
    let task = Task {
        load_steps: Vec::new(),
        instants: 1,
        sampling_instants: 1,
        lead: 100,
        after: 200,
        tail: 100,
    };
    let converter = HiddenConverter::new(bench);
    let mut agent = Agent::<f32>::new(policy)?;
    let mut figures = Figures::default();
    for values in STEPS {
        let step = LoadStep {
            kind: LoadKind::Power,
            values,
            source: None,
            reference: None,
        };
        let instant = task.all_instants()[0];
        let run = follow(&converter, &mut agent, v_ref, &task, step, instant)?;
        let errors = run.periods.iter().filter(|period| period.record.time > 0.0);
        let errors: Vec<f64> = errors
            .map(|period| (period.record.sample.v_out - v_ref).abs())
            .collect();
        figures.mean_abs += errors.iter().sum::<f64>() / errors.len().max(1) as f64 / STEPS.len() as f64;
        let m = &run.metrics;
        figures.tail_mean = figures.tail_mean.max(m.tail_mean);
        figures.tail_max = figures.tail_max.max(m.tail_max);
        figures.deviation = figures.deviation.max(m.deviation);
        figures.settling = figures.settling.max(m.settling);
    }
    Ok(figures)
}

/// Duty that holds 100 V at `i` A in steady state, from the loop equation.
fn needed(bench: &Bench, i: f64) -> f64 {
    let (c, m) = (&bench.circuit, &bench.modulator);
    let lost = (m.dead_time + m.turn_on_delay) / T_SW;
    let mut on = 0.5;
    for _ in 0..50 {
        let upper = c.v_in - c.source_resistance * on * i - c.r_ds_on * i;
        let lower = c.v_f + c.r_d * i;
        on = (100.0 + c.dcr * i + lower) / (upper + lower);
    }
    on + lost
}

/// Largest change of that duty against the nominal bench's, over the loads of the judge: what a mapping can repair.
#[must_use]
pub fn repairable(bench: &Bench) -> f64 {
    let nominal = Bench::nominal();
    let change = |i: &f64| (needed(bench, *i) - needed(&nominal, *i)).abs();
    [2.0, 5.0, 8.0].iter().map(change).fold(0.0, f64::max)
}
