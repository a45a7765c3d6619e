//! Other people's kernels on the same network, Cortex-M4F: built here as far as a registry has them, else by the figures
//! others stated. No package of theirs is a dependency of the workspace: they are built in a folder of their own.

mod built;

use std::fmt::Write;
use std::path::Path;

use policy::Policy;
use report::{Axis, BarChart, BarPanel, ReportError, Svg};
use targets::TargetSpec;

use crate::build::{Bench, blank};
use crate::row::Row;

/// Start of the variant of a peer's row.
pub const PEER: &str = "peer: ";
/// What stands for a compiler in the row of a figure that was not measured here.
pub const STATED: &str = "stated";

/// How a peer computes: what of ours may stand beside it.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Arithmetic {
    /// Part of a peer's name that says so.
    mark: &'static str,
    words: &'static str,
    /// Our format.
    ours: &'static str,
}

/// The first that is marked counts. C in binary32 was stated as gcc builds it unless told otherwise, which is contracted; what is
/// built here is not.
const ARITHMETIC: [Arithmetic; 4] = [
    Arithmetic {
        mark: "s16",
        words: "w8, a16",
        ours: "i8",
    },
    Arithmetic {
        mark: "int8",
        words: "w8, a8",
        ours: "i8",
    },
    Arithmetic {
        mark: "contracted",
        words: "binary32, contracted",
        ours: "f32-fma",
    },
    Arithmetic {
        mark: "f32",
        words: "binary32",
        ours: "f32",
    },
];

/// Name with numeric format, instructions of an inference, flash in bytes: arm-none-eabi-gcc 12.2, the same network and emulator,
/// measured by others, stated in November 2026.
const OTHERS: [(&str, u64, u64); 8] = [
    ("onnx2c f32 contracted", 26_670, 20_952),
    ("emx-onnx-cgen f32 contracted", 27_569, 20_952),
    ("TFLM f32 contracted", 29_439, 60_328),
    ("CMSIS-NN f32 contracted", 28_265, 21_528),
    ("RLtools f32 contracted, other order of sums", 14_442, 23_072),
    ("CMSIS-NN int8, floats in and out", 16_596, 9_936),
    ("CMSIS-NN s16", 20_574, 7_656),
    ("TFLM int8 with CMSIS-NN", 18_062, 42_032),
];

/// All peers: measured, else as stated.
pub fn rows(bench: &Bench, policy: &Policy, target: &TargetSpec, root: &Path) -> Vec<Row> {
    let mut rows = built::rows(bench, policy, target, root);
    let project = |name: &str| name.split(' ').next().map(|word| format!("{PEER}{word} "));
    let stated = OTHERS.iter().filter(|(name, _, _)| {
        let is_same = |row: &Row| project(name).is_some_and(|start| row.variant.starts_with(&start));
        !rows.iter().any(is_same)
    });
    let stated: Vec<Row> = stated
        .map(|(name, instructions, flash)| Row {
            compiler: STATED.to_owned(),
            q_values: Some((*instructions, *instructions)),
            flash: Some(*flash),
            ..row(name, target)
        })
        .collect();
    rows.extend(stated);
    rows
}

fn row(name: &str, target: &TargetSpec) -> Row {
    Row {
        policy: "bench".to_owned(),
        variant: format!("{PEER}{name}"),
        ..blank(target.name)
    }
}

fn arithmetic(peer: &Row) -> Option<&'static Arithmetic> {
    ARITHMETIC.iter().find(|kind| peer.variant.contains(kind.mark))
}

/// Our rows on the core of the peers.
fn ours<'a>(rows: &'a [Row], core: &'a str) -> impl Iterator<Item = &'a Row> {
    rows.iter().filter(move |row| {
        let is_ours = !row.variant.starts_with(PEER) && !row.variant.starts_with("naive");
        row.policy == "bench" && row.core == core && is_ours
    })
}

fn instructions(row: &Row) -> Option<u64> {
    row.q_values.map(|(_, most)| most)
}

