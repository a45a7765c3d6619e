//! A bench of its own, which shares neither code nor parameters with the plant: Kirchhoff's equations of a switched converter, by
//! Runge and Kutta's method from edge to edge, and a table as a logger writes it.

#![allow(dead_code, reason = "each test program uses its part")]

pub mod control;

use std::fmt::Write as _;
use std::path::Path;

use diagnose::findings::Findings;
use diagnose::record::Record;
use measured::{ColumnMap, Sheet};
use plant::Parameters;
use toml_input::Faults;

/// Names of the causes and of all that would do in their place.
pub fn named(findings: &Findings) -> Vec<&str> {
    let rivals = findings.causes.iter().flat_map(|cause| cause.rivals.iter().flatten());
    rivals
        .copied()
        .chain(findings.causes.iter().map(|cause| cause.id))
        .collect()
}

/// Moves `x` by `steps` steps of `h` s, by Runge and Kutta's method of the fourth order.
pub fn integrate<const N: usize>(x: &mut [f64; N], h: f64, steps: usize, slope: impl Fn([f64; N]) -> [f64; N]) {
    let moved = |x: &[f64; N], by: f64, k: &[f64; N]| std::array::from_fn(|n| x[n] + by * k[n]);
    for _ in 0..steps {
        let a = slope(*x);
        let b = slope(moved(x, 0.5 * h, &a));
        let c = slope(moved(x, 0.5 * h, &b));
        let d = slope(moved(x, h, &c));
        for n in 0..N {
            x[n] += h / 6.0 * (a[n] + 2.0 * b[n] + 2.0 * c[n] + d[n]);
        }
    }
}

/// The step of a course that a row is in, by the row from which each holds; the first before the record begins.
pub fn at<T>(course: &[T], row: isize, from: impl Fn(&T) -> usize) -> &T {
    let last = course.iter().rev().find(|step| from(step) as isize <= row.max(0));
    last.unwrap_or_else(|| panic!("no step of the course at row {row}"))
}

/// Longest step of the integration, periods.
const STEP: f64 = 1.0 / 24.0;

/// Pieces of a period in which a load that slopes is one.
const PIECES: u32 = 64;

/// How the switch, the inductor and the source are wired.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Wiring {
    Buck,
    Boost,
    BuckBoost,
}

/// A converter and what is done to it.
#[derive(Debug, Clone)]
pub struct Bench {
    pub wiring: Wiring,
    pub v_in: f64,
    pub inductance: f64,
    pub capacitance: f64,
    pub f_sw: f64,
    pub dcr: f64,
    pub esr: f64,
    pub r_ds_on: f64,
    pub v_f: f64,
    pub r_d: f64,
    /// Duty that is lost at each rising edge, periods.
    pub lost: f64,
    pub rows: usize,
    /// Sampling instant in the period.
    pub sampled: f64,
    /// Where in the period the switch is on: 0 first, 0.5 in the middle, 1 last.
    pub carrier: f64,
    /// Duties from rows on.
    pub duty: Vec<(usize, f64)>,
    /// Conductance and current from instants on, periods.
    pub load: Vec<(f64, f64, f64)>,
    /// Load current that grows, A a period.
    pub ramp: f64,
    /// Periods that a load step takes from one level to the next.
    pub slope: f64,
    /// Gain and offset of `v_out`, `i_l`, `i_out`, `v_in`.
    pub gain: [f64; 4],
    pub offset: [f64; 4],
    /// Time constants of the four sensors' filters, periods.
    pub slow: [f64; 4],
}

impl Default for Bench {
    fn default() -> Self {
        Bench {
            wiring: Wiring::Buck,
            v_in: 200.0,
            inductance: 2e-3,
            capacitance: 150e-6,
            f_sw: 10e3,
            dcr: 0.1,
            esr: 0.03,
            r_ds_on: 0.05,
            v_f: 0.8,
            r_d: 0.02,
            lost: 0.0,
            rows: 200,
            sampled: 0.5,
            carrier: 0.5,
            duty: vec![(0, 0.5)],
            load: vec![(0.0, 0.0, 5.0)],
            ramp: 0.0,
            slope: 0.0,
            gain: [1.0; 4],
            offset: [0.0; 4],
            slow: [0.0; 4],
        }
    }
}

/// The plant file that describes the nominal bench.
pub fn model() -> Parameters {
    of(&Bench::default())
}

/// The plant file that describes a bench.
pub fn of(bench: &Bench) -> Parameters {
    let mut p = Parameters::paper_table();
    (p.converter.v_in, p.converter.f_sw) = (bench.v_in, bench.f_sw);
    (p.converter.inductance, p.converter.capacitance) = (bench.inductance, bench.capacitance);
    (p.pwm.sampling_phase, p.pwm.carrier) = (0.5, plant::Carrier::Centre);
    (p.inductor.dcr, p.capacitor.esr) = (bench.dcr, bench.esr);
    (p.switch.r_ds_on, p.switch.v_f, p.switch.r_d) = (bench.r_ds_on, bench.v_f, bench.r_d);
    p
}

