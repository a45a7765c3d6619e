//! `policyc diagnose`

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

use ::diagnose::columns::Columns;
use ::diagnose::diagnosis::diagnose;
use ::diagnose::extend::extended_toml;
use ::diagnose::page::page;
use ::diagnose::record::Record;
use plant::{Fault, Faults, Parameters};

use crate::arguments::Diagnose;
use crate::{Failure, Outcome, output};

/// Reads the records, diagnoses, writes the three files.
pub fn run(options: &Diagnose) -> Result<Outcome, Failure> {
    let model = Parameters::from_file(&options.model)?;
    let columns = options
        .columns
        .as_deref()
        .map_or_else(|| Ok(Columns::default()), Columns::open)?;
    let (train, heldout) = records(options, &columns, &model)?;
    let start = Instant::now();
    let say = |what: &str| eprintln!("{:6.1} s  {what}", start.elapsed().as_secs_f64());
    let diagnosis = diagnose(&model, train, &heldout, &say);
    let mut json = serde_json::to_string_pretty(&diagnosis.findings)?;
    json.push('\n');
    let files = BTreeMap::from([
        ("diagnosis.json".to_owned(), json),
        ("plant.extended.toml".to_owned(), extended_toml(&diagnosis)),
        ("report.html".to_owned(), page(&diagnosis)?),
    ]);
    output::write_texts(&options.out, &files)?;
    let out = options.out.display();
    for repair in &diagnosis.findings.noise.repairs {
        output::say(&format!("note: {repair}"))?;
    }
    output::say(&format!("{}\n\nreport: {out}/report.html", diagnosis.findings.sentence))?;
    Ok(Outcome::Done)
}

/// All records, or all their faults.
fn records(options: &Diagnose, columns: &Columns, model: &Parameters) -> Result<(Vec<Record>, Vec<Record>), Faults> {
    let mut faults: Vec<Fault> = Vec::new();
    let mut read = |files: &[PathBuf]| {
        let one = |file: &PathBuf| match Record::open(Path::new(file), columns, model) {
            Ok(record) => Some(record),
            Err(found) => {
                faults.extend(found.list);
                None
            }
        };
        files.iter().filter_map(one).collect::<Vec<_>>()
    };
    let (train, heldout) = (read(&options.train), read(&options.heldout));
    Faults::unless_empty(faults)?;
    Ok((train, heldout))
}
