//! What came out, as data.

use serde::Serialize;

use crate::oracle::Coverage;
use crate::toolchain::{Install, Missing};
use interp::decisions::Decisions;
pub use interp::golden::GoldenResult;

/// Result of a verification.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// Name of the policy.
    pub policy: String,
    /// Name of the target.
    pub target: &'static str,
    /// Seed of the stream.
    pub seed: u64,
    /// Control steps of the stream.
    pub steps: u64,
    /// CRC-32 over every word the interpreter expects of this stream: equal builds share it.
    pub checksum: String,
    /// What the stream has reached.
    pub coverage: Coverage,
    /// Known answers against the interpreter; `None` if the policy has none.
    pub golden: Option<GoldenResult>,
    /// What the numeric format does to the trainer's decisions; `None` if the policy has no known answers.
    pub decisions: Option<Decisions>,
    /// One entry per build.
    pub builds: Vec<BuildReport>,
}

impl Report {
    /// The builds are equal, and the format keeps the decisions.
    pub fn passed(&self) -> bool {
        self.equal() && self.decisions.as_ref().is_none_or(Decisions::kept)
    }

    /// At least one build was compared, all compared builds are equal, and the network gives the trainer's answers.
    pub fn equal(&self) -> bool {
        let golden = |result: &Option<GoldenResult>| result.as_ref().is_none_or(GoldenResult::passed);
        self.builds_equal() && golden(&self.golden) && self.builds.iter().all(|build| golden(&build.golden))
    }

    /// At least one build was compared, and all compared builds give the interpreter's bits, whatever these are worth.
    pub fn builds_equal(&self) -> bool {
        // with every build skipped nothing was shown
        let compared = self.builds.iter().any(|build| build.outcome == Outcome::Equal);
        let sound = |build: &BuildReport| matches!(build.outcome, Outcome::Equal | Outcome::Skipped { .. });
        compared && self.builds.iter().all(sound)
    }

    /// Whether a build was started, whatever came of it.
    pub fn compared(&self) -> bool {
        self.builds
            .iter()
            .any(|build| !matches!(build.outcome, Outcome::Skipped { .. }))
    }

    /// What to install so that no build is skipped, in order, once each.
    pub fn to_install(&self) -> Vec<&Install> {
        let all: std::collections::BTreeSet<&Install> = self
            .builds
            .iter()
            .filter_map(|build| match &build.outcome {
                Outcome::Skipped { missing } => Some(missing),
                _ => None,
            })
            .flatten()
            .filter_map(|missing| missing.install.as_ref())
            .collect();
        all.into_iter().collect()
    }

    /// `equal` only if every build was made and compared; else the first that was not equal, and what it did.
    pub fn in_a_line(&self) -> String {
        if self.builds.is_empty() {
            return "no build".into();
        }
        let unequal = self.builds.iter().find(|build| build.outcome != Outcome::Equal);
        match unequal.map(|build| (&build.build, &build.outcome)) {
            None => "equal".into(),
            Some((name, Outcome::Different { difference })) => {
                let measured = difference.measurement.iter();
                let at: String = measured
                    .map(|item| format!("; {} = {}", item.signal, item.sample.value))
                    .collect();
                format!("{name} differs at step {} in {}{at}", difference.step, difference.what)
            }
            Some((name, Outcome::Failed { step, reason, .. })) => format!("{name} failed at step {step}: {reason}"),
            Some((name, Outcome::CompileError { message })) => format!("{name} refused: {message}"),
            Some((name, Outcome::Skipped { .. } | Outcome::Equal)) => format!("{name} is missing"),
        }
    }

    /// The builds that could not be made here.
    pub fn skipped(&self) -> impl Iterator<Item = &BuildReport> {
        self.builds
            .iter()
            .filter(|build| matches!(build.outcome, Outcome::Skipped { .. }))
    }
}

/// One compiler at one optimisation level.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BuildReport {
    /// Such as `gcc -O2`.
    pub build: String,
    /// First line of the compiler's version text; empty if it is missing.
    pub compiler: String,
    /// Steps compared, all equal up to here.
    pub steps_compared: u64,
    /// Result.
    pub outcome: Outcome,
    /// Known answers against this build; `None` if the policy has none or the build did not run.
    pub golden: Option<GoldenResult>,
}

/// Result of one build.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "result", rename_all = "snake_case")]
pub enum Outcome {
    /// Every word was equal.
    Equal,
    /// The first word that was not.
    Different {
        /// Where and what.
        difference: Box<Difference>,
    },
    /// It crashed or hung.
    Failed {
        /// Step at which it happened.
        step: u64,
        /// The event it did not answer.
        event: String,
        /// What happened.
        reason: String,
        /// The measurement of that step.
        measurement: Vec<Measured>,
    },
    /// The compiler refused the code.
    CompileError {
        /// The compiler's text.
        message: String,
    },
    /// Not compared.
    Skipped {
        /// What is not on this machine or not among the files.
        missing: Vec<Missing>,
    },
}

/// The first word of a build that is not the interpreter's.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Difference {
    /// Control steps completed before; the step itself if `event` is a step.
    pub step: u64,
    /// `step`, `set_mapping`, `reset`, `init`, `network` or `start`.
    pub event: String,
    /// The word, such as `observation[2] (de_dt)`, `q[5]`, `state held.v_out`, `status`.
    pub what: String,
    /// What the interpreter says.
    pub expected: Value,
    /// What the build says.
    pub got: Value,
    /// The measurement of that step.
    pub measurement: Vec<Measured>,
}

/// A word, read as what it is.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Value {
    /// Number, or names of status bits.
    pub value: String,
    /// The bits, as `0x3f000000`.
    pub bits: String,
}

/// One signal of a measurement.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Measured {
    /// Name of the signal.
    pub signal: String,
    /// Value or ADC code.
    pub sample: Value,
}
