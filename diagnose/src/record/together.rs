//! The records of a diagnosis.

use std::path::Path;

use measured::ColumnMap;
use plant::Parameters;
use toml_input::{Fault, Faults, FileName, Message, Sink};

use super::Record;
use super::channels::QUANTITIES;
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
    let (mut train, mut heldout) = (read(train), read(heldout));
    leave_out_ends(&mut train, &mut heldout);
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

/// Leaves out in every record what lies where another shows that the range of an instrument ends: too few rows to be seen by themselves.
fn leave_out_ends(train: &mut [Record], heldout: &mut [Record]) {
    for (n, name) in QUANTITIES.iter().enumerate() {
        let all = || train.iter().chain(heldout.iter());
        let ends: Vec<f64> = all().filter_map(|record| record.ends[n]).collect();
        for end in ends {
            let is_end = |record: &&mut Record| {
                let known = record.measured[n].iter().copied().filter(|v| v.is_finite());
                let (low, high) = known.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
                record.ends[n].is_none() && !record.settled && (end == low || end == high)
            };
            for record in train.iter_mut().chain(heldout.iter_mut()).filter(is_end) {
                record.leave_out_end(n, name, end);
            }
        }
    }
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
    use std::fmt::Write as _;

    use super::*;

    /// A record of 60 rows of which those in `cut` lie at the end of a range of 101 V.
    fn clipped(name: &str, cut: std::ops::Range<usize>) -> Record {
        let mut text = String::from("t,d,v_o,r_load\n");
        for n in 0..60 {
            let v = if cut.contains(&n) {
                101.0
            } else {
                96.0 + 4.4 * (n as f64 * 0.4).sin() + 0.13 * (n * 7 % 5) as f64
            };
            let _ = writeln!(text, "{:.6},0.5,{:.3},20", (n as f64 + 0.5) * 1e-4, v.min(101.0));
        }
        let sheet = measured::Sheet::parse(Path::new(name), text.into(), &Record::file_options()).unwrap();
        Record::read(&sheet, &ColumnMap::default(), &Parameters::paper_table()).unwrap()
    }

    #[test]
    fn the_end_of_a_range_that_one_record_shows_is_that_of_the_others() {
        let mut train = [clipped("a.csv", 20..30), clipped("b.csv", 40..43)];
        let mut heldout = [clipped("c.csv", 0..0)];
        let left = |record: &Record| record.measured[0].iter().filter(|v| v.is_nan()).count();
        // three rows are too few to be seen by themselves
        assert_eq!([left(&train[0]), left(&train[1]), left(&heldout[0])], [10, 0, 0]);
        leave_out_ends(&mut train, &mut heldout);
        assert_eq!([left(&train[0]), left(&train[1]), left(&heldout[0])], [10, 3, 0]);
        assert!(
            train[1]
                .repairs
                .iter()
                .any(|said| said.contains("3 rows of v_out lie at 101")),
            "{:?}",
            train[1].repairs
        );
    }

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
