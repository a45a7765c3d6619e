//! Requests and the parts of answers that several share.

use serde::{Deserialize, Serialize};
use toml_input::Faults;

/// What the page asks. Files are paths among those of the session.
#[derive(Debug, Clone, Deserialize)]
#[serde(tag = "ask", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Request {
    /// What there is to choose from: formats, outputs, targets, numbers of a plant.
    Choices,
    /// The contract as `policyc inspect` prints it, or its faults.
    Read(Contract),
    /// A contract for a file of a trainer, as `policyc new` would write it.
    New {
        /// What the trainer saved.
        file: String,
        /// Path of the contract.
        contract: String,
        /// Actions, where the file does not say how many.
        actions: Option<usize>,
    },
    /// The files of `policyc compile --no-costs`.
    Compile {
        /// The contract.
        #[serde(flatten)]
        of: Contract,
        /// Names of outputs.
        emit: Vec<String>,
        /// Name of the target.
        target: String,
    },
    /// The policy's duty over two signals.
    Map(crate::map::Wanted),
    /// A load step in closed loop, quickly.
    Loop(crate::loops::Step),
    /// The files of `policyc simulate`.
    Simulate {
        /// The contract.
        #[serde(flatten)]
        of: Contract,
        /// The scenario.
        scenario: String,
    },
    /// The files of `policyc diagnose`.
    Diagnose(crate::records::Wanted),
}

/// A contract, in a numeric format of its own or another one.
#[derive(Debug, Clone, Deserialize)]
pub struct Contract {
    /// Path of `policy.toml`.
    pub contract: String,
    /// Name of a numeric format.
    pub format: Option<String>,
}

/// A fault and where it is.
#[derive(Debug, Clone, Serialize)]
pub struct Wrong {
    /// As the command prints it, without colours.
    pub text: String,
}

/// Why there is no other answer.
#[derive(Debug, Clone, Serialize)]
pub struct Refused {
    /// At least one.
    pub faults: Vec<Wrong>,
    /// Places in texts, for the page to jump to: file, line and column, counted from 1.
    pub places: Vec<(String, usize, usize)>,
}

impl From<Faults> for Refused {
    fn from(faults: Faults) -> Self {
        let place = |fault: &toml_input::Fault| {
            let (line, column) = fault.line_column()?;
            Some((fault.file.display().to_string(), line, column))
        };
        let mut texts = faults.snippets(false);
        if texts.len() > 1 {
            texts.push(format!("{} faults; nothing was written", faults.list.len()));
        }
        Refused {
            places: faults.iter().filter_map(place).collect(),
            faults: texts.into_iter().map(|text| Wrong { text }).collect(),
        }
    }
}

/// A file that was made.
#[derive(Debug, Clone, Serialize)]
pub struct Made {
    /// Its name: [`crate::Session::made`] has the content.
    pub name: String,
    /// Its length.
    pub bytes: usize,
}
