//! What can go wrong in a build script.

use std::fmt;
use std::path::PathBuf;

use codegen::CodegenError;
use policy::Faults;

/// Why a policy did not become code. `Debug` shows the text for people, because cargo shows that when `main` returns it.
pub enum Error {
    /// Every fault of the policy, with file, place, found, expected and hint.
    Policy(Faults),
    /// No target of that name.
    Target(String),
    /// A fault of the compiler itself.
    Codegen(CodegenError),
    /// A file could not be written; the system's text.
    Write(PathBuf, String),
    /// The C compiler refused this file; the text of `cc`.
    Compiler(PathBuf, String),
    /// `OUT_DIR` or `TARGET` is not set.
    NoCargo,
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            // a fault begins with `error: `, and so does what cargo prints around it
            Error::Policy(faults) => write!(f, "the policy has faults\n{}", faults.to_string().trim_end()),
            Error::Target(name) => write!(f, "no target `{name}`; there are {}", targets::names().join(", ")),
            Error::Codegen(error) => error.fmt(f),
            Error::Write(path, error) => write!(f, "cannot write {}: {error}", path.display()),
            Error::Compiler(path, error) => write!(f, "cannot compile {}: {error}", path.display()),
            Error::NoCargo => write!(
                f,
                "OUT_DIR or TARGET is not set: call this from a build script under cargo"
            ),
        }
    }
}

impl fmt::Debug for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl std::error::Error for Error {}

impl From<Faults> for Error {
    fn from(faults: Faults) -> Self {
        Error::Policy(faults)
    }
}

impl From<CodegenError> for Error {
    fn from(error: CodegenError) -> Self {
        Error::Codegen(error)
    }
}
