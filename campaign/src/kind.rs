//! What a task may be.

use serde::{Deserialize, Serialize};

/// A command of `policyc` that a campaign runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// One seed of one training file.
    Train,
    /// One policy on one scenario and plant.
    Simulate,
    /// A share of the steps, or of the ADC codes, of one policy.
    Verify,
    /// One policy in one numeric format.
    Certify,
    /// One model against one set of records.
    Diagnose,
    /// One policy in one numeric format.
    Prove,
}

impl Kind {
    /// All of them, in the order of the results.
    pub const ALL: [Self; 6] = [
        Self::Train,
        Self::Simulate,
        Self::Verify,
        Self::Certify,
        Self::Diagnose,
        Self::Prove,
    ];

    /// Name of the command, and of the section in the plan.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Train => "train",
            Self::Simulate => "simulate",
            Self::Verify => "verify",
            Self::Certify => "certify",
            Self::Diagnose => "diagnose",
            Self::Prove => "prove",
        }
    }
}
