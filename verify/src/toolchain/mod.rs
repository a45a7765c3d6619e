//! Compilers of this machine and what is built with them for a target.

mod assembly;
mod compile;
pub mod debian;
mod run;
mod rust;

use std::fmt;
use std::path::PathBuf;
use std::process::Command;
use std::time::Duration;

use codegen::Language;
use serde::Serialize;
use targets::{Board, CCompiler, Runner, RustTarget, TargetSpec};

pub use compile::{BuildError, Purpose, Sources, compile, controller_object};
pub use run::run_for;
pub use rust::{Toolchain, toolchain};

/// Optimisation levels that are built: name, flags.
type Levels = &'static [(&'static str, &'static [&'static str])];

const C_LEVELS: Levels = &[("-O0", &["-O0"]), ("-O2", &["-O2"]), ("-O3", &["-O3"])];

/// The levels of gcc: one more with sanitisers, which end the driver at an access outside of an array.
const GCC_LEVELS: Levels = &[
    ("-O0", &["-O0"]),
    ("-O2", &["-O2"]),
    ("-O3", &["-O3"]),
    (
        "sanitised",
        // no recovery: a driver that went on after a fault would answer, and count as equal
        &["-O1", "-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"],
    ),
];

/// The checked build panics on overflow: that would be a difference.
const RUST_LEVELS: Levels = &[
    (
        "checked",
        &["-Copt-level=1", "-Cdebug-assertions=on", "-Coverflow-checks=on"],
    ),
    ("-O", &["-O"]),
];

/// What firmware is built with.
const EMULATED_C_LEVELS: Levels = &[("-O2", &["-O2"]), ("-O3", &["-O3"])];
const EMULATED_RUST_LEVELS: Levels = &[("-O", &["-O"])];

/// Name of the Rust compiler in filters.
pub const RUSTC: &str = "rustc";

/// What a build needs and is not on this machine.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Missing {
    /// Such as `qemu-system-arm is not on PATH`.
    pub reason: String,
    /// What to type to get it, if that is known.
    pub install: Option<Install>,
}

impl fmt::Display for Missing {
    /// What is missing, and how to get it if that is known.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.reason)?;
        match &self.install {
            Some(Install::Package(package)) => write!(f, " (Debian package {package})"),
            Some(Install::RustTarget(triple)) => write!(f, " (rustup target add {triple})"),
            None => Ok(()),
        }
    }
}

/// How to get a tool.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Install {
    /// A Debian package.
    Package(String),
    /// A target of the Rust toolchain, for `rustup target add`.
    RustTarget(String),
}

/// A compiler for a language.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Tool {
    C(CCompiler),
    Rust(RustTarget),
}

/// One compiler at one level.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Build {
    /// Program name of the compiler.
    pub compiler: &'static str,
    /// First line of its version text; empty if it is missing.
    pub version: String,
    /// Name of the level.
    pub level: &'static str,
    /// What is not on this machine; empty if the build can be made and run.
    pub missing: Vec<Missing>,
    tool: Tool,
    flags: &'static [&'static str],
    /// Further flags, which name the build.
    extra: Vec<String>,
    /// Which `rustc`; of a build in Rust whose compiler is there.
    rust: Option<Toolchain>,
}

impl Build {
    /// Such as `gcc -O2`.
    pub fn name(&self) -> String {
        let plain = format!("{} {}", self.compiler, self.level);
        match self.extra.is_empty() {
            true => plain,
            false => format!("{plain} {} (assembly)", self.extra.join(" ")),
        }
    }

    /// What it compiles.
    pub fn language(&self) -> Language {
        match self.tool {
            Tool::C(_) => Language::C,
            Tool::Rust(_) => Language::Rust,
        }
    }
}

/// Names of the target's compilers, as filters take them.
pub fn compilers(target: &TargetSpec) -> Vec<&'static str> {
    let c = target.c_compilers.iter().map(|compiler| compiler.program);
    c.chain(target.rust.map(|_| RUSTC)).collect()
}

/// Every build of every compiler that `wanted` names (all if empty), found or not, at the levels that `levels` names (all
/// if empty).
pub fn builds(target: &TargetSpec, wanted: &[String], levels: &[String]) -> Vec<Build> {
    let is_wanted = |names: &[String], name: &str| names.is_empty() || names.iter().any(|other| other == name);
    let tools = target.c_compilers.iter().map(|compiler| Tool::C(*compiler));
    tools
        .chain(target.rust.map(Tool::Rust))
        .filter(|tool| is_wanted(wanted, name_of(*tool)))
        .flat_map(|tool| of_tool(target, tool))
        .filter(|build| is_wanted(levels, build.level))
        .collect()
}

fn name_of(tool: Tool) -> &'static str {
    match tool {
        Tool::C(compiler) => compiler.program,
        Tool::Rust(_) => RUSTC,
    }
}

