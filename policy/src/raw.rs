//! The files of a policy as they are, every value with its place.

use std::borrow::Cow;
use std::path::{Component, Path, PathBuf};

use toml_input::{Document, Fault, FileName, Files, Message, Origin, Sink, Source, Value};

use crate::catalogue;
use crate::faults::{Faults, Skeleton};
use crate::limits::{MAX_OUTPUTS, MAX_TOML_BYTES, MAX_WEIGHT_BYTES};
use crate::names::{self, Kind};
use crate::weights::header::not_a_contract;

/// How files are found.
#[derive(Debug, Clone, Default)]
pub struct ReadOptions {
    /// Folder that every file must lie in, by its path alone (links are not followed); a relative path of the
    /// contract is then taken from here, and messages name files relative to it.
    pub root: Option<PathBuf>,
    /// Files that a program carries inside or holds in memory. With them nothing is looked for on disk.
    pub files: Option<Files>,
    /// Files that the contract names must lie in its own folder, by the path alone. A contract from elsewhere could name any
    /// file of this machine, and a message about it would show a line of it.
    pub own_folder: bool,
    /// Do not read the golden vectors: whoever looks for what is wrong with the features must get past them.
    pub without_golden: bool,
    /// Take a contract with several outputs ([`crate::Head::Several`]). Whoever knows one duty must not get one of several for it,
    /// so they are refused unless somebody says that he knows them.
    pub several_outputs: bool,
}

impl ReadOptions {
    /// Options for a policy that a program carries inside or holds in memory.
    pub fn embedded<P, B>(files: impl IntoIterator<Item = (P, B)>) -> Self
    where
        P: AsRef<Path>,
        B: Into<Cow<'static, [u8]>>,
    {
        ReadOptions {
            files: Some(files.into_iter().collect()),
            ..ReadOptions::default()
        }
    }

    /// Options with [`ReadOptions::root`] set.
    #[must_use]
    pub fn within(root: impl Into<PathBuf>) -> Self {
        ReadOptions {
            root: Some(root.into()),
            ..ReadOptions::default()
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
    /// Of each of several outputs.
    pub(crate) mappings: Vec<Option<Document>>,
    /// [`ReadOptions::several_outputs`]
    pub(crate) several: bool,
    pub(crate) weights: Option<Binary>,
    pub(crate) golden: Option<Binary>,
    pub(crate) files: Vec<PathBuf>,
    pub(crate) faults: Sink,
}

impl RawPolicy {
    /// Every file that was opened or should have been, the contract first.
    #[must_use]
    pub fn files(&self) -> &[PathBuf] {
        &self.files
    }

    /// `faults` with what a caller needs beside them.
    pub(crate) fn rejected(&self, faults: toml_input::Faults) -> Faults {
        rejected(&self.contract, self.files.clone(), faults)
    }
}

/// Reads the contract at `path` and the files it names (weights, golden vectors, mapping), relative to its folder.
///
/// # Errors
/// If the contract cannot be read, lies outside `options.root`, or is not valid TOML.
pub fn read(path: &Path, options: &ReadOptions) -> Result<RawPolicy, Faults> {
    let alone = |fault: Fault, files: Vec<PathBuf>| Faults {
        faults: fault.into(),
        files,
        skeleton: Box::default(),
    };
    let mut faults = Sink::new();
    let given = FileName::new(path);
    let name = locate(path, options).map_err(|message| alone(given.fault(message), Vec::new()))?;
    let mut files = vec![name.path.clone()];
    let bytes = name
        .read(MAX_TOML_BYTES)
        .map_err(|message| alone(name.fault(message), files.clone()))?;
    // before the bytes become text: "not UTF-8" would be the lesser hint for a file of weights
    if let Some(message) = not_a_contract(&bytes) {
        return Err(alone(name.fault(message), files));
    }
    let source = Source::new(name.clone(), bytes).map_err(|fault| alone(*fault, files.clone()))?;
    let contract = Document::parse(source, &mut faults);
    faults
        // in a text with faults of syntax the names of the other files may be what is broken
        .propagate()
        .map_err(|faults| rejected(&contract, files.clone(), faults))?;
    let mut companion = |value: Option<Value<'_>>, limit: u64| -> Option<Binary> {
        let value = value?;
        let text = value.as_text()?;
        let read = beside(&name, text, options).and_then(|name| {
            // before it is read: a file that is missing has to cause a rebuild when it comes
            files.push(name.path.clone());
            name.read(limit).map(|bytes| Binary { name, bytes })
        });
        read.map_err(|message| faults.push(value.fault(message))).ok()
    };
    let weights = companion(contract.peek(&["network", "weights"]), MAX_WEIGHT_BYTES);
    let golden = match options.without_golden {
        true => None,
        false => companion(contract.peek(&["network", "golden"]), MAX_WEIGHT_BYTES),
    };
    let mapping = companion(contract.peek(&["mapping", "file"]), MAX_TOML_BYTES);
    let outputs = contract.peek(&["output"]).and_then(|value| value.as_list());
    // more than there may be are refused unread
    let outputs = outputs.unwrap_or_default().into_iter().take(MAX_OUTPUTS);
    let of_outputs: Vec<Option<Binary>> = outputs
        .map(|output| companion(output.peek("mapping").and_then(|own| own.peek("file")), MAX_TOML_BYTES))
        .collect();
    let mapping = mapping.and_then(|file| document(file, &mut faults));
    let mappings = of_outputs
        .into_iter()
        .map(|file| file.and_then(|file| document(file, &mut faults)))
        .collect();
    Ok(RawPolicy {
        contract,
        mapping,
        mappings,
        several: options.several_outputs,
        weights,
        golden,
        files,
        faults,
    })
}

fn document(file: Binary, faults: &mut Sink) -> Option<Document> {
    let source = Source::new(file.name, file.bytes)
        .map_err(|fault| faults.push(*fault))
        .ok()?;
    let before = faults.count();
    let document = Document::parse(source, faults);
    // what was recovered may lack keys, and each would be reported as missing
    (faults.count() == before).then_some(document)
}

/// The contract's path, checked against the root.
fn locate(path: &Path, options: &ReadOptions) -> Result<FileName, Message> {
    let Some(root) = &options.root else {
        return Ok(FileName::new(path).among(options.files.as_ref()));
    };
    let shown = path.strip_prefix(root).unwrap_or(path).display().to_string();
    let name = FileName {
        origin: Origin::Crate,
        ..FileName::new(&root.join(path)).among(options.files.as_ref())
    };
    inside(root, &name).ok_or_else(|| catalogue::outside_root(&shown))
}

/// A file named in `owner`, relative to its folder.
fn beside(owner: &FileName, text: &str, options: &ReadOptions) -> Result<FileName, Message> {
    let name = owner.beside(text);
    if options.own_folder && !is_in_folder_of(owner, &name) {
        return Err(catalogue::outside_folder(text));
    }
    match &options.root {
        None => Ok(name),
        Some(root) => inside(root, &name).ok_or_else(|| catalogue::outside_root(text)),
    }
}

fn is_in_folder_of(owner: &FileName, name: &FileName) -> bool {
    // from the root of the file system: one of the two paths may be relative and the other not
    // where there is no file system there is no working folder, and both are from the root
    let whole = |path: &Path| normalise(&std::path::absolute(path).unwrap_or_else(|_| path.to_owned()));
    let folder = whole(&owner.path).and_then(|path| path.parent().map(Path::to_owned));
    folder
        .zip(whole(&name.path))
        .is_some_and(|(folder, path)| path.starts_with(folder))
}

/// A file by the text of its path alone, if it lies in `root`; shown relative to it.
fn inside(root: &Path, name: &FileName) -> Option<FileName> {
    let (root, path) = (normalise(root)?, normalise(&name.path)?);
    let shown = path
        .strip_prefix(&root)
        .ok()
        .filter(|rest| !rest.as_os_str().is_empty())?
        .to_path_buf();
    Some(FileName {
        path,
        shown,
        ..name.clone()
    })
}

/// `path` without `.` and `..`, by text alone; `None` if it climbs above its start.
fn normalise(path: &Path) -> Option<PathBuf> {
    // not `canonicalize`, which needs a file that exists: a missing one is to be called missing, not outside
    let mut parts: Vec<Component<'_>> = Vec::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir => match parts.last() {
                Some(Component::Normal(_)) => drop(parts.pop()),
                _ => return None,
            },
            other => parts.push(other),
        }
    }
    Some(parts.iter().collect())
}

