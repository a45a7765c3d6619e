//! Programs that tests run. A test has no better answer to a missing tool than to fail, so these functions panic.
#![allow(clippy::panic, clippy::expect_used)]

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use serde_json::Value;

use crate::root;

/// How a program ended and what it said.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Ran {
    /// Exit code; `None` if a signal ended it.
    pub code: Option<i32>,
    /// Standard output.
    pub stdout: String,
    /// Standard error.
    pub stderr: String,
}

/// Runs a program to its end.
///
/// # Panics
/// If it cannot be started.
#[track_caller]
pub fn run(command: &mut Command) -> Ran {
    let shown = format!("{command:?}");
    match command.env("LC_ALL", "C").output() {
        Ok(output) => Ran {
            code: output.status.code(),
            stdout: String::from_utf8_lossy(&output.stdout).into_owned(),
            stderr: String::from_utf8_lossy(&output.stderr).into_owned(),
        },
        Err(error) => panic!("cannot start {shown}: {error} (`cargo xtask setup` installs the tools)"),
    }
}

/// Runs a program that must succeed and have nothing to say on standard error; returns its standard output.
///
/// # Panics
/// If it does not.
#[track_caller]
pub fn run_silently(command: &mut Command) -> String {
    let ran = run(command);
    assert!(
        ran.code == Some(0) && ran.stderr.is_empty(),
        "{command:?}: exit code {:?}\n{}",
        ran.code,
        ran.stderr
    );
    ran.stdout
}

/// The cargo that builds these tests, in the root of the workspace.
#[must_use]
pub fn cargo() -> Command {
    let mut command = Command::new(env!("CARGO"));
    command.current_dir(root()).env("CARGO_TERM_COLOR", "never");
    command
}

/// The compiler that cargo uses.
#[must_use]
pub fn rustc() -> Command {
    Command::new(std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into()))
}

/// The Python of `cargo xtask setup`, with the packages that tests need; `tmp` is `env!("CARGO_TARGET_TMPDIR")`.
#[must_use]
pub fn python(tmp: &str) -> Command {
    let folder = Path::new(tmp).with_file_name("python").join("bin");
    let path = std::env::var("PATH").unwrap_or_default();
    let mut command = Command::new(folder.join("python3"));
    // programs that packages bring along, FMPy's cmake
    command.env("PATH", format!("{}:{path}", folder.display()));
    command
}

/// Whether the test command says that this Python package cannot be had here: tests that need it are left out, and the
/// command's last lines name it.
#[must_use]
pub fn is_without(package: &str) -> bool {
    let is_left_out = std::env::var("POLICYC_WITHOUT_PYTHON_PACKAGES")
        .is_ok_and(|names| names.split(',').any(|name| name == package));
    if is_left_out {
        eprintln!("{package} cannot be had here: NOT tested");
    }
    is_left_out
}

/// Whether expected files are rewritten instead of compared.
#[must_use]
pub fn bless() -> bool {
    std::env::var_os("POLICYC_BLESS").is_some_and(|value| value == "1")
}

/// The program `policyc`, built once per test program; with the features of the whole workspace, since those of the package
/// alone would build all it needs a second time.
pub fn policyc() -> &'static Path {
    static PROGRAM: OnceLock<PathBuf> = OnceLock::new();
    PROGRAM.get_or_init(|| built(&["build", "--workspace", "--bin", "policyc"], "policyc", ""))
}

/// The library of the crate `policy-macro` as rustc loads it, built once per test program.
pub fn macro_library() -> &'static Path {
    static LIBRARY: OnceLock<PathBuf> = OnceLock::new();
    let extension = std::env::consts::DLL_SUFFIX;
    LIBRARY.get_or_init(|| built(&["build", "--workspace", "--lib"], "policy_macro", extension))
}

fn built(arguments: &[&str], target: &str, ending: &str) -> PathBuf {
    let ran = run(cargo().args(arguments).arg("--message-format=json"));
    assert_eq!(ran.code, Some(0), "cargo {arguments:?}\n{}", ran.stderr);
    let artifact = artifacts(&ran.stdout)
        .into_iter()
        .find(|artifact| artifact.name == target)
        .unwrap_or_else(|| panic!("cargo built no {target}"));
    let file = artifact.files.into_iter().find(|file| file.ends_with(ending));
    PathBuf::from(file.unwrap_or_else(|| panic!("{target} has no file *{ending}")))
}

/// What cargo has built or found up to date.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Artifact {
    /// Name of the cargo target.
    pub name: String,
    /// Nothing had to be done.
    pub fresh: bool,
    /// Built files; an executable comes first.
    pub files: Vec<String>,
}

/// Reads the output of `cargo build --message-format=json`.
#[must_use]
pub fn artifacts(messages: &str) -> Vec<Artifact> {
    let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
    messages
        .lines()
        .filter_map(|line| serde_json::from_str::<Value>(line).ok())
        .filter(|message| message["reason"] == "compiler-artifact")
        .map(|message| Artifact {
            name: text(&message["target"]["name"]),
            fresh: message["fresh"] == true,
            files: message["executable"]
                .as_str()
                .map(str::to_owned)
                .into_iter()
                .chain(message["filenames"].as_array().into_iter().flatten().map(text))
                .collect(),
        })
        .collect()
}

/// Names of the files in a folder, with those of its folders, sorted.
///
/// # Panics
/// If the folder cannot be read.
#[must_use]
pub fn listing(folder: &Path) -> Vec<String> {
    let mut names = Vec::new();
    for entry in std::fs::read_dir(folder).expect("a readable folder") {
        let path = entry.expect("a readable entry").path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if path.is_dir() && !path.is_symlink() {
            names.extend(listing(&path).into_iter().map(|inner| format!("{name}/{inner}")));
        }
        names.push(name);
    }
    names.sort();
    names
}

/// Copies the files of a folder into another, which is made.
///
/// # Panics
/// If that fails.
pub fn copy_folder(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).expect("a new folder");
    for entry in std::fs::read_dir(from).expect("a readable folder") {
        let path = entry.expect("a readable entry").path();
        let destination = to.join(path.file_name().unwrap_or_default());
        if path.is_dir() {
            copy_folder(&path, &destination);
        } else {
            std::fs::copy(&path, &destination).expect("a copied file");
        }
    }
}
