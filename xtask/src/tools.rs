//! Programs beyond Rust that the steps need, and how to get them.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::process::{self, Output};

enum Source {
    /// A Debian package.
    Apt(&'static str),
    /// A component of the Rust toolchain.
    Rustup(&'static str),
    /// A target of the Rust toolchain.
    RustTarget(&'static str),
    /// A Python package with its version, for the environment of [`python`].
    Python(&'static str),
    /// A package of npm with its version, for the folder of [`npm`]. Its probe is a file in it.
    Npm(&'static str),
}
use Source::{Apt, Npm, Python, RustTarget, Rustup};

/// A tool is there when its probe runs and ends with 0.
struct Tool {
    name: &'static str,
    probe: &'static [&'static str],
    source: Source,
}

const fn tool(name: &'static str, probe: &'static [&'static str], source: Source) -> Tool {
    Tool { name, probe, source }
}

const CALLGRIND: &[&str] = &["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", "true"];
const C_HEADERS: &[&str] = &["gcc", "-fsyntax-only", "-include", "math.h", "-xc", "/dev/null"];
const ARM_HEADERS: &[&str] = &[
    "arm-none-eabi-gcc",
    "-fsyntax-only",
    "-include",
    "stdint.h",
    "-xc",
    "/dev/null",
];
const POWERPC_HEADERS: &[&str] = &[
    "powerpc-linux-gnu-gcc",
    "-fsyntax-only",
    "-include",
    "math.h",
    "-xc",
    "/dev/null",
];

/// The library `core` of a Rust target lies where the compiler looks for it.
macro_rules! rust_target {
    ($triple:literal) => {
        tool(
            $triple,
            &[
                "sh",
                "-c",
                concat!("ls \"$(rustc --print target-libdir --target ", $triple, ")\"/libcore-*"),
            ],
            RustTarget($triple),
        )
    };
}

const CORE_SOURCES: &[&str] = &[
    "sh",
    "-c",
    "test -d \"$(/usr/bin/rustc --print sysroot)/lib/rustlib/src/rust/library/core\"",
];

const NGSPICE_HEADER: &[&str] = &[
    "gcc",
    "-fsyntax-only",
    "-include",
    "stdbool.h",
    "-include",
    "ngspice/sharedspice.h",
    "-xc",
    "/dev/null",
];

const VENV: &[&str] = &["python3", "-c", "import venv, ensurepip"];
const MARABOU: &[&str] = &["python3", "-c", "from maraboupy import MarabouCore"];
const BITWUZLA: &[&str] = &["python3", "-c", "import bitwuzla; bitwuzla.Parser"];
const FMPY: &[&str] = &["python3", "-c", "import fmpy; assert fmpy.__version__ == '0.3.32'"];

/// One row a tool. A Python package is probed by `["python3", "-c", "import it"]` in the environment of [`python`].
const TOOLS: &[Tool] = &[
    tool("rustfmt", &["cargo-fmt", "--version"], Rustup("rustfmt")),
    tool("clippy", &["cargo-clippy", "--version"], Rustup("clippy")),
    tool("git", &["git", "--version"], Apt("git")),
    tool("gcc", &["gcc", "--version"], Apt("gcc")),
    tool("C headers", C_HEADERS, Apt("libc6-dev")),
    tool("g++", &["g++", "--version"], Apt("g++")),
    tool("clang", &["clang", "--version"], Apt("clang")),
    tool("callgrind", CALLGRIND, Apt("valgrind")),
    tool(
        "arm-none-eabi-gcc",
        &["arm-none-eabi-gcc", "--version"],
        Apt("gcc-arm-none-eabi"),
    ),
    tool("newlib for arm-none-eabi", ARM_HEADERS, Apt("libnewlib-arm-none-eabi")),
    tool(
        "riscv64-unknown-elf-gcc",
        &["riscv64-unknown-elf-gcc", "--version"],
        Apt("gcc-riscv64-unknown-elf"),
    ),
    tool(
        "powerpc-linux-gnu-gcc",
        &["powerpc-linux-gnu-gcc", "--version"],
        Apt("gcc-powerpc-linux-gnu"),
    ),
    tool("C library for PowerPC", POWERPC_HEADERS, Apt("libc6-dev-powerpc-cross")),
    tool(
        "qemu-system-arm",
        &["qemu-system-arm", "--version"],
        Apt("qemu-system-arm"),
    ),
    tool(
        "qemu-system-riscv32",
        &["qemu-system-riscv32", "--version"],
        Apt("qemu-system-misc"),
    ),
    tool("qemu-ppc", &["qemu-ppc", "--version"], Apt("qemu-user")),
    rust_target!("thumbv6m-none-eabi"),
    rust_target!("thumbv7m-none-eabi"),
    rust_target!("thumbv7em-none-eabihf"),
    rust_target!("thumbv8m.main-none-eabihf"),
    rust_target!("riscv32imc-unknown-none-elf"),
    rust_target!("riscv32imafc-unknown-none-elf"),
    rust_target!("powerpc-unknown-linux-gnu"),
    rust_target!("wasm32-unknown-unknown"),
    tool("Frama-C", &["frama-c", "-version"], Apt("frama-c-base")),
    tool("ngspice", &["ngspice", "--version"], Apt("ngspice")),
    tool("Chromium", &["chromium", "--version"], Apt("chromium")),
    // rules of accessibility, for the pages; where npm is, which Debian has in hundreds of packages
    tool(
        "axe-core",
        &["node_modules/axe-core/axe.min.js"],
        Npm("axe-core@4.14.1"),
    ),
    tool("ngspice's library", NGSPICE_HEADER, Apt("libngspice0-dev")),
    // FMPy builds an FMU's sources with the cmake that it brings along
    tool("make", &["make", "--version"], Apt("make")),
    tool("venv", VENV, Apt("python3-venv")),
    tool("FMPy", FMPY, Python("fmpy==0.3.32")),
    tool(
        "libcosim",
        &["python3", "-c", "import libcosimpy"],
        Python("libcosimpy==0.0.6"),
    ),
    tool("Marabou", MARABOU, Python("maraboupy==2.0.0")),
    tool("Bitwuzla", BITWUZLA, Python("bitwuzla==0.9.1")),
    tool(
        "maturin",
        &["python3", "-c", "import maturin"],
        Python("maturin==1.16.0"),
    ),
    tool("numpy", &["python3", "-c", "import numpy"], Python("numpy==2.4.6")),
    tool("pandas", &["python3", "-c", "import pandas"], Python("pandas==3.1.1")),
    tool(
        "gymnasium",
        &["python3", "-c", "import gymnasium"],
        Python("gymnasium==1.4.0"),
    ),
    tool("pytest", &["python3", "-c", "import pytest"], Python("pytest==9.2.0")),
];

/// Debian's Rust with the sources of `core`, which stands in where rustup has no target.
const DEBIAN_RUST: &[Tool] = &[
    tool("Debian's rustc", &["/usr/bin/rustc", "--version"], Apt("rustc-web")),
    tool("Debian's cargo", &["/usr/bin/cargo", "--version"], Apt("cargo-web")),
    tool("the sources of core", CORE_SOURCES, Apt("rust-web-src")),
];

/// Tests leave out Rust on the targets that this names, by triple and separated by commas.
pub const WITHOUT_RUST_TARGETS: &str = "POLICYC_WITHOUT_RUST_TARGETS";

/// The folder of the Python environment: beside what cargo builds, so that no package gets into the system's Python.
fn python(target_dir: &Path) -> PathBuf {
    target_dir.join("python")
}

/// The folder of npm's packages, likewise.
fn npm(target_dir: &Path) -> PathBuf {
    target_dir.join("npm")
}

/// The Python program of that environment.
pub fn python_program(target_dir: &Path) -> PathBuf {
    interpreter(&python(target_dir))
}

/// Those of the tools by these names that are not there.
pub fn lacking<'a>(target_dir: &Path, names: &[&'a str]) -> Vec<&'a str> {
    let missing = missing(TOOLS, target_dir);
    let lacks = |name: &&&str| missing.iter().any(|tool| tool.name == **name);
    names.iter().filter(lacks).copied().collect()
}

/// Tests leave out what needs the Python packages that this names, separated by commas.
pub const WITHOUT_PYTHON_PACKAGES: &str = "POLICYC_WITHOUT_PYTHON_PACKAGES";

/// What tests must do without: names and values of environment variables.
pub fn absent(target_dir: &Path) -> [(&'static str, String); 2] {
    let missing = missing(TOOLS, target_dir);
    let packages = missing.iter().filter(|tool| matches!(tool.source, Python(_)));
    let packages: Vec<&str> = packages.map(|tool| tool.name).collect();
    let stand_in = self::missing(DEBIAN_RUST, target_dir).is_empty();
    let targets = if stand_in {
        Vec::new()
    } else {
        Plan::of(&missing).targets
    };
    [
        (WITHOUT_RUST_TARGETS, targets.join(",")),
        (WITHOUT_PYTHON_PACKAGES, packages.join(",")),
    ]
}

/// Sees to it that every tool is there; installs what is missing as root on Debian. A target of the Rust toolchain or a
/// Python package that cannot be had is no error: all else is tested. Returned is what to say about that.
///
/// # Errors
/// What is missing and the command to type.
pub fn provide(target_dir: &Path, output: &Output) -> Result<Vec<String>, String> {
    let missing = missing(TOOLS, target_dir);
    let plan = Plan::of(&missing);
    if !plan.targets.is_empty() && works(&["rustup", "--version"]) {
        let mut rustup = Command::new("rustup");
        rustup.args(["target", "add"]).args(&plan.targets);
        // offline or refused: Debian's Rust is next
        let _ = process::run(&mut rustup, output);
    }
    let explained = |error| format!("{}\n{error}", plan.message(&missing, target_dir));
    if !plan.packages.is_empty() && may_install() {
        install(&plan, output).map_err(explained)?;
    }
    let debian = self::missing(DEBIAN_RUST, target_dir);
    let targets = Plan::of(&self::missing(TOOLS, target_dir)).targets;
    if !targets.is_empty() && !debian.is_empty() && may_install() {
        // other names in this distribution, or no network: said at the end
        let _ = install(&Plan::of(&debian), output);
    }
    if !plan.python.is_empty() && works(VENV) {
        let (mut environment, packages) = plan.python_install(&python(target_dir));
        process::run(&mut environment, output).map_err(explained)?;
        for mut package in packages {
            // offline or refused: said at the end
            let _ = process::run(&mut package, output);
        }
    }
    if !plan.npm.is_empty() && works(&["npm", "--version"]) {
        // offline or refused: said at the end
        let _ = process::run(&mut plan.npm_install(target_dir), output);
    }
    require(target_dir)
}

fn install(plan: &Plan, output: &Output) -> Result<(), String> {
    for arguments in [&["update"][..], &plan.apt_install()] {
        let mut apt = Command::new("apt-get");
        apt.args(arguments).env("DEBIAN_FRONTEND", "noninteractive");
        process::run(&mut apt, output)?;
    }
    Ok(())
}

/// Looks only.
///
/// # Errors
/// What is missing and the command to type.
pub fn require(target_dir: &Path) -> Result<Vec<String>, String> {
    let (optional, others): (Vec<_>, Vec<_>) = missing(TOOLS, target_dir)
        .into_iter()
        .partition(|tool| matches!(tool.source, RustTarget(_) | Python(_) | Npm(_)));
    if !others.is_empty() {
        return Err(Plan::of(&others).message(&others, target_dir));
    }
    let (targets, packages): (Vec<_>, Vec<_>) = optional
        .into_iter()
        .partition(|tool| matches!(tool.source, RustTarget(_)));
    let debian = missing(DEBIAN_RUST, target_dir);
    let about_rust = match (targets.is_empty(), debian.is_empty()) {
        (true, _) => "NOT tested: Debian's Rust in the place of a target of rustup",
        (false, true) => "tested with Debian's Rust, for want of rustup's targets",
        (false, false) => "Rust is NOT tested there",
    };
    let said = [(about_rust, [targets, debian].concat()), ("NOT tested with", packages)];
    let said = said.into_iter().filter(|(_, tools)| !tools.is_empty());
    Ok(said
        .map(|(what, tools)| format!("{what}: {}", Plan::of(&tools).message(&tools, target_dir)))
        .collect())
}

fn missing<'a>(tools: &'a [Tool], target_dir: &Path) -> Vec<&'a Tool> {
    let is_there = |tool: &&Tool| match tool.source {
        Python(_) => works_as(&python_program(target_dir), tool.probe),
        Npm(_) => tool.probe.iter().all(|file| npm(target_dir).join(file).is_file()),
        _ => works(tool.probe),
    };
    tools.iter().filter(|tool| !is_there(tool)).collect()
}

/// The Python program of an environment.
fn interpreter(python: &Path) -> PathBuf {
    python.join("bin/python3")
}

fn works(probe: &[&str]) -> bool {
    probe.first().is_some_and(|program| works_as(Path::new(program), probe))
}

/// Whether a probe ends with 0 when it is `program` that runs.
fn works_as(program: &Path, probe: &[&str]) -> bool {
    let arguments = probe.iter().skip(1);
    let mut command = Command::new(program);
    command.args(arguments).stdin(Stdio::null());
    command.stdout(Stdio::null()).stderr(Stdio::null());
    command.status().is_ok_and(|status| status.success())
}

fn may_install() -> bool {
    let id = Command::new("id").arg("-u").output();
    let root = id.is_ok_and(|output| output.stdout.trim_ascii() == b"0");
    root && works(&["apt-get", "--version"])
}

/// What to install, by source.
struct Plan {
    packages: Vec<&'static str>,
    components: Vec<&'static str>,
    targets: Vec<&'static str>,
    python: Vec<&'static str>,
    npm: Vec<&'static str>,
}

impl Plan {
    fn of(missing: &[&Tool]) -> Self {
        let mut plan = Self {
            packages: Vec::new(),
            components: Vec::new(),
            targets: Vec::new(),
            python: Vec::new(),
            npm: Vec::new(),
        };
        for tool in missing {
            match tool.source {
                Apt(package) => plan.packages.push(package),
                Rustup(component) => plan.components.push(component),
                RustTarget(triple) => plan.targets.push(triple),
                Python(package) => plan.python.push(package),
                Npm(package) => plan.npm.push(package),
            }
        }
        plan.packages.sort_unstable();
        plan.packages.dedup();
        plan
    }

