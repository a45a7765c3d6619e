//! The only writer of files: all or nothing, under a lock, through temporary files in the same folder.

use std::collections::BTreeMap;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use toml_input::Message;

use crate::failure::Failure;
use crate::interruption;
use crate::ownership::{self, Replacing};

/// Start of the names of temporary files; leftovers of an interrupted run are removed by the next.
const TEMPORARY: &str = ".policyc-tmp-";

/// Writes files into a folder: either all of them are there afterwards or none has changed.
///
/// # Errors
/// If the folder cannot be made or written, or a destination is a folder or a symbolic link.
pub fn write_all(folder: &Path, files: &BTreeMap<String, Vec<u8>>) -> Result<(), Failure> {
    interruption::go_no_further_if_ending();
    let destinations: Vec<(PathBuf, &[u8])> = files
        .iter()
        .map(|(name, content)| (folder.join(name), content.as_slice()))
        .collect();
    for (path, _) in &destinations {
        check_destination(path)?;
    }
    fs::create_dir_all(folder).map_err(|error| cannot("make the folder", folder, &error))?;
    let _lock = lock(folder);
    remove_leftovers(folder);
    let mut staged = Staged { files: Vec::new() };
    for (index, (path, content)) in destinations.iter().enumerate() {
        staged
            .stage(folder, index, path, content)
            .map_err(|error| cannot("write", path, &error))?;
    }
    staged.publish()
}

/// [`write_all`] where files of others may stand: they are kept. What does not bear policyc's name goes on record.
///
/// # Errors
/// If a file of others is in the way ([`ownership::check`]); else as [`write_all`].
pub fn replace_own(folder: &Path, files: BTreeMap<String, Vec<u8>>, replacing: Replacing) -> Result<(), Failure> {
    let files = ownership::recorded(files)?;
    for name in files.keys() {
        check_destination(&folder.join(name))?;
    }
    ownership::check(folder, &files, replacing)?;
    write_all(folder, &files)
}

/// [`replace_own`] for text.
///
/// # Errors
/// As [`replace_own`].
pub fn replace_own_texts(folder: &Path, files: &BTreeMap<String, String>, replacing: Replacing) -> Result<(), Failure> {
    replace_own(folder, bytes_of(files), replacing)
}

fn bytes_of(files: &BTreeMap<String, String>) -> BTreeMap<String, Vec<u8>> {
    let bytes = |(name, text): (&String, &String)| (name.clone(), text.clone().into_bytes());
    files.iter().map(bytes).collect()
}

/// Writes the results of a run to a folder that holds nothing yet, then says `summary` and what to look at.
///
/// # Errors
/// If the folder holds something by now; else as [`write_all`].
pub fn write_results(
    folder: &Path,
    files: &BTreeMap<String, String>,
    summary: &str,
    page: &str,
) -> Result<(), Failure> {
    check_new_folder(folder)?;
    write_all(folder, &bytes_of(files))?;
    let (count, out) = (files.len(), folder.display());
    say(&format!("{summary}\n{count} files in {out}; to look at: {out}/{page}"))
}

/// Writes one file, and others by name beside it, none of which may exist yet.
///
/// # Errors
/// If one exists or cannot be written.
pub fn write_new_all(path: &Path, text: &str, beside: &BTreeMap<String, Vec<u8>>) -> Result<(), Failure> {
    let (folder, name) = split(path)?;
    let mut files = beside.clone();
    files.insert(name, text.as_bytes().to_vec());
    for name in files.keys() {
        let path = path.with_file_name(name);
        if fs::symlink_metadata(&path).is_ok() {
            let message = Message::new(format!("{} exists already; nothing written", path.display()));
            return Err(message.hint("move it away or choose another name with --out").into());
        }
    }
    write_all(folder, &files)
}

