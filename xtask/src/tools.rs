//! Programs beyond Rust that the steps need, and how to get them.

use std::process::{Command, Stdio};

use crate::process::{self, Output};

enum Source {
    /// A Debian package.
    Apt(&'static str),
    /// A component of the Rust toolchain.
    Rustup(&'static str),
    /// A target of the Rust toolchain.
    RustTarget(&'static str),
    /// A package of PyPI with its version.
    Pip(&'static str),
}
use Source::{Apt, Pip, RustTarget, Rustup};

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

/// One row a tool. A Python package is probed by `["python3", "-c", "import it"]`.
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
    tool("ngspice", &["ngspice", "--version"], Apt("ngspice")),
    tool("ngspice's library", NGSPICE_HEADER, Apt("libngspice0-dev")),
    tool("pip", &["python3", "-m", "pip", "--version"], Apt("python3-pip")),
    tool(
        "maraboupy",
        &["python3", "-c", "from maraboupy import MarabouCore"],
        Pip("maraboupy==2.0.0"),
    ),
];

/// Tests leave out Rust on the targets that this names, by triple and separated by commas.
pub const WITHOUT_RUST_TARGETS: &str = "POLICYC_WITHOUT_RUST_TARGETS";

/// Tests leave out what needs the Python packages that this names, separated by commas.
pub const WITHOUT_PYTHON_PACKAGES: &str = "POLICYC_WITHOUT_PYTHON_PACKAGES";

/// What tests must do without: names and values of environment variables.
pub fn absent() -> [(&'static str, String); 2] {
    let missing = missing(TOOLS);
    let packages = missing.iter().filter(|tool| matches!(tool.source, Pip(_)));
    let packages: Vec<&str> = packages.map(|tool| tool.name).collect();
    [
        (WITHOUT_RUST_TARGETS, Plan::of(&missing).targets.join(",")),
        (WITHOUT_PYTHON_PACKAGES, packages.join(",")),
    ]
}

/// Sees to it that every tool is there; installs what is missing as root on Debian. A target of the Rust toolchain or a
/// Python package that cannot be had is no error: all else is tested. Returned is what to say about that.
///
/// # Errors
/// What is missing and the command to type.
pub fn provide(output: &Output) -> Result<Vec<String>, String> {
    let missing = missing(TOOLS);
    let plan = Plan::of(&missing);
    if !plan.targets.is_empty() && works(&["rustup", "--version"]) {
        let mut rustup = Command::new("rustup");
        rustup.args(["target", "add"]).args(&plan.targets);
        // offline or refused: said at the end
        let _ = process::run(&mut rustup, output);
    }
    if !plan.packages.is_empty() && may_install() {
        for arguments in [&["update"][..], &plan.apt_install()] {
            let mut apt = Command::new("apt-get");
            apt.args(arguments).env("DEBIAN_FRONTEND", "noninteractive");
            process::run(&mut apt, output).map_err(|e| format!("{}\n{e}", plan.message(&missing)))?;
        }
    }
    if !plan.python.is_empty() && may_install() {
        let mut pip = Command::new("python3");
        pip.args(PIP_INSTALL).args(&plan.python);
        // Debian's Python asks for a virtual environment otherwise; a machine that installs by itself has one user
        pip.env("PIP_BREAK_SYSTEM_PACKAGES", "1");
        // offline or refused: said at the end
        let _ = process::run(&mut pip, output);
    }
    require()
}

/// Looks only.
///
/// # Errors
/// What is missing and the command to type.
pub fn require() -> Result<Vec<String>, String> {
    let (optional, others): (Vec<_>, Vec<_>) = missing(TOOLS)
        .into_iter()
        .partition(|tool| matches!(tool.source, RustTarget(_) | Pip(_)));
    if !others.is_empty() {
        return Err(Plan::of(&others).message(&others));
    }
    let (targets, packages): (Vec<_>, Vec<_>) = optional
        .into_iter()
        .partition(|tool| matches!(tool.source, RustTarget(_)));
    let said = [("Rust is NOT tested there", targets), ("NOT compared with", packages)];
    let said = said.into_iter().filter(|(_, tools)| !tools.is_empty());
    Ok(said
        .map(|(what, tools)| format!("{what}: {}", Plan::of(&tools).message(&tools)))
        .collect())
}

fn missing(tools: &[Tool]) -> Vec<&Tool> {
    tools.iter().filter(|tool| !works(tool.probe)).collect()
}

fn works(probe: &[&str]) -> bool {
    let Some((program, arguments)) = probe.split_first() else {
        return false;
    };
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
}

const PIP_INSTALL: [&str; 4] = ["-m", "pip", "install", "--disable-pip-version-check"];

impl Plan {
    fn of(missing: &[&Tool]) -> Self {
        let mut plan = Self {
            packages: Vec::new(),
            components: Vec::new(),
            targets: Vec::new(),
            python: Vec::new(),
        };
        for tool in missing {
            match tool.source {
                Apt(package) => plan.packages.push(package),
                Rustup(component) => plan.components.push(component),
                RustTarget(triple) => plan.targets.push(triple),
                Pip(package) => plan.python.push(package),
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

    fn message(&self, missing: &[&Tool]) -> String {
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
            lines.push(format!(
                "    python3 {} {}",
                PIP_INSTALL.join(" "),
                self.python.join(" ")
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
        let found = missing(&tools);
        assert_eq!(found.iter().map(|t| t.name).collect::<Vec<_>>(), ["fails", "absent"]);
    }

    #[test]
    fn message_gives_the_commands_to_type() {
        let tools = [
            tool("valgrind", &["false"], Apt("valgrind")),
            tool("callgrind", &["false"], Apt("valgrind")),
            tool("clippy", &["false"], Rustup("clippy")),
            tool("thumbv7m", &["false"], RustTarget("thumbv7m-none-eabi")),
        ];
        let missing: Vec<_> = tools.iter().collect();
        assert_eq!(
            Plan::of(&missing).message(&missing),
            "not found: valgrind, callgrind, clippy, thumbv7m; type\n    \
             sudo apt-get update && sudo apt-get install -y --no-install-recommends valgrind\n    \
             rustup component add clippy\n    rustup target add thumbv7m-none-eabi"
        );
    }
}
