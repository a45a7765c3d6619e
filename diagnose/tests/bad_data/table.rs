//! A good table of a record, and ways to spoil it.

use std::fmt::Write as _;
use std::path::Path;

use diagnose::record::Record;
use measured::{ColumnMap, Sheet};
use plant::{Faults, Parameters};

pub const HEADER: &str = "t,d,v_o,i_l,v_in,r_load";

/// Forty rows at the middle of the period, at 100 V and 5 A.
pub fn good() -> Vec<String> {
    let row = |n: usize| {
        let (v, i) = (100.0 + 0.137 * (n % 7) as f64, 5.0 + 0.061 * (n % 5) as f64);
        let v_in = 200.0 + 0.11 * (n % 3) as f64;
        format!("{:.6},0.5,{v:.3},{i:.3},{v_in:.2},20", (n as f64 + 0.5) * 1e-4)
    };
    std::iter::once(HEADER.to_owned()).chain((0..40).map(row)).collect()
}

pub fn text(lines: &[String]) -> String {
    lines.iter().fold(String::new(), |mut text, line| {
        let _ = writeln!(text, "{line}");
        text
    })
}

pub fn read(bytes: &[u8]) -> Result<Record, Faults> {
    let sheet = Sheet::parse(Path::new("run.csv"), bytes.to_vec(), &Record::file_options())?;
    Record::read(&sheet, &ColumnMap::default(), &Parameters::paper_table())
}

/// The good table with one line changed (0 is the header).
pub fn with(line: usize, change: impl Fn(&str) -> String) -> String {
    let mut lines = good();
    lines[line] = change(&lines[line]);
    text(&lines)
}

/// The good table with a cell of every row changed.
pub fn column(index: usize, change: impl Fn(&str) -> String) -> String {
    let mut lines = good();
    for line in &mut lines[1..] {
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        cells[index] = change(&cells[index]);
        *line = cells.join(",");
    }
    text(&lines)
}

pub fn times(factor: f64) -> impl Fn(&str) -> String {
    move |cell| format!("{}", factor * cell.parse::<f64>().unwrap())
}

pub fn header(from: &str, to: &str) -> String {
    with(0, |line| line.replace(from, to))
}
