//! The files that a task reads: those it names, and those that these name.
//!
//! A TOML file, whatever its name ends in, is searched for every text that is a path of a file beside it. This takes a file too many rather than one too few; one too
//! few is noticed, because the command then runs without it. A task is run in a folder that holds its inputs alone, under the paths
//! that they have from their common folder: nothing else can have a part in its result.

use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use toml_input::{Document, Faults, FileName, Message, Source};

use crate::digest::sha256;

/// Largest input file in bytes (256 MiB): a file is held in memory and may be sent to another machine.
pub const MAX_INPUT_BYTES: u64 = 256 << 20;

/// Largest file in bytes (1 MiB) that is looked into although it is not called `.toml`: contracts and settings are far smaller.
const MAX_TOML_BYTES: usize = 1 << 20;

/// Folder of the inputs in the folder of a task.
const FOLDER: &str = "in";

/// A file that tasks share.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Content {
    /// All of it.
    pub bytes: Vec<u8>,
    /// SHA-256, hexadecimal.
    pub digest: String,
}

#[derive(Debug)]
struct Known {
    content: Arc<Content>,
    names: Vec<PathBuf>,
}

/// Files that were read, each once.
#[derive(Debug, Default)]
pub struct Inputs {
    known: BTreeMap<PathBuf, Known>,
}

/// The inputs of one task under construction.
pub(crate) struct Gathered {
    /// From the folder of the task to the content.
    pub files: BTreeMap<String, Arc<Content>>,
    /// The named files as seen from there, in the order in which they were named.
    pub named: Vec<String>,
}

impl Inputs {
    /// The closure of the files `named`.
    ///
    /// # Errors
    /// A file that cannot be read, is no valid TOML, or names a file by its absolute path.
    pub(crate) fn gather(&mut self, named: &[FileName]) -> Result<Gathered, Faults> {
        let mut found: BTreeMap<PathBuf, Arc<Content>> = BTreeMap::new();
        let mut open: Vec<FileName> = named.to_vec();
        let mut paths = Vec::new();
        for name in named {
            paths.push(tidy(&name.path)?);
        }
        while let Some(name) = open.pop() {
            let path = tidy(&name.path)?;
            if found.contains_key(&path) {
                continue;
            }
            let known = self.read(&path, &name)?;
            found.insert(path, Arc::clone(&known.content));
            open.extend(known.names.iter().map(|path| FileName::named_by_a_file(path)));
        }
        let common = common_folder(found.keys());
        let seen = |path: &Path| {
            let rest = path.strip_prefix(&common).unwrap_or(path);
            let parts = rest.components().map(|part| part.as_os_str().to_string_lossy());
            let mut text = FOLDER.to_owned();
            parts.for_each(|part| text.push_str(&format!("/{part}")));
            text
        };
        Ok(Gathered {
            named: paths.iter().map(|path| seen(path)).collect(),
            files: found
                .iter()
                .map(|(path, content)| (seen(path), Arc::clone(content)))
                .collect(),
        })
    }

    fn read(&mut self, path: &Path, name: &FileName) -> Result<&Known, Faults> {
        if !self.known.contains_key(path) {
            let bytes = name.read(MAX_INPUT_BYTES).map_err(|message| name.fault(message))?;
            let names = match is_toml(path, &bytes) {
                true => named_by(name, path, &bytes)?,
                false => Vec::new(),
            };
            let content = Arc::new(Content {
                digest: sha256(&bytes),
                bytes,
            });
            self.known.insert(path.to_owned(), Known { content, names });
        }
        match self.known.get(path) {
            Some(known) => Ok(known),
            None => Err(name.fault(Message::new("the file was lost")).into()),
        }
    }
}

