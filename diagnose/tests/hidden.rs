//! Effects hidden in records of our own plant. The judge of the method is another simulator (tests/blind); here the
//! rules are tested.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::fmt::Write as _;
use std::path::Path;

use diagnose::columns::Columns;
use diagnose::csv::Table;
use diagnose::diagnosis::{Diagnosis, Verdict, diagnose};
use diagnose::extend::extended_toml;
use diagnose::record::Record;
use plant::{Load, Parameters, Plant};

fn model() -> Parameters {
    let mut p = Parameters::paper_table();
    p.inductor.dcr = 0.1;
    p.capacitor.esr = 0.03;
    p.switch.v_f = 0.8;
    p
}

/// Duty steps at 20 ohm and load current steps beside 40 ohm, with noise.
fn records(hidden: &Parameters, seed: u64) -> Vec<Record> {
    let duties: [f64; 4] = [0.5, 0.55, 0.42, 0.5];
    let currents: [f64; 4] = [0.0, 4.0, 1.0, 6.0];
    let one = |stepped: bool, seed: u64| {
        let mut p = hidden.clone();
        p.sensors.seed = seed;
        (p.sensors.v_out.noise, p.sensors.i_l.noise, p.sensors.i_out.noise) = (0.1, 0.05, 0.05);
        let mut plant = Plant::new(&p).unwrap();
        let mut text = String::from("t,d,v_o,i_l,i_o,r_load,i_load\n");
        let set = |n: usize| match stepped {
            true => (duties[n / 70 % 4], 20.0, 0.0),
            false => (0.5, 40.0, currents[n / 70 % 4]),
        };
        let load = |n: usize| Load {
            current: set(n).2,
            ..Load::resistor(set(n).1)
        };
        plant.reset_at(99.0, set(0).1.recip() * 99.0 - 1.2, &load(0));
        for n in 0..280 {
            let s = plant.measured();
            let (d, r, i) = set(n);
            let t = n as f64 * 1e-4;
            let _ = writeln!(text, "{t:.5},{d},{:.5},{:.5},{:.5},{r},{i}", s.v_out, s.i_l, s.i_out);
            plant.step(d, &load(n));
        }
        let name = if stepped { "duty.csv" } else { "load.csv" };
        let table = Table::parse(Path::new(name), text.as_bytes()).unwrap();
        Record::new(table, &Columns::default(), &model()).unwrap()
    };
    vec![one(true, 3 * seed + 1), one(false, 3 * seed + 2)]
}

fn diagnosed(hidden: &Parameters, seed: u64) -> Diagnosis {
    let found = diagnose(&model(), records(hidden, seed), &records(hidden, seed + 100), &|_| ());
    println!("{}", found.findings.sentence);
    found
}

#[test]
fn nothing_hidden_is_nothing_found() {
    for seed in 0..2 {
        let found = diagnosed(&model(), seed);
        assert_eq!(
            found.findings.verdict,
            Verdict::Consistent,
            "{}",
            found.findings.sentence
        );
    }
}

#[test]
fn a_larger_esr_is_found_with_its_size_and_helps_on_other_records() {
    let mut hidden = model();
    hidden.capacitor.esr = 0.25;
    let found = diagnosed(&hidden, 1);
    assert_eq!(found.findings.verdict, Verdict::Explained);
    let cause = &found.findings.causes[0];
    let esr = &cause.parameters["esr"];
    assert_eq!(cause.id, "esr");
    assert!(
        (esr.value - 0.25).abs() < 0.02 && esr.low < 0.25 && 0.25 < esr.high,
        "{esr:?}"
    );
    let [before, after] = found.findings.gain.mean_square;
    assert!(before > 1.2 * after && after < 1.15, "{before} {after}");
    let text = extended_toml(&found);
    let extended = Parameters::from_toml(Path::new("plant.extended.toml"), &text).unwrap();
    assert_eq!(extended.capacitor.esr, esr.value);
}

#[test]
fn dead_time_and_turn_on_delay_are_a_tie_that_is_said() {
    let mut hidden = model();
    hidden.switch.dead_time = 2e-6;
    let found = diagnosed(&hidden, 2);
    assert_eq!(
        found.findings.verdict,
        Verdict::Ambiguous,
        "{}",
        found.findings.sentence
    );
    let cause = &found.findings.causes[0];
    let mut tie: Vec<&str> = cause.rivals.iter().flatten().copied().chain([cause.id]).collect();
    tie.sort_unstable();
    assert!(tie.contains(&"dead_time") && tie.contains(&"turn_on_delay"), "{tie:?}");
    assert!(!found.findings.next_experiments.is_empty());
}

#[test]
fn two_effects_are_found_together() {
    let mut hidden = model();
    hidden.converter.inductance *= 0.8;
    hidden.sensors.v_out.gain = 1.02;
    let found = diagnosed(&hidden, 3);
    let mut ids: Vec<&str> = found.findings.causes.iter().map(|cause| cause.id).collect();
    ids.sort_unstable();
    assert!(ids.contains(&"l_wrong") && ids.len() == 2, "{ids:?}");
}

#[test]
fn a_shift_inside_a_record_is_unexplained() {
    let mut shifted = records(&model(), 4);
    for value in &mut shifted[1].measured[0][150..] {
        *value += 1.5;
    }
    let found = diagnose(&model(), shifted, &[], &|_| ());
    assert_eq!(
        found.findings.verdict,
        Verdict::Unexplained,
        "{}",
        found.findings.sentence
    );
    assert!(found.findings.causes.is_empty());
    let shapes: Vec<&str> = found.findings.structure.iter().map(|s| s.shape.as_str()).collect();
    println!("{shapes:?}");
}
