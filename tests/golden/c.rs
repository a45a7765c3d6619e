//! Every C file of the golden cases and of the example, built as each dialect that the backend promises.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use codegen::Output;
use targets::{RowBlock, TargetSpec};
use tests::fixture::generate;
use tests::tools::{run, run_silently};

use super::{Case, cases, host};

const STRICT: &[&str] = &[
    "-pedantic",
    "-Wall",
    "-Wextra",
    "-Wconversion",
    "-Wdouble-promotion",
    "-Wfloat-equal",
    "-Wshadow",
    "-Werror",
];
const CXX_STRICT: &[&str] = &["-pedantic", "-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Werror"];

/// Writes the files and returns the name of the C source among them.
fn write(files: &BTreeMap<String, String>, folder: &Path) -> String {
    for (name, text) in files {
        std::fs::write(folder.join(name), text).unwrap();
    }
    files.keys().find(|name| name.ends_with(".c")).unwrap().clone()
}

fn union_flag(case: &Case) -> String {
    format!("-D{}_UNION", case.policy.name.to_uppercase())
}

/// Builds an object; the compiler must not have anything to say.
fn object(compiler: &str, flags: &[&str], source: &str, folder: &Path) {
    let mut command = Command::new(compiler);
    command
        .args(flags)
        .args(["-c", source, "-o", "code.o"])
        .current_dir(folder);
    run_silently(&mut command);
}

/// Symbols that the object wants from elsewhere.
fn undefined(folder: &Path) -> String {
    run_silently(Command::new("nm").args(["-u", "code.o"]).current_dir(folder))
}

/// Access to the bits of a float, as the backend offers it.
#[derive(Clone, Copy, PartialEq)]
enum Bits {
    Default,
    DefaultAndUnion,
}

/// Builds with each set of flags and looks for calls out of the file.
fn builds(compiler: &str, sets: &[&[&str]], bits: Bits) {
    for case in cases() {
        let folder = tempfile::tempdir().unwrap();
        let source = write(&case.files, folder.path());
        let union = union_flag(case);
        for set in sets {
            let by_union = Some(union.as_str()).filter(|_| bits == Bits::DefaultAndUnion);
            for by_union in std::iter::once(None).chain(by_union.map(Some)) {
                let flags: Vec<&str> = set.iter().copied().chain(by_union).collect();
                object(compiler, &flags, &source, folder.path());
                let calls = undefined(folder.path());
                assert!(calls.is_empty(), "{}: {compiler} {flags:?} calls\n{calls}", case.name);
            }
        }
    }
}

fn strict(compiler: &str) {
    let levels = ["-O0", "-O2"];
    let sets: Vec<Vec<&str>> = levels
        .iter()
        .map(|level| [&["-std=c99", level], STRICT].concat())
        .chain([[&["-std=c90", "-O2"], STRICT].concat()])
        .collect();
    let sets: Vec<&[&str]> = sets.iter().map(Vec::as_slice).collect();
    builds(compiler, &sets, Bits::DefaultAndUnion);
}

#[test]
fn gcc_takes_the_code_as_c99_and_c90_without_a_warning() {
    strict("gcc");
}

#[test]
fn clang_takes_the_code_as_c99_and_c90_without_a_warning() {
    strict("clang");
}

fn cxx(compiler: &str) {
    let sets = ["-std=c++98", "-std=c++17"].map(|dialect| [&["-x", "c++", dialect, "-O2"], CXX_STRICT].concat());
    builds(compiler, &[&sets[0], &sets[1]], Bits::DefaultAndUnion);
}

#[test]
fn gxx_takes_the_code_as_cxx98_and_cxx17_without_a_warning() {
    cxx("g++");
}

#[test]
fn clangxx_takes_the_code_as_cxx98_and_cxx17_without_a_warning() {
    cxx("clang++");
}

