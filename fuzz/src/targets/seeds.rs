//! Seeds from files of the repository, and answers from faults.

use std::path::{Path, PathBuf};

use toml_input::Faults;

use crate::guard::Answer;

/// Longest seed: changes of a longer one rarely meet what a reader looks at.
const LONGEST: usize = 40_000;

/// A path of the repository.
pub(super) fn at(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path)
}

/// The content of a file of the repository.
pub(super) fn read(path: &str) -> Result<Vec<u8>, String> {
    std::fs::read(at(path)).map_err(|error| format!("{path}: {error}"))
}

/// The contents of files of the repository.
pub(super) fn files(paths: &[&str]) -> Result<Vec<Vec<u8>>, String> {
    paths.iter().map(|path| read(path)).collect()
}

/// All files of a folder with one of these ends that are not too long, by name.
pub(super) fn folder(path: &str, ends: &[&str]) -> Result<Vec<Vec<u8>>, String> {
    let entries = std::fs::read_dir(at(path)).map_err(|error| format!("{path}: {error}"))?;
    let mut files: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    // the order of a folder is another one on every machine, and a run is to be repeated
    files.sort();
    let is_wanted = |file: &PathBuf| ends.iter().any(|end| file.to_string_lossy().ends_with(end));
    let mut seeds = Vec::new();
    for file in files.into_iter().filter(is_wanted) {
        let bytes = std::fs::read(&file).map_err(|error| format!("{}: {error}", file.display()))?;
        if bytes.len() <= LONGEST {
            seeds.push(bytes);
        }
    }
    Ok(seeds)
}

/// The first lines of a text.
pub(super) fn head(bytes: &[u8], lines: usize) -> Vec<u8> {
    bytes
        .split_inclusive(|byte| *byte == b'\n')
        .take(lines)
        .flatten()
        .copied()
        .collect()
}

/// What a reader's faults say; each must be a message that can be shown.
pub(super) fn refused(faults: &Faults) -> Answer {
    assert!(!faults.list.is_empty(), "refused without a fault");
    for fault in &faults.list {
        let text = fault.to_string();
        assert!(text.starts_with("error: "), "a fault without its beginning: {text}");
        let is_shown = text.chars().all(|c| c == '\n' || !c.is_control());
        assert!(is_shown, "a control character is shown: {text:?}");
    }
    let kinds: Vec<&str> = faults.list.iter().map(|fault| fault.problem.as_str()).collect();
    Answer::refused(kinds.first().copied().unwrap_or_default())
}

/// The answer to a result of which only the kind matters.
pub(super) fn answer<T>(result: Result<T, Faults>, then: impl FnOnce(T) -> String) -> Answer {
    match result {
        Ok(value) => Answer::accepted(then(value)),
        Err(faults) => refused(&faults),
    }
}
