//! What comes out of the compiler: files as data, or a fault of its own.

use std::collections::BTreeMap;
use std::fmt;

use policy::NumericFormat;
use toml_input::{Faults, Message};

/// Version stamped into every generated file.
pub const TOOL: &str = concat!("policyc ", env!("CARGO_PKG_VERSION"));

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
    /// An output lacks what it needs.
    Output(&'static str),
    /// The processor would take a constant for zero.
    Flushed {
        /// Where it stands.
        place: String,
        /// The constant.
        value: f64,
        /// Name of the target.
        target: &'static str,
    },
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
            CodegenError::Output(message) => write!(f, "internal fault: output: {message}"),
            CodegenError::Flushed { .. } => f.write_str("the processor would take a constant of the policy for zero"),
            CodegenError::NoType { .. } => f.write_str("the processor has no type for the numeric format"),
        }
    }
}

impl std::error::Error for CodegenError {}

impl From<CodegenError> for Faults {
    fn from(error: CodegenError) -> Self {
        let message = Message::new(error.to_string());
        let (format, target) = match error {
            CodegenError::NoType { format, target } => (format, target),
            CodegenError::Flushed { place, value, target } => {
                return message
                    .found(format!(
                        "{value:e} in {place}; the FPU of {target} has no subnormal numbers"
                    ))
                    // the smallest normal number: below it the FPU sees zero
                    .expected(format!("0, or a magnitude of at least {:e}", f32::MIN_POSITIVE))
                    .hint("round it to 0 where the policy is exported, or take --format i16")
                    .into();
            }
            _ => return message.into(),
        };
        let (needed, expected) = match format {
            NumericFormat::F64 => (
                "whose numbers are a double of 64 bits, which there depends on the compiler's settings",
                "f32 or i16",
            ),
            _ => ("whose weights have 8 bits", "a format of 16 bits or more"),
        };
        message
            .found(format!("{}, {needed}, for {target}", format.name()))
            .expected(expected)
            .hint("--format i16")
            .into()
    }
}
