//! The Rust compiler for a target: the one on `PATH` if it has the target's library, else Debian's.

use std::path::Path;
use std::process::Command;
use std::time::Duration;

use targets::RustTarget;

use super::run::run_for;
use super::{Install, Missing, RUSTC, debian, find};

/// A `rustc` for a target.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Toolchain {
    /// The one on `PATH`.
    OnPath,
    /// Debian's, with a library that is built at its first use for this triple.
    Debian(&'static str),
}

impl Toolchain {
    /// The compiler, without arguments; enough to ask for its version.
    pub fn program(self) -> Command {
        Command::new(match self {
            Self::OnPath => RUSTC,
            Self::Debian(_) => debian::RUSTC,
        })
    }

    /// The compiler with the library of the target.
    ///
    /// # Errors
    /// If the library could not be built; text for a user.
    pub fn rustc(self) -> Result<Command, String> {
        let mut command = self.program();
        if let Self::Debian(triple) = self {
            command.arg("--sysroot").arg(debian::sysroot(triple)?);
        }
        Ok(command)
    }
}

/// Flags that choose target and processor.
pub fn flags(spec: RustTarget) -> Vec<&'static str> {
    let triple = (!spec.triple.is_empty()).then_some(["--target", spec.triple]);
    triple
        .into_iter()
        .flatten()
        .chain(spec.machine_flags.iter().copied())
        .collect()
}

/// The compiler for a target, or what is missing.
pub fn toolchain(spec: RustTarget) -> Result<Toolchain, Missing> {
    if find(RUSTC).is_none() {
        return Err(Missing {
            reason: format!("{RUSTC} is not on PATH"),
            install: Some(Install::Package("rustc".to_owned())),
        });
    }
    // no triple is this machine, whose library is always there
    if spec.triple.is_empty() || has_core(RUSTC, spec.triple) {
        return Ok(Toolchain::OnPath);
    }
    if debian::cargo().is_some() {
        return Ok(Toolchain::Debian(spec.triple));
    }
    Err(Missing {
        reason: format!("{RUSTC} has no library for {}", spec.triple),
        install: Some(Install::RustTarget(spec.triple.to_owned())),
    })
}

/// Whether the library `core` of that target lies beside the compiler.
fn has_core(rustc: &str, triple: &str) -> bool {
    let mut command = Command::new(rustc);
    // rustc prints this folder for every target that it knows, installed or not: so look into it
    command.args(["--target", triple, "--print", "target-libdir"]);
    let Ok(output) = run_for(&mut command, Duration::from_secs(20)) else {
        return false;
    };
    let folder = String::from_utf8_lossy(&output.stdout).trim().to_owned();
    let entries = std::fs::read_dir(Path::new(&folder));
    entries.is_ok_and(|entries| {
        entries
            .flatten()
            .any(|entry| entry.file_name().to_string_lossy().starts_with("libcore-"))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triple_is_named_unless_it_is_this_machine() {
        let here = RustTarget {
            triple: "",
            machine_flags: &[],
        };
        assert!(flags(here).is_empty());
        let there = RustTarget {
            triple: "thumbv7m-none-eabi",
            machine_flags: &["-Ctarget-cpu=cortex-m3"],
        };
        assert_eq!(
            flags(there),
            ["--target", "thumbv7m-none-eabi", "-Ctarget-cpu=cortex-m3"]
        );
        assert!(!has_core(RUSTC, "pdp11-unknown-none"));
    }
}