/// Each peer beside our builds of the same arithmetic, C and assembly apart, as a Markdown table; empty without peers. Flash is
/// that of the network alone, as linked.
pub fn table(rows: &[Row]) -> String {
    let peers: Vec<&Row> = rows.iter().filter(|row| row.variant.starts_with(PEER)).collect();
    if peers.is_empty() {
        return String::new();
    }
    let mut text = String::from(
        "\n| peer | figures | arithmetic | instructions | flash B | ours | in C | flash B | ratio | in assembly | flash B |\n\
         |---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    let number = |value: Option<u64>| value.map(|value| value.to_string()).unwrap_or_default();
    for peer in peers {
        let Some(kind) = arithmetic(peer) else { continue };
        let c = best(rows, &peer.core, kind.ours);
        let assembly = best(rows, &peer.core, &format!("{}, assembly", kind.ours));
        let count = |row: Option<&Row>| row.and_then(instructions);
        let flash = |row: Option<&Row>| row.and_then(|row| row.network_flash);
        let ratio = match (count(c), instructions(peer)) {
            (Some(ours), Some(theirs)) if ours > 0 => format!("{:.1}", theirs as f64 / ours as f64),
            _ => String::new(),
        };
        // writing to a String cannot fail
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {} | {} | {} | {} | {ratio} | {} | {} |",
            peer.variant.trim_start_matches(PEER),
            if peer.compiler == STATED { STATED } else { "measured" },
            kind.words,
            number(instructions(peer)),
            number(peer.flash),
            kind.ours,
            number(count(c)),
            number(flash(c)),
            number(count(assembly)),
            number(flash(assembly)),
        );
    }
    text
}

/// Our C build of a variant: of the fastest ones, less than 2 % apart, the smallest.
fn best<'a>(rows: &'a [Row], core: &'a str, variant: &str) -> Option<&'a Row> {
    let same: Vec<&Row> = ours(rows, core)
        .filter(|row| row.variant == variant && row.network_flash.is_some())
        .collect();
    let fewest = same.iter().filter_map(|row| instructions(row)).min()?;
    let fast = same
        .into_iter()
        .filter(|row| instructions(row).is_some_and(|count| count <= fewest + fewest / 50));
    fast.min_by_key(|row| row.network_flash)
}

/// Instructions of an inference, ours and the peers', fewest first.
///
/// # Errors
/// If there is nothing to draw.
pub fn picture(rows: &[Row]) -> Result<Svg, ReportError> {
    let core = "cortex-m4f";
    let mut bars: Vec<(String, u64, bool)> = Vec::new();
    for format in [
        "f32",
        "f32, assembly",
        "f32-fma",
        "i16",
        "i16, assembly",
        "i8",
        "i8, assembly",
    ] {
        let best = ours(rows, core)
            .filter(|row| row.variant == format)
            .filter_map(instructions)
            .min();
        bars.extend(best.map(|count| (format!("policyc {format}"), count, true)));
    }
    for row in rows.iter().filter(|row| row.core == core) {
        let mark = if row.compiler == STATED { ", stated" } else { "" };
        let name = match row.variant.strip_prefix(PEER) {
            Some(name) => format!("{name}{mark}"),
            None if row.variant.starts_with("naive C") => row.variant.replace("naive C", "naive C f32"),
            None => continue,
        };
        bars.extend(instructions(row).map(|count| (name, count, false)));
    }
    bars.sort_by_key(|(_, count, _)| *count);
    let values = |is_ours: bool| -> Vec<f64> {
        let value = |(_, count, owner): &(String, u64, bool)| if *owner == is_ours { *count as f64 } else { f64::NAN };
        bars.iter().map(value).collect()
    };
    BarChart::new(
        "Instructions of one inference, 6-64-64-9, Cortex-M4F under QEMU",
        bars.iter().map(|(name, _, _)| name.clone()),
    )
    .panel(
        BarPanel::new(Axis::new("instructions").log())
            .bars("policyc", values(true))
            .bars("others", values(false)),
    )
    .dots()
    .svg()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn counted(variant: &str, compiler: &str, count: u64, flash: u64) -> Row {
        let network_flash = (!variant.starts_with(PEER)).then_some(flash);
        Row {
            policy: "bench".into(),
            variant: variant.into(),
            compiler: compiler.into(),
            q_values: Some((count, count)),
            flash: Some(flash),
            network_flash,
            ..blank("m")
        }
    }

    #[test]
    fn like_stands_beside_like() {
        let rows = [
            counted("f32", "gcc -O2", 500, 90),
            counted("f32", "gcc -O3", 495, 95),
            counted("f32, assembly", "gcc -O2", 300, 91),
            counted("f32-fma", "gcc -O2", 400, 92),
            counted("i8", "gcc -O2", 200, 30),
            counted(&format!("{PEER}exact f32"), "gcc -O2", 1000, 80),
            counted(&format!("{PEER}fused f32 contracted"), STATED, 800, 81),
            counted(&format!("{PEER}half s16"), STATED, 500, 25),
        ];
        let text = table(&rows);
        for line in [
            "| exact f32 | measured | binary32 | 1000 | 80 | f32 | 500 | 90 | 2.0 | 300 | 91 |",
            "| fused f32 contracted | stated | binary32, contracted | 800 | 81 | f32-fma | 400 | 92 | 2.0 |  |  |",
            "| half s16 | stated | w8, a16 | 500 | 25 | i8 | 200 | 30 | 2.5 |  |  |",
        ] {
            assert!(text.contains(line), "{text}");
        }
    }
}
