//! Compilers of this machine and what is built with them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use codegen::Language;
use policy::Policy;
use targets::TargetSpec;

use crate::drivers;

/// A compiler that can build a driver.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Compiler {
    /// Program name, also the name in filters.
    pub name: &'static str,
    /// Debian package that has it.
    pub package: &'static str,
    /// What it compiles.
    pub language: Language,
    /// Optimisation levels that are built: name, flags.
    pub levels: &'static [(&'static str, &'static [&'static str])],
}

const C_LEVELS: &[(&str, &[&str])] = &[("-O0", &["-O0"]), ("-O2", &["-O2"]), ("-O3", &["-O3"])];

/// The levels of gcc: one more with sanitisers, which end the driver at an access outside of an array.
const GCC_LEVELS: &[(&str, &[&str])] = &[
    ("-O0", &["-O0"]),
    ("-O2", &["-O2"]),
    ("-O3", &["-O3"]),
    (
        "sanitised",
        &["-O1", "-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"],
    ),
];

/// All compilers, in report order. One entry per compiler.
pub const COMPILERS: &[Compiler] = &[
    Compiler {
        name: "gcc",
        package: "gcc",
        language: Language::C,
        levels: GCC_LEVELS,
    },
    Compiler {
        name: "clang",
        package: "clang",
        language: Language::C,
        levels: C_LEVELS,
    },
    Compiler {
        name: "rustc",
        package: "rustc",
        language: Language::Rust,
        // the checked build panics on overflow: that would be a difference
        levels: &[
            (
                "checked",
                &["-Copt-level=1", "-Cdebug-assertions=on", "-Coverflow-checks=on"],
            ),
            ("-O", &["-O"]),
        ],
    },
];

/// One compiler at one level.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Build {
    /// The compiler.
    pub compiler: &'static Compiler,
    /// Its program, `None` if it is not on `PATH`.
    pub program: Option<PathBuf>,
    /// First line of its version text; empty if it is missing.
    pub version: String,
    /// Name of the level.
    pub level: &'static str,
    flags: &'static [&'static str],
}

impl Build {
    /// Such as `gcc -O2`.
    pub fn name(&self) -> String {
        format!("{} {}", self.compiler.name, self.level)
    }
}

/// Every build of every compiler that `wanted` names (all if empty), found or not.
pub fn builds(wanted: &[String]) -> Vec<Build> {
    COMPILERS
        .iter()
        .filter(|compiler| wanted.is_empty() || wanted.iter().any(|name| name == compiler.name))
        .flat_map(|compiler| {
            let program = find(compiler.name);
            let version = program.as_deref().map(version).unwrap_or_default();
            compiler.levels.iter().map(move |&(level, flags)| Build {
                compiler,
                program: program.clone(),
                version: version.clone(),
                level,
                flags,
            })
        })
        .collect()
}

/// The program of that name on `PATH`.
pub fn find(name: &str) -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    std::env::split_paths(&path)
        .map(|folder| folder.join(name))
        .find(|program| program.is_file())
}

fn version(program: &Path) -> String {
    let output = Command::new(program).arg("--version").output();
    let text = output
        .map(|output| String::from_utf8_lossy(&output.stdout).into_owned())
        .unwrap_or_default();
    text.lines().next().unwrap_or_default().to_owned()
}

/// What is compiled, the same for all builds.
#[derive(Debug, Clone, Copy)]
pub struct Sources<'a> {
    /// The policy, for the driver.
    pub policy: &'a Policy,
    /// Generated files: relative path, text.
    pub files: &'a BTreeMap<String, String>,
    /// Whose flags are used.
    pub target: &'a TargetSpec,
    /// More flags for the C compilers, after all others.
    pub extra_flags: &'a [String],
}

/// Why there is no program.
#[derive(Debug)]
pub enum BuildError {
    /// The files have no code in the compiler's language.
    NoFiles,
    /// A file could not be written or the compiler not be started.
    Io(std::io::Error),
    /// The run-time library of the sanitisers is not installed.
    NoSanitiser,
    /// The compiler refused, with its text.
    Refused(String),
}

impl From<std::io::Error> for BuildError {
    fn from(error: std::io::Error) -> Self {
        Self::Io(error)
    }
}

/// Compiles driver and generated files in `folder`, which must be empty and private to this build.
pub fn compile(build: &Build, program: &Path, sources: Sources<'_>, folder: &Path) -> Result<PathBuf, BuildError> {
    let executable = folder.join("driver.exe");
    let mut command = Command::new(program);
    command.current_dir(folder).env("LC_ALL", "C");
    for (path, text) in sources.files {
        let path = folder.join(path);
        if let Some(parent) = path.parent() {
            std::fs::create_dir_all(parent)?;
        }
        std::fs::write(path, text)?;
    }
    let of_kind = |extension: &'static str| {
        sources
            .files
            .keys()
            .filter(move |path| Path::new(path).extension().is_some_and(|e| e == extension))
    };
    match build.compiler.language {
        Language::C => {
            let headers: Vec<_> = of_kind("h").collect();
            let units: Vec<_> = of_kind("c").collect();
            if units.is_empty() {
                return Err(BuildError::NoFiles);
            }
            std::fs::write(folder.join("policyc_driver.c"), drivers::c::text(sources.policy))?;
            command
                .args(sources.target.c_flags)
                .args(build.flags)
                .args(sources.extra_flags);
            let include = headers.iter().filter_map(|path| Path::new(path).parent());
            for parent in include.collect::<std::collections::BTreeSet<_>>() {
                command.arg("-I").arg(folder.join(parent));
            }
            // no -lm: the generated code must not need it
            command.arg("policyc_driver.c").args(units).arg("-o").arg(&executable);
        }
        Language::Rust => {
            let name = format!("{}.rs", sources.policy.name);
            let unit = of_kind("rs").find(|path| Path::new(path).file_name().is_some_and(|file| *file == *name));
            let Some(unit) = unit else {
                return Err(BuildError::NoFiles);
            };
            std::fs::write(
                folder.join("policyc_driver.rs"),
                drivers::rust::text(sources.policy, unit),
            )?;
            command.args(sources.target.rust_flags).args(build.flags);
            command.arg("policyc_driver.rs").arg("-o").arg(&executable);
        }
    }
    let output = command.output()?;
    if output.status.success() {
        return Ok(executable);
    }
    // the folder is a random name: without it the same fault gives the same text
    let text = String::from_utf8_lossy(&output.stderr).replace(&folder.display().to_string(), ".");
    if text.contains("cannot find") && text.contains("san") && build.flags.iter().any(|f| f.starts_with("-fsanitize")) {
        return Err(BuildError::NoSanitiser);
    }
    let first_lines: Vec<&str> = text.lines().take(40).collect();
    Err(BuildError::Refused(first_lines.join("\n")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_filter_names_compilers() {
        let names: Vec<String> = builds(&["clang".to_owned()]).iter().map(Build::name).collect();
        assert_eq!(names, ["clang -O0", "clang -O2", "clang -O3"]);
        assert!(builds(&["pdp11-cc".to_owned()]).is_empty());
    }

    #[test]
    fn a_compiler_that_is_not_there_is_planned_without_a_program() {
        assert_eq!(find("no-such-compiler-here"), None);
    }
}
