//! Other people's kernels on the same network, Cortex-M4F: built here as far as a registry has them, else by the figures
//! others stated. No package of theirs is a dependency of the workspace: they are built in a folder of their own.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

use policy::Policy;
use report::{Axis, BarChart, BarPanel, ReportError, Svg};
use targets::{RustTarget, TargetSpec};

use crate::build::{Bench, Failure, blank, run};
use crate::sources;
use crate::table::Row;

/// Start of the variant of a peer's row.
pub const PEER: &str = "peer: ";
/// What stands for a compiler in the row of a figure that was not measured here.
pub const STATED: &str = "stated";

/// Python packages that write the network for the peers.
const PACKAGES: [&str; 4] = [
    "emlearn==0.23.2",
    "flatbuffers==25.12.19",
    "numpy==2.4.6",
    "tflite==2.18.0",
];

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

/// All peers; a peer that cannot be built here is said on standard error.
pub fn rows(bench: &Bench, policy: &Policy, target: &TargetSpec, root: &Path) -> Vec<Row> {
    let mut rows: Vec<Row> = Vec::new();
    match built(bench, policy, target, root) {
        Ok(found) => rows.extend(found),
        Err(failure) => eprintln!("note: MicroFlow and emlearn are not measured: {failure}"),
    }
    rows.extend(OTHERS.map(|(name, instructions, flash)| Row {
        compiler: STATED.to_owned(),
        q_values: Some((instructions, instructions)),
        flash: Some(flash),
        ..row(name, target)
    }));
    rows
}

fn row(name: &str, target: &TargetSpec) -> Row {
    Row {
        policy: "bench".to_owned(),
        variant: format!("{PEER}{name}"),
        ..blank(target.name)
    }
}

fn built(bench: &Bench, policy: &Policy, target: &TargetSpec, root: &Path) -> Result<Vec<Row>, Failure> {
    let (Some(gcc), Some(rust)) = (target.c_compilers.first(), target.rust) else {
        return Err(Failure(format!("{} has no compilers", target.name)));
    };
    let folder = folder()?;
    let python = environment(&folder)?;
    run(Command::new(&python)
        .arg(root.join("bench/peers/models.py"))
        .arg(root.join("bench/policy/weights.safetensors"))
        .arg(&folder))?;
    bench.put_naive(policy)?;
    bench.put("main.c", &sources::naive_main(policy))?;
    // what board and counting take is not the network's
    bench.put(
        "null.c",
        "void naive_q_values(const float *o, float *q) { (void)o; q[0] = 0.0f; }\n",
    )?;
    bench.object(gcc, "-O2", "null.c", &[])?;
    bench.counted(target, &["unit.o"], &["main.c"])?;
    let board = bench.linked_flash(target)?;

    let microflow = micro_flow(&folder, policy, rust)?;
    let mut micro_flow = bench.counted(target, &[&microflow], &["main.c"])?;
    micro_flow.flash = Some(bench.linked_flash(target)?.saturating_sub(board));
    let headers = python_headers(&python)?;
    bench.put("emlearn.c", &emlearn(&folder.join("emlearn.h"), policy))?;
    let include = format!("-I{headers}");
    bench.object(gcc, "-O2", "emlearn.c", &["-ffunction-sections", &include])?;
    let mut emlearn = bench.counted(target, &["unit.o", "-lm", "-lc"], &["main.c"])?;
    emlearn.flash = Some(bench.linked_flash(target)?.saturating_sub(board));
    let named = |found: Row, name: &str, compiler: &str| Row {
        compiler: compiler.to_owned(),
        step: None,
        policy: "bench".to_owned(),
        variant: format!("{PEER}{name}"),
        ..found
    };
    Ok(vec![
        named(micro_flow, "MicroFlow 0.1.3 int8", "rustc -O3, LTO"),
        named(emlearn, "emlearn 0.23.2 f32", "gcc -O2"),
    ])
}

/// Beside the programs of the workspace.
fn folder() -> Result<PathBuf, Failure> {
    let program = std::env::current_exe().map_err(|error| Failure(error.to_string()))?;
    let folder = program.ancestors().nth(2).unwrap_or(Path::new(".")).join("peers");
    std::fs::create_dir_all(folder.join("microflow/src")).map_err(|error| Failure(error.to_string()))?;
    Ok(folder)
}

/// A virtual environment with [`PACKAGES`]; returns its Python.
fn environment(folder: &Path) -> Result<PathBuf, Failure> {
    let environment = folder.join("python");
    let python = environment.join("bin/python");
    if !python.exists() {
        run(Command::new("python3").args(["-m", "venv"]).arg(&environment))?;
    }
    let pip = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check"];
    run(Command::new(&python).args(pip).args(PACKAGES))?;
    Ok(python)
}

/// Folder of emlearn's C headers.
fn python_headers(python: &Path) -> Result<String, Failure> {
    let code = "import emlearn, os; print(os.path.dirname(emlearn.__file__))";
    let text = run(Command::new(python).args(["-c", code]))?;
    Ok(String::from_utf8_lossy(&text).trim().to_owned())
}

fn emlearn(generated: &Path, policy: &Policy) -> String {
    format!(
        "#include \"{}\"\nvoid naive_q_values(const float *o, float *q)\n{{\n    (void)network_regress(o, {}, q, {});\n}}\n",
        generated.display(),
        policy.features.len(),
        policy.actions.len()
    )
}

/// Builds MicroFlow around the network; returns the library.
fn micro_flow(folder: &Path, policy: &Policy, rust: RustTarget) -> Result<String, Failure> {
    let package = folder.join("microflow");
    let put = |name: &str, text: &str| {
        std::fs::write(package.join(name), text).map_err(|error| Failure(format!("{name}: {error}")))
    };
    put("Cargo.toml", MICROFLOW_PACKAGE)?;
    let (features, actions) = (policy.features.len(), policy.actions.len());
    put(
        "src/lib.rs",
        &format!(
            r#"#![no_std]
use microflow::buffer::Buffer2D;
use microflow::model;
#[model("{}")]
struct Network;
extern "C" {{
    fn board_exit(code: i32);
}}
#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {{
    unsafe {{ board_exit(9) }}
    loop {{}}
}}
#[no_mangle]
pub unsafe extern "C" fn naive_q_values(o: *const [f32; {features}], q: *mut [f32; {actions}]) {{
    let o = &*o;
    let y = Network::predict(Buffer2D::from_fn(|_, i| o[i]));
    *q = core::array::from_fn(|n| y[n]);
}}
"#,
            folder.join("network.tflite").display()
        ),
    )?;
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let target = folder.join("target");
    run(Command::new(cargo)
        .current_dir(&package)
        .args(["build", "--quiet", "--release", "--target", rust.triple])
        .env("RUSTFLAGS", rust.machine_flags.join(" "))
        .env("CARGO_TARGET_DIR", &target))?;
    let library = target.join(rust.triple).join("release/libpeer.a");
    Ok(library.display().to_string())
}

/// Not a member of the workspace.
const MICROFLOW_PACKAGE: &str = r#"[package]
name = "peer"
version = "0.0.0"
edition = "2021"
[workspace]
[lib]
crate-type = ["staticlib"]
[dependencies]
microflow = "=0.1.3"
nalgebra = { version = "=0.32.6", default-features = false, features = ["macros"] }
[profile.release]
opt-level = 3
lto = true
panic = "abort"
codegen-units = 1
"#;

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