/// Uniform numbers by a linear congruential generator; twelve make a normal one.
#[derive(Debug, Clone)]
pub struct Noise(pub u64);

impl Noise {
    /// 0 to 1.
    pub fn uniform(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }

    pub fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform() - 0.5).sum()
    }

    pub fn below(&mut self, count: usize) -> usize {
        ((self.uniform() * count as f64) as usize).min(count - 1)
    }
}

/// Columns with their names.
#[derive(Debug, Clone, Default)]
pub struct Table(pub Vec<(String, Vec<f64>)>);

impl Table {
    /// Without rows as yet.
    pub fn of(names: &[&str]) -> Self {
        Table(names.iter().map(|name| ((*name).to_owned(), Vec::new())).collect())
    }

    /// Takes in a row, a value for each column.
    pub fn push(&mut self, row: &[f64]) {
        assert_eq!(row.len(), self.0.len());
        for (column, value) in self.0.iter_mut().zip(row) {
            column.1.push(*value);
        }
    }

    pub fn column(&mut self, name: &str) -> &mut Vec<f64> {
        let found = self.0.iter().position(|(known, _)| known == name);
        &mut self.0[found.unwrap_or_else(|| panic!("no column {name}"))].1
    }

    pub fn without(mut self, names: &[&str]) -> Self {
        self.0.retain(|(name, _)| !names.contains(&name.as_str()));
        self
    }

    pub fn with(mut self, name: &str, values: Vec<f64>) -> Self {
        self.0.push((name.to_owned(), values));
        self
    }

    pub fn rows(&self) -> usize {
        self.0.first().map_or(0, |(_, values)| values.len())
    }

    /// Noise of each standard deviation, then rounding to each step.
    pub fn measured(mut self, columns: &[(&str, f64, f64)], noise: &mut Noise) -> Self {
        for (name, sigma, step) in columns {
            if let Some((_, values)) = self.0.iter_mut().find(|(known, _)| known == name) {
                for value in values {
                    *value = ((*value + sigma * noise.normal()) / step).round() * step;
                }
            }
        }
        self
    }

    pub fn text(&self) -> String {
        let names: Vec<&str> = self.0.iter().map(|(name, _)| name.as_str()).collect();
        let mut text = names.join(",") + "\n";
        for row in 0..self.rows() {
            let cells = self.0.iter().map(|(name, values)| match name.as_str() {
                "t" => format!("{:.9}", values[row]),
                "duty" => format!("{:.5}", values[row]),
                _ => format!("{:.4}", values[row]),
            });
            let _ = writeln!(text, "{}", cells.collect::<Vec<_>>().join(","));
        }
        text
    }

    pub fn read(&self, name: &str, model: &Parameters) -> Result<Record, Faults> {
        self.read_mapped(name, model, &ColumnMap::default())
    }

    pub fn read_mapped(&self, name: &str, model: &Parameters, map: &ColumnMap) -> Result<Record, Faults> {
        let file = format!("{name}.csv");
        let sheet = Sheet::parse(Path::new(&file), self.text().into(), &Record::file_options())?;
        Record::read(&sheet, map, model)
    }
}

impl Bench {
    fn duty_at(&self, row: usize) -> f64 {
        self.duty
            .iter()
            .rev()
            .find(|(from, _)| *from <= row)
            .map_or(0.5, |(_, d)| *d)
    }

    fn load_at(&self, periods: f64) -> (f64, f64) {
        let last = self
            .load
            .iter()
            .rposition(|(at, ..)| *at <= periods + 1e-9)
            .unwrap_or(0);
        let (at, conductance, current) = self.load[last];
        let before = self.load[last.saturating_sub(1)];
        let share = if self.slope > 0.0 {
            ((periods - at) / self.slope).min(1.0)
        } else {
            1.0
        };
        (
            before.1 + share * (conductance - before.1),
            before.2 + share * (current - before.2) + self.ramp * periods.max(0.0),
        )
    }

    /// Output voltage and load current.
    fn output(&self, x: [f64; 2], on: bool, (conductance, current): (f64, f64)) -> (f64, f64) {
        let into = match (self.wiring, on) {
            (Wiring::Buck, _) | (_, false) => x[0],
            _ => 0.0,
        };
        let v = (x[1] + self.esr * (into - current)) / (1.0 + self.esr * conductance);
        (v, v * conductance + current)
    }

    fn slope(&self, x: [f64; 2], on: bool, load: (f64, f64)) -> [f64; 2] {
        let (v, out) = self.output(x, on, load);
        let i = x[0];
        let (closed, open) = (self.v_in - self.r_ds_on * i, -self.v_f - self.r_d * i);
        let (across, into) = match (self.wiring, on) {
            (Wiring::Buck, true) => (closed - v, i),
            (Wiring::Buck, false) => (open - v, i),
            (_, true) => (closed, 0.0),
            (Wiring::Boost, false) => (self.v_in + open - v, i),
            (Wiring::BuckBoost, false) => (open - v, i),
        };
        let rise = (across - self.dcr * i) / self.inductance;
        // a current that has ended begins by a voltage in its direction alone
        let rise = if i == 0.0 { rise.max(0.0) } else { rise };
        [rise, (into - out) / self.capacitance]
    }

