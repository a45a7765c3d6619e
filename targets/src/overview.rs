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

/// All of a target that a user compiles and measures by, a line each, no line end behind the last.
#[must_use]
pub fn details(target: &TargetSpec) -> String {
    let mut lines = vec![format!("{}: {}", target.name, target.description), String::new()];
    let mut line = |what: &str, text: String| lines.push(format!("  {what:22} {text}"));
    line("byte order", order(target).to_owned());
    let widths = &target.widths;
    line(
        "widths",
        format!(
            "char {}, int {}, pointer {} bits",
            widths.char_bits, widths.int_bits, widths.pointer_bits
        ),
    );
    line("floats in hardware", floats(target).to_owned());
    if target.flushes_subnormals {
        line("subnormal numbers", "taken for zero".to_owned());
    }
    line("suitable format", target.suitable_format.to_owned());
    if let Some(hertz) = target.clock_hz {
        line("clock of a usual part", format!("{} MHz", f64::from(hertz) / 1e6));
    }
    for compiler in target.c_compilers {
        let flags = compiler.machine_flags.iter().chain(target.c_flags);
        let flags: Vec<&str> = flags.copied().collect();
        line("C", format!("{} {}", compiler.program, flags.join(" ")));
    }
    match &target.rust {
        Some(rust) => line("Rust", format!("{} {}", rust.triple, target.rust_flags.join(" "))),
        None => line("Rust", "none".to_owned()),
    }
    line("verify runs it", runner(target));
    if let Runner::None(reason) = target.runner {
        line("", reason.to_owned());
    }
    let parts = crate::families::of_target(target.name);
    if !parts.is_empty() {
        line("parts", parts.join(" "));
    }
    lines.join("\n")
}

fn order(target: &TargetSpec) -> &'static str {
    match target.endianness {
        Endianness::Little => "little",
        Endianness::Big => "big",
        Endianness::Native => "any",
    }
}

fn floats(target: &TargetSpec) -> &'static str {
    match target.fpu {
        Fpu::None => "library",
        Fpu::Single => "f32",
        Fpu::Double => "f32, f64",
        Fpu::Native => "any",
    }
}

fn runner(target: &TargetSpec) -> String {
    match target.runner {
        Runner::Native => "here".to_owned(),
        Runner::Emulated(board) => format!("{} {}", board.emulator, board.name),
        Runner::None(_) => "nowhere".to_owned(),
    }
}

fn row(target: &TargetSpec) -> [String; COLUMNS] {
    // what `compile --clock` can say
    let cycles = if target.cycles.is_some() { "modelled" } else { "-" };
    [
        target.name,
        order(target),
        floats(target),
        target.suitable_format,
        cycles,
        &runner(target),
        target.description,
    ]
    .map(str::to_owned)
}
