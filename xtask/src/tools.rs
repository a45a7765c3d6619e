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
}
use Source::{Apt, RustTarget, Rustup};

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
];

/// Debian's Rust with the sources of `core`, which stands in where rustup has no target.
const DEBIAN_RUST: &[Tool] = &[
    tool("Debian's rustc", &["/usr/bin/rustc", "--version"], Apt("rustc-web")),
    tool("Debian's cargo", &["/usr/bin/cargo", "--version"], Apt("cargo-web")),
    tool(
        "sources of Rust's libraries",
        &[
            "sh",
            "-c",
            "test -d \"$(/usr/bin/rustc --print sysroot)/lib/rustlib/src/rust/library/core\"",
        ],
        Apt("rust-web-src"),
    ),
];

/// Tests leave out Rust on the targets that this names, by triple and separated by commas.
pub const WITHOUT_RUST_TARGETS: &str = "POLICYC_WITHOUT_RUST_TARGETS";

/// Targets of the Rust toolchain that are not here.
pub fn absent_rust_targets() -> Vec<&'static str> {
    if missing(DEBIAN_RUST).is_empty() {
        return Vec::new();
    }
    Plan::of(&missing(TOOLS)).targets
}

/// Sees to it that every tool is there; installs what is missing as root on Debian. A target of the Rust toolchain that
/// cannot be had is no error: the C is tested on it all the same. Returned is what to say about that.
///
/// # Errors
/// What is missing and the command to type.
pub fn provide(output: &Output) -> Result<Vec<String>, String> {
    let missing = missing(TOOLS);
    let plan = Plan::of(&missing);
    if !plan.targets.is_empty() && works(&["rustup", "--version"]) {
        let mut rustup = Command::new("rustup");
        rustup.args(["target", "add"]).args(&plan.targets);
        // offline or refused: Debian's Rust is next
        let _ = process::run(&mut rustup, output);
    }
    if !plan.packages.is_empty() && may_install() {
        install(&plan, output).map_err(|e| format!("{}\n{e}", plan.message(&missing)))?;
    }
    if !absent_rust_targets().is_empty() && may_install() {
        // other names in this distribution, or no network: said at the end
        let _ = install(&Plan::of(&self::missing(DEBIAN_RUST)), output);
    }
    require()
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
pub fn require() -> Result<Vec<String>, String> {
    let (targets, others): (Vec<_>, Vec<_>) = missing(TOOLS)
        .into_iter()
        .partition(|tool| matches!(tool.source, RustTarget(_)));
    if !others.is_empty() {
        return Err(Plan::of(&others).message(&others));
    }
    let debian = missing(DEBIAN_RUST);
    let said = match (targets.is_empty(), debian.is_empty()) {
        (true, true) => return Ok(Vec::new()),
        (true, false) => "not tested: Debian's Rust in place of a missing target of rustup",
        (false, true) => "rustup lacks targets, so that Debian's Rust is tested there",
        (false, false) => "Rust is NOT tested there",
    };
    let missing = [targets, debian].concat();
    Ok(vec![format!("{said}: {}", Plan::of(&missing).message(&missing))])
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
}

impl Plan {
    fn of(missing: &[&Tool]) -> Self {
        let mut plan = Self {
            packages: Vec::new(),
            components: Vec::new(),
            targets: Vec::new(),
        };
        for tool in missing {
            match tool.source {
                Apt(package) => plan.packages.push(package),
                Rustup(component) => plan.components.push(component),
                RustTarget(triple) => plan.targets.push(triple),
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