/// Writes one file that bears policyc's name; an older one of its own is replaced.
///
/// # Errors
/// If a file of others is in the way, or it cannot be written.
pub fn replace_own_one(path: &Path, text: &str, replacing: Replacing) -> Result<(), Failure> {
    let (folder, name) = split(path)?;
    check_destination(path)?;
    let file = BTreeMap::from([(name, text.as_bytes().to_vec())]);
    ownership::check(folder, &file, replacing)?;
    write_all(folder, &file)
}

/// Writes one file; an older one is replaced, so the caller has looked at it.
///
/// # Errors
/// If it cannot be written.
pub fn write_one(path: &Path, text: &str) -> Result<(), Failure> {
    let (folder, name) = split(path)?;
    write_all(folder, &BTreeMap::from([(name, text.as_bytes().to_vec())]))
}

/// Folder and name of a file.
fn split(path: &Path) -> Result<(&Path, String), Failure> {
    let folder = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty())
        .unwrap_or(Path::new("."));
    let Some(name) = path.file_name().and_then(|name| name.to_str()) else {
        return Err(Message::new(format!("{} is not a file name", path.display())).into());
    };
    Ok((folder, name.to_owned()))
}

/// Refuses a folder that holds something: results of two runs are not mixed, and none are lost.
///
/// # Errors
/// If it is there and not empty, or cannot be read.
pub fn check_new_folder(folder: &Path) -> Result<(), Failure> {
    let entries = match fs::read_dir(folder) {
        Ok(entries) => entries,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        Err(error) => return Err(cannot("read", folder, &error)),
    };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        if !name.starts_with(TEMPORARY) {
            let message = Message::new(format!("{} is not empty; nothing written", folder.display()));
            let message = message.found(name.escape_debug().to_string());
            return Err(message.hint("choose another --out, or move it away").into());
        }
    }
    Ok(())
}

/// Prints a line or more on standard output. A reader that has seen enough (`policyc inspect policy | head -1`) is no fault.
///
/// # Errors
/// If the text cannot be written.
pub fn say(text: &str) -> Result<(), Failure> {
    interruption::go_no_further_if_ending();
    let mut out = io::stdout().lock();
    match writeln!(out, "{text}").and_then(|()| out.flush()) {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        Err(error) => Err(Message::new(format!("cannot write to standard output: {error}")).into()),
        Ok(()) => Ok(()),
    }
}

fn cannot(what: &str, path: &Path, error: &io::Error) -> Failure {
    Message::new(format!("cannot {what} {}: {error}; nothing written", path.display())).into()
}

fn check_destination(path: &Path) -> Result<(), Failure> {
    let Ok(metadata) = fs::symlink_metadata(path) else {
        return Ok(());
    };
    let kind = if metadata.is_symlink() {
        "a symbolic link"
    } else if metadata.is_dir() {
        "a folder"
    } else {
        return Ok(());
    };
    let message = Message::new(format!("{} is {kind}; nothing written", path.display()));
    Err(message
        .hint("policyc replaces plain files only; choose another --out")
        .into())
}

/// Two runs into one folder take turns. Where folders cannot be locked, the renames alone keep each file whole.
fn lock(folder: &Path) -> Option<File> {
    let file = File::open(folder).ok()?;
    file.lock().ok()?;
    Some(file)
}

fn remove_leftovers(folder: &Path) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        if entry.file_name().to_string_lossy().starts_with(TEMPORARY) {
            // a leftover that cannot be removed does no harm
            let _ = fs::remove_file(entry.path());
        }
    }
}

struct StagedFile {
    temporary: PathBuf,
    backup: PathBuf,
    destination: PathBuf,
    had_backup: bool,
    published: bool,
}

/// Files written under temporary names; dropped without `publish` they vanish.
struct Staged {
    files: Vec<StagedFile>,
}

