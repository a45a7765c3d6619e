//! Debian's Rust, for a target that the toolchain on `PATH` has no library for: it comes with the sources of `core`, which its
//! cargo builds for any target.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;
use std::time::Duration;

use super::run::run_for;

/// Where Debian puts the compiler.
pub(super) const RUSTC: &str = "/usr/bin/rustc";
const CARGO: &str = "/usr/bin/cargo";
/// The switch that lets cargo build `core`, unstable in upstream's eyes.
pub const BUILD_CORE: &str = "-Zbuild-std=core";
/// Building `core` takes half a minute.
// twenty times that, for machines under load
const TIMEOUT: Duration = Duration::from_secs(600);

/// Debian's cargo, set up for [`BUILD_CORE`]; `None` if it, the compiler or the sources of `core` are not installed
/// (packages `rustc-web`, `cargo-web`, `rust-web-src`; from Debian 13 on also `rustc`, `cargo`, `rust-src`).
#[must_use]
pub fn cargo() -> Option<Command> {
    let mut sysroot = Command::new(RUSTC);
    sysroot.args(["--print", "sysroot"]);
    // here, and wherever a program only says what it is: a fraction of a second, and 20 s for machines under load
    let output = run_for(&mut sysroot, Duration::from_secs(20)).ok()?;
    let sysroot = PathBuf::from(String::from_utf8_lossy(&output.stdout).trim());
    let core = sysroot.join("lib/rustlib/src/rust/library/core");
    if !core.is_dir() || !Path::new(CARGO).is_file() {
        return None;
    }
    let mut cargo = Command::new(CARGO);
    // what the cargo or the rustup that started this program has set is about another toolchain
    for (name, _) in std::env::vars_os() {
        let name = name.to_string_lossy().into_owned();
        if name.starts_with("CARGO") && name != "CARGO_HOME" || name.starts_with("RUST") {
            cargo.env_remove(name);
        }
    }
    // -Zbuild-std is unstable: a stable compiler takes it only so
    cargo.env("RUSTC", RUSTC).env("RUSTC_BOOTSTRAP", "1");
    Some(cargo)
}

/// A folder for `rustc --sysroot` with `core` for that target; built at its first use and kept in the user's cache.
///
/// # Errors
/// Cargo's text, or the system's.
pub(super) fn sysroot(triple: &str) -> Result<PathBuf, String> {
    static TURN: Mutex<()> = Mutex::new(());
    // one at a time: builds are compiled side by side, and two would make the same library
    let _turn = TURN.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    // kept across runs: building takes half a minute, and asks crates.io for what `core` depends on
    let folder = cache()?.join(version()?).join(triple);
    let library = PathBuf::from("lib/rustlib").join(triple).join("lib");
    if folder.join(&library).is_dir() {
        return Ok(folder);
    }
    let failed = |error: std::io::Error| format!("cannot build core for {triple}: {error}");
    let parent = folder.parent().unwrap_or(&folder);
    std::fs::create_dir_all(parent).map_err(failed)?;
    // beside its place, so that one rename makes it appear as a whole
    let work = tempfile::tempdir_in(parent).map_err(failed)?;
    build(triple, work.path())?;
    let sysroot = work.path().join("sysroot");
    std::fs::create_dir_all(sysroot.join(&library)).map_err(failed)?;
    let built = work.path().join("target").join(triple).join("release/deps");
    for entry in std::fs::read_dir(&built).map_err(failed)?.flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        if name.ends_with(".rlib") && (name.starts_with("libcore-") || name.starts_with("libcompiler_builtins-")) {
            std::fs::copy(entry.path(), sysroot.join(&library).join(&*name)).map_err(failed)?;
        }
    }
    match std::fs::rename(&sysroot, &folder) {
        // another process may have been faster
        Err(error) if !folder.join(&library).is_dir() => Err(failed(error)),
        _ => Ok(folder),
    }
}

/// An empty crate, for which cargo builds `core` first.
fn build(triple: &str, folder: &Path) -> Result<(), String> {
    let failed = |error: std::io::Error| format!("cannot build core for {triple}: {error}");
    let manifest =
        "[package]\nname = \"empty\"\nedition = \"2021\"\n[workspace]\n[profile.release]\npanic = \"abort\"\n";
    std::fs::create_dir(folder.join("src")).map_err(failed)?;
    std::fs::write(folder.join("Cargo.toml"), manifest).map_err(failed)?;
    std::fs::write(folder.join("src/lib.rs"), "#![no_std]\n").map_err(failed)?;
    let mut cargo = cargo().ok_or("Debian's Rust is not installed")?;
    cargo.current_dir(folder);
    cargo.args([
        "build",
        "--release",
        "--target-dir",
        "target",
        BUILD_CORE,
        "--target",
        triple,
    ]);
    let output = run_for(&mut cargo, TIMEOUT).map_err(failed)?;
    match output.status.success() {
        true => Ok(()),
        false => Err(format!(
            "cannot build core for {triple}: {}",
            String::from_utf8_lossy(&output.stderr)
        )),
    }
}

/// The version is part of the path: a library of one compiler is none for another.
fn version() -> Result<String, String> {
    let output = run_for(Command::new(RUSTC).arg("--version"), Duration::from_secs(20));
    let output = output.map_err(|error| format!("{RUSTC}: {error}"))?;
    let text = String::from_utf8_lossy(&output.stdout).trim().to_owned();
    Ok(text.replace(|c: char| !c.is_ascii_alphanumeric() && c != '.', "-"))
}

fn cache() -> Result<PathBuf, String> {
    let given = std::env::var_os("XDG_CACHE_HOME")
        .map(PathBuf::from)
        .filter(|path| path.is_absolute());
    let home = || Some(PathBuf::from(std::env::var_os("HOME")?).join(".cache"));
    let folder = given
        .or_else(home)
        .ok_or("neither XDG_CACHE_HOME nor HOME is set: no place for core")?;
    Ok(folder.join("policyc"))
}
