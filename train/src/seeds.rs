//! Several seeds side by side: one thread each, as many as there are cores.

use std::collections::BTreeMap;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread;

use crate::contract::Contract;
use crate::faults::Error;
use crate::outcome::Outcome;
use crate::settings::Settings;
use crate::trainer::{Ended, Progress, Trainer};
use closed_loop::environment::Environment;

/// One seed's training after a run.
#[derive(Debug)]
pub struct SeedRun {
    /// The outcome; nothing if it was interrupted before the first look.
    pub outcome: Option<Outcome>,
    /// Why it stopped.
    pub ended: Ended,
    /// From which it goes on.
    pub checkpoint: Vec<u8>,
}

/// Trains every seed of `settings`, on at most `threads` cores at once (0: all). A seed with bytes in `checkpoints` goes on
/// from there. `progress` is called from the threads. The results stand in the order of the seeds and depend on nothing
/// but files, seeds and checkpoints.
///
/// # Errors
/// The first of the errors, in the order of the seeds.
pub fn train_all<E: Environment + Sync>(
    settings: &Settings,
    contract: &Contract,
    environment: &E,
    threads: usize,
    checkpoints: &BTreeMap<u64, Vec<u8>>,
    stop: &AtomicBool,
    progress: &(dyn Fn(&Progress) + Sync),
) -> Result<Vec<SeedRun>, Error> {
    let seeds = &settings.seeds;
    let cores = thread::available_parallelism().map_or(1, usize::from);
    let threads = if threads == 0 { cores } else { threads }.min(seeds.len());
    let results: Vec<Mutex<Option<Result<SeedRun, Error>>>> = seeds.iter().map(|_| Mutex::new(None)).collect();
    let next = AtomicUsize::new(0);
    let work = || {
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let (Some(&seed), Some(slot)) = (seeds.get(index), results.get(index)) else {
                return;
            };
            let checkpoint = checkpoints.get(&seed).map(Vec::as_slice);
            let result = one(settings, contract, environment, seed, checkpoint, stop, progress);
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
    let missing = || Err(Error::Mismatch("a training thread ended without a result".to_owned()));
    let result = |slot: Mutex<Option<_>>| slot.into_inner().ok().flatten().unwrap_or_else(missing);
    results.into_iter().map(result).collect()
}

fn one<E: Environment>(
    settings: &Settings,
    contract: &Contract,
    environment: &E,
    seed: u64,
    checkpoint: Option<&[u8]>,
    stop: &AtomicBool,
    progress: &(dyn Fn(&Progress) + Sync),
) -> Result<SeedRun, Error> {
    let mut trainer = Trainer::new(settings, contract, environment, seed)?;
    if let Some(bytes) = checkpoint {
        trainer.resume(bytes)?;
    }
    let ended = trainer.run(stop, progress)?;
    Ok(SeedRun {
        outcome: trainer.best().is_some().then(|| trainer.finish(ended)).transpose()?,
        ended,
        checkpoint: trainer.checkpoint()?,
    })
}

/// The run whose policy did best on the selection scenarios; the first among equals.
#[must_use]
pub fn best(runs: &[SeedRun]) -> Option<&Outcome> {
    let outcomes = runs.iter().filter_map(|run| run.outcome.as_ref());
    outcomes.min_by(|a, b| {
        let order = |outcome: &Outcome| (!outcome.selected.met, outcome.selected.cost);
        let ((a_open, a_cost), (b_open, b_cost)) = (order(a), order(b));
        a_open.cmp(&b_open).then(a_cost.total_cmp(&b_cost))
    })
}
