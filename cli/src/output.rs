//! The only writer of files: all or nothing, under a lock, through temporary files in the same folder.

use std::collections::BTreeMap;
use std::fs;
use std::io::{self, Write};
use std::path::Path;
use std::sync::{Mutex, PoisonError};

use serde::Serialize;
use toml_input::Message;

use crate::failure::Failure;
use crate::interruption;
use crate::look;
use crate::ownership::{self, Replacing};
use crate::staging::{self, Staged};
use crate::talk;

/// Where answers go while they are kept; see [`keep_answers`].
static KEPT: Mutex<Option<String>> = Mutex::new(None);

/// What `run` would print on standard output, beside what it returns: for whoever runs a command inside of another program.
pub fn keep_answers<T>(run: impl FnOnce() -> T) -> (T, String) {
    let set = |value: Option<String>| {
        let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
        std::mem::replace(&mut *kept, value)
    };
    /// Whatever becomes of `run`, answers are printed again.
    struct Printed;
    impl Drop for Printed {
        fn drop(&mut self) {
            *KEPT.lock().unwrap_or_else(PoisonError::into_inner) = None;
        }
    }
    set(Some(String::new()));
    let printed = Printed;
    let result = run();
    let answer = set(None).unwrap_or_default();
    drop(printed);
    (result, answer)
}

/// Writes files into a folder: either all of them are there afterwards or none has changed.
///
/// # Errors
/// If the folder cannot be made or written, or a destination is a folder or a symbolic link.
pub fn write_all(folder: &Path, files: &BTreeMap<String, Vec<u8>>) -> Result<(), Failure> {
    write_if(folder, files, || Ok(()))
}

/// [`write_all`] if nothing in the folder speaks against it. `check` runs under the lock: what it sees is what is replaced, and
/// not what another run has half written.
fn write_if(
    folder: &Path,
    files: &BTreeMap<String, Vec<u8>>,
    check: impl FnOnce() -> Result<(), Failure>,
) -> Result<(), Failure> {
    interruption::go_no_further_if_ending();
    for name in files.keys() {
        check_destination(&folder.join(name))?;
    }
    fs::create_dir_all(folder).map_err(|error| cannot("make the folder", folder, &error))?;
    let _lock = staging::lock(folder);
    check()?;
    let mut staged = Staged::new(folder);
    for (name, content) in files {
        staged
            .stage(name, content)
            .map_err(|error| cannot("write", &folder.join(name), &error))?;
    }
    staged
        .publish()
        .map_err(|(path, error)| cannot("replace", &path, &error))?;
    staging::remove_leftovers(folder);
    for name in files.keys() {
        talk::tell_more(|| format!("wrote {}", folder.join(name).display()));
    }
    Ok(())
}

/// [`write_all`] where files of others may stand: they are kept. What does not bear policyc's name goes on record.
///
/// # Errors
/// If a file of others is in the way ([`ownership::check`]); else as [`write_all`].
pub fn replace_own(folder: &Path, files: BTreeMap<String, Vec<u8>>, replacing: Replacing) -> Result<(), Failure> {
    let files = ownership::recorded(files)?;
    write_if(folder, &files, || ownership::check(folder, &files, replacing))
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

/// Writes the results of a run to a folder that holds nothing yet.
///
/// # Errors
/// If the folder holds something by now; else as [`write_all`].
pub fn write_results(folder: &Path, files: &BTreeMap<String, String>) -> Result<(), Failure> {
    write_if(folder, &bytes_of(files), || check_new_folder(folder))
}

/// Says what results mean and what to look at.
///
/// # Errors
/// As [`say`].
pub fn say_results(folder: &Path, files: &BTreeMap<String, String>, summary: &str, page: &str) -> Result<(), Failure> {
    let (count, out) = (files.len(), folder.display());
    // apart, so that no note at the end of a summary takes the blank line along
    say(summary.trim_end())?;
    say(&format!("\n{count} files in {out}; to look at: {out}/{page}"))
}

/// Writes one file that may not exist yet; `flag` is what named it.
///
/// # Errors
/// If it exists or cannot be written.
pub fn write_new_one(path: &Path, bytes: Vec<u8>, flag: &str) -> Result<(), Failure> {
    let (folder, name) = split(path)?;
    write_new(folder, &BTreeMap::from([(name, bytes)]), flag)
}

/// Writes one file, and others by name beside it, none of which may exist yet.
///
/// # Errors
/// If one exists or cannot be written.
pub fn write_new_all(path: &Path, text: &str, beside: &BTreeMap<String, Vec<u8>>) -> Result<(), Failure> {
    let (folder, name) = split(path)?;
    let mut files = beside.clone();
    files.insert(name, text.as_bytes().to_vec());
    write_new(folder, &files, "--out")
}

fn write_new(folder: &Path, files: &BTreeMap<String, Vec<u8>>, flag: &str) -> Result<(), Failure> {
    write_if(folder, files, || {
        let mut paths = files.keys().map(|name| folder.join(name));
        let Some(path) = paths.find(|path| fs::symlink_metadata(path).is_ok()) else {
            return Ok(());
        };
        let message = Message::new(format!("{} exists already; nothing written", path.display()));
        Err(message
            .hint(format!("move it away or choose another name with {flag}"))
            .into())
    })
}

/// Writes one file that bears policyc's name; an older one of its own is replaced.
///
/// # Errors
/// If a file of others is in the way, or it cannot be written.
pub fn replace_own_one(path: &Path, text: &str, replacing: Replacing) -> Result<(), Failure> {
    let (folder, name) = split(path)?;
    let file = BTreeMap::from([(name, text.as_bytes().to_vec())]);
    write_if(folder, &file, || ownership::check(folder, &file, replacing))
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
        if !staging::is_leftover(&name) {
            let message = Message::new(format!("{} is not empty; nothing written", folder.display()));
            let message = message.found(name.escape_debug().to_string());
            return Err(message.hint("choose another --out, or move it away").into());
        }
    }
    Ok(())
}

