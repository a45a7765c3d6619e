//! A log of the trainer's environment against the contract: are the features what the network was trained on?
//!
//! Golden vectors check the network, and nothing that stands before it. A log has the samples too: the interpreter makes its own
//! observation of them, and what differs is searched for a simple reason.
//!
//! ```text
//! log ─► samples ──────────► sense ─► own observation ─► network ─► own action
//!     ├► what was applied ──► commit: `previous_duty`, as the trainer had it
//!     └► his observation, his action ─► compare ─► explain
//! ```

mod answers;
mod chain;
mod chosen;
mod course;
mod duties;
mod explain;
mod integral;
mod itself;
mod late;
mod log;
mod sources;
mod text;
mod values;
mod variants;

use interp::decisions::Decisions;
use policy::{DutyPath, NumericFormat, Policy, Scalar};
use serde::Serialize;
use toml_input::Faults;

pub use answers::{answers, tolerance};
pub use duties::DutyResult;
pub use log::Log;
pub use text::text;

use course::course;
use duties::Logged;
use explain::OutputCourse;
use values::{allowed, ends};

/// What differs less than this share of the largest logged magnitude is equal.
// a log has five digits at least, and an environment in binary32 adds in another order than the contract
pub const TOLERANCE: f64 = 1e-4;

/// The contract against a log.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Replay {
    /// Control periods in the log.
    pub rows: usize,
    /// Of these, rows at the start of episodes that were not compared, as asked for.
    pub skipped: usize,
    /// Fresh starts in it, the first included.
    pub episodes: usize,
    /// One entry per feature, in the order of the network's inputs.
    pub features: Vec<FeatureResult>,
    /// The network's choice or duty beside the logged one; `None` if the log has none.
    pub actions: Option<ActionResult>,
    /// The duties that the log has with its actions beside those of the contract; `None` if it has none.
    pub duties: Option<DutyResult>,
    /// The same of each of several outputs, in the order of the contract, and nothing of it above; empty where there is one.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub outputs: Vec<OutputResult>,
    /// The column that is logged one row below the others, if that is all that differs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub late: Option<String>,
    /// Signals with samples outside their plausible range: name, rows, smallest and largest logged value. They were taken as they
    /// are; the controller will hold the last good sample.
    pub outside: Vec<(String, usize, [f64; 2])>,
    /// What an integer format changes of the decisions, where all that the log has is equal in floats.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub format: Option<Decisions>,
    /// Rows that do not count in `format`: the controller never answers them.
    #[serde(skip_serializing_if = "is_zero")]
    pub uncounted: usize,
    /// The contract is one of integers, and all but `format` is what it makes of the log in f32.
    #[serde(skip)]
    pub in_floats: bool,
    /// Share of the largest logged magnitude of a feature that is still equal.
    pub tolerance: f64,
    /// What a reader of the log should know.
    pub notes: Vec<String>,
}

/// One of several outputs beside the log.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OutputResult {
    /// Its name in the contract.
    pub name: String,
    /// As [`Replay::actions`].
    pub actions: Option<ActionResult>,
    /// As [`Replay::duties`].
    pub duties: Option<DutyResult>,
}

/// What was found of an output, of one or of several.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Commanded<'a> {
    /// Its name; `None` where there is one.
    pub name: Option<&'a str>,
    pub actions: Option<&'a ActionResult>,
    pub duties: Option<&'a DutyResult>,
}

impl Commanded<'_> {
    /// Whether the log's choice or duty is another.
    pub fn differs(&self) -> bool {
        self.actions
            .is_some_and(|actions| !actions.exploring && actions.first_line.is_some())
    }

    /// Whether its actions have other duties.
    pub fn has_other_duties(&self) -> bool {
        self.duties.is_some_and(|duties| duties.first_line.is_some())
    }
}

/// A feature of the contract beside the log's.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FeatureResult {
    /// Its name in the contract.
    pub name: String,
    /// Smallest and largest value that the contract makes of the log's samples.
    pub own: [f64; 2],
    /// The comparison; `None` if the log does not have this feature.
    pub logged: Option<Compared>,
}

/// A feature's values against logged ones.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Compared {
    /// Smallest and largest logged value.
    pub range: [f64; 2],
    /// Rows that are equal within the tolerance.
    pub equal: usize,
    /// Largest difference.
    pub worst: f64,
    /// Line of the log in which it is.
    pub worst_line: usize,
    /// Line of the first difference beyond the tolerance.
    pub first_line: Option<usize>,
    /// What the logged values are instead, if that is simple.
    pub explanation: Option<String>,
}

