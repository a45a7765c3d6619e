//! Ctrl-C: every command ends with 130, and no temporary file stays behind.
//!
//! All temporary folders of a run lie in one. A signal removes it while the rest of the program is still at work, compilers
//! among it: from then on nothing may be said or written that comes of their failing.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::{Duration, Instant};

use tempfile::TempDir;
use toml_input::{Faults, Message};

use crate::failure::Failure;
use crate::outcome::Outcome;

/// Set by the first signal for a command that ends by itself; see [`stop_on_signal`].
static STOP: OnceLock<Arc<AtomicBool>> = OnceLock::new();
/// All temporary files of the run.
static SCRATCH: OnceLock<Arc<Mutex<Option<PathBuf>>>> = OnceLock::new();
/// The program is being ended.
static ENDING: AtomicBool = AtomicBool::new(false);

/// Compilers and emulators end within this time, because their files and pipes are gone.
const PATIENCE: Duration = Duration::from_secs(10);

/// Handles signals from now on and gives all temporary files of this run a folder, which goes when the result is dropped.
///
/// # Errors
/// If signals cannot be handled.
pub fn watch() -> Result<Option<TempDir>, Failure> {
    // held while the folder is made: a signal in between waits and then finds it
    let folder = SCRATCH.get_or_init(Arc::default);
    let mut made = lock(folder);
    let known = Arc::clone(folder);
    ctrlc::set_handler(move || match STOP.get() {
        Some(stop) if !stop.swap(true, Ordering::Relaxed) => {}
        _ => end(lock(&known).as_deref()),
    })?;
    // where there is no folder for temporary files, the command that needs one says so
    let scratch = tempfile::Builder::new().prefix("policyc-").tempdir().ok();
    let scratch = scratch.filter(|folder| tempfile::env::override_temp_dir(folder.path()).is_ok());
    *made = scratch.as_ref().map(|folder| folder.path().to_owned());
    Ok(scratch)
}

/// A path is whole whoever panicked with the lock in hand.
fn lock(folder: &Mutex<Option<PathBuf>>) -> MutexGuard<'_, Option<PathBuf>> {
    folder.lock().unwrap_or_else(PoisonError::into_inner)
}

/// For a command that keeps what it has done: the first signal sets this flag, only the second ends the program.
pub fn stop_on_signal() -> Arc<AtomicBool> {
    Arc::clone(STOP.get_or_init(Arc::default))
}

/// Ends the program as a second signal does: for a worker whose campaign is gone.
pub fn end_now() -> ! {
    let scratch = SCRATCH.get().and_then(|folder| lock(folder).clone());
    end(scratch.as_deref())
}

/// Whether a signal has come that [`stop_on_signal`] heeds.
pub fn is_stopped() -> bool {
    STOP.get().is_some_and(|stop| stop.load(Ordering::Relaxed))
}

/// An error where the user has had enough.
///
/// # Errors
/// After a signal that [`stop_on_signal`] heeds.
pub fn go_on() -> Result<(), Faults> {
    match STOP.get() {
        Some(stop) if stop.load(Ordering::Relaxed) => Err(Message::new("interrupted").into()),
        _ => Ok(()),
    }
}

/// Does not return once the program is being ended: to be called before anything leaves it.
pub fn go_no_further_if_ending() {
    while ENDING.load(Ordering::SeqCst) {
        std::thread::park();
    }
}

fn end(scratch: Option<&Path>) -> ! {
    ENDING.store(true, Ordering::SeqCst);
    if let Some(folder) = scratch {
        let begun = Instant::now();
        // a compiler may put a file into it while it is being removed
        while std::fs::remove_dir_all(folder).is_err() && folder.exists() && begun.elapsed() < PATIENCE {
            std::thread::sleep(Duration::from_millis(10));
        }
    }
    // nobody may be listening any more
    let _ = writeln!(std::io::stderr(), "\ninterrupted");
    std::process::exit(Outcome::Interrupted as i32)
}
