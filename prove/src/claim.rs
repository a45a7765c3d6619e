//! What a prover answers: one shape for all of them.

use policy::NumericFormat;
use serde::Serialize;

/// How a claim came out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// It holds for every input that it names.
    Proved,
    /// The prover could not be run, or the claim is outside of what it can state; the reason is beside it.
    NotRun,
    /// The prover ran and does not know.
    Unproven,
    /// There is an input for which it does not hold.
    Refuted,
}

impl Verdict {
    /// In words.
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            Verdict::Proved => "proved",
            Verdict::NotRun => "not run",
            Verdict::Unproven => "unproven",
            Verdict::Refuted => "refuted",
        }
    }
}

/// One sentence about the generated code, and what a prover says to it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Claim {
    /// Prover, such as `eva`.
    pub prover: &'static str,
    /// Short name, unique among the claims of a prover in one numeric format.
    pub name: String,
    /// The sentence.
    pub text: String,
    /// Under which inputs, such as "one step from every sound state"; claims of one subject share their runs.
    pub subject: String,
    /// Numeric format of the generated code.
    #[serde(serialize_with = "format_name")]
    pub format: NumericFormat,
    /// Under which settings it was tried, such as the machine; empty if it has none.
    pub settings: Vec<String>,
    /// How it came out.
    pub verdict: Verdict,
    /// Why it was not run, or what the prover did not see; empty if there is nothing to say.
    pub reason: String,
    /// Wall-clock time of the runs that decided it; claims that one run decides share its time.
    pub seconds: f64,
    /// Program and version; empty if none ran.
    pub tool: String,
    /// Alarms and other places in the code, a line each.
    pub details: Vec<String>,
}

fn format_name<S: serde::Serializer>(format: &NumericFormat, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(format.name())
}