/// Whether a file may name others. One that is called so has to be TOML; of another, such as a contract under a name of its own, the content
/// tells.
fn is_toml(path: &Path, bytes: &[u8]) -> bool {
    let is_called_so = path.extension().is_some_and(|extension| extension == "toml");
    let content = || match bytes.len() <= MAX_TOML_BYTES {
        true => std::str::from_utf8(bytes).is_ok_and(|text| Document::from_text(path, text).is_ok()),
        false => false,
    };
    is_called_so || content()
}

/// Goes out of a folder that it has gone into: in the folder of a task, into which only the files themselves are put, there is no such
/// folder.
fn turns_back(text: &str) -> bool {
    let parts = Path::new(text).components();
    let mut inside = parts.skip_while(|part| matches!(part, Component::ParentDir | Component::CurDir));
    inside.any(|part| part == Component::ParentDir)
}

/// Files that a TOML file names, relative to its folder.
fn named_by(name: &FileName, path: &Path, bytes: &[u8]) -> Result<Vec<PathBuf>, Faults> {
    let source = Source::new(name.clone(), bytes.to_vec()).map_err(|fault| *fault)?;
    let document = Document::from_text(&source.name.shown, &source.text)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut names = Vec::new();
    let mut faults = toml_input::Sink::new();
    for (text, span) in document.texts() {
        if text.is_empty() || text.contains(['\n', '\0']) {
            continue;
        }
        let Some(file) = file_at(&folder.join(text)) else {
            continue;
        };
        if Path::new(text).is_absolute() {
            // it would be read past the folder of the task, and exist on no other machine
            let message = Message::new("a file of a campaign must not be named by its absolute path");
            let message = message.found(text).hint("name it as seen from the folder of this file");
            faults.push(document.fault(span, message));
        } else if turns_back(text) {
            let message = Message::new("a path of a campaign must not lead into a folder and out of it again");
            let message = message
                .found(text)
                .hint("name the file by the shortest path from the folder of this file");
            faults.push(document.fault(span, message));
        }
        names.push(file);
    }
    faults.propagate()?;
    Ok(names)
}

/// The file at a path; of a folder its contract, as every command takes it.
pub(crate) fn file_at(path: &Path) -> Option<PathBuf> {
    let contract = || Some(path.join("policy.toml")).filter(|path| path.is_file());
    match path.is_file() {
        true => Some(path.to_owned()),
        false => contract(),
    }
}

/// An absolute path without `.` and `..`: by its letters, because a link is to be read under the name that it has.
fn tidy(path: &Path) -> Result<PathBuf, Faults> {
    let absolute = std::path::absolute(path).map_err(|error| {
        let shown = path.display();
        Message::new(format!("cannot find the folder of `{shown}`: {error}"))
    })?;
    let mut tidied = PathBuf::new();
    for part in absolute.components() {
        match part {
            Component::ParentDir => {
                tidied.pop();
            }
            Component::CurDir => {}
            part => tidied.push(part),
        }
    }
    Ok(tidied)
}

fn common_folder<'a>(paths: impl IntoIterator<Item = &'a PathBuf>) -> PathBuf {
    let mut folders = paths.into_iter().map(|path| path.parent().unwrap_or(path));
    let first = folders.next().map(Path::to_owned).unwrap_or_default();
    folders.fold(first, |common, folder| {
        let shared = common.components().zip(folder.components());
        shared.take_while(|(a, b)| a == b).map(|(a, _)| a).collect()
    })
}

/// What the plan calls `text`, as a file.
///
/// # Errors
/// If there is none.
pub(crate) fn named_in_plan(plan: &FileName, text: &str) -> Result<FileName, Message> {
    let name = plan.beside(text);
    match file_at(&name.path) {
        Some(path) if path == name.path => Ok(name),
        // the contract in the folder that was named
        Some(_) => Ok(plan.beside(&format!("{text}/policy.toml"))),
        None if name.path.is_dir() => Err(Message::new(format!("the folder `{text}` holds no policy.toml"))
            .expected("a file, or the folder of a policy")),
        // in the words of every other file that cannot be found
        None => Err(name
            .read(0)
            .err()
            .unwrap_or_else(|| Message::new(format!("`{text}` is not read")))),
    }
}

