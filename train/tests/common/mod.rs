//! A converter for the tests of the trainer: buck with switch and diode drops, switched, few Runge-Kutta steps per
//! segment, no effects. Quick, deterministic, independent of `plant`'s own code.

#![allow(dead_code, clippy::unwrap_used, clippy::panic)]

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use closed_loop::environment::{Environment, LoadPath, Start};
use plant::{Load, Sample, Signals};
use train::{Contract, Settings};

/// The training of `fixtures/tiny.toml`.
pub fn tiny() -> (Settings, Contract) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/tiny.toml");
    let settings = Settings::load(&path).unwrap_or_else(|error| panic!("{error}"));
    let contract = Contract::load(&settings.contract, &settings.hidden).unwrap_or_else(|error| panic!("{error}"));
    (settings, contract)
}

/// Raises a flag after so many steps of a converter and its copies.
#[derive(Debug, Default)]
pub struct Alarm {
    pub steps: AtomicU64,
    pub flag: AtomicBool,
}

#[derive(Debug, Clone)]
pub struct StandIn {
    pub capacitance: f64,
    pub v_in: f64,
    /// Whole control periods that a duty waits.
    pub delay: usize,
    pub alarm: Option<Arc<Alarm>>,
    factor: f64,
    i: f64,
    v: f64,
    waiting: Vec<f64>,
}

impl StandIn {
    pub fn new(capacitance: f64, delay: usize) -> Self {
        Self {
            capacitance,
            v_in: 200.0,
            delay,
            alarm: None,
            factor: 1.0,
            i: 0.0,
            v: 0.0,
            waiting: vec![],
        }
    }

    fn slopes(&self, on: bool, power: f64, i: f64, v: f64) -> (f64, f64) {
        let drive = if on { self.v_in * self.factor - 0.1 * i } else { -0.8 };
        let di = if !on && i <= 0.0 { 0.0 } else { (drive - v) / 2e-3 };
        (di, (i - power / v.max(20.0)) / self.capacitance)
    }

    fn segment(&mut self, on: bool, power: f64, time: f64, range: &mut (f64, f64)) {
        let h = time / 3.0;
        for _ in 0..3 {
            let (i, v) = (self.i, self.v);
            let a = self.slopes(on, power, i, v);
            let b = self.slopes(on, power, i + 0.5 * h * a.0, v + 0.5 * h * a.1);
            let c = self.slopes(on, power, i + 0.5 * h * b.0, v + 0.5 * h * b.1);
            let d = self.slopes(on, power, i + h * c.0, v + h * c.1);
            self.i = (i + h / 6.0 * (a.0 + 2.0 * b.0 + 2.0 * c.0 + d.0)).max(0.0);
            self.v = v + h / 6.0 * (a.1 + 2.0 * b.1 + 2.0 * c.1 + d.1);
            *range = (range.0.min(self.v), range.1.max(self.v));
        }
    }

    fn sample(&self, power: f64, range: (f64, f64)) -> Sample {
        let measured = Signals {
            v_out: self.v,
            i_l: self.i,
            i_out: power / self.v.max(20.0),
            v_in: self.v_in * self.factor,
        };
        Sample {
            v_out: self.v,
            i_l: self.i,
            i_out: measured.i_out,
            v_in: measured.v_in,
            v_min: range.0,
            v_max: range.1,
            measured,
            ..Sample::default()
        }
    }
}

impl Environment for StandIn {
    fn t_sample(&self) -> f64 {
        1e-4
    }

    fn parameter(&self, key: &str) -> Option<f64> {
        (key == "converter.v_in").then_some(self.v_in)
    }

    fn ideal_ripple(&self, v_out: f64) -> f64 {
        v_out * (1.0 - v_out / self.v_in) * 1e-4 / 2e-3
    }

    fn identity(&self) -> Vec<u8> {
        format!("{} {} {}", self.capacitance, self.v_in, self.delay).into_bytes()
    }

    fn restart(&mut self, start: &Start<'_>) -> Result<Sample, closed_loop::Error> {
        self.factor = start.varied.first().map_or(1.0, |(_, v_in)| v_in / self.v_in);
        (self.i, self.v) = (start.i_l, start.v_out);
        self.waiting = vec![start.v_out / self.v_in; self.delay];
        Ok(self.sample(start.load.power, (self.v, self.v)))
    }

    fn step(&mut self, duty: f64, load: &LoadPath) -> Sample {
        if let Some(alarm) = &self.alarm
            && alarm.steps.fetch_sub(1, Ordering::Relaxed) == 1
        {
            alarm.flag.store(true, Ordering::Relaxed);
        }
        self.waiting.push(duty);
        let duty = self.waiting.remove(0);
        let (at, after) = load.change.unwrap_or((1.0, load.before));
        let mut range = (self.v, self.v);
        let mut edges = [(0.0, false), (duty, true), (at, false), (1.0, false)];
        edges[1..3].sort_by(|a, b| a.0.total_cmp(&b.0));
        for pair in edges.windows(2) {
            let (from, to) = (pair[0].0, pair[1].0);
            let load: Load = if from < at { load.before } else { after };
            if to > from {
                self.segment(from < duty, load.power, (to - from) * 1e-4, &mut range);
            }
        }
        self.sample(load.end().power, range)
    }

    fn save(&self) -> Result<Vec<u8>, closed_loop::Error> {
        let words = [self.factor, self.i, self.v]
            .into_iter()
            .chain(self.waiting.iter().copied());
        Ok(words.flat_map(f64::to_le_bytes).collect())
    }

    fn load(&mut self, bytes: &[u8]) -> Result<(), closed_loop::Error> {
        let words: Vec<f64> = bytes
            .as_chunks::<8>()
            .0
            .iter()
            .map(|word| f64::from_le_bytes(*word))
            .collect();
        (self.factor, self.i, self.v) = (words[0], words[1], words[2]);
        self.waiting = words[3..].to_vec();
        Ok(())
    }
}