/// Greedy actions against logged ones.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ActionResult {
    /// Rows with the logged action.
    pub equal: usize,
    /// Rows with another action whose Q value is the same up to the rounding that `golden_tolerance` allows: told, not judged.
    pub ties: usize,
    /// Line of the first other one, ties left out.
    pub first_line: Option<usize>,
    /// The log's actions are a trainer's who explores: told, not judged.
    pub exploring: bool,
    /// Of a duty that is no choice: the largest difference as a share of its range, and the line of the log in which it is.
    pub worst: Option<(f64, usize)>,
}

impl Replay {
    /// Nothing that the log has is other than the contract says, but for decisions that its integer format may change.
    #[must_use]
    pub fn equal(&self) -> bool {
        // all else was equal, else it would not be there
        if let Some(decisions) = &self.format {
            return decisions.kept();
        }
        let other = |output: &Commanded<'_>| output.differs() || output.has_other_duties();
        !self.commands().iter().any(other) && self.compared().all(|(_, compared)| compared.first_line.is_none())
    }

    /// Of each output, in the order of the contract.
    pub(crate) fn commands(&self) -> Vec<Commanded<'_>> {
        if self.outputs.is_empty() {
            let (actions, duties) = (self.actions.as_ref(), self.duties.as_ref());
            let name = None;
            return vec![Commanded { name, actions, duties }];
        }
        (self.outputs.iter())
            .map(|output| Commanded {
                name: Some(&output.name),
                actions: output.actions.as_ref(),
                duties: output.duties.as_ref(),
            })
            .collect()
    }

    /// The features that the log has.
    pub fn compared(&self) -> impl Iterator<Item = (&FeatureResult, &Compared)> {
        self.features
            .iter()
            .filter_map(|feature| Some((feature, feature.logged.as_ref()?)))
    }
}

/// How a log is compared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wanted {
    /// Share of the largest logged magnitude of a feature that is still equal ([`TOLERANCE`]).
    pub tolerance: f64,
    /// The logged actions are those of a trainer who explores.
    pub exploring: bool,
    /// Rows at the start of each episode that are not compared: an environment that begins with another memory is another one
    /// there, and nowhere else.
    pub skip: usize,
}

/// Puts a log through the contract.
///
/// With [`Wanted::exploring`] the logged actions are those that were applied, and need not be the network's.
///
/// # Errors
/// A duty in the log that no action of the contract commands.
pub fn replay(policy: &Policy, log: &Log, wanted: Wanted) -> Result<Replay, Faults> {
    // a contract that is wrong in floats is wrong whatever the format does on top of it
    let in_floats = policy.numeric_format.is_integer() && !wanted.exploring;
    let float = in_floats.then(|| policy.clone().with_format(NumericFormat::F32));
    let held = float.as_ref().unwrap_or(policy);
    let mut replay = compared(held, log, wanted)?;
    replay.in_floats = in_floats;
    replay.late = late::column(held, log, wanted, &replay);
    // what an integer format changes is said where it changes nothing, too
    if in_floats && replay.late.is_none() && replay.equal() {
        (replay.format, replay.uncounted) = answers::changed(policy, log, wanted)?;
    }
    Ok(replay)
}

// of a count that is left out of the JSON, as serde asks for it
#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes a reference")]
fn is_zero(count: &usize) -> bool {
    *count == 0
}

