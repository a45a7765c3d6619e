//! Files, and answers about them.

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::Value;
use toml_input::{Faults, FileName, Files, Message};

use crate::answer::{Made, Refused};
use crate::part::Part;

/// Hears how far a long piece of work is.
pub type Tell = fn(&str);

/// Files of a user in memory, and what was made of them last.
#[derive(Debug, Clone)]
pub struct Session {
    parts: &'static [Part],
    files: Files,
    made: BTreeMap<String, Vec<u8>>,
}

/// What a request makes: an answer, and files beside it.
pub(crate) struct Reply {
    pub answer: Value,
    pub made: BTreeMap<String, Vec<u8>>,
}

impl Reply {
    /// An answer alone.
    pub fn of(answer: &impl Serialize) -> Result<Self, Faults> {
        Self::with(answer, BTreeMap::new())
    }

    /// An answer, whose `files` list what was made.
    pub fn with(answer: &impl Serialize, made: BTreeMap<String, Vec<u8>>) -> Result<Self, Faults> {
        let told = |error: serde_json::Error| Message::new(error.to_string());
        let mut answer = serde_json::to_value(answer).map_err(told)?;
        let listed: Vec<Made> = made
            .iter()
            .map(|(name, bytes)| Made {
                name: name.clone(),
                bytes: bytes.len(),
            })
            .collect();
        if let (Value::Object(fields), false) = (&mut answer, listed.is_empty()) {
            fields.insert("files".to_owned(), serde_json::to_value(listed).map_err(told)?);
        }
        Ok(Reply { answer, made })
    }
}

/// What a request says, as far as `T` asks for it.
pub(crate) fn read<'r, T: Deserialize<'r>>(request: &'r Value) -> Result<T, Faults> {
    T::deserialize(request).map_err(|error| not_understood(&error))
}

fn not_understood(error: &serde_json::Error) -> Faults {
    Message::new("the page asks what is not understood")
        .found(error.to_string())
        .into()
}

impl Session {
    /// A session without files that answers the requests of `parts`.
    #[must_use]
    pub fn new(parts: &'static [Part]) -> Self {
        Session {
            parts,
            files: Files::default(),
            made: BTreeMap::new(),
        }
    }

    /// Takes a file in, in the place of one of the same path.
    pub fn put(&mut self, path: &str, bytes: Vec<u8>) {
        self.files.insert(Path::new(path), bytes);
    }

    /// Takes a file away.
    pub fn forget(&mut self, path: &str) {
        self.files.remove(Path::new(path));
    }

    /// A file that the last request made.
    #[must_use]
    pub fn made(&self, name: &str) -> Option<&[u8]> {
        self.made.get(name).map(Vec::as_slice)
    }

    /// Answers `request`, a JSON object whose `ask` is its name, in JSON. `tell` hears of long work.
    pub fn ask(&mut self, request: &[u8], tell: Tell) -> String {
        let asked = serde_json::from_slice::<Value>(request).map_err(|error| not_understood(&error));
        let reply = asked.and_then(|asked| self.reply(&asked, tell));
        let (answer, made) = match reply {
            Ok(Reply { answer, made }) => (answer, made),
            // texts and numbers alone: this cannot fail
            Err(faults) => (
                serde_json::to_value(Refused::from(faults)).unwrap_or_default(),
                BTreeMap::new(),
            ),
        };
        self.made = made;
        answer.to_string()
    }

    fn reply(&self, request: &Value, tell: Tell) -> Result<Reply, Faults> {
        let name = request["ask"].as_str().unwrap_or_default();
        let Some(answer) = self.parts.iter().find_map(|part| part.find(name)) else {
            return Err(Message::new("the page asks what is not understood").found(name).into());
        };
        answer(self, request, tell)
    }

    /// A file of the session by its path, named by the user.
    pub(crate) fn named(&self, path: &str) -> FileName {
        FileName::new(Path::new(path)).among(Some(&self.files))
    }

    pub(crate) fn files(&self) -> &Files {
        &self.files
    }
}

/// Texts as bytes.
pub(crate) fn texts(files: BTreeMap<String, String>) -> BTreeMap<String, Vec<u8>> {
    files
        .into_iter()
        .map(|(name, text)| (name, text.into_bytes()))
        .collect()
}
