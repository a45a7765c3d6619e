//! What is too small, too fine or out of reach to be named.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::fmt::Write as _;
use std::path::Path;

use diagnose::diagnosis::{Diagnosis, diagnose};
use diagnose::extend::extended_toml;
use diagnose::findings::Verdict;
use diagnose::record::Record;
use measured::{ColumnMap, Sheet};
use plant::{Load, Parameters, Plant};

fn model() -> Parameters {
    let mut p = Parameters::paper_table();
    p.converter.capacitance = 150e-6;
    (p.inductor.dcr, p.switch.v_f) = (0.1, 0.8);
    p
}

/// Duty steps at 20 ohm with noise of `noise` V and half as many A, written with `digits` behind the point.
fn diagnosed(hidden: &Parameters, noise: f64, digits: usize) -> Diagnosis {
    let mut p = hidden.clone();
    (p.sensors.v_out.noise, p.sensors.i_l.noise) = (noise, 0.5 * noise);
    let mut plant = Plant::new(&p).unwrap();
    let load = Load::resistor(20.0);
    plant.reset_at(98.0, 4.9, &load);
    let mut text = "t,d,v_o,i_l,r_load\n".to_owned();
    for n in 0..300 {
        let (s, duty) = (plant.measured(), [0.5, 0.55, 0.42, 0.5][n / 75]);
        let t = n as f64 * 1e-4;
        let _ = writeln!(text, "{t:.4},{duty},{:.digits$},{:.digits$},20", s.v_out, s.i_l);
        plant.step(duty, &load);
    }
    let sheet = Sheet::parse(Path::new("run.csv"), text.into(), &Record::file_options()).unwrap();
    let record = Record::read(&sheet, &ColumnMap::default(), &model()).unwrap();
    let found = diagnose(&model(), vec![record], &[], &|_| ());
    println!("{}\n{:?}", found.findings.sentence, found.findings.noise.repairs);
    found
}

fn said(found: &Diagnosis) -> String {
    found.findings.noise.repairs.join("\n")
}

#[test]
fn a_cause_whose_size_is_nothing_is_not_named() {
    let mut hidden = model();
    // a tenth of what two simulators differ by, in a record with next to no noise
    hidden.converter.capacitance *= 1.0001;
    hidden.capacitor.derating = 1e-4;
    hidden.capacitor.v_half = 50.0;
    let found = diagnosed(&hidden, 2e-4, 6);
    for cause in &found.findings.causes {
        let moved = cause.parameters.values().any(|v| v.model < v.low || v.high < v.model);
        assert!(moved, "{}", found.findings.sentence);
    }
    assert_eq!(
        found.findings.verdict,
        Verdict::Consistent,
        "{}",
        found.findings.sentence
    );
    assert!(said(&found).contains("too clean to be measured"), "{}", said(&found));
}

#[test]
fn a_record_with_the_noise_of_a_bench_is_not_too_clean() {
    let found = diagnosed(&model(), 0.05, 3);
    assert_eq!(found.findings.verdict, Verdict::Consistent);
    assert!(!said(&found).contains("too clean"), "{}", said(&found));
}

#[test]
fn a_step_of_a_converter_that_is_lost_in_the_noise_is_a_note() {
    let mut hidden = model();
    hidden.sensors.v_out.lsb = 0.05;
    let found = diagnosed(&hidden, 0.1, 4);
    assert_eq!(
        found.findings.verdict,
        Verdict::Consistent,
        "{}",
        found.findings.sentence
    );
    let said = said(&found);
    assert!(
        said.contains("v_o on steps of 50.00 mV") && said.contains("analogue-to-digital converter"),
        "{said}"
    );
}

#[test]
fn a_coarse_step_is_named_and_stands_in_the_extended_model() {
    let mut hidden = model();
    hidden.sensors.v_out.lsb = 0.5;
    let found = diagnosed(&hidden, 0.1, 4);
    assert_eq!(
        found.findings.verdict,
        Verdict::Explained,
        "{}",
        found.findings.sentence
    );
    assert!(found.findings.sentence.contains("analogue-to-digital converter"));
    let text = extended_toml(&found);
    let extended = Parameters::from_toml(Path::new("plant.extended.toml"), &text).unwrap();
    assert!((extended.sensors.v_out.lsb / 0.5 - 1.0).abs() < 1e-3, "{text}");
}

#[test]
fn nothing_is_called_visible_beyond_its_reach() {
    let found = diagnosed(&model(), 0.1, 3);
    let list = &found.findings.not_detectable;
    assert!(!list.is_empty());
    for hidden in list {
        assert!(hidden.smallest.is_none_or(|size| size <= hidden.reach), "{hidden:?}");
    }
}

#[test]
fn nothing_is_called_hidden_of_loads_and_meters_that_are_not_there() {
    // a resistor alone, and no meter of load current or source voltage
    let found = diagnosed(&model(), 0.1, 3);
    let list = &found.findings.not_detectable;
    for hidden in list {
        let names = ["cpl_bandwidth", "cpl_fold", "v_in_gain"];
        assert!(!names.contains(&hidden.id), "{hidden:?}");
        let of_load_current = ["gain_o", "offset_o", "delay_o", "time_constant_o"];
        assert!(!of_load_current.contains(&hidden.parameter), "{hidden:?}");
        assert!(
            hidden.id != "load_gain" || hidden.parameter == "resistor_gain",
            "{hidden:?}"
        );
    }
}
