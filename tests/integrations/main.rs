//! The integrations: what `compile --emit` puts beside the cores is built and run here, as far as that goes without the tools it is
//! made for. Each check has a planted fault beside it.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod boards;
mod c2000;
mod fmu;
mod kit;
mod kit_defects;
mod kit_edits;
mod kit_equal;
mod rust;
mod sfunction;

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use codegen::Output;
use policy::Policy;
use tests::tools::{Ran, run};

fn golden_case(name: &str) -> Policy {
    let path = tests::root().join("tests/golden/cases").join(name).join("policy.toml");
    policy::load(&path).unwrap_or_else(|faults| panic!("{faults}"))
}

/// Three legs in the place of the one duty of that golden case.
fn legs(case: &str) -> Policy {
    let folder = tests::random::several::legs(case).unwrap();
    policy::load_with(&folder.path(), &tests::random::several::options()).unwrap_or_else(|faults| panic!("{faults}"))
}

fn example() -> Policy {
    policy::load(&tests::example()).unwrap_or_else(|faults| panic!("{faults}"))
}

/// The files of an output and its core, as `policyc compile` writes them.
fn files(policy: &Policy, output: Output, kit_steps: u32) -> BTreeMap<String, String> {
    let expected = verify::kit::expected(policy, targets::host(), &[output], kit_steps).unwrap();
    let generated = codegen::generate(policy, targets::host(), &[output], expected.as_ref());
    generated.unwrap().files
}

fn write(files: &BTreeMap<String, String>, folder: &Path) {
    for (name, text) in files {
        let path = folder.join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    }
}

/// Builds a program in the folder; nothing may be said about it.
fn build(compiler: &[&str], sources: &[&str], folder: &Path) -> Ran {
    let mut command = Command::new(compiler[0]);
    command.args(&compiler[1..]).args(sources).args(["-o", "program"]);
    run(command.current_dir(folder))
}

#[track_caller]
fn build_silently(compiler: &[&str], sources: &[&str], folder: &Path) {
    let built = build(compiler, sources, folder);
    assert!(
        built.code == Some(0) && built.stderr.is_empty(),
        "{compiler:?}\n{}",
        built.stderr
    );
}

/// Runs the program that was built, under an emulator if one is given.
fn run_program(emulator: Option<&str>, folder: &Path) -> Ran {
    let program = folder.join("program");
    match emulator {
        Some(emulator) => run(Command::new(emulator).arg(program)),
        None => run(&mut Command::new(program)),
    }
}
