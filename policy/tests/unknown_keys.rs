//! A key that nobody knows is refused wherever it stands: in every table of every golden case, at its place.
#![allow(clippy::unwrap_used, clippy::disallowed_methods)]

mod common;
use std::path::Path;

use common::*;
use policy::ReadOptions;

/// The text with `zzz = 1` as the first key of each table in turn, and the place of the key.
fn spoiled(contract: &str) -> Vec<(String, (usize, usize))> {
    let mut texts = Vec::new();
    let mut insert = |at: usize, key: &str| {
        let marked = format!("{}¦{key}{}", &contract[..at], &contract[at..]);
        texts.push(unmark(&marked));
    };
    let mut start = 0;
    for line in contract.split_inclusive('\n') {
        let is_comment = line.starts_with('#');
        // names of parameters are free
        if line.starts_with('[') && !line.starts_with("[parameters]") {
            insert(start + line.len(), "zzz = 1\n");
        }
        for (at, _) in line.match_indices("{ ").filter(|_| !is_comment) {
            insert(start + at + 2, "zzz = 1, ");
        }
        start += line.len();
    }
    texts
}

#[test]
fn a_key_that_nobody_knows_is_refused_in_every_table() {
    let cases = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/golden/cases");
    let options = ReadOptions {
        several_outputs: true,
        ..ReadOptions::default()
    };
    let mut count = 0;
    for entry in std::fs::read_dir(cases).unwrap() {
        let case = entry.unwrap().path();
        let folder = tempfile::tempdir().unwrap();
        let files = std::fs::read_dir(&case).unwrap().map(|entry| entry.unwrap().path());
        for file in files.filter(|path| path.is_file()) {
            std::fs::copy(&file, folder.path().join(file.file_name().unwrap())).unwrap();
        }
        let contract = std::fs::read_to_string(case.join("policy.toml")).unwrap();
        let path = folder.path().join("policy.toml");
        for (text, place) in spoiled(&contract) {
            std::fs::write(&path, &text).unwrap();
            let faults = policy::load_with(&path, &options).unwrap_err();
            let mut there = faults.faults.list.iter().filter(|fault| {
                let is_there = fault.line_column().is_some_and(|(line, _)| line == place.0);
                // a filter has one key, which is its kind
                is_there && (words(fault).contains("zzz") || words(fault).contains("a filter needs exactly one of"))
            });
            assert!(there.next().is_some(), "{} {place:?}: {faults}", case.display());
            count += 1;
        }
    }
    assert!(count > 250, "{count} tables");
}
