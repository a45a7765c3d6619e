//! Checkpoints of a training: written on the way and after an interruption, gone when the training is whole.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use toml_input::Message;

use crate::failure::Failure;
use crate::output;

const CHECKPOINTS: &str = "checkpoints";

/// Checkpoints of a training, one file per seed.
pub struct Kept {
    out: PathBuf,
    /// Where they lie.
    pub folder: PathBuf,
    failure: Mutex<Option<Failure>>,
}

impl Kept {
    /// Of a training that goes to this folder.
    pub fn new(out: &Path) -> Self {
        Self {
            out: out.to_owned(),
            folder: out.join(CHECKPOINTS),
            failure: Mutex::new(None),
        }
    }

    fn path(&self, seed: u64) -> PathBuf {
        self.folder.join(format!("seed-{seed}.bin"))
    }

    /// The checkpoints to go on from. Hours of work are not overwritten by a command that was typed once too often.
    pub fn prepare(&self, seeds: &[u64], resume: bool) -> Result<BTreeMap<u64, Vec<u8>>, Failure> {
        let (out, kept) = (self.out.display(), self.folder.display());
        if self.out.join("policy.toml").exists() {
            let message = Message::new(format!("{out} holds a policy already; nothing written"));
            return Err(message.hint("choose another --out, or move it away").into());
        }
        let found: Vec<u64> = seeds.iter().copied().filter(|seed| self.path(*seed).exists()).collect();
        match (resume, found.is_empty()) {
            (false, true) => Ok(BTreeMap::new()),
            (false, false) => {
                let message = Message::new(format!("{out} holds an interrupted training; nothing written"));
                let hint = format!("--resume goes on with it; to begin anew, remove {kept} or choose another --out");
                Err(message.hint(hint).into())
            }
            (true, true) => {
                let message = Message::new("nothing to resume");
                let message = message.found(format!("no checkpoint of these seeds in {kept}"));
                Err(message.hint("without --resume the training begins").into())
            }
            (true, false) => found.into_iter().map(|seed| Ok((seed, self.read(seed)?))).collect(),
        }
    }

    fn read(&self, seed: u64) -> Result<Vec<u8>, Failure> {
        let path = self.path(seed);
        std::fs::read(&path).map_err(|error| Message::new(format!("cannot read {}: {error}", path.display())).into())
    }

    /// Writes that of a seed.
    pub fn write(&self, seed: u64, bytes: &[u8]) -> Result<(), Failure> {
        let name = self
            .path(seed)
            .file_name()
            .map(|name| name.to_string_lossy().into_owned());
        let files = BTreeMap::from([(name.unwrap_or_default(), bytes.to_vec())]);
        output::write_all(&self.folder, &files)
    }

    /// As [`Kept::write`], while the training runs: the first failure is kept for [`Kept::failure`]. Whether it could be
    /// written.
    pub fn try_write(&self, seed: u64, bytes: &[u8]) -> bool {
        let Err(failure) = self.write(seed, bytes) else {
            return true;
        };
        if let Ok(mut first) = self.failure.lock() {
            first.get_or_insert(failure);
        }
        false
    }

    /// The first checkpoint that could not be written, once.
    pub fn failure(&self) -> Result<(), Failure> {
        let failure = self.failure.lock().ok().and_then(|mut failure| failure.take());
        failure.map_or(Ok(()), Err)
    }

    /// They belong to a training that is whole now.
    pub fn remove(&self) {
        // what cannot be removed only takes room
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}
