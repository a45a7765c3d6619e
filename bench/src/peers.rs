//! Other people's kernels on the same network, Cortex-M4F: built here as far as a registry has them, else by the figures
//! others stated. No package of theirs is a dependency of the workspace: they are built in a folder of their own.

mod built;

use std::fmt::Write;
use std::path::Path;

use policy::Policy;
use report::{Axis, BarChart, BarPanel, ReportError, Svg};
use targets::TargetSpec;

use crate::build::{Bench, blank};
use crate::table::Row;

/// Start of the variant of a peer's row.
pub const PEER: &str = "peer: ";
/// What stands for a compiler in the row of a figure that was not measured here.
pub const STATED: &str = "stated";

/// Name with numeric format, instructions of an inference, flash in bytes: arm-none-eabi-gcc 12.2 or rustc, the same network and
/// emulator, measured by others.
const OTHERS: [(&str, u64, u64); 8] = [
    ("burn-onnx f32", 230_297, 1_245_880),
    ("onnx2c f32", 26_670, 20_944),
    ("emx-onnx-cgen f32", 27_569, 20_952),
    ("TFLM f32", 29_439, 60_328),
    ("CMSIS-NN f32", 28_265, 21_528),
    ("RLtools f32 (other order of sums)", 14_442, 23_072),
    ("CMSIS-NN int8", 16_480, 9_592),
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

/// Whether a row computes in integers.
fn is_integer(row: &Row) -> bool {
    row.variant.contains("int8") || row.variant.starts_with('i')
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

/// Each peer beside our best row of the same kind (8-bit integers or binary32), as a Markdown table; empty without peers. Flash
/// is that of the network alone, as linked.
pub fn table(rows: &[Row]) -> String {
    let peers: Vec<&Row> = rows.iter().filter(|row| row.variant.starts_with(PEER)).collect();
    if peers.is_empty() {
        return String::new();
    }
    let mut text = String::from(
        "\n| peer | figures | instructions | flash B | ours | instructions | flash B | instructions / peer's | flash / peer's |\n\
         |---|---|---|---|---|---|---|---|---|\n",
    );
    for peer in peers {
        let format = if is_integer(peer) { "i8" } else { "f32" };
        let same: Vec<&Row> = ours(rows, &peer.core)
            .filter(|row| row.variant.split(',').next() == Some(format) && row.network_flash.is_some())
            .collect();
        // of the fastest ones, less than 2 % apart, the smallest
        let fewest = same
            .iter()
            .filter_map(|row| instructions(row))
            .min()
            .unwrap_or_default();
        let fast = same
            .iter()
            .filter(|row| instructions(row).is_some_and(|count| count <= fewest + fewest / 50));
        let Some(best) = fast.min_by_key(|row| row.network_flash) else {
            continue;
        };
        let ratio = |ours: Option<u64>, theirs: Option<u64>| match (ours, theirs) {
            (Some(ours), Some(theirs)) if ours > 0 => format!("1/{:.1}", theirs as f64 / ours as f64),
            _ => String::new(),
        };
        let number = |value: Option<u64>| value.map(|value| value.to_string()).unwrap_or_default();
        // writing to a String cannot fail
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {}, {} | {} | {} | {} | {} |",
            peer.variant.trim_start_matches(PEER),
            if peer.compiler == STATED { "stated" } else { "measured" },
            number(instructions(peer)),
            number(peer.flash),
            best.variant,
            best.compiler,
            number(instructions(best)),
            number(best.network_flash),
            ratio(instructions(best), instructions(peer)),
            ratio(best.network_flash, peer.flash),
        );
    }
    text
}

/// Instructions of an inference, ours and the peers', fewest first.
///
/// # Errors
/// If there is nothing to draw.
pub fn picture(rows: &[Row]) -> Result<Svg, ReportError> {
    let core = "cortex-m4f";
    let mut bars: Vec<(String, u64, bool)> = Vec::new();
    for format in ["f32", "f32, assembly", "i16", "i16, assembly", "i8", "i8, assembly"] {
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
            None if row.variant == "naive C" => "naive C f32".to_owned(),
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
