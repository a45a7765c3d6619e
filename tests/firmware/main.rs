//! The example firmware builds, runs, and holds no way to a panic.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod qemu;

// what the image of `firmware/qemu-m4` runs beside its controller
#[path = "../../firmware/qemu-m4/src/converter.rs"]
mod converter;
#[path = "../../firmware/qemu-m4/src/run.rs"]
mod run;

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Mutex, MutexGuard};

use tests::tools::{Ran, artifacts, cargo, copy_folder, run, run_silently};

/// One build at a time: both profiles and the copies share a target folder.
static CARGO: Mutex<()> = Mutex::new(());

fn turn() -> MutexGuard<'static, ()> {
    CARGO.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

fn firmware() -> PathBuf {
    tests::root().canonicalize().unwrap().join("firmware/no-std")
}

const NAME: &str = "firmware-no-std";

/// Where `cargo xtask test` builds it, too.
fn target_folder() -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join("../firmware/no-std")
}

/// The program of that name that cargo builds in this folder.
fn build(folder: &Path, name: &str, flags: &[&str]) -> PathBuf {
    let mut command = cargo();
    command
        .args(["build", "--message-format=json-render-diagnostics"])
        .args(flags)
        .current_dir(folder);
    let ran = run(command.env("CARGO_TARGET_DIR", target_folder()));
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let artifacts = artifacts(&ran.stdout);
    let own = artifacts.iter().find(|artifact| artifact.name == name).unwrap();
    PathBuf::from(&own.files[0])
}

/// Parts of symbol names that stand for what a firmware without panics, text and heap does not hold.
///
/// The names are mangled: a length comes before each part, so `3fmt` is the module `fmt` of any crate and no variable
/// `fmtx`. Allowed and present are the program's own functions, `core` functions that end (`memcpy` and the like) and
/// the start-up code of the C library, whose names are not mangled. The panic handler, which `no_std` demands, is
/// `rust_begin_unwind`; the linker drops it when nothing can reach it, so that it stands in this list as well.
const FORBIDDEN: &[&str] = &[
    "panic",
    "3fmt",
    "5alloc",
    "__rust_alloc",
    "__rust_dealloc",
    "__rdl_",
    "rust_begin_unwind",
    "rust_eh_personality",
    "unwrap_failed",
    "expect_failed",
    "slice_index_fail",
    "6unwind",
];

/// The forbidden symbols of a program; fails when the program has no symbol table to look at.
fn forbidden(program: &Path) -> Vec<String> {
    let symbols = run_silently(Command::new("nm").arg(program));
    assert!(
        symbols.lines().any(|line| line.ends_with(" T main")),
        "stripped?\n{symbols}"
    );
    let bad = |line: &&str| FORBIDDEN.iter().any(|part| line.contains(part));
    symbols.lines().filter(bad).map(str::to_owned).collect()
}

/// Ends with 124 when the program does not end: the panic handler of a firmware loops.
fn run_for_a_while(program: &Path) -> Ran {
    run(Command::new("timeout").arg("30").arg(program))
}

#[test]
fn the_release_build_runs_and_its_elf_holds_no_panic_text_or_heap() {
    let _turn = turn();
    let program = build(&firmware(), NAME, &["--release"]);
    let ran = run_for_a_while(&program);
    assert_eq!(
        ran.code,
        Some(0),
        "1: self-test or integrity, 2: the controller does not control, 124: the panic handler loops"
    );
    assert_eq!(forbidden(&program), [""; 0]);
}

#[test]
fn the_debug_build_runs() {
    let _turn = turn();
    let ran = run_for_a_while(&build(&firmware(), NAME, &[]));
    assert_eq!(
        ran.code,
        Some(0),
        "1: self-test or integrity, 2: the controller does not control, 124: the panic handler loops"
    );
}

/// A copy of the firmware with one text of a source replaced, under a name of its own: for cargo, crates of one name in
/// two folders are one in a shared target folder, and it would take the program of the other for up to date.
fn copy(name: &str, old: &str, new: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    copy_folder(&firmware(), folder.path());
    let edit = |file: &str, old: &str, new: &str| {
        let path = folder.path().join(file);
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.contains(old), "{old}");
        std::fs::write(path, text.replacen(old, new, 1)).unwrap();
    };
    let policy_macro = tests::root().canonicalize().unwrap().join("policy-macro");
    edit("Cargo.toml", "\"../../policy-macro\"", &format!("{policy_macro:?}"));
    edit(
        "Cargo.toml",
        &format!("name = \"{NAME}\""),
        &format!("name = \"{name}\""),
    );
    edit("src/control.rs", old, new);
    folder
}

/// The measurement itself: an index that nothing bounds must turn it red.
#[test]
fn a_planted_index_is_seen_in_the_elf() {
    let _turn = turn();
    let planted = "
static STEPS: [u16; 5] = [1, 3, 5, 7, 9];
#[inline(never)]
fn planted(ticks: u16) -> u16 {
    STEPS[usize::from(ticks) % 6]
}

/// One control period";
    let folder = copy("firmware-planted", "\n/// One control period", planted);
    let path = folder.path().join("src/control.rs");
    let text = std::fs::read_to_string(&path).unwrap();
    let call = "(command.duty * f32::from(PERIOD_TICKS)) as u16";
    assert!(text.contains(call));
    std::fs::write(
        &path,
        text.replace(call, &format!("({call}).wrapping_add(planted({call}) / 10)")),
    )
    .unwrap();
    let found = forbidden(&build(folder.path(), "firmware-planted", &["--release"]));
    assert!(found.iter().any(|symbol| symbol.contains("panic")), "{found:?}");
}

/// Exit code 0 means something: a firmware that finds its tables damaged says so.
#[test]
fn a_failed_start_up_check_ends_with_1() {
    let _turn = turn();
    let check = "Controller::self_test().is_ok() && Controller::integrity()";
    let folder = copy(
        "firmware-damaged",
        check,
        &check.replace("Controller::integrity", "!Controller::integrity"),
    );
    let program = build(folder.path(), "firmware-damaged", &["--release"]);
    assert_eq!(run_for_a_while(&program).code, Some(1));
}
