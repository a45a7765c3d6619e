//! A trained policy in a build script: `policy.toml` to Rust, or to C with Rust in front of it, in cargo's `OUT_DIR`.
//!
//! ```no_run
//! // build.rs
//! fn main() -> Result<(), policy_build::Error> {
//!     policy_build::Build::new("policy/policy.toml").rust()
//! }
//! ```
//! ```ignore
//! // src/lib.rs
//! #[allow(clippy::all)]
//! mod buck12 {
//!     include!(concat!(env!("OUT_DIR"), "/buck12.rs"));
//! }
//! ```
//!
//! `Build::c` (feature `cc`) does the same with the C core, for which the included file is `buck12_ffi.rs`. Both files offer the
//! same types and methods. Cargo runs the script again when one of the policy's files changes.

mod error;

use std::path::{Path, PathBuf};

use codegen::{GeneratedFiles, Output};
use policy::Policy;
use targets::TargetSpec;

pub use error::Error;

/// What to make of a policy.
#[derive(Debug, Clone)]
pub struct Build {
    contract: PathBuf,
    target: Option<String>,
}

/// The C core in `OUT_DIR`, for a build system of one's own.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CFiles {
    /// `<name>.c`.
    pub source: PathBuf,
    /// Folder of `<name>.h`.
    pub include: PathBuf,
    /// Flags under which the bits hold with gcc and clang.
    pub flags: &'static [&'static str],
    /// Name of the policy.
    pub name: String,
}

impl Build {
    /// The policy whose contract lies there; a relative path starts at the package's folder.
    #[must_use]
    pub fn new(contract: impl Into<PathBuf>) -> Self {
        Self {
            contract: contract.into(),
            target: None,
        }
    }

    /// Generates for this target of `policyc targets`, instead of the one that fits cargo's `TARGET`. The choice
    /// decides the shape of the loops and the C flags; the bits are the same.
    #[must_use]
    pub fn target(mut self, name: impl Into<String>) -> Self {
        self.target = Some(name.into());
        self
    }

    /// Writes `<name>.rs`: `no_std`, no unsafe code, to be included in a module.
    ///
    /// # Errors
    /// Every fault of the policy, with file and line; an unknown target; a folder that cannot be written.
    pub fn rust(&self) -> Result<(), Error> {
        self.rust_in(&Surroundings::of_cargo()?)
    }

    /// Writes `<name>.c`, `<name>.h` and, for Rust in front of them, `<name>_ffi.rs`.
    ///
    /// # Errors
    /// As [`Build::rust`].
    pub fn c_files(&self) -> Result<CFiles, Error> {
        self.c_files_in(&Surroundings::of_cargo()?)
    }

    /// [`Build::c_files`], compiled with the crate `cc` into a static library that cargo links.
    ///
    /// # Errors
    /// As [`Build::rust`], and the C compiler's.
    #[cfg(feature = "cc")]
    pub fn c(&self) -> Result<(), Error> {
        let files = self.c_files()?;
        let mut compiler = cc::Build::new();
        // a debug build of firmware is to keep its control period, too
        compiler
            .file(&files.source)
            .include(&files.include)
            .opt_level(2)
            .warnings(false);
        // without them a compiler may contract products and sums, and the bits are others
        for flag in files.flags {
            compiler.flag(flag);
        }
        let done = compiler.try_compile(&format!("policyc_{}", files.name));
        done.map_err(|error| Error::Compiler(files.source, error.to_string()))
    }

    fn rust_in(&self, surroundings: &Surroundings) -> Result<(), Error> {
        self.write(surroundings, Output::Rust).map(drop)
    }

    fn c_files_in(&self, surroundings: &Surroundings) -> Result<CFiles, Error> {
        let (policy, target) = self.write(surroundings, Output::RustOverC)?;
        Ok(CFiles {
            source: surroundings.out.join(format!("{}.c", policy.name)),
            include: surroundings.out.clone(),
            flags: target.c_flags,
            name: policy.name,
        })
    }

    /// Writes the sources of one output; a build script has no use for a manifest.
    fn write(&self, surroundings: &Surroundings, output: Output) -> Result<(Policy, &'static TargetSpec), Error> {
        let (policy, target) = self.checked(surroundings)?;
        write(&codegen::sources(&policy, target, &[output], None)?, &surroundings.out)?;
        Ok((policy, target))
    }

    /// Policy and target; cargo is told what to look at.
    fn checked(&self, surroundings: &Surroundings) -> Result<(Policy, &'static TargetSpec), Error> {
        let target = self.find_target(&surroundings.triple)?;
        // cargo runs a script that failed again, so that the files of a policy with faults need no line
        let options = policy::ReadOptions {
            several_outputs: true,
            ..policy::ReadOptions::default()
        };
        let policy = policy::load_with(&self.contract, &options)?;
        // as `policyc compile` does: who never types `policyc` must not get the controller of a misread network
        if let Some(message) = interp::golden::refusal(&policy) {
            return Err(policy::Faults::refusing(&policy, message).into());
        }
        for line in reruns(&policy) {
            println!("{line}");
        }
        Ok((policy, target))
    }