    fn apt_install(&self) -> Vec<&'static str> {
        let mut arguments = vec!["install", "-y", "--no-install-recommends"];
        arguments.extend(&self.packages);
        arguments
    }

    /// Makes the environment and fills it, package by package: one that is not made for this Python keeps none from coming.
    fn python_install(&self, python: &Path) -> (Command, Vec<Command>) {
        let mut environment = Command::new("python3");
        environment.args(["-m", "venv"]).arg(python);
        let install = |package: &&str| {
            let mut command = Command::new(interpreter(python));
            command.args(["-m", "pip", "install", "--disable-pip-version-check", package]);
            command
        };
        (environment, self.python.iter().map(install).collect())
    }

    fn npm_install(&self, target_dir: &Path) -> Command {
        let mut command = Command::new("npm");
        command.args(["install", "--no-audit", "--no-fund", "--ignore-scripts", "--prefix"]);
        command.arg(npm(target_dir)).args(&self.npm);
        command
    }

    fn message(&self, missing: &[&Tool], target_dir: &Path) -> String {
        let python = python(target_dir);
        let names: Vec<_> = missing.iter().map(|tool| tool.name).collect();
        let mut lines = vec![format!("not found: {}; type", names.join(", "))];
        if !self.packages.is_empty() {
            let install = self.apt_install().join(" ");
            lines.push(format!("    sudo apt-get update && sudo apt-get {install}"));
        }
        if !self.components.is_empty() {
            let components = self.components.join(" ");
            lines.push(format!("    rustup component add {components}"));
        }
        if !self.targets.is_empty() {
            let targets = self.targets.join(" ");
            lines.push(format!("    rustup target add {targets}"));
        }
        if !self.python.is_empty() {
            let (folder, program) = (python.display(), interpreter(&python));
            let packages = self.python.join(" ");
            lines.push(format!(
                "    python3 -m venv {folder} && {} -m pip install {packages}",
                program.display()
            ));
        }
        if !self.npm.is_empty() {
            let folder = npm(target_dir);
            lines.push(format!(
                "    npm install --prefix {} {}",
                folder.display(),
                self.npm.join(" ")
            ));
        }
        lines.join("\n")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tool_without_a_working_probe_is_missing() {
        let tools = [
            tool("there", &["true"], Apt("coreutils")),
            tool("fails", &["false"], Apt("fails-package")),
            tool("absent", &["no-such-program-here"], Apt("absent-package")),
        ];
        let found = missing(&tools, Path::new("/nonexistent"));
        assert_eq!(found.iter().map(|t| t.name).collect::<Vec<_>>(), ["fails", "absent"]);
    }

    #[test]
    fn message_gives_the_commands_to_type() {
        let tools = [
            tool("valgrind", &["false"], Apt("valgrind")),
            tool("callgrind", &["false"], Apt("valgrind")),
            tool("clippy", &["false"], Rustup("clippy")),
            tool("thumbv7m", &["false"], RustTarget("thumbv7m-none-eabi")),
            tool("FMPy", &["false"], Python("fmpy==1")),
            tool("axe-core", &["axe.js"], Npm("axe-core@1")),
        ];
        let missing: Vec<_> = tools.iter().collect();
        assert_eq!(
            Plan::of(&missing).message(&missing, Path::new("t")),
            "not found: valgrind, callgrind, clippy, thumbv7m, FMPy, axe-core; type\n    \
             sudo apt-get update && sudo apt-get install -y --no-install-recommends valgrind\n    \
             rustup component add clippy\n    rustup target add thumbv7m-none-eabi\n    \
             python3 -m venv t/python && t/python/bin/python3 -m pip install fmpy==1\n    \
             npm install --prefix t/npm axe-core@1"
        );
    }
}
