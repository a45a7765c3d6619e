//! The process that performs tasks, a line in and a line out for each.

use std::io::{BufRead, Write};
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, mpsc};

use campaign::BUILD;
use serde::{Deserialize, Serialize};

use super::perform::{Performed, perform_in};
use crate::failure::Failure;
use crate::interruption;
use crate::outcome::Outcome;

/// The one argument of a worker. It is no command: nobody types it.
pub const WORKER: &str = "campaign-worker";

/// What a line out begins with: a program that a task starts may print, too.
pub const ANSWER: &str = "policyc-task ";

/// A line in.
#[derive(Debug, Serialize, Deserialize)]
pub struct Job {
    /// The build of the campaign, which named the task: another one may compute something else.
    pub build: String,
    /// An absolute path.
    pub folder: PathBuf,
    /// The command line behind `policyc`.
    pub arguments: Vec<String>,
}

/// Performs jobs until there are no more. When its standard input ends in the midst of one, the campaign is gone or has had enough,
/// and so has the worker.
pub fn work() -> Outcome {
    match answered() {
        Ok(()) => Outcome::Done,
        Err(failure) => {
            failure.print();
            Outcome::Different
        }
    }
}

fn answered() -> Result<(), Failure> {
    // a Ctrl-C reaches the whole group: a training then leaves a checkpoint
    interruption::stop_on_signal();
    let _scratch = interruption::watch()?;
    let (send, receive) = mpsc::channel::<Job>();
    let owed = Arc::new(AtomicUsize::new(0));
    let owing = Arc::clone(&owed);
    std::thread::spawn(move || {
        for line in std::io::stdin().lock().lines().map_while(Result::ok) {
            let Ok(job) = serde_json::from_str(&line) else { break };
            owing.fetch_add(1, Ordering::SeqCst);
            if send.send(job).is_err() {
                break;
            }
        }
        if owing.load(Ordering::SeqCst) > 0 {
            interruption::end_now();
        }
    });
    while let Ok(job) = receive.recv() {
        let performed = match job.build == BUILD {
            true => perform_in(&job.folder, &job.arguments),
            false => Performed::refused(&job.build),
        };
        let line = format!("{ANSWER}{}\n", serde_json::to_string(&performed)?);
        let mut out = std::io::stdout().lock();
        out.write_all(line.as_bytes())?;
        out.flush()?;
        owed.fetch_sub(1, Ordering::SeqCst);
    }
    Ok(())
}