const FREESTANDING: &[&[&str]] = &[
    &["-std=c99", "-O3"],
    &["-std=c99", "-Os"],
    &["-std=c99", "-O0", "-ffreestanding"],
    &["-std=c99", "-O2", "-ffreestanding"],
    &["-std=c99", "-O3", "-ffreestanding"],
    &["-std=c99", "-Os", "-ffreestanding"],
];

#[test]
fn the_objects_of_gcc_call_nothing_outside_at_any_level() {
    builds("gcc", FREESTANDING, Bits::Default);
}

#[test]
fn the_objects_of_clang_call_nothing_outside_at_any_level() {
    builds("clang", FREESTANDING, Bits::Default);
}

/// The other shape that a layer can have in C; no target at hand takes it yet.
#[test]
fn the_block_form_of_a_layer_is_clean_and_computes_the_same_bits() {
    let block_form = TargetSpec {
        c_row_block: RowBlock::Rows(16),
        ..host().clone()
    };
    let case = cases().iter().find(|case| case.name == "tail_blocks").unwrap();
    let files = generate(&case.policy, &block_form, &[Output::C]).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let source = write(&files, folder.path());
    assert_ne!(files[&source], case.files[&source]);
    for compiler in ["gcc", "clang"] {
        for level in ["-O0", "-O2", "-O3"] {
            let flags = [&["-std=c99", level], STRICT].concat();
            object(compiler, &flags, &source, folder.path());
            assert_eq!(undefined(folder.path()), "", "{compiler} {level}");
        }
    }
    let report = verify::run(
        &case.policy,
        verify::Options {
            steps: 2000,
            generated: Some(&files),
            compilers: vec!["gcc".to_owned(), "clang".to_owned()],
            ..verify::Options::default()
        },
    )
    .unwrap();
    assert!(report.passed(), "{report:?}");
    assert!(report.builds.iter().all(|build| build.steps_compared == 2000));
}

/// The guards are part of the contract: flags that change the arithmetic stop the build.
#[test]
fn flags_that_change_the_arithmetic_are_refused() {
    let case = &cases()[0];
    let folder = tempfile::tempdir().unwrap();
    let source = write(&case.files, folder.path());
    let whole = ["-ffast-math", "-Ofast", "-ffinite-math-only"];
    // clang says nothing of these in its macros
    let parts = ["-freciprocal-math", "-fno-signed-zeros", "-funsafe-math-optimizations"];
    let builds = ["gcc", "clang"]
        .iter()
        .flat_map(|compiler| whole.map(|flag| (*compiler, flag)));
    for (compiler, flag) in builds.chain(parts.map(|flag| ("gcc", flag))) {
        let mut command = Command::new(compiler);
        command.args(["-O2", flag, "-c", &source, "-o", "code.o"]);
        let ran = run(command.current_dir(folder.path()));
        assert_ne!(ran.code, Some(0), "{compiler} {flag}");
        let reason = format!("\"{}: ", case.policy.name);
        let refusal = ran
            .stderr
            .lines()
            .find(|line| line.contains("error") && line.contains(&reason));
        assert!(refusal.is_some(), "{compiler} {flag}: {}", ran.stderr);
    }
}

/// The measurement itself: a planted call of the C library and a planted warning must be found.
#[test]
fn a_call_and_a_warning_are_seen() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(
        folder.path().join("x.c"),
        "float sinf(float);\nfloat x(float a) { return sinf(a); }\n",
    )
    .unwrap();
    object("gcc", &["-O2"], "x.c", folder.path());
    assert!(undefined(folder.path()).contains("sinf"));
    let mut command = Command::new("gcc");
    std::fs::write(folder.path().join("y.c"), "float y(int a) { return a; }\n").unwrap();
    let ran = run(command.args(STRICT).args(["-c", "y.c"]).current_dir(folder.path()));
    assert!(ran.code == Some(1) && ran.stderr.contains("-Werror"), "{ran:?}");
}
