//! Load steps at any instant of a switching period, as on every bench. The records come from a circuit of their own that shares no
//! code with the plant: trapezoidal integration of a switched buck, an ADC, noise, and a load column as a logger writes it.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::fmt::Write as _;
use std::path::Path;

use diagnose::diagnosis::{Diagnosis, diagnose};
use diagnose::findings::Verdict;
use diagnose::record::Record;
use measured::{ColumnMap, Sheet};
use plant::Parameters;

const ROWS: usize = 200;
const T_SW: f64 = 1e-4;
/// Steps of the integration in a period.
const FINE: usize = 400;

/// The model: 200 V, 10 kHz, sampled in the middle of the period.
fn model() -> Parameters {
    let mut p = Parameters::paper_table();
    (p.converter.capacitance, p.pwm.sampling_phase, p.pwm.carrier) = (150e-6, 0.5, plant::Carrier::Centre);
    (p.inductor.dcr, p.capacitor.esr) = (0.1, 0.03);
    (p.switch.r_ds_on, p.switch.v_f, p.switch.r_d) = (0.05, 0.8, 0.02);
    for sensor in [&mut p.sensors.v_out, &mut p.sensors.i_l, &mut p.sensors.i_out] {
        sensor.low_pass = LAG;
    }
    p
}

const LAG: f64 = 10e-6;

/// What is on the bench, and how it is recorded.
struct Bench {
    capacitance: f64,
    esr: f64,
    /// Instants of the load steps, periods, and the load current beside 38 ohm from there on.
    steps: &'static [(f64, f64)],
    /// Sampling instant in the period; the table says 0.5.
    sampled: f64,
    columns: &'static [&'static str],
    seed: u64,
}

const HEALTHY: Bench = Bench {
    capacitance: 150e-6,
    esr: 0.03,
    steps: &[(28.45, 3.019), (76.92, 0.595), (123.51, 4.143), (171.18, 2.804)],
    sampled: 0.5,
    columns: &["v_out", "i_l", "i_out"],
    seed: 1,
};

/// Uniform numbers of -0.5 to 0.5 (a linear congruential generator), twelve of which make a normal one.
struct Noise(u64);

impl Noise {
    fn normal(&mut self) -> f64 {
        let uniform = |_| {
            self.0 = self
                .0
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        (0..12).map(uniform).sum()
    }
}

impl Bench {
    fn load(&self, periods: f64) -> f64 {
        let last = self.steps.iter().rev().find(|(at, _)| *at <= periods);
        last.map_or(0.0, |(_, current)| *current)
    }

    /// One step of the circuit: current, capacitor, and what the filters of voltage, current and load current hold.
    fn advance(&self, x: &mut [f64; 5], on: bool, drawn: f64) {
        let h = T_SW / FINE as f64;
        let slope = |x: &[f64; 5]| {
            let [i, v_c, ..] = *x;
            let v = (v_c + self.esr * (i - drawn)) / (1.0 + self.esr / 38.0);
            let out = v / 38.0 + drawn;
            let emf = if on { 200.0 - 0.05 * i } else { -0.8 - 0.02 * i };
            let filtered = [v, i, out];
            let di = (emf - 0.1 * i - v) / 2e-3;
            let lag = |n: usize| (filtered[n] - x[n + 2]) / LAG;
            [di, (i - out) / self.capacitance, lag(0), lag(1), lag(2)]
        };
        let first = slope(x);
        let ahead: [f64; 5] = std::array::from_fn(|n| x[n] + h * first[n]);
        let second = slope(&ahead);
        for n in 0..5 {
            x[n] += 0.5 * h * (first[n] + second[n]);
        }
        x[0] = x[0].max(0.0);
    }