impl Staged {
    fn stage(&mut self, folder: &Path, index: usize, destination: &Path, content: &[u8]) -> io::Result<()> {
        let temporary = folder.join(format!("{TEMPORARY}{}-{index}", std::process::id()));
        let backup = folder.join(format!("{TEMPORARY}{}-{index}-old", std::process::id()));
        let mut file = OpenOptions::new().write(true).create_new(true).open(&temporary)?;
        let destination = destination.to_owned();
        self.files.push(StagedFile {
            temporary,
            backup,
            destination,
            had_backup: false,
            published: false,
        });
        file.write_all(content)?;
        file.sync_all()
    }

    fn publish(mut self) -> Result<(), Failure> {
        for file in &mut self.files {
            let result = file.publish();
            result.map_err(|error| cannot("replace", &file.destination, &error))?;
        }
        for file in &mut self.files {
            if file.had_backup {
                let _ = fs::remove_file(&file.backup);
            }
        }
        self.files.clear();
        Ok(())
    }
}

impl StagedFile {
    fn publish(&mut self) -> io::Result<()> {
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
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn files(names: &[&str]) -> BTreeMap<String, Vec<u8>> {
        names
            .iter()
            .map(|name| ((*name).to_owned(), format!("new {name}").into_bytes()))
            .collect()
    }

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> = fs::read_dir(folder)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn files_are_replaced_and_nothing_else_stays_behind() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("a"), "old").unwrap();
        fs::write(folder.path().join(".policyc-tmp-1-0"), "left by an interrupted run").unwrap();
        write_all(folder.path(), &files(&["a", "b"])).unwrap();
        assert_eq!(names(folder.path()), ["a", "b"]);
        assert_eq!(fs::read_to_string(folder.path().join("a")).unwrap(), "new a");
    }

    #[test]
    fn a_folder_in_the_place_of_a_file_leaves_everything_as_it_was() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("a"), "old").unwrap();
        fs::create_dir(folder.path().join("b")).unwrap();
        let Err(Failure(faults)) = write_all(folder.path(), &files(&["a", "b"])) else {
            panic!("must fail")
        };
        assert!(faults.to_string().contains("is a folder; nothing written"), "{faults}");
        assert_eq!(fs::read_to_string(folder.path().join("a")).unwrap(), "old");
        assert_eq!(names(folder.path()), ["a", "b"]);
    }

    #[cfg(unix)]
    #[test]
    fn a_symbolic_link_is_not_followed() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("precious"), "old").unwrap();
        std::os::unix::fs::symlink("precious", folder.path().join("a")).unwrap();
        let Err(Failure(faults)) = write_all(folder.path(), &files(&["a"])) else {
            panic!("must fail")
        };
        assert!(faults.to_string().contains("symbolic link"), "{faults}");
        assert_eq!(fs::read_to_string(folder.path().join("precious")).unwrap(), "old");
    }

    #[test]
    fn a_failed_publication_puts_the_old_files_back() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("a"), "old a").unwrap();
        fs::write(folder.path().join("b"), "old b").unwrap();
        let mut staged = Staged { files: Vec::new() };
        for (index, name) in ["a", "b"].iter().enumerate() {
            staged
                .stage(folder.path(), index, &folder.path().join(name), b"new")
                .unwrap();
        }
        // the second rename cannot succeed any more
        fs::remove_file(&staged.files[1].temporary).unwrap();
        assert!(staged.publish().is_err());
        assert_eq!(names(folder.path()), ["a", "b"]);
        assert_eq!(fs::read_to_string(folder.path().join("a")).unwrap(), "old a");
        assert_eq!(fs::read_to_string(folder.path().join("b")).unwrap(), "old b");
    }

    #[test]
    fn an_existing_contract_is_never_overwritten() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("policy.toml");
        write_new_all(&path, "mine", &BTreeMap::new()).unwrap();
        assert!(write_new_all(&path, "other", &BTreeMap::new()).is_err());
        assert_eq!(fs::read_to_string(path).unwrap(), "mine");
    }
}
