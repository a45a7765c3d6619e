//! A temporary folder for readers that open a path.

use std::path::{Path, PathBuf};

use tempfile::TempDir;

/// A temporary folder: in memory where the system has it as a folder, since a disk would be what is measured.
pub(crate) fn folder() -> std::io::Result<TempDir> {
    let memory = Path::new("/dev/shm");
    match memory.is_dir() {
        true => tempfile::tempdir_in(memory),
        false => tempfile::tempdir(),
    }
}

pub(super) struct Desk {
    folder: TempDir,
}

impl Desk {
    pub fn new() -> Result<Self, String> {
        let folder = folder().map_err(|error| format!("cannot make a folder: {error}"))?;
        Ok(Desk { folder })
    }

    /// The path of `name`, which holds `bytes` from now on.
    pub fn file(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.path(name);
        let outcome = std::fs::write(&path, bytes);
        assert!(outcome.is_ok(), "no room in the temporary folder: {outcome:?}");
        path
    }

    /// A path in the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }
}
