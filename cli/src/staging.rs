//! Files on their way into a folder: written under temporary names, then renamed; two runs into one folder take turns.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Start of the names of temporary files; leftovers of an interrupted run are removed by the next that succeeds.
const TEMPORARY: &str = ".policyc-tmp-";

/// Whether a file was left by an interrupted run.
pub fn is_leftover(name: &str) -> bool {
    name.starts_with(TEMPORARY)
}

/// Two runs into one folder take turns. Where folders cannot be locked, the renames alone keep each file whole.
pub fn lock(folder: &Path) -> Option<File> {
    let file = File::open(folder).ok()?;
    file.lock().ok()?;
    Some(file)
}

/// What interrupted runs left in a folder: new files that were not yet, and old ones that were still, in their place.
pub fn leftovers(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let left = entries.filter(|entry| is_leftover(&entry.file_name().to_string_lossy()));
    left.map(|entry| entry.path()).collect()
}

/// Once all files are in their place.
pub fn remove_leftovers(folder: &Path) {
    for path in leftovers(folder) {
        // a leftover that cannot be removed does no harm
        let _ = fs::remove_file(path);
    }
}

struct StagedFile {
    temporary: PathBuf,
    backup: PathBuf,
    destination: PathBuf,
    /// Folders that were made for it, the outer ones first.
    folders: Vec<PathBuf>,
    had_backup: bool,
    published: bool,
}

/// Files written under temporary names; dropped without `publish` they vanish.
pub struct Staged {
    folder: PathBuf,
    /// Start of the temporary names of this run: no leftover of a run with the same process number has it.
    prefix: String,
    files: Vec<StagedFile>,
}

impl Staged {
    /// Nothing yet, for a folder that is there.
    pub fn new(folder: &Path) -> Self {
        let taken = leftovers(folder);
        let prefix = |run: usize| format!("{TEMPORARY}{}-{run}-", std::process::id());
        let is_free = |prefix: &String| {
            let mut names = taken.iter().filter_map(|path| path.file_name());
            !names.any(|name| name.to_string_lossy().starts_with(prefix))
        };
        // one of them is free: there are more than leftovers
        let prefix = (0..taken.len())
            .map(prefix)
            .find(is_free)
            .unwrap_or_else(|| prefix(taken.len()));
        Self {
            folder: folder.to_owned(),
            prefix,
            files: Vec::new(),
        }
    }

    /// Writes a file under a temporary name.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn stage(&mut self, name: &str, content: &[u8]) -> io::Result<()> {
        let index = self.files.len();
        let temporary = self.folder.join(format!("{}{index}", self.prefix));
        let backup = self.folder.join(format!("{}{index}-old", self.prefix));
        let mut file = OpenOptions::new().write(true).create_new(true).open(&temporary)?;
        self.files.push(StagedFile {
            temporary,
            backup,
            destination: self.folder.join(name),
            folders: Vec::new(),
            had_backup: false,
            published: false,
        });
        file.write_all(content)?;
        file.sync_all()
    }

    /// Puts all files into their place.
    ///
    /// # Errors
    /// The first file that cannot be replaced; all are as before then.
    pub fn publish(mut self) -> Result<(), (PathBuf, io::Error)> {
        self.publish_first(self.files.len())?;
        for file in &mut self.files {
            if file.had_backup {
                let _ = fs::remove_file(&file.backup);
            }
        }
        self.files.clear();
        Ok(())
    }

    /// Puts the first `count` files into their place; what is dropped then goes back.
    pub(crate) fn publish_first(&mut self, count: usize) -> Result<(), (PathBuf, io::Error)> {
        for file in self.files.iter_mut().take(count).filter(|file| !file.published) {
            file.publish().map_err(|error| (file.destination.clone(), error))?;
        }
        Ok(())
    }
}

impl StagedFile {
    fn publish(&mut self) -> io::Result<()> {
        // the name may lead into folders: those that are missing, from the innermost out
        let missing = self
            .destination
            .ancestors()
            .skip(1)
            .take_while(|folder| !folder.exists());
        let missing: Vec<PathBuf> = missing.map(Path::to_owned).collect();
        for folder in missing.into_iter().rev() {
            fs::create_dir(&folder)?;
            self.folders.push(folder);
        }
        if fs::symlink_metadata(&self.destination).is_ok() {
            // a second name for the old file: the destination is never missing, whenever the run is interrupted
            fs::hard_link(&self.destination, &self.backup)
                .or_else(|_| fs::copy(&self.destination, &self.backup).map(|_| ()))?;
            self.had_backup = true;
        }
        fs::rename(&self.temporary, &self.destination)?;
        self.published = true;
        Ok(())
    }
}

impl Drop for Staged {
    /// Puts back what was there before.
    fn drop(&mut self) {
        for file in self.files.iter().rev() {
            // nothing more can be done where putting back fails, too
            let _ = match (file.published, file.had_backup) {
                (true, true) => fs::rename(&file.backup, &file.destination),
                (true, false) => fs::remove_file(&file.destination),
                (false, had_backup) => {
                    if had_backup {
                        let _ = fs::remove_file(&file.backup);
                    }
                    fs::remove_file(&file.temporary)
                }
            };
            for folder in file.folders.iter().rev() {
                let _ = fs::remove_dir(folder);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_publication_puts_the_old_files_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        fs::write(path("a"), "old a").unwrap();
        fs::write(path("b"), "old b").unwrap();
        let mut staged = Staged::new(folder.path());
        for name in ["a", "b"] {
            staged.stage(name, b"new").unwrap();
        }
        // the second rename cannot succeed any more
        fs::remove_file(&staged.files[1].temporary).unwrap();
        assert!(staged.publish().is_err());
        assert!(leftovers(folder.path()).is_empty());
        assert_eq!(fs::read_to_string(path("a")).unwrap(), "old a");
        assert_eq!(fs::read_to_string(path("b")).unwrap(), "old b");
    }

    #[test]
    fn folders_of_a_name_are_made_and_go_again_with_a_failed_publication() {
        let folder = tempfile::tempdir().unwrap();
        let stage = || {
            let mut staged = Staged::new(folder.path());
            for name in ["a/b/c", "a/d"] {
                staged.stage(name, b"new").unwrap();
            }
            staged
        };
        let staged = stage();
        fs::remove_file(&staged.files[1].temporary).unwrap();
        assert!(staged.publish().is_err());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
        assert!(stage().publish().is_ok());
        assert_eq!(fs::read_to_string(folder.path().join("a/b/c")).unwrap(), "new");
        assert_eq!(fs::read_to_string(folder.path().join("a/d")).unwrap(), "new");
    }

    #[test]
    fn a_leftover_of_the_same_process_number_is_in_nobodys_way() {
        let folder = tempfile::tempdir().unwrap();
        for _ in 0..3 {
            let mut staged = Staged::new(folder.path());
            staged.stage("a", b"new").unwrap();
            std::mem::forget(staged);
        }
        assert_eq!(leftovers(folder.path()).len(), 3);
    }
}
