//! Folders of recorded cases.

use std::path::{Path, PathBuf};

use diagnose::diagnosis::{Diagnosis, diagnose};
use diagnose::findings::Findings;
use diagnose::record::Record;
use measured::{ColumnMap, Sheet};
use plant::Parameters;

/// What is said of the first one or two records of a folder, and of those that judge.
pub fn findings(folder: &str, judges: &[&str]) -> Findings {
    diagnosed(folder, judges).findings
}

/// The whole diagnosis of them.
pub fn diagnosed(folder: &str, judges: &[&str]) -> Diagnosis {
    let path = |name: &str| -> PathBuf {
        let tests = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/recorded");
        tests.join(folder).join(name)
    };
    let text = std::fs::read_to_string(path("plant.toml")).unwrap();
    let model = Parameters::from_toml("plant.toml".as_ref(), &text).unwrap();
    let read = |name: &&str| {
        let sheet = Sheet::parse(
            Path::new(name),
            std::fs::read(path(name)).unwrap(),
            &Record::file_options(),
        );
        Record::read(&sheet.unwrap(), &ColumnMap::default(), &model).unwrap()
    };
    let train = ["first.csv", "second.csv"].iter().filter(|name| path(name).exists());
    let train = train.map(read).collect();
    let held: Vec<Record> = judges.iter().map(read).collect();
    let diagnosis = diagnose(&model, train, &held, &|_| ());
    println!("{}", diagnosis.findings.sentence);
    diagnosis
}

/// The causes that are named.
pub fn ids(findings: &Findings) -> Vec<&'static str> {
    findings.causes.iter().map(|cause| cause.id).collect()
}