    fn find_target(&self, triple: &str) -> Result<&'static TargetSpec, Error> {
        // the targets of this machine have an empty triple, which an empty TARGET must not find
        let fitting = |target: &&TargetSpec| {
            target
                .rust
                .is_some_and(|rust| !triple.is_empty() && rust.triple == triple)
        };
        match &self.target {
            Some(name) => targets::find(name).ok_or_else(|| Error::Target(name.clone())),
            // an unknown processor gets the code of the host: its bits are the same, its loops may be slower
            None => Ok(targets::TARGETS.iter().find(fitting).unwrap_or(targets::host())),
        }
    }
}

/// What cargo tells a build script.
struct Surroundings {
    out: PathBuf,
    triple: String,
}

impl Surroundings {
    fn of_cargo() -> Result<Self, Error> {
        let (out, triple) = (std::env::var_os("OUT_DIR"), std::env::var("TARGET"));
        match (out, triple) {
            (Some(out), Ok(triple)) => Ok(Self {
                out: out.into(),
                triple,
            }),
            _ => Err(Error::NoCargo),
        }
    }
}

/// One line per file of the policy.
fn reruns(policy: &Policy) -> impl Iterator<Item = String> {
    policy
        .files
        .iter()
        // as soon as a script prints one such line, cargo looks at no other file: all of them have to be named
        .map(|file| format!("cargo::rerun-if-changed={}", file.display()))
}

fn write(generated: &GeneratedFiles, folder: &Path) -> Result<(), Error> {
    for (name, text) in &generated.files {
        // written in place, without a temporary file: the folder is cargo's, and a script that failed is run again
        let path = folder.join(name);
        std::fs::write(&path, text).map_err(|error| Error::Write(path, error.to_string()))?;
    }
    Ok(())
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn example() -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/buck12")
    }

    fn surroundings(out: &Path) -> Surroundings {
        Surroundings {
            out: out.to_owned(),
            triple: "thumbv7em-none-eabihf".to_owned(),
        }
    }

    fn names(folder: &Path) -> Vec<String> {
        let entries = std::fs::read_dir(folder).unwrap().flatten();
        let mut names: Vec<String> = entries.map(|entry| entry.file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn the_files_of_each_language_are_written() {
        let out = tempfile::tempdir().unwrap();
        let build = Build::new(example().join("policy.toml"));
        build.rust_in(&surroundings(out.path())).unwrap();
        assert_eq!(names(out.path()), ["buck12.rs"]);
        let c = build.c_files_in(&surroundings(out.path())).unwrap();
        assert_eq!(
            names(out.path()),
            ["buck12.c", "buck12.h", "buck12.rs", "buck12_ffi.rs"]
        );
        assert!(c.source.ends_with("buck12.c") && c.flags.contains(&"-ffp-contract=off"));
        let text = std::fs::read_to_string(c.source).unwrap();
        assert!(text.contains("for target cortex-m4f"), "the target is cargo's");
    }

    #[test]
    fn cargo_hears_of_every_file_of_the_policy() {
        let policy = policy::load(&example().join("policy.toml")).unwrap();
        for file in ["policy.toml", "weights.safetensors", "drm.toml", "golden.safetensors"] {
            let path = example().join(file);
            let line = format!("cargo::rerun-if-changed={}", path.display());
            assert_eq!(reruns(&policy).filter(|said| *said == line).count(), 1, "{line}");
        }
    }

    #[test]
    fn a_policy_with_faults_gives_file_and_line_of_each_and_no_file() {
        let folder = tempfile::tempdir().unwrap();
        let contract = folder.path().join("policy.toml");
        let text = std::fs::read_to_string(example().join("policy.toml")).unwrap();
        std::fs::write(&contract, text.replace("sample_period = 1e-4", "sample_period = -1e-4")).unwrap();
        let out = tempfile::tempdir().unwrap();
        let error = Build::new(&contract).rust_in(&surroundings(out.path())).unwrap_err();
        let text = format!("{error:?}");
        let place = format!("{}:4", contract.display());
        assert!(
            text.starts_with("the policy has faults\n") && text.contains(&place),
            "{text}"
        );
        // the weights were not copied: a second fault
        assert!(text.contains("weights.safetensors"), "{text}");
        assert_eq!(names(out.path()), [""; 0]);
    }

    #[test]
    fn the_target_follows_cargo_unless_it_is_named() {
        let name = |build: &Build, triple| build.find_target(triple).map(|target| target.name).unwrap_or_default();
        let build = Build::new("policy.toml");
        assert_eq!(name(&build, "thumbv6m-none-eabi"), "cortex-m0plus");
        assert_eq!(name(&build, "thumbv7em-none-eabihf"), "cortex-m4f");
        assert_eq!(name(&build, "x86_64-unknown-linux-gnu"), "host");
        assert_eq!(name(&build.target("cortex-m7"), "thumbv7em-none-eabihf"), "cortex-m7");
    }

    #[test]
    fn an_error_shows_as_its_text_when_main_returns_it() {
        let error = Build::new("policy.toml").target("pdp-11").find_target("").err();
        let text = format!("{:?}", error.unwrap_or(Error::NoCargo));
        assert!(
            text.starts_with("no target `pdp-11`; there are host, cortex-m0plus"),
            "{text}"
        );
    }
}