/// Prints a line or more of an answer on standard output; in a quiet run its notes are left out.
///
/// # Errors
/// As [`print`].
pub fn say(text: &str) -> Result<(), Failure> {
    match talk::heard(text) {
        // it was a note and nothing else
        heard if heard.is_empty() && !text.is_empty() => Ok(()),
        heard => put(&look::of_answer(&format!("{heard}\n")), anstream::stdout().lock()),
    }
}

/// Prints an answer for programs: one JSON value.
///
/// # Errors
/// As [`print`]; if a number cannot be written as JSON.
pub fn say_json(answer: &impl Serialize) -> Result<(), Failure> {
    print(&(serde_json::to_string_pretty(answer)? + "\n"))
}

/// Prints a text as it is. A reader that has seen enough (`policyc inspect policy | head -1`) is no fault.
///
/// # Errors
/// If the text cannot be written.
pub fn print(text: &str) -> Result<(), Failure> {
    put(text, io::stdout().lock())
}

/// [`print`]; the stream takes colours out where they do not belong, and what is kept has none.
fn put(text: &str, mut out: impl Write) -> Result<(), Failure> {
    interruption::go_no_further_if_ending();
    if let Some(kept) = &mut *KEPT.lock().unwrap_or_else(PoisonError::into_inner) {
        kept.push_str(&anstream::adapter::strip_str(text).to_string());
        return Ok(());
    }
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
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

    /// A run that another one's half-written folder is shown to, or that finds what a killed one left.
    fn half_written(folder: &Path, version: &str) -> Staged {
        let files =
            BTreeMap::from(["a.c", "t.csv"].map(|name| (name.to_owned(), format!("{version} {name}").into_bytes())));
        let files = ownership::recorded(files).unwrap();
        let mut staged = Staged::new(folder);
        for (name, content) in &files {
            staged.stage(name, content).unwrap();
        }
        staged
    }

    const KEEP: Replacing = Replacing { force: false };

    #[test]
    fn a_run_waits_for_the_other_before_it_looks_whose_the_files_are() {
        let folder = tempfile::tempdir().unwrap();
        replace_own(folder.path(), files(&["a.c", "t.csv"]), KEEP).unwrap();
        let lock = staging::lock(folder.path()).unwrap();
        let mut staged = half_written(folder.path(), "newer");
        staged.publish_first(1).unwrap();
        let (sender, receiver) = std::sync::mpsc::channel();
        std::thread::scope(|scope| {
            scope.spawn(|| sender.send(replace_own(folder.path(), files(&["a.c", "t.csv"]), KEEP).is_ok()));
            // long enough for a run that does not wait to have seen the edited file; too short can only miss the fault
            assert!(
                receiver.recv_timeout(std::time::Duration::from_millis(200)).is_err(),
                "did not wait"
            );
            staged.publish().unwrap();
            drop(lock);
        });
        assert!(receiver.recv().unwrap(), "refused its own files");
    }

    #[test]
    fn what_a_killed_run_half_replaced_is_no_edit() {
        for published in 0..=3 {
            let folder = tempfile::tempdir().unwrap();
            replace_own(folder.path(), files(&["a.c", "t.csv"]), KEEP).unwrap();
            let mut staged = half_written(folder.path(), "newer");
            staged.publish_first(published).unwrap();
            std::mem::forget(staged);
            replace_own(folder.path(), files(&["a.c", "t.csv"]), KEEP).unwrap();
            assert_eq!(
                names(folder.path()),
                ["a.c", "policyc-files.json", "t.csv"],
                "{published}"
            );
            assert_eq!(fs::read_to_string(folder.path().join("t.csv")).unwrap(), "new t.csv");
        }
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
