//! The driver finds what is planted: a panic, a loop, slowness, memory, a stack that overflows. And it repeats itself.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::path::Path;
use std::process::{Command, Output};

fn fuzz(arguments: &[&str], out: &Path) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_fuzz"));
    command.args(arguments).arg("--out").arg(out).output().unwrap()
}

/// Runs a target with a planted fault; returns what was said and the input that was kept.
fn found(target: &str, executions: &str) -> (String, Vec<u8>) {
    let folder = tempfile::tempdir().unwrap();
    let output = fuzz(
        &["--target", target, "--executions", executions, "--seed", "1"],
        folder.path(),
    );
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert_eq!(output.status.code(), Some(1), "{said}");
    let files = std::fs::read_dir(folder.path().join(target)).unwrap().flatten();
    let input = files
        .map(|file| file.path())
        .find(|path| path.extension().is_none())
        .unwrap();
    (said, std::fs::read(input).unwrap())
}

#[test]
fn a_planted_panic_is_found_and_made_short() {
    let (said, input) = found("planted-panic", "20000");
    assert!(
        said.contains("panic at") && said.contains("the planted panic"),
        "{said}"
    );
    assert_eq!(input, b"needle");
}

#[test]
fn planted_slowness_is_found() {
    // few: each that is slow takes a third of a second
    let (said, input) = found("planted-slowness", "60");
    assert!(said.contains("slow: 0."), "{said}");
    assert_eq!(input, b"needle");
}

#[test]
fn planted_memory_is_found() {
    let (said, input) = found("planted-allocation", "20000");
    assert!(said.contains("memory: 8 MiB"), "{said}");
    assert_eq!(input, b"needle");
}

#[test]
fn a_planted_loop_ends_its_process_and_leaves_its_input() {
    let (said, input) = found("planted-loop", "20000");
    assert!(said.contains("hang: no answer within"), "{said}");
    assert!(input.windows(6).any(|window| window == b"needle"));
}

#[test]
fn a_stack_that_overflows_leaves_its_input() {
    let (said, input) = found("planted-recursion", "20000");
    assert!(said.contains("death of the process"), "{said}");
    assert!(input.windows(6).any(|window| window == b"needle"));
}

#[test]
fn a_finding_is_replayed() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("input");
    for (input, code) in [("needle", 1), ("hay", 0)] {
        std::fs::write(&file, input).unwrap();
        let path = file.to_str().unwrap();
        let output = fuzz(&["--target", "planted-panic", "--replay", path], folder.path());
        assert_eq!(output.status.code(), Some(code));
    }
}

#[test]
fn an_unknown_target_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let output = fuzz(&["--target", "nothing"], folder.path());
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("--list"));
}

#[test]
fn equal_seeds_give_equal_inputs() {
    let folder = tempfile::tempdir().unwrap();
    let figures = || {
        let output = fuzz(
            &["--target", "manifest", "--executions", "3000", "--seed", "5"],
            folder.path(),
        );
        let said = String::from_utf8_lossy(&output.stdout).into_owned();
        let row = said
            .lines()
            .find(|line| line.starts_with("| manifest"))
            .unwrap()
            .to_owned();
        // without the rate
        row.split('|')
            .enumerate()
            .filter(|(column, _)| *column != 3)
            .map(|(_, cell)| cell.to_owned())
            .collect::<Vec<_>>()
    };
    assert_eq!(figures(), figures());
}