    fn record(&self) -> Record {
        let (duty, mut noise) = (0.505, Noise(self.seed));
        let mut x = [2.63, 99.8, 99.8, 2.63, 2.63];
        let mut text = format!("t,duty,{},r_load,i_load\n", self.columns.join(","));
        for n in 0..(ROWS + 40) * FINE {
            let periods = n as f64 / FINE as f64 - 40.0;
            let within = periods.rem_euclid(1.0);
            if periods >= 0.0 && (within - self.sampled).abs() < 0.5 / FINE as f64 {
                let row = periods.floor() + 0.5;
                let _ = write!(text, "{:.8},{duty}", row * T_SW);
                for column in self.columns {
                    let (place, sigma, step) = match *column {
                        "v_out" => (2, 0.1, 0.1),
                        "i_l" => (3, 0.05, 0.02),
                        _ => (4, 0.05, 0.02),
                    };
                    let value = ((x[place] + sigma * noise.normal()) / step).round() * step;
                    let _ = write!(text, ",{value:.2}");
                }
                let _ = writeln!(text, ",38,{}", self.load(row));
            }
            let middle = within + 0.5 / FINE as f64;
            let on = (middle - 0.5).abs() < 0.5 * duty;
            self.advance(&mut x, on, self.load(periods));
        }
        let sheet = Sheet::parse(Path::new("bench.csv"), text.into(), &Record::file_options()).unwrap();
        Record::read(&sheet, &ColumnMap::default(), &model()).unwrap()
    }

    fn diagnosed(&self) -> Diagnosis {
        let heldout = Bench {
            seed: self.seed + 100,
            ..*self
        }
        .record();
        let found = diagnose(&model(), vec![self.record()], &[heldout], &|_| ());
        println!("{}\n{:?}", found.findings.sentence, found.findings.noise.repairs);
        found
    }
}

/// The value of the leading cause, which is `id`.
fn leading(found: &Diagnosis, id: &str) -> f64 {
    let causes = &found.findings.causes;
    assert_eq!(causes.iter().map(|cause| cause.id).collect::<Vec<_>>(), [id]);
    causes[0].parameters.values().next().unwrap().value
}

#[test]
fn a_healthy_bench_whose_load_steps_inside_a_period_is_consistent() {
    let found = HEALTHY.diagnosed();
    assert_eq!(found.findings.verdict, Verdict::Consistent);
    let notes = found.findings.noise.repairs.join("\n");
    assert!(
        notes.contains("4 load steps are taken to lie inside a switching period"),
        "{notes}"
    );
    let [before, after] = found.findings.gain.mean_square;
    assert!(before < 1.3 && after < 1.3, "held out: {before}, {after}");
}

/// A single step late by a part of a period could be a late sampling instant as well: then nothing is named.
#[test]
fn one_load_step_inside_a_period_is_no_late_sample() {
    let bench = Bench {
        steps: &[(60.3, 3.0)],
        columns: &["v_out"],
        ..HEALTHY
    };
    assert_eq!(bench.diagnosed().findings.verdict, Verdict::Consistent);
}

#[test]
fn a_capacitor_that_lost_a_fifth_is_found_beside_load_steps_inside_a_period() {
    let bench = Bench {
        capacitance: 120e-6,
        ..HEALTHY
    };
    let c = leading(&bench.diagnosed(), "c_wrong");
    assert!((c / 120e-6 - 1.0).abs() < 0.01, "{c}");
}

#[test]
fn the_leap_at_a_load_step_still_shows_the_series_resistance() {
    let bench = Bench { esr: 0.12, ..HEALTHY };
    let esr = leading(&bench.diagnosed(), "esr");
    assert!((esr / 0.12 - 1.0).abs() < 0.1, "{esr}");
}

/// What all steps have in common is a cause, not an instant of each.
#[test]
fn samples_that_are_all_late_are_still_found_where_the_load_steps() {
    let bench = Bench {
        sampled: 0.7,
        steps: &[(28.0, 3.019), (77.0, 0.595), (124.0, 4.143), (171.0, 2.804)],
        columns: &["v_out", "i_l"],
        ..HEALTHY
    };
    let late = leading(&bench.diagnosed(), "sampling_delay");
    assert!((late - 20e-6).abs() < 2e-6, "{late}");
}
