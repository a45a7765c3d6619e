//! A verification as a list of cases, for programs that show such lists: a case per file that differs, per build, per claim.

use std::path::Path;

use interp::decisions::Decisions;
use interp::golden::GoldenResult;
use policy::Policy;

use crate::drift::{Changed, Drift};
use crate::report::{BuildReport, Difference, Outcome, Report};
use crate::text;

/// What a case is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A generated file against what the policy yields today.
    Drift,
    /// A build against the interpreter.
    Build,
    /// The network against the trainer's answers.
    Golden,
    /// The numeric format against the trainer's decisions.
    Decisions,
}

impl Kind {
    /// All of them.
    pub const ALL: [Kind; 4] = [Kind::Drift, Kind::Build, Kind::Golden, Kind::Decisions];

    /// A name for programs; it never changes.
    #[must_use]
    pub fn id(self) -> &'static str {
        match self {
            Kind::Drift => "drift",
            Kind::Build => "build",
            Kind::Golden => "golden",
            Kind::Decisions => "decisions",
        }
    }

    /// What is claimed, in words.
    #[must_use]
    pub fn claim(self) -> &'static str {
        match self {
            Kind::Drift => "the generated files are what the policy yields today",
            Kind::Build => "the build computes what the interpreter computes",
            Kind::Golden => "the network gives the trainer's golden answers",
            Kind::Decisions => "the numeric format keeps the trainer's decisions",
        }
    }
}

/// How a case ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Verdict {
    /// It holds.
    Passed,
    /// It was not tried, and why.
    Skipped(String),
    /// It does not hold, and what was found.
    Failed(String),
}

/// One case.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Case {
    /// What it is about.
    pub kind: Kind,
    /// Which file or build.
    pub name: String,
    /// File, as seen from where the command was typed, with `/` between folders.
    pub file: String,
    /// Line of it, from 1.
    pub line: usize,
    /// How it ended.
    pub verdict: Verdict,
}

impl Case {
    /// What was found, if the case does not hold.
    #[must_use]
    pub fn failure(&self) -> Option<&str> {
        match &self.verdict {
            Verdict::Failed(found) => Some(found),
            Verdict::Passed | Verdict::Skipped(_) => None,
        }
    }
}

/// A path as programs on every system read it.
fn shown(path: &Path) -> String {
    path.display().to_string().replace('\\', "/")
}

/// The files of a generated folder: a case for each that differs, or one for all.
#[must_use]
pub fn of_drift(folder: &Path, drift: &Drift) -> Vec<Case> {
    let case = |path: &str, line: usize, verdict: Verdict| Case {
        kind: Kind::Drift,
        name: path.to_owned(),
        file: shown(&folder.join(path)),
        line,
        verdict,
    };
    if drift.is_empty() {
        return vec![case("", 1, Verdict::Passed)];
    }
    let failed = |path: &String, line, what: &str| case(path, line, Verdict::Failed(what.to_owned()));
    let missing = drift.missing.iter().map(|path| {
        let what = "is missing: the policy yields this file today";
        failed(path, 1, what)
    });
    let extra = drift
        .extra
        .iter()
        .map(|path| failed(path, 1, "the policy yields no such file"));
    let changed = drift
        .changed
        .iter()
        .map(|changed| failed(&changed.path, changed.line, &words(changed)));
    missing.chain(extra).chain(changed).collect()
}

/// Both lines of a file that differs.
fn words(changed: &Changed) -> String {
    if changed.differs_at_its_end() {
        return "differs in the white space or line ending at its end (LF is expected)".to_owned();
    }
    let line = |line: &Option<String>| match line {
        Some(text) => format!("`{}`", text.trim()),
        None => "the end of the file".to_owned(),
    };
    format!(
        "differs from what the policy yields today: {} is expected, {} is found",
        line(&changed.expected),
        line(&changed.found)
    )
}

/// Builds, golden answers and decisions. They lie in no line: `contract` stands for them.
#[must_use]
pub fn of_report(contract: &Path, policy: &Policy, report: &Report) -> Vec<Case> {
    let case = |kind, name: &str, verdict| Case {
        kind,
        name: name.to_owned(),
        file: shown(contract),
        line: 1,
        verdict,
    };
    let golden = report.golden.as_ref().map(|golden| {
        let verdict = match golden.passed() {
            true => Verdict::Passed,
            false => Verdict::Failed(golden.to_string()),
        };
        case(Kind::Golden, "network", verdict)
    });
    let read = report.golden.as_ref().is_none_or(GoldenResult::passed);
    // the decisions of a network that was read wrongly say nothing about its format
    let decisions = report.decisions.as_ref().filter(|_| read).map(|decisions| {
        let verdict = match Decisions::kept(decisions) {
            true => Verdict::Passed,
            false => Verdict::Failed(text::decisions(policy, decisions).join("\n")),
        };
        case(Kind::Decisions, policy.numeric_format.name(), verdict)
    });
    let builds = report
        .builds
        .iter()
        .map(|build| case(Kind::Build, &build.build, verdict(build)));
    golden.into_iter().chain(decisions).chain(builds).collect()
}

fn verdict(build: &BuildReport) -> Verdict {
    match &build.outcome {
        Outcome::Equal => Verdict::Passed,
        Outcome::Skipped { missing } => {
            let missing: Vec<String> = missing.iter().map(ToString::to_string).collect();
            Verdict::Skipped(missing.join(", "))
        }
        Outcome::Different { difference } => {
            let Difference {
                step,
                event,
                what,
                expected,
                got,
                ..
            } = difference.as_ref();
            Verdict::Failed(format!(
                "first difference at step {step}, in `{event}`: {what} is {} ({}) in the interpreter and {} ({}) in the generated code",
                expected.value, expected.bits, got.value, got.bits
            ))
        }
        Outcome::Failed { event, reason, .. } => Verdict::Failed(format!("{reason}, in `{event}`")),
        Outcome::CompileError { message } => Verdict::Failed(format!("does not compile\n{message}")),
    }
}
