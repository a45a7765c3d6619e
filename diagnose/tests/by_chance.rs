//! A cause that fits by chance beside the true one is refuted by a record that no fit has seen. The records are from a simulator of their own
//! (`policyc-blind`): the diode drops 1.405 V in the place of 0.52 V, and nothing else is hidden.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::path::{Path, PathBuf};

use diagnose::diagnosis::diagnose;
use diagnose::findings::Verdict;
use diagnose::record::Record;
use measured::{ColumnMap, Sheet};
use plant::Parameters;

#[test]
fn a_second_cause_that_the_held_out_record_refutes_is_not_named() {
    let path = |name: &str| -> PathBuf { Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/by_chance").join(name) };
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
    let train = ["first.csv", "second.csv"].map(read).into();
    let alone = diagnose(&model, Vec::clone(&train), &[], &|_| ()).findings;
    let judged = diagnose(&model, train, &[read("judge.csv")], &|_| ()).findings;
    println!("{}\n{}", alone.sentence, judged.sentence);
    // the training records by themselves lend a second cause more than its threshold: else the record judges nothing here
    assert_eq!(alone.causes.len(), 2, "{}", alone.sentence);
    assert_eq!(judged.verdict, Verdict::Explained, "{}", judged.sentence);
    let causes: Vec<&str> = judged.causes.iter().map(|cause| cause.id).collect();
    assert_eq!(causes, ["diode"], "{}", judged.sentence);
    let v_f = &judged.causes[0].parameters["v_f"];
    assert!((v_f.value - 1.405).abs() < 0.02, "{}", judged.sentence);
}