#[cfg(test)]
#[allow(clippy::disallowed_methods, reason = "the files that are gathered")]
mod tests {
    use super::*;

    fn write(folder: &Path, name: &str, text: &str) {
        let path = folder.join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    }

    fn gathered(folder: &Path, name: &str) -> Result<Gathered, Faults> {
        Inputs::default().gather(&[FileName::new(&folder.join(name))])
    }

    #[test]
    fn what_a_file_names_is_gathered_through_files_and_folders() {
        let folder = tempfile::tempdir().unwrap();
        write(
            folder.path(),
            "a/train.toml",
            "plant = \"../plants/p.toml\"\nlist = [{ policy = \"pol\" }]\nname = \"none\"\n",
        );
        write(folder.path(), "plants/p.toml", "[converter]\n");
        write(folder.path(), "a/pol/policy.toml", "[network]\nweights = \"w.bin\"\n");
        write(folder.path(), "a/pol/w.bin", "1");
        write(folder.path(), "a/other.toml", "");
        let found = gathered(folder.path(), "a/train.toml").unwrap();
        let names: Vec<&str> = found.files.keys().map(String::as_str).collect();
        assert_eq!(
            names,
            [
                "in/a/pol/policy.toml",
                "in/a/pol/w.bin",
                "in/a/train.toml",
                "in/plants/p.toml"
            ]
        );
        assert_eq!(found.named, ["in/a/train.toml"]);
    }

    #[test]
    fn files_that_name_each_other_have_an_end() {
        let folder = tempfile::tempdir().unwrap();
        write(folder.path(), "a.toml", "x = \"b.toml\"");
        write(folder.path(), "b.toml", "x = [\"./a.toml\", \"b.toml\"]");
        assert_eq!(gathered(folder.path(), "a.toml").unwrap().files.len(), 2);
    }

    #[test]
    fn a_contract_under_a_name_of_its_own_brings_its_weights() {
        let folder = tempfile::tempdir().unwrap();
        write(folder.path(), "a.contract", "[network]\nweights = \"w.bin\"\n");
        write(folder.path(), "w.bin", "1");
        write(folder.path(), "a.csv", "t,v_out\n0,1\n");
        let names: Vec<String> = gathered(folder.path(), "a.contract")
            .unwrap()
            .files
            .into_keys()
            .collect();
        assert_eq!(names, ["in/a.contract", "in/w.bin"]);
        assert_eq!(gathered(folder.path(), "a.csv").unwrap().files.len(), 1);
    }

    #[test]
    fn a_path_through_a_folder_that_will_not_be_there_is_refused_at_its_place() {
        let folder = tempfile::tempdir().unwrap();
        write(folder.path(), "a/p.toml", "");
        write(folder.path(), "a/extra/none", "");
        write(folder.path(), "a/a.toml", "plant = \"extra/../p.toml\"");
        let faults = gathered(folder.path(), "a/a.toml").err().unwrap();
        assert_eq!(faults.list[0].line_column(), Some((1, 9)));
        assert!(faults.to_string().contains("extra/../p.toml"), "{faults}");
        write(folder.path(), "a/a.toml", "plant = \"./../a/p.toml\"");
        assert!(gathered(folder.path(), "a/a.toml").is_ok());
    }

    #[test]
    fn an_absolute_path_is_refused_at_its_place() {
        let folder = tempfile::tempdir().unwrap();
        write(folder.path(), "p.toml", "");
        let path = folder.path().join("p.toml").display().to_string();
        write(folder.path(), "a.toml", &format!("x = 1\nplant = \"{path}\""));
        let faults = gathered(folder.path(), "a.toml").err().unwrap();
        assert_eq!(faults.list[0].line_column(), Some((2, 9)));
        assert!(faults.to_string().contains("absolute"));
    }
}
