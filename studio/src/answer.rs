//! What several requests and answers share.

use serde::{Deserialize, Serialize};
use toml_input::Faults;

/// A contract, in a numeric format of its own or another one.
#[derive(Debug, Clone, Deserialize)]
pub struct Contract {
    /// Path of `policy.toml`.
    pub contract: String,
    /// Name of a numeric format.
    pub format: Option<String>,
    /// Name of the output that drives the plant or is shown, of a contract with several.
    #[serde(default)]
    pub output: Option<String>,
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
