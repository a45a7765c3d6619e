//! The copy of the workspace in which the mutants live.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::draw::Drawn;
use crate::instrument::{self, Ranges};

/// Where each mutant stands in each instrumented file.
pub type Placed = BTreeMap<PathBuf, Ranges>;

fn at<T>(path: &Path, result: std::io::Result<T>) -> Result<T, String> {
    result.map_err(|error| format!("{}: {error}", path.display()))
}

/// Copies what is under version control, and new files that are not ignored. A file that is the same keeps its time, so
/// that cargo builds no more than what changed.
///
/// # Errors
/// What cannot be read or written; no git.
pub fn refresh(root: &Path, copy: &Path, mutants: &[Drawn]) -> Result<Placed, String> {
    let listed = Command::new("git")
        .args(["ls-files", "-z", "--cached", "--others", "--exclude-standard"])
        .current_dir(root)
        .output()
        .map_err(|error| format!("git: {error}"))?;
    let names = String::from_utf8_lossy(&listed.stdout).into_owned();
    for name in names.split('\0').filter(|name| !name.is_empty()) {
        let source = root.join(name);
        if let Ok(to) = std::fs::read_link(&source) {
            link(&copy.join(name), &to)?;
            continue;
        }
        let is_changed = mutants.iter().any(|drawn| drawn.file == Path::new(name));
        if !is_changed && !name.ends_with("/src/lib.rs") && source.is_file() {
            write(&copy.join(name), &at(&source, std::fs::read(&source))?)?;
        }
    }
    let mut placed = Placed::new();
    for name in names.split('\0').map(Path::new) {
        let numbered: Vec<_> = mutants
            .iter()
            .enumerate()
            .filter(|(_, drawn)| drawn.file == name)
            .collect();
        let numbered: Vec<_> = numbered
            .iter()
            .map(|(number, drawn)| (*number, &drawn.mutant))
            .collect();
        let krate = crate::draw::CRATES
            .iter()
            .find(|krate| name == Path::new(krate).join("src/lib.rs"));
        let is_lib = name.ends_with("src/lib.rs");
        if numbered.is_empty() && !is_lib {
            continue;
        }
        let source = root.join(name);
        let text = at(&source, std::fs::read_to_string(&source))?;
        let (mut text, mut ranges) = instrument::instrument(&text, &numbered);
        if let Some(krate) = krate {
            // what a mutant makes of the code is not always tidy, and some would be an error for a certain fault only
            let allow = "#![allow(warnings, overflowing_literals, arithmetic_overflow, unconditional_panic)]\n";
            ranges
                .iter_mut()
                .for_each(|(_, range)| *range = range.start + allow.len()..range.end + allow.len());
            text = format!("{allow}{text}\nmod mutant_switch;\n");
            let switch = instrument::SWITCH.replace("COUNT", &mutants.len().to_string());
            write(&copy.join(krate).join("src/mutant_switch.rs"), switch.as_bytes())?;
        }
        write(&copy.join(name), text.as_bytes())?;
        placed.insert(name.to_owned(), ranges);
    }
    Ok(placed)
}

fn link(path: &Path, to: &Path) -> Result<(), String> {
    if std::fs::read_link(path).is_ok_and(|old| old == to) {
        return Ok(());
    }
    at(path, std::os::unix::fs::symlink(to, path))
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), String> {
    if std::fs::read(path).is_ok_and(|old| old == bytes) {
        return Ok(());
    }
    if let Some(folder) = path.parent() {
        at(folder, std::fs::create_dir_all(folder))?;
    }
    at(path, std::fs::write(path, bytes))
}