    /// What is true at the sensors.
    fn shown(&self, x: [f64; 2], on: bool, load: (f64, f64)) -> [f64; 4] {
        let (v, out) = self.output(x, on, load);
        [v, x[0], out, self.v_in]
    }

    /// Lets the filters of the sensors follow over a piece in which what is true changes from `before` to `after` along a line.
    fn follow(&self, filters: &mut [f64; 4], before: [f64; 4], after: [f64; 4], periods: f64) {
        for n in 0..4 {
            if self.slow[n] > 0.0 {
                let (a, rise) = (periods / self.slow[n], after[n] - before[n]);
                // y' = (u - y) / tau for u on a line: behind it by rise / a, but for what is left of the start
                let behind = |u: f64| u - rise / a;
                filters[n] = behind(after[n]) + (filters[n] - behind(before[n])) * (-a).exp();
            }
        }
    }

    fn advance(&self, x: &mut [f64; 2], filters: &mut [f64; 4], on: bool, load: (f64, f64), periods: f64) {
        let count = (periods / STEP).ceil().max(1.0);
        let h = periods / count / self.f_sw;
        for _ in 0..count as usize {
            let before = self.shown(*x, on, load);
            let start = *x;
            self.step(x, on, load, h);
            if x[0] < 0.0 {
                // the diode ends the current inside of the step, and not at its end
                let share = start[0] / (start[0] - x[0]);
                *x = start;
                self.step(x, on, load, share * h);
                x[0] = 0.0;
                self.step(x, on, load, (1.0 - share) * h);
                x[0] = x[0].max(0.0);
            }
            self.follow(filters, before, self.shown(*x, on, load), periods / count);
        }
    }

    /// A step by Runge and Kutta's method.
    fn step(&self, x: &mut [f64; 2], on: bool, load: (f64, f64), h: f64) {
        let moved = |x: &[f64; 2], k: &[f64; 2], h: f64| [x[0] + h * k[0], x[1] + h * k[1]];
        let a = self.slope(*x, on, load);
        let b = self.slope(moved(x, &a, 0.5 * h), on, load);
        let c = self.slope(moved(x, &b, 0.5 * h), on, load);
        let d = self.slope(moved(x, &c, h), on, load);
        for n in 0..2 {
            x[n] += h / 6.0 * (a[n] + 2.0 * b[n] + 2.0 * c[n] + d[n]);
        }
    }

    /// What ideal instruments would note, a row each period. It begins at rest.
    pub fn run(&self) -> Table {
        let d = self.duty_at(0);
        let v = match self.wiring {
            Wiring::Buck => d * self.v_in,
            Wiring::Boost => self.v_in / (1.0 - d),
            Wiring::BuckBoost => self.v_in * d / (1.0 - d),
        };
        let (conductance, current) = self.load_at(0.0);
        let out = v * conductance + current;
        let mut x = [
            if self.wiring == Wiring::Buck {
                out
            } else {
                out / (1.0 - d)
            },
            v,
        ];
        let mut filters = [v, x[0], out, self.v_in];
        let mut columns: [Vec<f64>; 6] = Default::default();
        // long enough that what is left of the start is far below any noise
        let lead = 400;
        for n in 0..lead + self.rows {
            let row = n as f64 - f64::from(lead as u32);
            let duty = self.duty_at(n.saturating_sub(lead));
            let on = self.carrier * (1.0 - duty);
            let (rise, fall) = (on + self.lost, on + duty);
            let mut marks = vec![0.0, rise, fall, self.sampled, 1.0];
            marks.extend(
                self.load
                    .iter()
                    .map(|(at, ..)| at - row)
                    .filter(|at| (0.0..1.0).contains(at)),
            );
            if self.slope > 0.0 {
                // the load is one between two marks
                marks.extend((1..PIECES).map(|n| f64::from(n) / f64::from(PIECES)));
            }
            marks.sort_by(f64::total_cmp);
            for pair in marks.windows(2) {
                let middle = 0.5 * (pair[0] + pair[1]);
                let on = (rise..fall).contains(&middle);
                let load = self.load_at(row + middle);
                // once a period: the instant may be an edge as well
                if n >= lead && pair[0] == self.sampled && columns[0].len() < n - lead + 1 {
                    let mut shown = self.shown(x, on, load);
                    for k in (0..4).filter(|k| self.slow[*k] > 0.0) {
                        shown[k] = filters[k];
                    }
                    columns[0].push((row + self.sampled) / self.f_sw);
                    columns[1].push(duty);
                    for k in 0..4 {
                        columns[k + 2].push(shown[k] * self.gain[k] + self.offset[k]);
                    }
                }
                if pair[1] > pair[0] {
                    self.advance(&mut x, &mut filters, on, load, pair[1] - pair[0]);
                }
            }
        }
        let names = ["t", "duty", "v_out", "i_l", "i_out", "v_in"];
        Table(names.map(str::to_owned).into_iter().zip(columns).collect())
    }
}
