//! Records of more rows than those of a blind set: what is found in short ones is found in long ones.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::path::{Path, PathBuf};

use diagnose::diagnosis::diagnose;
use diagnose::findings::Verdict;
use diagnose::record::Record;
use measured::{ColumnMap, Sheet};
use plant::Parameters;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/long_records")
}

/// Seven hundred rows of duty steps and as many of load steps, from a simulation of the switching circuit by somebody who had not read the solver:
/// the capacitor has 220 uF and 0.1 ohm in the place of 330 uF and 0.04 ohm.
#[test]
fn two_causes_are_found_in_long_records() {
    let model = Parameters::from_toml(
        "plant.toml".as_ref(),
        &std::fs::read_to_string(folder().join("plant.toml")).unwrap(),
    )
    .unwrap();
    let read = |name: &str| {
        let bytes = std::fs::read(folder().join(name)).unwrap();
        let sheet = Sheet::parse(Path::new(name), bytes, &Record::file_options()).unwrap();
        Record::read(&sheet, &ColumnMap::default(), &model).unwrap()
    };
    let train = ["duty-steps.csv", "load-steps.csv"].map(read).into();
    let findings = diagnose(&model, train, &[], &|_| ()).findings;
    println!("{}", findings.sentence);
    let value = |id: &str, parameter: &str| {
        let cause = findings.causes.iter().find(|cause| cause.id == id);
        cause
            .unwrap_or_else(|| panic!("{id}: {}", findings.sentence))
            .parameters[parameter]
            .value
    };
    assert_eq!(findings.verdict, Verdict::Explained, "{}", findings.sentence);
    assert!((value("c_wrong", "capacitance") - 220e-6).abs() < 1e-6);
    assert!((value("esr", "esr") - 0.1).abs() < 1e-3);
}
