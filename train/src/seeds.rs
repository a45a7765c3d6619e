//! Several seeds side by side: one thread each, as many as there are cores.

use std::collections::BTreeMap;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use report::grouped;
use toml_input::Message;

use crate::checkpoint::other;
use crate::contract::Contract;
use crate::faults::Error;
use crate::outcome::Outcome;
use crate::settings::Settings;
use crate::summary::Worst;
use crate::trainer::{Ended, Progress, Trainer};
use closed_loop::Converter;
use closed_loop::environment::Environment;
use closed_loop::scenario::settled_band;
use closed_loop::{digits, time_digits};

/// One seed's training after a run.
#[derive(Debug)]
pub struct SeedRun {
    /// The outcome; nothing if it was interrupted before the first look.
    pub outcome: Option<Outcome>,
    /// Why it stopped.
    pub ended: Ended,
    /// Control periods so far.
    pub steps: u64,
    /// From which it goes on.
    pub checkpoint: Vec<u8>,
}

/// Control periods between two looks at the clock: with the paper's network some 50 ms.
const BETWEEN_CLOCKS: u64 = 256;

/// How several seeds are trained.
#[derive(Debug, Clone, Default)]
pub struct Course {
    /// Cores used at most; 0: all.
    pub threads: usize,
    /// Seeds that go on from a checkpoint.
    pub checkpoints: BTreeMap<u64, Vec<u8>>,
    /// Time between two checkpoints on the way; without it there are none. A look at the selection scenarios is not
    /// interrupted: one that takes longer puts the checkpoint off.
    pub checkpoint_every: Option<Duration>,
}

/// Who follows a training; called from its threads.
pub trait Watch: Sync {
    /// At every look of every seed.
    fn look(&self, progress: &Progress);

    /// A checkpoint on the way, from which the seed could go on.
    fn checkpoint(&self, seed: u64, bytes: &[u8]);

    /// A seed has ended.
    fn ended(&self, seed: u64, run: &SeedRun);
}

/// Nobody follows.
#[derive(Debug, Clone, Copy)]
pub struct Unwatched;

impl Watch for Unwatched {
    fn look(&self, _: &Progress) {}
    fn checkpoint(&self, _: u64, _: &[u8]) {}
    fn ended(&self, _: u64, _: &SeedRun) {}
}

/// Trains every seed of `settings`, one thread each, as many at once as `course` allows. The results stand in the order of
/// the seeds and depend on nothing but files, seeds and checkpoints.
///
/// # Errors
/// The first of the errors, in the order of the seeds.
pub fn train_all<E: Environment + Sync>(
    settings: &Settings,
    contract: &Contract,
    environment: &E,
    course: &Course,
    stop: &AtomicBool,
    watch: &dyn Watch,
) -> Result<Vec<SeedRun>, Error> {
    let seeds = &settings.seeds;
    let cores = thread::available_parallelism().map_or(1, usize::from);
    let threads = if course.threads == 0 { cores } else { course.threads }.min(seeds.len());
    let results: Vec<Mutex<Option<Result<SeedRun, Error>>>> = seeds.iter().map(|_| Mutex::new(None)).collect();
    // one after the other from a common list: seeds take very different times, because each may stop early
    let next = AtomicUsize::new(0);
    let work = || {
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let (Some(&seed), Some(slot)) = (seeds.get(index), results.get(index)) else {
                return;
            };
            let trainer = Trainer::new(settings, contract, environment, seed);
            let result = trainer.and_then(|trainer| one(trainer, course, stop, watch));
            if let Ok(mut slot) = slot.lock() {
                *slot = Some(result);
            }
        }
    };
    thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(work);
        }
    });
    let missing = || Err(Message::new("a training thread ended without a result").into());
    let result = |slot: Mutex<Option<_>>| slot.into_inner().ok().flatten().unwrap_or_else(missing);
    results.into_iter().map(result).collect()
}

/// [`train_all`] on a converter, compiled in this crate: its generics would else be compiled in the caller's, which may be
/// optimised less.
///
/// # Errors
/// As [`train_all`].
pub fn train_converter(
    settings: &Settings,
    contract: &Contract,
    converter: &Converter,
    course: &Course,
    stop: &AtomicBool,
    watch: &dyn Watch,
) -> Result<Vec<SeedRun>, Error> {
    train_all(settings, contract, converter, course, stop, watch)
}