/// The same without a search for a column that is late.
fn compared(policy: &Policy, log: &Log, wanted: Wanted) -> Result<Replay, Faults> {
    let Wanted { tolerance, .. } = wanted;
    let late = log.is_late(wanted.skip);
    // the environment held no sample: what the features are does not depend on what a sensor can show
    let wide = &log.widened(policy);
    let course = match policy.numeric_format.scalar() {
        Scalar::F32 => course::<f32>(wide, log)?,
        Scalar::F64 => course::<f64>(wide, log)?,
    };
    let paths = policy.paths();
    let outputs = paths.iter().zip(&log.done).zip(&course.outputs);
    let results = outputs.map(|((path, done), own)| {
        let of = Logged {
            policy,
            path,
            log,
            done,
        };
        (commands(of, own, wanted), duties::duties(of, &own.commanded))
    });
    let results: Vec<(Option<ActionResult>, Option<DutyResult>)> = results.collect();
    let features = policy.features.iter().enumerate().map(|(index, feature)| {
        let own = course.observation(index);
        let logged = log.observed.get(index).and_then(Option::as_ref);
        FeatureResult {
            name: feature.name.clone(),
            own: ends(own),
            logged: logged.map(|logged| {
                let mut compared = compare(own, logged, log, allowed(policy, feature, logged, tolerance), &late);
                if compared.first_line.is_some() {
                    let is_other =
                        |duties: &&DutyResult| duties.first_line.is_some() && (duties.adds || !duties.derived);
                    let read = |(path, _): &(&DutyPath<'_>, _)| feature.source.reads(path.previous_duty);
                    let read = paths.iter().zip(&results).filter(read);
                    let mut follows = read.filter_map(|(_, (_, duties))| duties.as_ref().filter(is_other));
                    compared.explanation = match follows.next() {
                        // a line through two tables of duties would hide it in scale and offset
                        Some(duties) if duties.derived => Some(
                            "it follows the duties of the actions, which are others, or its own scale and offset are"
                                .to_owned(),
                        ),
                        Some(_) => Some("it follows the duties of the actions, which are others".to_owned()),
                        None => explain::explain(policy, &course, index, logged, tolerance),
                    };
                }
                compared
            }),
        }
    });
    let features = features.collect();
    let (mut one, mut several) = ((None, None), Vec::new());
    for (path, (actions, duties)) in paths.iter().zip(results) {
        match path.name.map(str::to_owned) {
            None => one = (actions, duties),
            Some(name) => several.push(OutputResult { name, actions, duties }),
        }
    }
    Ok(Replay {
        rows: log.rows(),
        skipped: log
            .is_late(0)
            .iter()
            .zip(&late)
            .filter(|(all, late)| all != late)
            .count(),
        episodes: log.begins.iter().filter(|begins| **begins).count(),
        features,
        actions: one.0,
        duties: one.1,
        outputs: several,
        late: None,
        format: None,
        uncounted: 0,
        in_floats: false,
        outside: log.outside(policy),
        tolerance,
        notes: log.notes.clone(),
    })
}

/// The choices of a log for an output, or the duties of a continuous actor in it; `None` if it has neither.
fn commands(of: Logged<'_>, course: &OutputCourse, wanted: Wanted) -> Option<ActionResult> {
    let Wanted {
        tolerance,
        exploring,
        skip,
    } = wanted;
    let Logged {
        policy,
        path,
        log,
        done,
    } = of;
    let late = log.is_late(skip);
    let is_late = |row: &usize| late.get(*row).copied().unwrap_or(true);
    let (mut ties, mut worst) = (0, None);
    let others: Vec<usize> = match (&done.actions, path.head.duty_span().zip(done.commanded())) {
        (Some(logged), _) => {
            let other = |row: &usize| logged.get(*row) != course.actions.get(*row);
            let others = (0..log.rows()).filter(is_late).filter(other);
            // the same measure as of golden decisions: what the trainer's own order of additions could have turned
            let is_tie = |row: &usize| (course.lost.get(*row)).is_some_and(|lost| *lost <= policy.golden_tolerance());
            let (tied, others) = others.partition::<Vec<usize>, _>(is_tie);
            ties = tied.len();
            others
        }
        (None, Some((span, logged))) => {
            let apart = |row: usize| Some((logged.get(row)? - course.duties.get(row)?).abs());
            // by the product: of a range that is one duty there is no share
            let near = |row: usize| Some(apart(row)? <= tolerance * span);
            let shares = (0..log.rows())
                .filter(is_late)
                .filter_map(|row| Some((apart(row)? / span, row)));
            let largest = shares
                .filter(|(share, _)| share.is_finite())
                .max_by(|a, b| a.0.total_cmp(&b.0));
            worst = largest.map(|(share, row)| (share, log.line(row)));
            // what is no number is not near
            (0..log.rows())
                .filter(is_late)
                .filter(|row| near(*row) != Some(true))
                .collect()
        }
        (None, None) => return None,
    };
    Some(ActionResult {
        equal: log.rows() - others.len() - ties,
        ties,
        first_line: others.first().map(|row| log.line(*row)),
        exploring,
        worst,
    })
}

fn compare(own: &[f64], logged: &[f64], log: &Log, allowed: f64, late: &[bool]) -> Compared {
    let differences: Vec<f64> = (own.iter().zip(logged).enumerate())
        .map(|(row, (own, logged))| match late.get(row) {
            Some(false) => 0.0,
            _ => (own - logged).abs(),
        })
        .collect();
    // what is no number is not within anything
    let is_equal = |difference: &f64| *difference <= allowed;
    let (row, worst) = differences
        .iter()
        .enumerate()
        .fold((0, 0.0), |worst, (row, difference)| {
            if *difference > worst.1 {
                (row, *difference)
            } else {
                worst
            }
        });
    Compared {
        range: ends(logged),
        equal: differences.iter().filter(|difference| is_equal(difference)).count(),
        worst,
        worst_line: log.line(row),
        first_line: differences
            .iter()
            .position(|difference| !is_equal(difference))
            .map(|row| log.line(row)),
        explanation: None,
    }
}
