//! Records of more rows than those of a blind set: what is found in short ones is found in long ones.
//!
//! All are from simulations of the switching circuit by people who had not read the solver.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::path::{Path, PathBuf};

use diagnose::diagnosis::diagnose;
use diagnose::findings::{Findings, Verdict};
use diagnose::record::Record;
use measured::{ColumnMap, Sheet};
use plant::Parameters;

/// What was put into the simulation of `late`, H; and s, .298 of a period of 367 kHz.
const INDUCTANCE: f64 = 29.7e-6;
const LATE: f64 = 0.812e-6;

fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/long_records")
        .join(name)
}

/// What is found in a record of duty steps and one of load steps.
fn found(name: &str) -> Findings {
    let text = std::fs::read_to_string(folder(name).join("plant.toml")).unwrap();
    let model = Parameters::from_toml("plant.toml".as_ref(), &text).unwrap();
    let read = |file: &str| {
        let bytes = std::fs::read(folder(name).join(file)).unwrap();
        let sheet = Sheet::parse(Path::new(file), bytes, &Record::file_options()).unwrap();
        Record::read(&sheet, &ColumnMap::default(), &model).unwrap()
    };
    let train = ["duty-steps.csv", "load-steps.csv"].map(read).into();
    let findings = diagnose(&model, train, &[], &|_| ()).findings;
    println!("{}", findings.sentence);
    findings
}

fn value(findings: &Findings, id: &str, parameter: &str) -> f64 {
    let cause = findings.causes.iter().find(|cause| cause.id == id);
    cause
        .unwrap_or_else(|| panic!("{id}: {}", findings.sentence))
        .parameters[parameter]
        .value
}

/// Seven hundred rows each: the capacitor has 220 uF and 0.1 ohm in the place of 330 uF and 0.04 ohm.
#[test]
fn two_causes_are_found_in_long_records() {
    let findings = found("capacitor");
    assert_eq!(findings.verdict, Verdict::Explained, "{}", findings.sentence);
    assert!((value(&findings, "c_wrong", "capacitance") - 220e-6).abs() < 1e-6);
    assert!((value(&findings, "esr", "esr") - 0.1).abs() < 1e-3);
}

/// Samples .81 us behind where the file has them, and 29.7 uH in the place of 34.2 uH: together they leave behind every load step what the
/// load would leave that steps at another instant, and alone neither does.
#[test]
fn two_causes_are_no_load_steps_inside_a_period() {
    let findings = found("late");
    assert_eq!(findings.verdict, Verdict::Explained, "{}", findings.sentence);
    assert!((value(&findings, "l_wrong", "inductance") - INDUCTANCE).abs() < 0.01 * INDUCTANCE);
    assert!((value(&findings, "sampling_delay", "delay") - LATE).abs() < 0.01 * LATE);
}

/// The load steps .37 of a period behind its row, once in the one record and eleven times in the other; all else is as the file has it.
#[test]
fn a_single_load_step_inside_a_period_is_seen_beside_a_record_of_many() {
    let findings = found("inside");
    assert_eq!(findings.verdict, Verdict::Consistent, "{}", findings.sentence);
}
