//! Why a run could not be done, and the one place that prints it.

use std::io::Write;

use toml_input::{Fault, Faults, Message};

/// Bad input or an output that cannot be written. Exit code 2, nothing written.
#[derive(Debug)]
pub struct Failure(pub Faults);

impl Failure {
    /// Prints all faults on standard error, with colours where that is a terminal that wants them.
    pub fn print(&self) {
        // nobody may be listening, and a panic would give another exit code
        let _ = writeln!(anstream::stderr(), "{}", self.rendered());
    }

    /// The faults with their lines of source, coloured: the stream takes the colours out where they do not belong.
    fn rendered(&self) -> String {
        let mut texts = self.0.snippets(true);
        if texts.len() > 1 {
            texts.push(format!("{} faults; nothing was written", self.0.list.len()));
        }
        texts.join("\n\n")
    }
}

/// Errors that are faults with places.
macro_rules! of_faults {
    ($($error:ty),+ $(,)?) => {
        $(impl From<$error> for Failure {
            fn from(error: $error) -> Self {
                Failure(error.into())
            }
        })+
    };
}

of_faults!(
    Fault,
    Faults,
    Message,
    policy::Faults,
    codegen::CodegenError,
    verify::VerifyError,
);

/// Errors of libraries that know nothing of input files.
macro_rules! of_text {
    ($($error:ty),+ $(,)?) => {
        $(impl From<$error> for Failure {
            fn from(error: $error) -> Self {
                Message::new(error.to_string()).into()
            }
        })+
    };
}

of_text!(
    std::fmt::Error,
    std::io::Error,
    ctrlc::Error,
    report::ReportError,
    serde_json::Error,
);
