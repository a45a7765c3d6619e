//! Work in shards: a line of a file for each piece, so that a killed run goes on where it stood, and the files of all shards
//! merge to the same bytes in whatever order they were made.
//!
//! ```text
//!  pieces ─► shard 1 of n ─► shard-1-of-n.csv ─┐
//!         ─► shard 2 of n ─► shard-2-of-n.csv ─┴► merge ─► one table
//! ```

use std::collections::BTreeMap;
use std::fmt::{Display, Write as _};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::str::FromStr;

use toml_input::{Fault, Faults, Message};

/// Which part of the pieces: of the pieces 0, 1, 2 ... every `count`-th, from the `number`-th on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    number: u64,
    count: u64,
}

impl Shard {
    /// All pieces.
    pub const WHOLE: Self = Self { number: 1, count: 1 };

    /// Shard `number` (from 1) of `count`; `None` if there is no such one.
    #[must_use]
    pub fn new(number: u64, count: u64) -> Option<Self> {
        (1..=count).contains(&number).then_some(Self { number, count })
    }

    /// Whether the piece is in this shard.
    #[must_use]
    pub fn takes(self, piece: u64) -> bool {
        piece % self.count == self.number - 1
    }

    /// Its file.
    #[must_use]
    pub fn file(self, folder: &Path) -> PathBuf {
        folder.join(format!("shard-{}-of-{}.csv", self.number, self.count))
    }
}

impl Default for Shard {
    fn default() -> Self {
        Self::WHOLE
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = text
            .split_once('/')
            .map(|(number, count)| (number.parse(), count.parse()));
        match numbers {
            Some((Ok(number), Ok(count))) => Self::new(number, count),
            _ => None,
        }
        .ok_or_else(|| "expected I/N with 1 <= I <= N, such as 2/4".to_owned())
    }
}

/// What a piece of work came to, as a line.
pub trait Entry: Display + Clone + PartialEq {
    /// Number of the piece, or another number that it has alone.
    fn key(&self) -> u64;

    /// From the line that [`Display`] wrote.
    fn read(line: &str) -> Option<Self>;
}

/// What stands above the lines: a comment that says which run it is, and the names of the columns.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Head(String);

/// Lines of a head.
const HEAD_LINES: usize = 2;

impl Head {
    /// Files with another `run` or other `columns` are of another run.
    #[must_use]
    pub fn new(run: &str, columns: &str) -> Self {
        Self(format!("# {}, {run}\n{columns}\n", codegen::TOOL))
    }

    fn run(&self) -> &str {
        self.0.lines().next().unwrap_or_default()
    }
}

/// Does the pieces with these `keys` that the file of the shard does not hold yet, and appends each; `tell` hears each new one.
/// Returns all entries of the shard.
///
/// # Errors
/// If the file cannot be read or written, or is of another run; or the first that `make` has.
pub fn run<E: Entry>(
    folder: &Path,
    shard: Shard,
    head: &Head,
    keys: impl Iterator<Item = u64>,
    mut make: impl FnMut(u64) -> Result<E, Faults>,
    mut tell: impl FnMut(&E),
) -> Result<Vec<E>, Faults> {
    let path = shard.file(folder);
    std::fs::create_dir_all(folder).map_err(|error| told(folder, &error))?;
    let mut entries = kept::<E>(head, &path)?;
    let file = std::fs::OpenOptions::new().append(true).open(&path);
    let mut file = file.map_err(|error| told(&path, &error))?;
    for key in keys {
        if entries.iter().any(|entry| entry.key() == key) {
            continue;
        }
        let entry = make(key)?;
        // one call of the system: a kill leaves a whole line or a torn last one, which the next run cuts off
        let line = format!("{entry}\n");
        file.write_all(line.as_bytes()).map_err(|error| told(&path, &error))?;
        tell(&entry);
        entries.push(entry);
    }
    Ok(entries)
}

