//! The targets as a table for people.

use crate::spec::{Endianness, Fpu, Runner, TargetSpec};

const COLUMNS: usize = 7;

const HEAD: [&str; COLUMNS] = [
    "target",
    "order",
    "floats",
    "suits",
    "cycles",
    "verify runs it",
    "description",
];

/// A heading and a line for each target, columns padded with spaces, no line end behind the last.
#[must_use]
pub fn overview(targets: &[TargetSpec]) -> String {
    let rows: Vec<[String; COLUMNS]> = std::iter::once(HEAD.map(str::to_owned))
        .chain(targets.iter().map(row))
        .collect();
    let width = |column: usize| rows.iter().filter_map(|row| row.get(column)).map(String::len).max();
    let widths: [usize; COLUMNS] = std::array::from_fn(|column| width(column).unwrap_or_default());
    let line = |row: &[String; COLUMNS]| {
        let cells: Vec<String> = row
            .iter()
            .zip(widths)
            .map(|(cell, width)| format!("{cell:width$}"))
            .collect();
        cells.join("  ").trim_end().to_owned()
    };
    rows.iter().map(line).collect::<Vec<_>>().join("\n")
}

fn row(target: &TargetSpec) -> [String; COLUMNS] {
    let order = match target.endianness {
        Endianness::Little => "little",
        Endianness::Big => "big",
        Endianness::Native => "any",
    };
    let floats = match target.fpu {
        Fpu::None => "library",
        Fpu::Single => "f32",
        Fpu::Double => "f32, f64",
        Fpu::Native => "any",
    };
    let runner = match target.runner {
        Runner::Native => "here".to_owned(),
        Runner::Emulated(board) => format!("{} {}", board.emulator, board.name),
        Runner::None(_) => "nowhere".to_owned(),
    };
    // what `compile --clock` can say
    let cycles = if target.cycles.is_some() { "modelled" } else { "-" };
    [
        target.name,
        order,
        floats,
        target.suitable_format,
        cycles,
        &runner,
        target.description,
    ]
    .map(str::to_owned)
}