fn of_tool(target: &TargetSpec, tool: Tool) -> Vec<Build> {
    let name = name_of(tool);
    let mut missing = Vec::new();
    let mut rust = None;
    match tool {
        Tool::C(compiler) => missing.extend(absent(compiler.program, compiler.package)),
        // the compiler alone is not enough: it needs `core` for the target
        Tool::Rust(spec) => match toolchain(spec) {
            Ok(found) => rust = Some(found),
            Err(what) => missing.push(what),
        },
    }
    if let Runner::Emulated(board) = &target.runner {
        missing.extend(absent_of_board(target, board));
        // the first C compiler also links, and would be named twice
        missing.dedup();
    }
    if let Runner::None(why) = target.runner {
        missing.push(Missing {
            reason: why.to_owned(),
            install: None,
        });
    }
    let levels = match (target.runner, tool) {
        (Runner::Emulated(_) | Runner::None(_), Tool::C(_)) => EMULATED_C_LEVELS,
        (Runner::Emulated(_) | Runner::None(_), Tool::Rust(_)) => EMULATED_RUST_LEVELS,
        (Runner::Native, Tool::C(compiler)) if compiler.program == "gcc" => GCC_LEVELS,
        (Runner::Native, Tool::C(_)) => C_LEVELS,
        (Runner::Native, Tool::Rust(_)) => RUST_LEVELS,
    };
    let version = match (tool, &rust) {
        (Tool::C(compiler), _) => find(compiler.program).map(|program| version(Command::new(program))),
        (Tool::Rust(_), Some(toolchain)) => Some(version(toolchain.program())),
        (Tool::Rust(_), None) => None,
    }
    .unwrap_or_default();
    levels
        .iter()
        .map(|&(level, flags)| Build {
            compiler: name,
            version: version.clone(),
            level,
            missing: missing.clone(),
            tool,
            flags,
            extra: Vec::new(),
            rust,
        })
        .collect()
}

/// The emulator and the compiler that links, as far as they are not here.
fn absent_of_board(target: &TargetSpec, board: &Board) -> Vec<Missing> {
    let linker = target
        .c_compilers
        .first()
        .and_then(|linker| absent(linker.program, linker.package));
    linker
        .into_iter()
        .chain(absent(board.emulator, board.package))
        .collect()
}

fn absent(program: &str, package: &str) -> Option<Missing> {
    find(program).is_none().then(|| Missing {
        reason: format!("{program} is not on PATH"),
        install: (!package.is_empty()).then(|| Install::Package(package.to_owned())),
    })
}

/// The program of that name on `PATH`.
pub fn find(name: &str) -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    std::env::split_paths(&path)
        .map(|folder| folder.join(name))
        // a folder of the name does not run
        .find(|program| program.is_file())
}

fn version(mut program: Command) -> String {
    let text = run_for(program.arg("--version"), Duration::from_secs(20))
        .map(|output| String::from_utf8_lossy(&output.stdout).into_owned())
        .unwrap_or_default();
    text.lines().next().unwrap_or_default().to_owned()
}

/// The command that runs an executable of the target, with more arguments for the emulator; `None` where nothing can.
pub fn launch(target: &TargetSpec, executable: PathBuf, emulator: &[String]) -> Option<Command> {
    match target.runner {
        Runner::Native => Some(Command::new(executable)),
        Runner::Emulated(board) => {
            let mut command = Command::new(board.emulator);
            command.args(emulator).args(board.arguments).arg(executable);
            Some(command)
        }
        Runner::None(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn host() -> &'static TargetSpec {
        targets::find("host").unwrap_or_else(|| panic!("no host"))
    }

    #[test]
    fn a_filter_names_compilers() {
        let names: Vec<String> = builds(host(), &["clang".to_owned()], &[])
            .iter()
            .map(Build::name)
            .collect();
        assert_eq!(names, ["clang -O0", "clang -O2", "clang -O3"]);
        assert!(builds(host(), &["pdp11-cc".to_owned()], &[]).is_empty());
    }

    #[test]
    fn a_compiler_that_is_not_there_is_planned_with_what_is_missing() {
        assert_eq!(find("no-such-compiler-here"), None);
        let missing = absent("no-such-compiler-here", "no-package").map(|missing| missing.install);
        assert_eq!(missing, Some(Some(Install::Package("no-package".to_owned()))));
        assert_eq!(absent("sh", "dash"), None);
    }

    #[test]
    fn a_target_that_runs_nowhere_says_why() {
        let Some(target) = targets::find("c2000-c28x") else {
            panic!()
        };
        let builds = builds(target, &[], &[]);
        assert!(!builds.is_empty());
        for build in builds {
            assert!(
                build.missing.iter().any(|missing| missing.install.is_none()),
                "{build:?}"
            );
        }
    }
}
