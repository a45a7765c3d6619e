//! A leg with a dead time that the model leaves out, and a body diode that is not quite that of the model.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod bench;

use bench::{Noise, Table, at, integrate};
use diagnose::diagnosis::diagnose;
use diagnose::extend::extended_toml;
use diagnose::findings::Verdict;
use plant::Parameters;

const V_IN: f64 = 48.0;
const L: f64 = 22e-6;
const C: f64 = 330e-6;
const ESR: f64 = 0.009;
const PERIOD: f64 = 5e-6;
const PHASE: f64 = 0.6;
const DEAD: f64 = 120e-9;
const ROWS: usize = 800;

const MODEL: &str = "[converter]\nv_in = 48.0\ninductance = 22e-6\ncapacitance = 330e-6\nf_sw = 200e3\nrectifier = \"synchronous\"\n\
                     [inductor]\ndcr = 0.018\n[capacitor]\nesr = 0.009\n[switch]\nr_ds_on = 0.014\nr_ds_on_low = 0.010\nv_f = 0.8\n\
                     [pwm]\nsampling_phase = 0.6\n";

/// Who carries the inductor's current.
#[derive(Clone, Copy, PartialEq)]
enum Way {
    Upper,
    Lower,
    /// The body diode that the current asks for.
    Diode,
}

/// Runge and Kutta's method in `steps` over `time`.
fn stretch(x: &mut [f64; 2], way: Way, time: f64, load: f64, steps: usize) {
    let h = time / steps as f64;
    let slope = |[i, v]: [f64; 2]| {
        let node = match way {
            Way::Upper => V_IN - 0.014 * i,
            Way::Lower => -0.010 * i,
            Way::Diode if i > 0.0 => -0.8 - 0.01 * i,
            Way::Diode => V_IN + 0.8 - 0.01 * i,
        };
        [(node - 0.018 * i - v - ESR * (i - load)) / L, (i - load) / C]
    };
    integrate(x, h, steps, slope);
}

/// From each row on: duty and current of an electronic load.
fn record(course: &[(usize, f64, f64)], seed: u64) -> Table {
    let (mut x, mut random) = ([course[0].2, 11.0], Noise(seed));
    let mut table = Table::of(&["t", "duty", "v_out", "i_l", "i_out"]);
    let read = |value: f64, step: f64| (value / step).round() * step;
    for row in -2500..ROWS as isize {
        let (_, duty, load) = *at(course, row, |step| step.0);
        let on = duty * PERIOD;
        stretch(&mut x, Way::Diode, DEAD, load, 2);
        stretch(&mut x, Way::Upper, on - DEAD, load, 8);
        stretch(&mut x, Way::Diode, DEAD, load, 2);
        stretch(&mut x, Way::Lower, PHASE * PERIOD - on - DEAD, load, 6);
        if row >= 0 {
            let v = x[1] + ESR * (x[0] - load);
            let values = [
                (row as f64 + PHASE) * PERIOD,
                duty,
                read(v + 5e-3 * random.normal(), 20.0 / 4096.0),
                read(x[0] + 0.012 * random.normal(), 25.0 / 4096.0),
                read(load + 0.008 * random.normal(), 25.0 / 4096.0),
            ];
            table.push(&values);
        }
        stretch(&mut x, Way::Lower, (1.0 - PHASE) * PERIOD, load, 6);
    }
    table
}

/// The edges of the gate take what of a dead time nobody tells from them, and a diode was fitted beside it and taken out again: the value is
/// that of the file all the same, and the interval holds the truth.
#[test]
fn a_dead_time_is_the_same_in_words_and_in_the_file_and_its_interval_holds_it() {
    let model = Parameters::from_toml("plant.toml".as_ref(), MODEL).unwrap();
    let load = [(0, 0.275, 3.0), (200, 0.275, 7.0), (400, 0.275, 4.5), (600, 0.275, 9.0)];
    let duty = [(0, 0.275, 5.0), (200, 0.29, 5.0), (400, 0.26, 5.0), (600, 0.30, 5.0)];
    let train = vec![
        record(&load, 11).read("load", &model).unwrap(),
        record(&duty, 12).read("duty", &model).unwrap(),
    ];
    let diagnosis = diagnose(&model, train, &[], &|_| ());
    let findings = &diagnosis.findings;
    println!("{}", findings.sentence);
    let names: Vec<&str> = findings.causes.iter().map(|cause| cause.id).collect();
    assert_eq!(names, ["dead_time"], "{}", findings.sentence);
    assert!(
        matches!(findings.verdict, Verdict::Explained | Verdict::Ambiguous),
        "{}",
        findings.sentence
    );
    let found = findings.causes[0].parameters.values().next().unwrap();
    assert!(
        found.low < DEAD && DEAD < found.high && found.high < 2.0 * DEAD,
        "{}",
        findings.sentence
    );
    let text = extended_toml(&diagnosis);
    let file = Parameters::from_toml("extended.toml".as_ref(), &text).unwrap();
    assert!(
        (file.switch.dead_time - found.value).abs() < 1e-4 * found.value,
        "{} in the file: {}",
        file.switch.dead_time,
        findings.sentence
    );
}
