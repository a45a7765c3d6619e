//! Ceramic capacitors whose capacitance falls with their voltage, along curves that are not the plant's, whatever the model has in their place: the
//! label, a little more, what a meter shows at the output's voltage, or a curve of its own.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod bench;

use bench::{Noise, Table, at, integrate};
use diagnose::diagnosis::{Diagnosis, diagnose};
use diagnose::findings::Verdict;
use plant::Parameters;

const V_IN: f64 = 24.0;
const L: f64 = 10e-6;
const R: f64 = 0.035;
const ESR: f64 = 0.004;
const LABEL: f64 = 66e-6;
const PERIOD: f64 = 1.0 / 200e3;
const ROWS: usize = 700;

/// What is left of the label: `rest + (1 - rest) / (1 + (v / half)^power)`.
#[derive(Clone, Copy)]
struct Ceramic {
    rest: f64,
    half: f64,
    power: f64,
}

impl Ceramic {
    fn at(self, v: f64) -> f64 {
        LABEL * (self.rest + (1.0 - self.rest) / (1.0 + (v / self.half).powf(self.power)))
    }
}

/// One that loses all, slowly; and one that keeps a tenth, and falls more steeply.
const SOFT: Ceramic = Ceramic {
    rest: 0.0,
    half: 10.0,
    power: 2.0,
};
const HARD: Ceramic = Ceramic {
    rest: 0.1,
    half: 9.0,
    power: 2.4,
};

/// From each row on: duty and current of an electronic load. A synchronous leg, on at the start of a period, sampled there.
fn record(part: Ceramic, course: &[(usize, f64, f64)], seed: u64) -> Table {
    let (mut x, mut random) = ([course[0].2, 11.0], Noise(seed));
    let mut table = Table::of(&["t", "duty", "v_out", "i_l", "i_out"]);
    for row in -2000..ROWS as isize {
        let (_, duty, load) = *at(course, row, |step| step.0);
        if row >= 0 {
            let values = [
                row as f64 * PERIOD,
                duty,
                x[1] + ESR * (x[0] - load) + 4e-3 * random.normal(),
                x[0] + 0.012 * random.normal(),
                load + 0.008 * random.normal(),
            ];
            table.push(&values);
        }
        for (source, share) in [(V_IN, duty), (0.0, 1.0 - duty)] {
            integrate(&mut x, share * PERIOD / 10.0, 10, |x| {
                let out = x[1] + ESR * (x[0] - load);
                [(source - R * x[0] - out) / L, (x[0] - load) / part.at(x[1])]
            });
        }
    }
    table
}

/// With the capacitance that the model has at no voltage, and its curve.
fn found(part: Ceramic, capacitance: f64, curve: &str, seed: u64) -> Diagnosis {
    let text = format!(
        "[converter]\nv_in = {V_IN}\ninductance = {L:e}\ncapacitance = {capacitance:e}\nf_sw = 200e3\nrectifier = \"synchronous\"\n\
         [inductor]\ndcr = {R}\n[capacitor]\nesr = {ESR}\n{curve}"
    );
    let model = Parameters::from_toml("plant.toml".as_ref(), &text).unwrap();
    let courses: [&[(usize, f64, f64)]; 2] = [
        &[(0, 0.5, 2.0), (170, 0.5, 6.0), (350, 0.5, 3.0), (520, 0.5, 7.0)],
        &[(0, 0.48, 4.0), (170, 0.55, 4.0), (350, 0.44, 4.0), (520, 0.5, 4.0)],
    ];
    let read = |n: usize| {
        let table = record(part, courses[n], seed + n as u64);
        table.read(["load", "duty"][n], &model).unwrap()
    };
    diagnose(&model, vec![read(0), read(1)], &[], &|_| ())
}

/// The capacitance that was found is that of the part, wherever the records have been.
#[track_caller]
fn is_of(found: &Diagnosis, part: Ceramic) {
    for v in [10.5, 12.0, 13.0] {
        let [is, told] = [part.at(v), found.extended.plant.capacitance_at(v)];
        assert!(
            (told / is - 1.0).abs() < 0.03,
            "{v} V: {told:e} for {is:e}; {}",
            found.findings.sentence
        );
    }
}

/// At the label the filter rings at two thirds of the frequency that the records show: the search has to begin near it.
#[test]
fn a_capacitor_that_loses_all_is_explained_from_its_label_and_from_more() {
    for (capacitance, seed) in [(LABEL, 31), (1.15 * LABEL, 33)] {
        let found = found(SOFT, capacitance, "", seed);
        let findings = &found.findings;
        assert_eq!(findings.verdict, Verdict::Explained, "{}", findings.sentence);
        assert_eq!(findings.causes[0].id, "c_derating", "{}", findings.sentence);
        is_of(&found, SOFT);
        let note = findings
            .noise
            .repairs
            .iter()
            .find(|note| note.contains("along its curve"));
        assert!(note.is_some_and(|note| note.contains("µF at 1")), "{note:?}");
    }
}

/// Read off a meter with the output's voltage as bias, the model is right in the mean, and the curve is missing.
#[test]
fn a_capacitance_measured_at_the_output_s_voltage_is_no_obstacle() {
    let found = found(SOFT, SOFT.at(12.0), "", 41);
    assert_eq!(
        found.findings.verdict,
        Verdict::Explained,
        "{}",
        found.findings.sentence
    );
    assert_eq!(found.findings.causes[0].id, "c_derating", "{}", found.findings.sentence);
    is_of(&found, SOFT);
}

/// The plant's law follows another curve as far as the records go.
#[test]
fn a_curve_of_another_shape_is_named_for_what_it_is() {
    let found = found(HARD, LABEL, "", 51);
    let findings = &found.findings;
    let named = findings.causes.iter().chain(&findings.partial).map(|cause| cause.id);
    assert_eq!(named.collect::<Vec<_>>(), ["c_derating"], "{}", findings.sentence);
    is_of(&found, HARD);
}

/// A step of a capacitance that falls takes the circuit's general integrator, which has to answer to every nudge of every cause.
#[test]
fn a_model_that_has_a_curve_is_mended() {
    let found = found(SOFT, LABEL, "derating = 0.9\nv_half = 9.3\n", 61);
    assert_eq!(
        found.findings.verdict,
        Verdict::Explained,
        "{}",
        found.findings.sentence
    );
    is_of(&found, SOFT);
}
