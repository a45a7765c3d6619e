//! What a cable and an input filter do before the first row: they swing with the converter's ripple, which neither the output voltage nor the
//! inductor's current tells. And the resistance of both switches of such a leg. Kirchhoff's equations by Runge and Kutta's method, which share
//! nothing with the plant.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod bench;

use bench::{Noise, Table, at, integrate};
use diagnose::diagnosis::diagnose_knowing;
use diagnose::findings::{Findings, Verdict};
use plant::Parameters;

const V_IN: f64 = 18.0;
const L: f64 = 4.7e-6;
const C: f64 = 100e-6;
const PERIOD: f64 = 1.0 / 200e3;
const ROWS: usize = 160;

const MODEL: &str = "[converter]\nv_in = 18.0\ninductance = 4.7e-6\ncapacitance = 100e-6\nf_sw = 200e3\nrectifier = \"synchronous\"\n\
                     [inductor]\ndcr = 0.02\n[capacitor]\nesr = 0.007\n[switch]\nr_ds_on = 0.012\nr_ds_on_low = 0.006\n\
                     [pwm]\nsampling_phase = 0.0\n";

/// What the bench has and the model has not.
#[derive(Clone, Copy)]
struct Board {
    /// Resistances of upper and lower switch.
    switches: [f64; 2],
    /// Inductance, resistance and capacitance of a cable to the load.
    cable: Option<[f64; 3]>,
    /// Inductance, resistance, capacitance and its series resistance in front of the switch.
    filter: Option<[f64; 4]>,
}

const PLAIN: Board = Board {
    switches: [0.012, 0.006],
    cable: None,
    filter: None,
};

/// Inductor, output capacitor, cable, its capacitor, leads, input capacitor.
type X = [f64; 6];

impl Board {
    /// What flows out of the converter, and its output voltage.
    fn output(&self, x: X, load: f64) -> [f64; 2] {
        let drawn = if self.cable.is_some() { x[2] } else { load };
        [drawn, x[1] + 0.007 * (x[0] - drawn)]
    }

    fn slope(&self, x: X, is_on: bool, load: f64) -> X {
        let [drawn, out] = self.output(x, load);
        let taken = if is_on { x[0] } else { 0.0 };
        let [l_f, r_f, c_f, esr_f] = self.filter.unwrap_or([1.0, 0.0, 1.0, 0.0]);
        let input = match self.filter {
            Some(_) => x[5] + esr_f * (x[4] - taken),
            None => V_IN,
        };
        let [l_c, r_c, c_c] = self.cable.unwrap_or([1.0, 0.0, 1.0]);
        let r = 0.02 + self.switches[usize::from(!is_on)];
        let there = |has: bool, slope: f64| if has { slope } else { 0.0 };
        [
            (if is_on { input } else { 0.0 } - r * x[0] - out) / L,
            (x[0] - drawn) / C,
            there(self.cable.is_some(), (out - r_c * x[2] - x[3]) / l_c),
            there(self.cable.is_some(), (x[2] - load) / c_c),
            there(self.filter.is_some(), (V_IN - r_f * x[4] - input) / l_f),
            there(self.filter.is_some(), (x[4] - taken) / c_f),
        ]
    }

    /// From each row on: duty and current of an electronic load.
    fn record(&self, course: &[(usize, f64, f64)], random: &mut Noise) -> Table {
        let (_, duty, load) = course[0];
        let mut x = [load, duty * V_IN, load, duty * V_IN, duty * load, V_IN];
        let mut table = Table::of(&["t", "duty", "v_out", "i_l", "i_out", "i_load"]);
        for row in -4000..ROWS as isize {
            let (_, duty, load) = *at(course, row, |step| step.0);
            if row >= 0 {
                // a row at the very instant of a step shows what was before it
                let before = at(course, row - 1, |step| step.0).2;
                let [drawn, out] = self.output(x, before);
                table.push(&[
                    row as f64 * PERIOD,
                    duty,
                    out + 2e-3 * random.normal(),
                    x[0] + 0.01 * random.normal(),
                    drawn + 0.01 * random.normal(),
                    load,
                ]);
            }
            for (is_on, share) in [(true, duty), (false, 1.0 - duty)] {
                integrate(&mut x, share * PERIOD / 40.0, 40, |x| self.slope(x, is_on, load));
            }
        }
        table
    }