/// Merges all shards of a folder into a file of this name; returns the entries, by key.
///
/// # Errors
/// If a file cannot be read or written, if the files are of different runs, if two of them disagree about a piece, or if a file
/// of others has the name.
pub fn merge<E: Entry>(folder: &Path, name: &str) -> Result<Vec<E>, Faults> {
    let mut head: Option<Head> = None;
    let mut entries: BTreeMap<u64, E> = BTreeMap::new();
    for path in &files(folder)? {
        let text = std::fs::read_to_string(path).map_err(|error| told(path, &error))?;
        // a shard may be at work: its last line counts when it is whole
        let (found, more) = parsed::<E>(path, whole_lines(&text))?;
        let known = head.get_or_insert_with(|| found.clone());
        if *known != found {
            return Err(another_run(path, &found, known));
        }
        for entry in more {
            let key = entry.key();
            let known = entries.entry(key).or_insert_with(|| entry.clone());
            if *known != entry {
                let message = Message::new(format!("two results of {key}")).found(entry.to_string());
                return Err(Fault::in_file(path, message.expected(format!("as in another shard: {known}"))).into());
            }
        }
    }
    let Some(Head(mut text)) = head else {
        return Err(Fault::in_file(folder, Message::new("no shard in it")).into());
    };
    let entries: Vec<E> = entries.into_values().collect();
    for entry in &entries {
        let _ = writeln!(text, "{entry}");
    }
    let path = folder.join(name);
    match std::fs::read_to_string(&path) {
        Ok(old) if !old.starts_with("# policyc ") => {
            let message = Message::new("the file is not policyc's; nothing merged");
            return Err(Fault::in_file(&path, message.hint("move it away, or name another folder")).into());
        }
        _ => std::fs::write(&path, text).map_err(|error| told(&path, &error))?,
    }
    Ok(entries)
}

/// The files of shards in a folder, by name.
fn files(folder: &Path) -> Result<Vec<PathBuf>, Faults> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(|error| told(folder, &error))? {
        let path = entry.map_err(|error| told(folder, &error))?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if name.starts_with("shard-") && name.ends_with(".csv") {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

/// The entries of a file of this shard, which is made or cut back to its last whole line.
fn kept<E: Entry>(head: &Head, path: &Path) -> Result<Vec<E>, Faults> {
    let text = match std::fs::read_to_string(path) {
        Ok(text) => text,
        Err(error) if error.kind() == io::ErrorKind::NotFound => String::new(),
        Err(error) => return Err(told(path, &error)),
    };
    let whole = whole_lines(&text);
    if head.0.starts_with(&text) {
        // new, or killed within its head
        std::fs::write(path, &head.0).map_err(|error| told(path, &error))?;
        return Ok(Vec::new());
    }
    let (found, entries) = parsed(path, whole)?;
    if found != *head {
        return Err(another_run(path, &found, head));
    }
    if whole.len() < text.len() {
        std::fs::write(path, whole).map_err(|error| told(path, &error))?;
    }
    Ok(entries)
}

fn whole_lines(text: &str) -> &str {
    &text[..text.rfind('\n').map_or(0, |at| at + 1)]
}

fn parsed<E: Entry>(path: &Path, text: &str) -> Result<(Head, Vec<E>), Faults> {
    let lines: Vec<&str> = text.lines().collect();
    let at = lines.len().min(HEAD_LINES);
    let head = Head(lines[..at].iter().map(|line| format!("{line}\n")).collect());
    let read = |(index, line): (usize, &&str)| {
        E::read(line).ok_or_else(|| {
            let message = Message::new(format!("line {} is no line of a shard", at + index + 1)).found(*line);
            Faults::from(Fault::in_file(path, message))
        })
    };
    let entries: Result<Vec<E>, Faults> = match head.run().starts_with("# policyc ") {
        true => lines[at..].iter().enumerate().map(read).collect(),
        // what stands in a file of others is not looked at
        false => Ok(Vec::new()),
    };
    Ok((head, entries?))
}

fn another_run(path: &Path, found: &Head, expected: &Head) -> Faults {
    let message = Message::new("of another run")
        .found(found.run())
        .expected(expected.run());
    Fault::in_file(path, message.hint("name another folder")).into()
}

fn told(path: &Path, error: &io::Error) -> Faults {
    Fault::in_file(path, Message::new(error.to_string())).into()
}
