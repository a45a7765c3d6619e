//! Members of a tie beside each other. The records are from a simulator of their own (`policyc-blind`): a boost whose voltmeter shows 0.443 V too
//! much, and nothing else is hidden. The voltage alone was measured, and a diode that drops 0.44 V less does the same.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::path::{Path, PathBuf};

use diagnose::diagnosis::diagnose;
use diagnose::findings::Verdict;
use diagnose::record::Record;
use measured::{ColumnMap, Sheet};
use plant::Parameters;

/// With both, the diode drops what the model has and the voltmeter does it all. That is the tie once more: the union of its intervals took the diode
/// for nothing, and the trim of the edges had to do what is left.
#[test]
fn a_cause_that_is_nothing_beside_its_rival_is_something_in_its_place() {
    let path = |name: &str| -> PathBuf { Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/tied").join(name) };
    let text = std::fs::read_to_string(path("plant.toml")).unwrap();
    let model = Parameters::from_toml("plant.toml".as_ref(), &text).unwrap();
    let read = |name: &str| {
        let sheet = Sheet::parse(
            Path::new(name),
            std::fs::read(path(name)).unwrap(),
            &Record::file_options(),
        );
        Record::read(&sheet.unwrap(), &ColumnMap::default(), &model).unwrap()
    };
    let findings = diagnose(&model, ["first.csv", "second.csv"].map(read).into(), &[], &|_| ()).findings;
    println!("{}", findings.sentence);
    assert_eq!(findings.verdict, Verdict::Ambiguous, "{}", findings.sentence);
    let [cause] = &findings.causes[..] else {
        panic!("{}", findings.sentence)
    };
    let tied = cause.rival_values.iter().flatten();
    let mut values = (tied.map(|value| (value.id, value.parameter, value.value))).chain(
        cause
            .parameters
            .iter()
            .map(|(name, value)| (cause.id, *name, value.value)),
    );
    let offset = values.find(|(id, ..)| *id == "v_offset");
    assert!(
        offset.is_some_and(|(.., value)| (value - 0.443).abs() < 0.01),
        "{}",
        findings.sentence
    );
}
