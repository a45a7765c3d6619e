//! What was found, on disk: the input, and beside it how it came about.

use std::path::{Path, PathBuf};

use crate::guard::Fault;

/// A fault with its input.
#[derive(Debug, Clone)]
pub struct Finding<'a> {
    /// Name of the target.
    pub target: &'a str,
    /// What happened.
    pub fault: &'a Fault,
    /// The input, as short as it was made.
    pub input: &'a [u8],
    /// Seed of the run.
    pub seed: u64,
    /// Which input of the run it was, from 1.
    pub execution: u64,
}

impl Finding<'_> {
    /// Writes the finding below `folder`; returns the file of the input.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn write(&self, folder: &Path) -> std::io::Result<PathBuf> {
        let folder = folder.join(self.target);
        std::fs::create_dir_all(&folder)?;
        let digest = policy::sha256(self.input);
        let file = folder.join(digest.get(..16).unwrap_or(&digest));
        std::fs::write(&file, self.input)?;
        let about = format!(
            "target {}\nfault {}\nseed {}\nexecution {}\n",
            self.target, self.fault, self.seed, self.execution
        );
        std::fs::write(file.with_extension("txt"), about)?;
        Ok(file)
    }
}
