//! The compiler: `lower` turns a checked [`Policy`] into a [`Program`], a [`Backend`] turns that into files.
//!
//! Nothing here writes to disk; the order of operations is the one of `docs/numeric-contract.md`.

pub mod backend;
pub mod crc;
#[cfg(feature = "c")]
pub mod door;
pub mod lower;
pub mod manifest;
pub mod program;

use std::collections::BTreeMap;
use std::fmt;

use policy::{NumericFormat, Policy};
use targets::TargetSpec;

pub use backend::Backend;
#[cfg(feature = "c")]
pub use door::Door;
pub use lower::lower;
pub use program::Program;

/// Version stamped into every generated file.
pub const TOOL: &str = concat!("policyc ", env!("CARGO_PKG_VERSION"));

/// Language of the generated code.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Language {
    /// C99 that is also C90 with `stdint.h` and C++.
    C,
    /// `no_std` Rust.
    Rust,
}

impl Language {
    /// Both languages.
    pub const ALL: [Language; 2] = [Language::C, Language::Rust];

    /// Name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Language::C => "c",
            Language::Rust => "rust",
        }
    }
}

/// Relative path to text, in path order.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct GeneratedFiles {
    /// The files.
    pub files: BTreeMap<String, String>,
}

/// A fault of the compiler itself: the policy was accepted, yet no code could be made of it.
#[derive(Debug)]
pub enum CodegenError {
    /// A template did not render.
    Template(String),
    /// Generated Rust did not parse.
    Rust(String),
    /// The manifest could not be written as JSON.
    Manifest(String),
    /// A door lacks what it needs.
    Door(&'static str),
    /// This build of the compiler lacks the backend.
    NotBuilt(Language),
    /// The processor lacks a type that the numeric format stores.
    NoType {
        /// The format.
        format: NumericFormat,
        /// Name of the target.
        target: &'static str,
    },
}

impl fmt::Display for CodegenError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            CodegenError::Template(message) => write!(f, "internal fault: template: {message}"),
            CodegenError::Rust(message) => write!(f, "internal fault: generated Rust: {message}"),
            CodegenError::Manifest(message) => write!(f, "internal fault: manifest: {message}"),
            CodegenError::Door(message) => write!(f, "internal fault: door: {message}"),
            CodegenError::NotBuilt(language) => write!(f, "this build has no {} backend", language.name()),
            CodegenError::NoType { format, target } => {
                let (needed, expected) = match format {
                    NumericFormat::F64 => (
                        "whose numbers are a double of 64 bits, which there depends on the compiler's settings",
                        "f32 or i16",
                    ),
                    _ => ("whose weights have 8 bits", "a format of 16 bits or more"),
                };
                write!(
                    f,
                    "the processor has no type for the numeric format\n  = found: {}, {needed}, for {target}\n  \
                     = expected: {expected}\n  = hint: --format i16",
                    format.name()
                )
            }
        }
    }
}

impl std::error::Error for CodegenError {}

/// Lowers and emits one language.
///
/// # Errors
/// If the target has no type for the numeric format; else only for a fault in the compiler itself.
pub fn compile(policy: &Policy, target: &TargetSpec, language: Language) -> Result<GeneratedFiles, CodegenError> {
    let needs_bytes = matches!(policy.numeric_format, NumericFormat::I8 | NumericFormat::F64);
    if needs_bytes && target.widths.char_bits > 8 {
        return Err(CodegenError::NoType {
            format: policy.numeric_format,
            target: target.name,
        });
    }
    let program = lower(policy, target, language);
    backend_for(language)?.emit(&program)
}

/// Everything that `policyc compile` writes: the files of all languages and the manifest.
///
/// # Errors
/// Only for a fault in the compiler itself.
pub fn generate(policy: &Policy, target: &TargetSpec, languages: &[Language]) -> Result<GeneratedFiles, CodegenError> {
    let mut all = GeneratedFiles::default();
    for language in languages {
        all.files.extend(compile(policy, target, *language)?.files);
    }
    let manifest = manifest::manifest(policy, target, languages, &all);
    with_manifest(all, &manifest)
}

/// [`generate`] with the files of `doors`; `material` is what the kit compares with.
///
/// # Errors
/// Only for a fault in the compiler itself.
#[cfg(feature = "c")]
pub fn generate_with_doors(
    policy: &Policy,
    target: &TargetSpec,
    languages: &[Language],
    doors: &[Door],
    material: Option<&backend::kit::Material>,
) -> Result<GeneratedFiles, CodegenError> {
    if doors.is_empty() {
        return generate(policy, target, languages);
    }
    let mut all = GeneratedFiles::default();
    for language in languages {
        all.files.extend(compile(policy, target, *language)?.files);
    }
    let program = lower(policy, target, Language::C);
    for door in doors {
        all.files.extend(door.emit(&program, material)?.files);
    }
    let mut manifest = manifest::manifest(policy, target, languages, &all);
    manifest.doors = doors.iter().map(|door| door.name()).collect();
    manifest.kit_steps = material.map(|material| material.policy.steps());
    with_manifest(all, &manifest)
}

fn with_manifest(mut all: GeneratedFiles, manifest: &manifest::Manifest) -> Result<GeneratedFiles, CodegenError> {
    let text = serde_json::to_string_pretty(manifest).map_err(|error| CodegenError::Manifest(error.to_string()))?;
    all.files.insert(manifest::FILE.to_owned(), text + "\n");
    Ok(all)
}

/// The backend of a language.
///
/// # Errors
/// If this build leaves it out (cargo features `c`, `rust-text`).
pub fn backend_for(language: Language) -> Result<&'static dyn Backend, CodegenError> {
    match language {
        #[cfg(feature = "c")]
        Language::C => Ok(&backend::c99::C99),
        #[cfg(feature = "rust-text")]
        Language::Rust => Ok(&backend::rust::RustText),
        #[allow(unreachable_patterns)]
        other => Err(CodegenError::NotBuilt(other)),
    }
}
