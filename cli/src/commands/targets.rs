//! `policyc targets`

use ::targets::{Endianness, Fpu, Runner, TARGETS, TargetSpec};

use crate::arguments::Targets;
use crate::{Failure, Outcome, output};

/// Lists the table.
pub fn run(options: &Targets) -> Result<Outcome, Failure> {
    if options.json {
        output::say(&serde_json::to_string_pretty(TARGETS)?)?;
        return Ok(Outcome::Done);
    }
    let rows: Vec<[String; COLUMNS]> = std::iter::once(HEAD.map(str::to_owned))
        .chain(TARGETS.iter().map(row))
        .collect();
    let widths: [usize; COLUMNS] =
        std::array::from_fn(|column| rows.iter().map(|row| row[column].len()).max().unwrap_or_default());
    for row in &rows {
        let cells: Vec<String> = row
            .iter()
            .zip(widths)
            .map(|(cell, width)| format!("{cell:width$}"))
            .collect();
        output::say(cells.join("  ").trim_end())?;
    }
    Ok(Outcome::Done)
}

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