    fn found(&self, certain: &[&str], seed: u64) -> Findings {
        let model = Parameters::from_toml("plant.toml".as_ref(), MODEL).unwrap();
        let mut random = Noise(seed);
        let courses: [&[(usize, f64, f64)]; 3] = [
            &[(0, 0.29, 4.0), (50, 0.29, 9.0), (110, 0.29, 6.0)],
            &[(0, 0.28, 7.0), (50, 0.33, 7.0), (110, 0.30, 7.0)],
            &[(0, 0.31, 5.0), (50, 0.31, 8.0), (110, 0.28, 8.0)],
        ];
        let [load, duty, held] = courses.map(|course| {
            let table = self.record(course, &mut random);
            table.read("record", &model).unwrap()
        });
        let certain: Vec<String> = certain.iter().map(|key| (*key).to_owned()).collect();
        let findings = diagnose_knowing(&model, &certain, vec![load, duty], &[held], &|_| ()).findings;
        println!("{}\n{:?}", findings.sentence, findings.noise.repairs);
        findings
    }
}

/// Values of the one cause that lie outside of their intervals.
fn outside(findings: &Findings, id: &str, truth: &[(&str, f64)]) -> usize {
    let names: Vec<&str> = findings.causes.iter().map(|cause| cause.id).collect();
    assert_eq!(
        (findings.verdict, &names[..]),
        (Verdict::Explained, &[id][..]),
        "{}",
        findings.sentence
    );
    let is_outside = |(name, value): &&(&str, f64)| {
        let found = &findings.causes[0].parameters[*name];
        *value < found.low || *value > found.high
    };
    truth.iter().filter(is_outside).count()
}

#[test]
fn a_cable_swings_before_the_first_row() {
    let [l, r, c] = [80e-9, 0.012, 33e-6];
    let board = Board {
        cable: Some([l, r, c]),
        ..PLAIN
    };
    let findings = board.found(&[], 21);
    let truth = [("inductance", l), ("resistance", r), ("capacitance", c)];
    // three intervals of 95 %
    assert!(outside(&findings, "cable", &truth) <= 1, "{}", findings.sentence);
}

#[test]
fn a_filter_swings_before_the_first_row_and_hides_behind_its_resistance() {
    // twice the frequency of the output filter, and damped until no line stands out of the records
    let [l, r, c, esr] = [2.2e-6, 0.12, 4.7e-6, 0.12];
    let board = Board {
        filter: Some([l, r, c, esr]),
        ..PLAIN
    };
    let findings = board.found(&[], 22);
    let truth = [("inductance", l), ("resistance", r), ("c_in", c), ("esr_in", esr)];
    assert!(
        outside(&findings, "source_impedance", &truth) <= 1,
        "{}",
        findings.sentence
    );
}

#[test]
fn both_switches_that_grew_hot_are_one_cause() {
    let board = Board {
        switches: [0.024, 0.012],
        ..PLAIN
    };
    let findings = board.found(&["inductor.dcr"], 23);
    let found = &findings.causes[0];
    assert_eq!(
        (findings.causes.len(), found.id),
        (1, "r_ds_on"),
        "{}",
        findings.sentence
    );
    let value = &found.parameters["r_ds_on"];
    assert!(value.low < 0.024 && 0.024 < value.high && value.low > 0.02, "{value:?}");
    // the winding is in series with both alike, and these are not
    let findings = board.found(&[], 23);
    let told: Vec<&str> = (findings.causes.iter())
        .flat_map(|cause| [cause.id].into_iter().chain(cause.rivals.iter().flatten().copied()))
        .collect();
    assert!(
        findings.causes.len() == 1 && told.contains(&"r_ds_on"),
        "{}",
        findings.sentence
    );
}
