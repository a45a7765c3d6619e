//! What the bench finds, line by line, and why it may find nothing.

use std::fmt;

use policy::Policy;
use serde::Serialize;

/// One measured line.
#[derive(Debug, Clone, Serialize)]
pub struct Row {
    /// Policy.
    pub policy: String,
    /// Processor.
    pub core: String,
    /// Compiler with its level.
    pub compiler: String,
    /// Numeric format or what the code is.
    pub variant: String,
    /// Fewest and most instructions of `q_values` over 64 observations.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub q_values: Option<(u64, u64)>,
    /// Fewest and most instructions of a whole step.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step: Option<(u64, u64)>,
    /// Fewest and most instructions of a slice of 32 numbers of the integrity check.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slice: Option<(u64, u64)>,
    /// Bytes of code and tables of the whole controller with all its functions.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub flash: Option<u64>,
    /// Of these what a linker keeps for a firmware that uses `q_values` alone: the network, as peers are counted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub network_flash: Option<u64>,
    /// What it keeps for a firmware that calls `init`, `step` and `integrity_slice`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step_flash: Option<u64>,
    /// Bytes of stack of a step.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stack: Option<u64>,
    /// CRC-32 over the Q values' bits: one per policy and format.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub checksum: Option<String>,
    /// Time as a ratio to the naive loop in the same run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time_ratio: Option<f64>,
}

/// Name of a policy's format as the table shows it.
pub fn variant(policy: &Policy, assembly: bool) -> String {
    let name = policy.numeric_format.name();
    if assembly {
        format!("{name}, assembly")
    } else {
        name.to_owned()
    }
}

/// Why there is no table.
#[derive(Debug)]
pub struct Failure(pub String);

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}
