//! One task.

use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use toml_input::FileName;

use crate::BUILD;
use crate::digest::of_parts;
use crate::inputs::Content;
use crate::kind::Kind;

/// Hexadecimal digits of a digest in a task's name: 64 bits, so that of a million tasks two have one name with a chance of 3e-8.
const DIGITS: usize = 16;

/// Where a task stands on an axis of its plan: a file as the plan names it, or a number.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Axis {
    /// A seed, a shard, ...
    Number(u64),
    /// A file, a format, ...
    Text(String),
}

impl fmt::Display for Axis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => number.fmt(f),
            Self::Text(text) => text.fmt(f),
        }
    }
}

impl PartialOrd for Axis {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Axis {
    fn cmp(&self, other: &Self) -> Ordering {
        match (self, other) {
            (Self::Number(a), Self::Number(b)) => a.cmp(b),
            (Self::Text(a), Self::Text(b)) => a.cmp(b),
            (Self::Number(_), Self::Text(_)) => Ordering::Less,
            (Self::Text(_), Self::Number(_)) => Ordering::Greater,
        }
    }
}

/// A run of a command, and everything that it reads.
#[derive(Debug, Clone)]
pub struct Task {
    /// Which command.
    pub kind: Kind,
    /// `train-0123456789abcdef`: the kind, and the digest of version, arguments and files. Equal names are equal results.
    pub id: String,
    /// Name and value of each axis on which the plan has several, or of what tells the task apart.
    pub axes: Vec<(String, Axis)>,
    /// The command line behind `policyc`, for a folder that holds `inputs`.
    pub arguments: Vec<String>,
    /// Files by their path from the folder of the task.
    pub inputs: BTreeMap<String, Arc<Content>>,
    /// The files that the command line names, where they are here: the training file; scenario, policy and plant; ...
    pub named: Vec<FileName>,
}

/// The command in the name of a task; nothing if it is no such name. A name becomes a folder, and may come from a file of somebody else.
#[must_use]
pub fn kind_of(id: &str) -> Option<Kind> {
    let (name, digest) = id.split_once('-')?;
    let is_digit = |byte: u8| byte.is_ascii_digit() || (b'a'..=b'f').contains(&byte);
    let is_whole = digest.len() == DIGITS && digest.bytes().all(is_digit);
    Kind::ALL
        .into_iter()
        .find(|kind| kind.name() == name)
        .filter(|_| is_whole)
}

impl Task {
    pub(crate) fn new(
        kind: Kind,
        axes: Vec<(String, Axis)>,
        arguments: Vec<String>,
        inputs: BTreeMap<String, Arc<Content>>,
        named: Vec<FileName>,
    ) -> Self {
        let own = [BUILD, kind.name(), "arguments"];
        let files = inputs
            .iter()
            .flat_map(|(path, content)| [path.as_str(), content.digest.as_str()]);
        let parts = own.into_iter().chain(arguments.iter().map(String::as_str));
        let digest = of_parts(parts.chain(["files"]).chain(files));
        Self {
            kind,
            id: format!("{}-{}", kind.name(), &digest[..DIGITS]),
            axes,
            arguments,
            inputs,
            named,
        }
    }

    /// The axes in words: `settings paper12.toml, seed 3`.
    #[must_use]
    pub fn title(&self) -> String {
        title(self.kind, &self.axes)
    }
}

pub(crate) fn title(kind: Kind, axes: &[(String, Axis)]) -> String {
    let axes: Vec<String> = axes.iter().map(|(name, value)| format!("{name} {value}")).collect();
    format!("{}: {}", kind.name(), axes.join(", "))
}
