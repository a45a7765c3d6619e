//! The files of a policy as they are, every value with its place.

use std::path::{Path, PathBuf};

use crate::catalogue;
use crate::faults::{Fault, Faults, Message};
use crate::limits::{MAX_TOML_BYTES, MAX_WEIGHT_BYTES};
use crate::names::{self, Kind};
use crate::source::{FileName, Span, normalise, read_bytes, text_of};
use crate::toml_reader::{At, Document, Node};

/// How files are found.
#[derive(Debug, Clone, Default)]
pub struct ReadOptions {
    /// Folder that every file must lie in, by its path alone (links are not followed); a relative path of the
    /// contract is then taken from here, and messages name files relative to it.
    pub root: Option<PathBuf>,
}

impl ReadOptions {
    /// Options with [`ReadOptions::root`] set.
    #[must_use]
    pub fn within(root: impl Into<PathBuf>) -> Self {
        ReadOptions {
            root: Some(root.into()),
        }
    }
}

/// A file that is not text.
#[derive(Debug, Clone)]
pub(crate) struct Binary {
    pub name: FileName,
    pub bytes: Vec<u8>,
}

/// The files of a policy, read but not checked. A file that the contract names and that could not be read is
/// remembered as a fault, so that [`crate::check`] reports it beside all others.
#[derive(Debug, Clone)]
pub struct RawPolicy {
    pub(crate) contract: Document,
    pub(crate) mapping: Option<Document>,
    pub(crate) weights: Option<Binary>,
    pub(crate) golden: Option<Binary>,
    pub(crate) files: Vec<PathBuf>,
    pub(crate) faults: Vec<Fault>,
}

impl RawPolicy {
    /// Every file that was opened or should have been, the contract first.
    #[must_use]
    pub fn files(&self) -> &[PathBuf] {
        &self.files
    }

    /// `list` with what a caller needs beside it.
    pub(crate) fn faults(&self, list: Vec<Fault>) -> Faults {
        let (name, signals) = skeleton(&self.contract);
        Faults {
            list,
            files: self.files.clone(),
            name,
            signals,
        }
    }
}

/// Reads the contract at `path` and the files it names (weights, golden vectors, mapping), relative to its folder.
///
/// # Errors
/// If the contract cannot be read, lies outside `options.root`, or is not valid TOML.
pub fn read(path: &Path, options: &ReadOptions) -> Result<RawPolicy, Faults> {
    let alone = |fault: Fault, files: Vec<PathBuf>| Faults {
        list: vec![fault],
        files,
        name: None,
        signals: Vec::new(),
    };
    let given = FileName {
        path: path.to_path_buf(),
        shown: path.to_path_buf(),
    };
    let name = locate(path, options).map_err(|message| alone(given.fault(message), Vec::new()))?;
    let mut files = vec![name.path.clone()];
    let bytes = read_bytes(&name, MAX_TOML_BYTES).map_err(|message| alone(name.fault(message), files.clone()))?;
    let source = text_of(&name, bytes).map_err(|fault| alone(*fault, files.clone()))?;
    let (contract, syntax) = Document::parse(source);
    if !syntax.is_empty() {
        let (name, signals) = skeleton(&contract);
        return Err(Faults {
            list: syntax,
            files,
            name,
            signals,
        });
    }
    let mut faults = Vec::new();
    let mut companion = |keys: &[&str], limit: u64| -> Option<(Binary, Span)> {
        let At {
            value: Node::Text(text),
            span,
        } = contract.peek(keys)?
        else {
            return None;
        };
        let read = beside(&name, text, options).and_then(|name| {
            files.push(name.path.clone());
            read_bytes(&name, limit).map(|bytes| Binary { name, bytes })
        });
        read.map_err(|message| faults.push(contract.fault(span, message)))
            .ok()
            .map(|file| (file, span.clone()))
    };
    let weights = companion(&["network", "weights"], MAX_WEIGHT_BYTES).map(|(file, _)| file);
    let golden = companion(&["network", "golden"], MAX_WEIGHT_BYTES).map(|(file, _)| file);
    let mapping = companion(&["mapping", "file"], MAX_TOML_BYTES);
    let mapping = mapping.and_then(|(file, _)| document(file, &mut faults));
    Ok(RawPolicy {
        contract,
        mapping,
        weights,
        golden,
        files,
        faults,
    })
}

fn document(file: Binary, faults: &mut Vec<Fault>) -> Option<Document> {
    let source = text_of(&file.name, file.bytes)
        .map_err(|fault| faults.push(*fault))
        .ok()?;
    let (document, syntax) = Document::parse(source);
    let sound = syntax.is_empty();
    faults.extend(syntax);
    sound.then_some(document)
}

/// The contract's path, checked against the root.
fn locate(path: &Path, options: &ReadOptions) -> Result<FileName, Message> {
    let Some(root) = &options.root else {
        return Ok(FileName {
            path: path.to_path_buf(),
            shown: path.to_path_buf(),
        });
    };
    let shown = path.strip_prefix(root).unwrap_or(path).display().to_string();
    inside(root, &root.join(path)).ok_or_else(|| catalogue::outside_root(&shown))
}

/// A file named in `owner`, relative to its folder.
fn beside(owner: &FileName, text: &str, options: &ReadOptions) -> Result<FileName, Message> {
    let join = |file: &Path| {
        file.parent()
            .map_or_else(|| PathBuf::from(text), |folder| folder.join(text))
    };
    let (path, shown) = (join(&owner.path), join(&owner.shown));
    match &options.root {
        None => Ok(FileName { path, shown }),
        Some(root) => inside(root, &path).ok_or_else(|| catalogue::outside_root(text)),
    }
}

/// `path` by its text alone, if it lies in `root`; shown relative to it.
fn inside(root: &Path, path: &Path) -> Option<FileName> {
    let (root, path) = (normalise(root)?, normalise(path)?);
    let shown = path
        .strip_prefix(&root)
        .ok()
        .filter(|rest| !rest.as_os_str().is_empty())?
        .to_path_buf();
    Some(FileName { path, shown })
}

/// Name and signals of a contract as far as they can be told.
fn skeleton(contract: &Document) -> (Option<String>, Vec<(String, bool)>) {
    let fit = |node: Option<&At<Node>>, kind| match node {
        Some(At {
            value: Node::Text(text),
            ..
        }) if names::objection(text, kind).is_none() => Some(text.clone()),
        _ => None,
    };
    let name = fit(contract.peek(&["name"]), Kind::Policy);
    let mut signals: Vec<(String, bool)> = Vec::new();
    if let Some(At {
        value: Node::List(items),
        ..
    }) = contract.peek(&["signal"])
    {
        for item in items {
            let Node::Table(entries) = &item.value else { continue };
            let find = |key: &str| entries.iter().find(|(name, _)| name.value == key).map(|(_, node)| node);
            if let Some(name) = fit(find("name"), Kind::Signal)
                && signals.iter().all(|(known, _)| *known != name)
            {
                signals.push((name, find("adc").is_some()));
            }
        }
    }
    (name, signals)
}