fn one<E: Environment>(
    mut trainer: Trainer<E>,
    course: &Course,
    stop: &AtomicBool,
    watch: &dyn Watch,
) -> Result<SeedRun, Error> {
    let seed = trainer.seed();
    if let Some(bytes) = course.checkpoints.get(&seed) {
        trainer.resume(bytes)?;
        // `resume` takes the checkpoint's seed over, so a file under the wrong name would train one seed twice
        if trainer.seed() != seed {
            return Err(other());
        }
    }
    // the first comes at once: what has begun can be resumed
    let mut last: Option<Instant> = None;
    let ended = loop {
        let next = course
            .checkpoint_every
            .map_or(u64::MAX, |_| trainer.step_count() + BETWEEN_CLOCKS);
        let ended = trainer.run_until(next, stop, |progress| watch.look(progress))?;
        // also called interrupted where only a look at the clock was due
        if ended != Ended::Interrupted || stop.load(Ordering::Relaxed) {
            break ended;
        }
        let is_due = |every| last.is_none_or(|last| last.elapsed() >= every);
        if course.checkpoint_every.is_some_and(is_due) {
            watch.checkpoint(seed, &trainer.checkpoint()?);
            last = Some(Instant::now());
        }
    };
    let run = SeedRun {
        outcome: trainer.best().is_some().then(|| trainer.finish(ended)).transpose()?,
        ended,
        steps: trainer.step_count(),
        checkpoint: trainer.checkpoint()?,
    };
    watch.ended(seed, &run);
    Ok(run)
}

/// Of the runs whose policies meet the specification in their evaluation the one that did best on the selection scenarios; if none does, the one
/// whose evaluation comes nearest. The first among equals.
#[must_use]
pub fn best(runs: &[SeedRun]) -> Option<&Outcome> {
    let outcomes = runs.iter().filter_map(|run| run.outcome.as_ref());
    outcomes.min_by(|a, b| {
        // the evaluation opens the door and no more: ranked by its figures, they would be those of a choice among many. Of those that fail it none is
        // better than it shows
        let order = |outcome: &Outcome| match outcome.evaluated.met {
            true => (0, !outcome.selected.met, outcome.selected.cost),
            false => (1, false, outcome.evaluated.cost),
        };
        let ((a_door, a_missed, a_cost), (b_door, b_missed, b_cost)) = (order(a), order(b));
        (a_door.cmp(&b_door))
            .then(a_missed.cmp(&b_missed))
            .then(a_cost.total_cmp(&b_cost))
    })
}

/// What the one that [`best`] chooses is among the others, in words.
#[must_use]
pub fn chosen(settings: &Settings, best: &Outcome) -> &'static str {
    match (settings.specification.is_empty(), best.evaluated.met) {
        (true, _) => "whose evaluation came out best",
        (false, true) => "of those that meet the specification the best on the selection scenarios",
        (false, false) => "the nearest to the specification, which none meets",
    }
}

/// A line for each seed that has an outcome, for people: whether it meets the specification, and the largest figures of its
/// evaluation, V and ms.
#[must_use]
pub fn table(settings: &Settings, runs: &[SeedRun]) -> String {
    let verdict = |met: bool| match (settings.specification.is_empty(), met) {
        (true, _) => "-",
        (false, true) => "met",
        (false, false) => "missed",
    };
    let mut text =
        "seed  control periods  kept after  selection  evaluation  deviation V  settling ms  tail V   cost\n"
            .to_owned();
    for run in runs {
        let Some(outcome) = &run.outcome else { continue };
        let worst = Worst::of(&outcome.findings);
        let volts = digits(settled_band(settings.reward.v_ref));
        let (tail, times) = (volts + 1, time_digits(worst.settling));
        text.push_str(&format!(
            "{:4}  {:>15}  {:>10}  {:<9}  {:<10}  {:>11.volts$}  {:>11.times$}  {:>6.tail$}  {:>6.3}\n",
            outcome.seed,
            grouped(run.steps),
            grouped(outcome.best_step),
            verdict(outcome.selected.met),
            verdict(outcome.evaluated.met),
            worst.deviation,
            1e3 * worst.settling,
            worst.tail_max,
            outcome.selected.cost,
        ));
    }
    text
}
