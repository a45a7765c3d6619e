//! The inputs of one target, drawn from a seed, until a count or a time is reached.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use random::SplitMix;

use crate::clock::Clock;
use crate::corpus::Corpus;
use crate::finding::Finding;
use crate::guard::{Fault, Reader, probe};
use crate::journal::Journal;
use crate::minimise::minimise;
use crate::mutate::mutate;
use crate::targets::Target;

/// Between two lines of progress.
const PROGRESS: Duration = Duration::from_secs(10);
/// Different faults after which a target is given up: it wants mending, not counting.
const MOST_FINDINGS: usize = 20;

/// When a run ends: at whichever comes first.
#[derive(Debug, Clone, Copy, Default)]
pub struct Until {
    /// Inputs.
    pub executions: Option<u64>,
    /// Seconds.
    pub seconds: Option<f64>,
}

/// How a run is done.
#[derive(Debug)]
pub struct Plan {
    /// Seed of all inputs.
    pub seed: u64,
    /// When it ends.
    pub until: Until,
    /// Folder of findings.
    pub findings: PathBuf,
}

/// What came of a run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Summary {
    /// Inputs read.
    pub executions: u64,
    /// Those that the reader took.
    pub accepted: u64,
    /// Time of a processor for all of it.
    pub seconds: f64,
    /// Kinds of answers.
    pub kinds: usize,
    /// Different faults, in words.
    pub findings: Vec<String>,
}

impl Summary {
    /// Inputs for each second of a processor.
    #[must_use]
    pub fn rate(&self) -> f64 {
        self.executions as f64 / self.seconds.max(1e-9)
    }
}

/// Runs one target. `journal` holds the input of the moment; `say` gets a line of progress now and then.
///
/// # Errors
/// If the target's seeds are missing or the findings cannot be written.
pub fn run(target: &Target, plan: &Plan, journal: Option<&Journal>, say: &dyn Fn(&str)) -> Result<Summary, String> {
    let reader = (target.reader)()?;
    let mut corpus = Corpus::new((target.seeds)()?);
    // one stream a target: a target that comes new leaves the inputs of all others as they are
    let mut random = SplitMix::new(plan.seed ^ name_hash(target.name));
    let mut known = BTreeSet::new();
    let mut summary = Summary::default();
    let mut input = Vec::new();
    let clock = Clock::start();
    let mut said = Instant::now();
    loop {
        let elapsed = clock.passed();
        if is_over(&plan.until, summary.executions, elapsed) || known.len() >= MOST_FINDINGS {
            break;
        }
        if said.elapsed() > PROGRESS {
            said = Instant::now();
            summary.seconds = clock.worked().as_secs_f64();
            say(&progress(target.name, &summary, corpus.kinds()));
        }
        // the seeds as they are come first: what they answer is known before anything is changed
        match usize::try_from(summary.executions)
            .ok()
            .and_then(|index| corpus.seed(index))
        {
            Some(seed) => input = seed.to_vec(),
            None => mutate(target, &corpus, &mut random, &mut input),
        }
        summary.executions += 1;
        if let Some(journal) = journal {
            journal.note(summary.executions, &input);
        }
        match probe(&*reader, &input, &target.limits) {
            Ok(answer) => {
                summary.accepted += u64::from(answer.accepted);
                corpus.learn(&input, &answer);
            }
            Err(fault) => {
                if known.insert(fault.kind()) {
                    let words = report(target, plan, (&*reader, journal), &fault, (&input, summary.executions))?;
                    say(&words);
                    summary.findings.push(words);
                }
            }
        }
    }
    summary.seconds = clock.worked().as_secs_f64();
    summary.kinds = corpus.kinds();
    Ok(summary)
}

fn is_over(until: &Until, executions: u64, elapsed: Duration) -> bool {
    let counted = until.executions.is_some_and(|most| executions >= most);
    counted || until.seconds.is_some_and(|most| elapsed.as_secs_f64() >= most)
}

fn progress(name: &str, summary: &Summary, kinds: usize) -> String {
    format!(
        "{name}: {} executions, {:.0} a second, {} accepted, {kinds} kinds of answers, {} findings",
        summary.executions,
        summary.rate(),
        summary.accepted,
        summary.findings.len()
    )
}

fn report(
    target: &Target,
    plan: &Plan,
    (reader, journal): (&Reader, Option<&Journal>),
    fault: &Fault,
    (input, execution): (&[u8], u64),
) -> Result<String, String> {
    let kind = fault.kind();
    let short = minimise(input, |bytes| {
        if let Some(journal) = journal {
            journal.note(execution, bytes);
        }
        probe(reader, bytes, &target.limits).is_err_and(|other| other.kind() == kind)
    });
    let finding = Finding {
        target: target.name,
        fault,
        input: &short,
        seed: plan.seed,
        execution,
    };
    let file = finding
        .write(&plan.findings)
        .map_err(|error| format!("cannot write a finding to {}: {error}", plan.findings.display()))?;
    Ok(format!("FINDING {}: {fault}; {}", target.name, file.display()))
}

/// FNV-1a of a name: a stream of random numbers for each.
fn name_hash(name: &str) -> u64 {
    // offset and prime as published for 64 bits
    name.bytes().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}