/// `faults` with what a caller needs beside them.
fn rejected(contract: &Document, files: Vec<PathBuf>, faults: toml_input::Faults) -> Faults {
    Faults {
        faults,
        files,
        skeleton: Box::new(skeleton(contract)),
    }
}

fn skeleton(contract: &Document) -> Skeleton {
    let fit = |value: Option<Value<'_>>, kind| {
        let text = value?.as_text()?;
        names::objection(text, kind).is_none().then(|| text.to_owned())
    };
    let name = fit(contract.peek(&["name"]), Kind::Policy);
    let mut signals: Vec<(String, bool)> = Vec::new();
    let items = contract.peek(&["signal"]).and_then(|value| value.as_list());
    for item in items.unwrap_or_default() {
        // a name that is given twice is left out: the stand-in has a field for each
        if let Some(name) = fit(item.peek("name"), Kind::Signal)
            && signals.iter().all(|(known, _)| *known != name)
        {
            signals.push((name, item.peek("adc").is_some()));
        }
    }
    let list = contract.peek(&["output"]).and_then(|value| value.as_list());
    let list = list.unwrap_or_default();
    let mut outputs: Vec<Option<String>> = Vec::new();
    for item in &list {
        let name = fit(item.peek("name"), Kind::Output);
        outputs.push(name.filter(|name| outputs.iter().flatten().all(|known| known != name)));
    }
    let columns = |table: Value<'_>| {
        let count = |key: &str| Some(table.peek(key)?.as_list()?.len());
        match table.peek("continuous") {
            Some(_) => Some(1),
            None => count("duties").or_else(|| count("offsets")),
        }
    };
    let own = list.iter().map(|item| columns(item.peek("actions")?)).sum();
    Skeleton {
        name,
        signals,
        features: contract
            .peek(&["feature"])
            .and_then(|value| value.as_list())
            .map(|list| list.len()),
        actions: match outputs.is_empty() {
            true => contract.peek(&["actions"]).and_then(columns),
            false => own,
        },
        outputs,
    }
}
