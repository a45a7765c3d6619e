//! All faults of a policy's files, and what a caller needs beside them.

use std::fmt;
use std::path::PathBuf;

use toml_input::{Fault, Message};

use crate::model::{Policy, Signal};

/// All faults found, and what a caller needs beside them.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Faults {
    /// The faults, in the order of the files.
    pub faults: toml_input::Faults,
    /// Every file that was opened or should have been, for rebuild tracking.
    pub files: Vec<PathBuf>,
    /// What the contract says all the same.
    pub skeleton: Box<Skeleton>,
}

/// What could be read of a contract with faults: enough for a stand-in of the controller.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Skeleton {
    /// Name of the policy, if it could be read and is a fit name.
    pub name: Option<String>,
    /// Signals with fit names, as far as they could be read, and whether each arrives as an ADC code.
    pub signals: Vec<(String, bool)>,
    /// How many features the contract lists, faulty ones included, if that can be told.
    pub features: Option<usize>,
    /// How many outputs the network has by the actions that it lists.
    pub actions: Option<usize>,
    /// Each of several outputs, with its name if that is fit and no other has it; none where there is one.
    pub outputs: Vec<Option<String>>,
}

impl Faults {
    /// A checked policy that is refused all the same.
    #[must_use]
    pub fn refusing(policy: &Policy, message: Message) -> Self {
        let contract = policy.files.first().map(PathBuf::as_path);
        let signal = |signal: &Signal| (signal.name.clone(), signal.adc.is_some());
        let names = policy.output_names();
        Faults {
            faults: contract.map_or_else(
                || message.clone().into(),
                |file| Fault::in_file(file, message.clone()).into(),
            ),
            files: policy.files.clone(),
            skeleton: Box::new(Skeleton {
                name: Some(policy.name.clone()),
                signals: policy.signals.iter().map(signal).collect(),
                features: Some(policy.features.len()),
                actions: Some(policy.outputs()),
                outputs: names.into_iter().map(|name| Some(name.to_owned())).collect(),
            }),
        }
    }
}

/// The faults alone.
impl From<Faults> for toml_input::Faults {
    fn from(faults: Faults) -> Self {
        faults.faults
    }
}

impl std::error::Error for Faults {}

impl fmt::Display for Faults {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.faults.fmt(f)
    }
}
