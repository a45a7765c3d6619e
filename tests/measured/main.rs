//! Nasty files against all readers of measurements: what one can read all can, what one refuses nobody takes silently.
//!
//! Each case is one text, and what `drm`, `diagnose` and the traces of `verify` make of it. `drm` wants every point
//! whole, `diagnose` has gaps and half a last line, `verify` replays NaN and infinity: that is all in which they differ.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod cases;

use std::path::Path;

use diagnose::record::Record;
use drm::TableOptions;
use interp::Sample;
use measured::{ColumnMap, Options, Sheet};
use plant::Parameters;
use policy::Policy;
use toml_input::Faults;
use verify::traces::Recorded;

use cases::{Case, Outcome, Outcome::*, cases, good};

/// The readers, in the order of the outcomes of a case.
const READERS: [&str; 3] = ["drm", "diagnose", "verify"];

/// What a reader made of a file: its numbers, and its notes.
type Read = Result<(Vec<f64>, Vec<String>), Faults>;

fn read_all(bytes: &[u8], policy: &Policy) -> [Read; 3] {
    let file = Path::new("run.csv");
    let drm = drm::Table::parse(file, bytes, &TableOptions::default()).map(|table| {
        let numbers = table.points.iter().flat_map(|p| [p.d_real, p.v_out, p.i_out, p.v_in]);
        (numbers.collect(), table.notes)
    });
    let diagnose = Sheet::parse(file, bytes.to_vec(), &Record::file_options())
        .and_then(|sheet| Record::read(&sheet, &ColumnMap::default(), &Parameters::paper_table()))
        .map(|record| {
            let numbers = record.measured.iter().chain([&record.duty]).flatten().copied();
            (numbers.collect(), record.repairs)
        });
    let verify = Sheet::parse(file, bytes.to_vec(), &Options::default())
        .and_then(|sheet| Recorded::read(policy, &sheet, ""))
        .map(|recorded| (recorded.steps().iter().flatten().map(number).collect(), recorded.notes));
    [drm, diagnose, verify]
}

fn number(sample: &Sample) -> f64 {
    match sample {
        Sample::Physical(value) => f64::from(*value),
        Sample::Wide(value) => *value,
        Sample::Code(code) => f64::from(*code),
    }
}

fn policy() -> Policy {
    policy::load(&tests::example()).unwrap()
}

fn same(a: &[f64], b: &[f64]) -> bool {
    // a unit in the name is one more rounding
    let close = |(a, b): (&f64, &f64)| a == b || (a - b).abs() <= 1e-6 * b.abs() || (a.is_nan() && b.is_nan());
    a.len() == b.len() && a.iter().zip(b).all(close)
}

/// What is not as it should be, if anything.
fn judged(outcome: &Outcome, read: &Read, plain: &[f64]) -> Result<(), String> {
    match (outcome, read) {
        (Same, Ok((numbers, _))) if same(numbers, plain) => Ok(()),
        (Same, Ok((numbers, _))) => Err(format!("other numbers: {:?} ...", &numbers[..numbers.len().min(8)])),
        (Read, Ok((numbers, _))) if !same(numbers, plain) => Ok(()),
        (Read, Ok(_)) => Err("the same numbers as the plain table".to_owned()),
        (Refused(words, line), Err(faults)) => {
            let fault = &faults.list[0];
            let text = faults.to_string();
            let helps = fault.hint.is_some() || fault.expected.is_some() || fault.found.is_some();
            let found = fault.line_column().map(|(line, _)| line);
            let wrong = words.iter().any(|word| !text.contains(word)) || !text.contains("run.csv");
            if wrong || !helps || found != *line {
                return Err(format!("expected {words:?} in line {line:?}\n{text}"));
            }
            Ok(())
        }
        (Refused(words, _), Ok(_)) => Err(format!("accepted instead of {words:?}")),
        (Same | Read, Err(faults)) => Err(format!("refused:\n{faults}")),
    }
}

#[test]
fn all_readers_read_and_refuse_the_same_files() {
    let policy = policy();
    let plain = read_all(good().as_bytes(), &policy).map(|read| read.unwrap_or_else(|faults| panic!("{faults}")).0);
    let mut wrong = Vec::new();
    for Case { name, bytes, outcomes } in cases() {
        let read = read_all(&bytes, &policy);
        for n in 0..READERS.len() {
            if let Err(what) = judged(&outcomes[n], &read[n], &plain[n]) {
                wrong.push(format!("{name}, {}: {what}", READERS[n]));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn a_column_that_is_not_used_is_named_by_every_reader() {
    let more = good().replace("r_load\n", "r_load,lamp\n").replace(",20\n", ",20,on\n");
    for (read, reader) in read_all(more.as_bytes(), &policy()).into_iter().zip(READERS) {
        let (_, notes) = read.unwrap_or_else(|faults| panic!("{reader}: {faults}"));
        assert!(notes.iter().any(|note| note.contains("`lamp`")), "{reader}: {notes:?}");
    }
}

/// A hundred thousand rows: too many for settled points, and no trouble for the others.
#[test]
fn a_long_record_is_read() {
    let row = |n: usize| format!("{:.5},0.5,99.{},5.{},5.0,200.0,20\n", n as f64 * 1e-4, n % 7, n % 5);
    let text = (0..100_000).fold("t,duty,v_out,i_l,i_out,v_in,r_load\n".to_owned(), |text, n| {
        text + &row(n)
    });
    let [drm, diagnose, verify] = read_all(text.as_bytes(), &policy());
    let refused = drm.unwrap_err().to_string();
    assert!(
        refused.contains("`duty` is the same") || refused.contains("too many rows"),
        "{refused}"
    );
    assert_eq!(diagnose.unwrap().0.len(), 5 * 100_000);
    assert_eq!(verify.unwrap().0.len(), 3 * 100_000);
}
