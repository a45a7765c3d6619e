//! Inductors that lose their inductance: cores of data sheets and of no law at all.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod bench;

use bench::{Noise, Table, at, integrate};
use diagnose::diagnosis::{Diagnosis, diagnose};
use diagnose::findings::{Findings, Verdict};
use plant::Parameters;

const V_IN: f64 = 24.0;
const L: f64 = 10e-6;
const C: f64 = 330e-6;
const R: f64 = 0.02;
const ESR: f64 = 0.008;
const PERIOD: f64 = 4e-6;
const PHASE: f64 = 0.7;
const ROWS: usize = 600;
/// Steps of Runge and Kutta's method in each piece of a period.
const FINE: usize = 24;

const MODEL: &str = "[converter]\nv_in = 24.0\ninductance = 10e-6\ncapacitance = 330e-6\nf_sw = 250e3\nrectifier = \"synchronous\"\n\
                     [inductor]\ndcr = 0.02\n[capacitor]\nesr = 0.008\n[pwm]\nsampling_phase = 0.7\n";

type Core = fn(f64) -> f64;

/// The law of a maker of powder cores: a share of 1 / (1 + (i / i_half)^c).
fn powder(i: f64) -> f64 {
    1.0 / (1.0 + (i.abs() / 14.0).powf(1.5))
}

/// The same of a core that falls later and more.
fn late(i: f64) -> f64 {
    1.0 / (1.0 + (i.abs() / 13.0).powf(2.3))
}

/// A ferrite with an air gap, and no law of anybody: a hyperbolic tangent.
fn ferrite(i: f64) -> f64 {
    0.3 + 0.35 * (1.0 - ((i.abs() - 11.0) / 2.5).tanh())
}

fn stretch(x: &mut [f64; 2], core: Core, is_on: bool, share: f64, load: f64) {
    let h = share * PERIOD / FINE as f64;
    let slope = |x: [f64; 2]| {
        let source = if is_on { V_IN } else { 0.0 };
        let out = x[1] + ESR * (x[0] - load);
        [(source - R * x[0] - out) / (L * core(x[0])), (x[0] - load) / C]
    };
    integrate(x, h, FINE, slope);
}

/// From each row on: duty and current of an electronic load.
fn record(core: Core, course: &[(usize, f64, f64)], seed: u64) -> Table {
    let (mut x, mut random) = ([course[0].2, 6.0], Noise(seed));
    let mut table = Table::of(&["t", "duty", "v_out", "i_l", "i_load"]);
    for row in -2500..ROWS as isize {
        let (_, duty, load) = *at(course, row, |step| step.0);
        stretch(&mut x, core, true, duty, load);
        stretch(&mut x, core, false, PHASE - duty, load);
        if row >= 0 {
            let values = [
                (row as f64 + PHASE) * PERIOD,
                duty,
                x[1] + ESR * (x[0] - load) + 4e-3 * random.normal(),
                x[0] + 0.02 * random.normal(),
                load,
            ];
            table.push(&values);
        }
        stretch(&mut x, core, false, 1.0 - PHASE, load);
    }
    table
}

fn found(core: Core) -> Diagnosis {
    let model = Parameters::from_toml("plant.toml".as_ref(), MODEL).unwrap();
    let courses: [&[(usize, f64, f64)]; 3] = [
        &[(0, 0.26, 2.0), (150, 0.26, 7.0), (300, 0.26, 11.0), (450, 0.26, 4.0)],
        &[
            (0, 0.26, 9.0),
            (120, 0.27, 9.0),
            (240, 0.25, 9.0),
            (360, 0.265, 9.0),
            (480, 0.255, 9.0),
        ],
        &[(0, 0.26, 3.0), (200, 0.268, 3.0), (400, 0.268, 10.0)],
    ];
    let read = |n: usize| {
        let table = record(core, courses[n], 31 + n as u64);
        table.read(["load", "duty", "held"][n], &model).unwrap()
    };
    diagnose(&model, vec![read(0), read(1)], &[read(2)], &|_| ())
}

/// What is left of the inductance at a current, by the law of the plant file.
fn curve(findings: &Findings, i: f64) -> f64 {
    let of = |key: &str, given: f64| findings.causes[0].parameters.get(key).map_or(given, |p| p.value);
    let y = (i / of("i_sat", 10.0)).powf(2.0 * of("steepness", 1.0));
    1.0 - of("saturation", 0.0) * y / (1.0 + y)
}

#[test]
fn an_inductor_that_saturates_is_named_and_its_curve_is_right_whatever_its_core() {
    for (name, core) in [("powder", powder as Core), ("late", late)] {
        let diagnosis = found(core);
        let findings = &diagnosis.findings;
        let names: Vec<&str> = findings.causes.iter().map(|cause| cause.id).collect();
        assert_eq!(
            (findings.verdict, &names[..]),
            (Verdict::Explained, &["l_saturation"][..]),
            "{name}: {}",
            findings.sentence
        );
        for i in [3.0_f64, 6.0, 9.0, 12.0] {
            let (law, bench) = (curve(findings, i), core(i));
            // 3 %: what a bridge and a data sheet differ by
            assert!(
                (law - bench).abs() < 0.03,
                "{name} at {i} A: {law} for {bench}, {}",
                findings.sentence
            );
        }
    }
}

#[test]
fn a_curve_of_no_law_is_no_explanation_and_yet_the_part_to_check() {
    let findings = found(ferrite).findings;
    let sentence = &findings.sentence;
    assert_eq!(findings.verdict, Verdict::Unexplained, "{sentence}");
    let nearest: Vec<&str> = findings.partial.iter().map(|cause| cause.id).collect();
    assert_eq!(nearest, ["l_saturation"], "{sentence}");
    assert!(
        sentence.contains("a part whose curve is not one of the law's"),
        "{sentence}"
    );
    // what the model without it leaves swings behind each step, and no pulse is lost
    assert!(!sentence.contains("lost"), "{sentence}");
}
