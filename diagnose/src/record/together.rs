//! The records of a diagnosis.

use std::path::Path;

use measured::ColumnMap;
use plant::Parameters;
use toml_input::{Fault, Faults, FileName, Message, Sink};

use super::Record;
use crate::preflight;

/// All records of a diagnosis, those that are fitted and those that are not, or all their faults.
///
/// # Errors
/// The faults of every file; a held-out record that is a training record again.
pub fn open_all(
    train: &[FileName],
    heldout: &[FileName],
    columns: &ColumnMap,
    model: &Parameters,
) -> Result<(Vec<Record>, Vec<Record>), Faults> {
    let file = heldout.first().map_or(Path::new(""), |name| name.path.as_path());
    let mut faults = Sink::new();
    let mut read = |files: &[FileName]| {
        let one = |file: &FileName| faults.keep(Record::open(file.clone(), columns, model));
        files.iter().filter_map(one).collect::<Vec<_>>()
    };
    let (train, heldout) = (read(train), read(heldout));
    faults.propagate().map_err(said_once)?;
    let again = preflight::repeated(&train, &heldout);
    let message = |(held, train): (&str, &str)| {
        Message::new(format!(
            "the held-out record `{held}` is the training record `{train}` again"
        ))
        .expected("a record that no fit has seen")
        .hint("it would judge a fit by what was fitted: leave it out, or cut the record in two")
    };
    let again = again.into_iter().map(|pair| Fault::in_file(file, message(pair)));
    again.collect::<Sink>().propagate()?;
    Ok((train, heldout))
}

/// The same fault of several files once, with the names of the others: records of one logger share their header.
fn said_once(mut faults: Faults) -> Faults {
    let mut list: Vec<(Fault, Vec<String>)> = Vec::new();
    for fault in faults.list {
        let is_same = |known: &Fault| {
            let mut other = known.clone();
            other.file.clone_from(&fault.file);
            known.file != fault.file && other == fault
        };
        match list.iter_mut().find(|(known, _)| is_same(known)) {
            Some((_, others)) => others.push(format!("`{}`", fault.file.display())),
            None => list.push((fault, Vec::new())),
        }
    }
    let told = |(mut fault, others): (Fault, Vec<String>)| {
        if !others.is_empty() {
            fault.problem = format!("{}; the same in {}", fault.problem, others.join(", "));
        }
        fault
    };
    faults.list = list.into_iter().map(told).collect();
    faults
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_of_three_files_is_said_once() {
        let fault = |file: &str, problem: &str| Fault::in_file(Path::new(file), Message::new(problem));
        let mut all = Faults::from(fault("a.csv", "no load"));
        all.list.extend([
            fault("b.csv", "no load"),
            fault("b.csv", "no duty"),
            fault("c.csv", "no load"),
        ]);
        let said: Vec<String> = said_once(all).iter().map(|fault| fault.problem.clone()).collect();
        assert_eq!(said, ["no load; the same in `b.csv`, `c.csv`", "no duty"]);
    }
}
