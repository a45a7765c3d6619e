//! Generated code says of itself that it computes the known answers, which are those of the interpreter (`answers`): built by the
//! compilers of this machine without optimisation.
#![allow(clippy::unwrap_used, clippy::disallowed_methods)]

mod common;
use std::path::Path;
use std::process::Command;

use codegen::Output;
use common::*;
use policy::{NumericFormat, Policy};

#[track_caller]
fn succeeds(command: &mut Command, what: &str) {
    let output = command.output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{what}: {command:?}\n{said}");
}

fn written(policy: &Policy, (output, name): (Output, &str), folder: &Path) {
    let files = codegen::sources(policy, target(name), &[output], None).unwrap();
    for (name, text) in files.files {
        std::fs::write(folder.join(name), text).unwrap();
    }
}

/// Both checks, as a program that ends with 0 if they hold.
#[track_caller]
fn assert_c(policy: &Policy, name: &str) {
    let folder = tempfile::tempdir().unwrap();
    written(policy, (Output::C, name), folder.path());
    let n = &policy.name;
    let main = format!(
        "#include \"{n}.h\"\nint main(void) {{ return ({n}_self_test() == 0u) && ({n}_integrity() == 1u) ? 0 : 1; }}\n"
    );
    std::fs::write(folder.path().join("main.c"), main).unwrap();
    let what = format!("{n} {:?} {name}", policy.numeric_format);
    let source = format!("{n}.c");
    let mut build = Command::new("gcc");
    build.args([
        "-std=c99",
        "-O0",
        "-ffp-contract=off",
        "main.c",
        &source,
        "-lm",
        "-o",
        "checks",
    ]);
    succeeds(build.current_dir(folder.path()), &what);
    succeeds(&mut Command::new(folder.path().join("checks")), &what);
}

#[track_caller]
fn assert_rust(policy: &Policy, name: &str) {
    let folder = tempfile::tempdir().unwrap();
    written(policy, (Output::Rust, name), folder.path());
    let n = &policy.name;
    let main = format!(
        "mod {n};\nfn main() {{ assert!({n}::Controller::self_test().is_ok() && {n}::Controller::integrity()); }}\n"
    );
    std::fs::write(folder.path().join("main.rs"), main).unwrap();
    let what = format!("{n} {:?} {name}", policy.numeric_format);
    let mut build = Command::new("rustc");
    build.args(["--edition", "2021", "-A", "warnings", "main.rs", "-o", "checks"]);
    succeeds(build.current_dir(folder.path()), &what);
    succeeds(&mut Command::new(folder.path().join("checks")), &what);
}

fn in_formats(name: &str) -> impl Iterator<Item = Policy> {
    let policy = case(name);
    NumericFormat::ALL
        .into_iter()
        .map(move |format| policy.clone().with_format(format))
}

/// Every activation in every format, in layers that are not the last two as in these.
#[test]
fn c_of_every_activation_passes_its_self_test() {
    in_formats("activations").for_each(|policy| assert_c(&policy, "host"));
    in_formats("constructs").for_each(|policy| assert_c(&policy, "host"));
}

/// Blocks with a rest, streamed last layers, one layer alone.
#[test]
fn c_of_every_kind_of_loop_passes_its_self_test() {
    for name in ["tail_blocks", "residual", "linear"] {
        in_formats(name).for_each(|policy| assert_c(&policy, "host"));
    }
}

#[test]
fn rust_of_every_activation_passes_its_self_test() {
    in_formats("activations").for_each(|policy| assert_rust(&policy, "host"));
}

#[test]
fn rust_of_every_kind_of_loop_passes_its_self_test() {
    for name in ["tail_blocks", "constructs"] {
        in_formats(name).for_each(|policy| assert_rust(&policy, "host"));
    }
}

/// What a processor without an FPU computes in integers around the network is the same on this machine.
#[test]
fn code_for_a_processor_without_an_fpu_passes_its_self_test() {
    for name in ["residual", "tail_blocks"] {
        for format in [NumericFormat::F32, NumericFormat::I16, NumericFormat::I8] {
            let policy = case(name).with_format(format);
            assert_c(&policy, "riscv32imc");
            assert_rust(&policy, "riscv32imc");
        }
    }
}
