//! `--tensorboard DIR`: a folder of event files for each seed, written while the training runs.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::{SystemTime, UNIX_EPOCH};

use toml_input::Message;
use train::summary::Worst;
use train::{Progress, SeedRun, tensorboard};

use crate::failure::Failure;

/// Where the events of all seeds go.
pub struct Events {
    folder: PathBuf,
    /// Seconds since 1970: part of a file's name, by which TensorBoard orders the files of a run.
    since: u64,
    failure: Mutex<Option<Failure>>,
}

impl Events {
    /// Files in `folder`; those of an interrupted training are gone on with where it is resumed.
    ///
    /// # Errors
    /// If one of the seeds has events there and is not resumed: two trainings in one curve are none.
    pub fn new(folder: &Path, seeds: &[u64], resume: bool) -> Result<Self, Failure> {
        let events = Self {
            folder: folder.to_owned(),
            since: wall_time() as u64,
            failure: Mutex::new(None),
        };
        let taken = seeds.iter().map(|seed| events.run(*seed)).find(|run| run.exists());
        match taken {
            Some(run) if !resume => {
                let message = Message::new(format!("{} holds events already; nothing written", run.display()));
                Err(message.hint("choose another --tensorboard, or move it away").into())
            }
            _ => Ok(events),
        }
    }

    fn run(&self, seed: u64) -> PathBuf {
        self.folder.join(format!("seed-{seed}"))
    }

    /// A look of a seed.
    pub fn look(&self, progress: &Progress) {
        let values = tensorboard::of_look(&progress.look, progress.best);
        self.add(progress.seed, progress.look.step, &values);
    }

    /// A seed has ended: the evaluation of its best policy, at the control period after which it was found.
    pub fn ended(&self, seed: u64, run: &SeedRun) {
        if let Some(outcome) = &run.outcome {
            let values = tensorboard::of_evaluation(&Worst::of(&outcome.findings), outcome.evaluated.cost);
            self.add(seed, outcome.best_step, &values);
        }
    }

    fn add(&self, seed: u64, step: u64, values: &[(&str, f64)]) {
        let Ok(mut failure) = self.failure.lock() else { return };
        // the first that cannot be written is told at the end, and the training is worth more than its events
        if failure.is_none()
            && let Err(error) = self.append(seed, step, values)
        {
            let file = self.run(seed);
            *failure = Some(Message::new(format!("cannot write events to {}: {error}", file.display())).into());
        }
    }

    fn append(&self, seed: u64, step: u64, values: &[(&str, f64)]) -> std::io::Result<()> {
        let run = self.run(seed);
        fs::create_dir_all(&run)?;
        // TensorBoard takes files with `tfevents` in their name
        let path = run.join(format!("events.out.tfevents.{}.policyc", self.since));
        let mut file = fs::OpenOptions::new().create(true).append(true).open(path)?;
        let now = wall_time();
        let mut bytes = Vec::new();
        if file.metadata()?.len() == 0 {
            bytes = tensorboard::opening(now);
        }
        bytes.extend(tensorboard::scalars(now, step, values));
        // whole records at once: TensorBoard may be reading
        file.write_all(&bytes)
    }

    /// The first event that could not be written, once.
    ///
    /// # Errors
    /// That.
    pub fn failure(&self) -> Result<(), Failure> {
        let failure = self.failure.lock().ok().and_then(|mut failure| failure.take());
        failure.map_or(Ok(()), Err)
    }
}

/// Seconds since 1970.
fn wall_time() -> f64 {
    // a clock before 1970 only shifts an axis
    SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .map_or(0.0, |since| since.as_secs_f64())
}
