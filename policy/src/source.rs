//! Files: read once, within their limits, with the way from a byte back to line and column.

use std::ops::Range;
use std::path::{Component, Path, PathBuf};

use crate::catalogue;
use crate::faults::{Fault, Message, Place};

/// Byte range in a text.
pub(crate) type Span = Range<usize>;

/// A file by two names: where to open it, and how to show it.
#[derive(Debug, Clone)]
pub(crate) struct FileName {
    /// Path to open.
    pub path: PathBuf,
    /// Path as the user gave it, for messages.
    pub shown: PathBuf,
}

impl FileName {
    pub fn fault(&self, message: Message) -> Fault {
        Fault::new(&self.shown, Place::File, message)
    }

    pub fn tensor_fault(&self, tensor: &str, message: Message) -> Fault {
        Fault::new(&self.shown, Place::Tensor(tensor.to_owned()), message)
    }
}

/// A text file with its name.
#[derive(Debug, Clone)]
pub(crate) struct Source {
    pub name: FileName,
    pub text: String,
}

impl Source {
    /// A fault at `span` of this text; a span over several lines is shown on its first.
    pub fn fault(&self, span: &Span, message: Message) -> Fault {
        Fault::new(&self.name.shown, self.place(span), message)
    }

    fn place(&self, span: &Span) -> Place {
        let bytes = self.text.as_bytes();
        let start = floor_boundary(&self.text, span.start);
        let end = floor_boundary(&self.text, span.end.max(start));
        let line_start = bytes[..start].iter().rposition(|&b| b == b'\n').map_or(0, |p| p + 1);
        let line_end = bytes[start..]
            .iter()
            .position(|&b| b == b'\n')
            .map_or(bytes.len(), |p| start + p);
        let text = self.text[line_start..line_end].trim_end_matches('\r');
        let line_end = (line_start + text.len()).max(start);
        Place::Span {
            line: bytes[..line_start].iter().filter(|&&b| b == b'\n').count() + 1,
            column: self.text[line_start..start].chars().count() + 1,
            text: text.to_owned(),
            length: self.text[start..end.min(line_end).max(start)].chars().count().max(1),
        }
    }
}

fn floor_boundary(text: &str, index: usize) -> usize {
    let mut index = index.min(text.len());
    while !text.is_char_boundary(index) {
        index -= 1;
    }
    index
}

/// Reads a whole file of at most `limit` bytes.
pub(crate) fn read_bytes(name: &FileName, limit: u64) -> Result<Vec<u8>, Message> {
    let shown = name.shown.display().to_string();
    let data = std::fs::metadata(&name.path).map_err(|e| catalogue::unreadable(&shown, &e))?;
    if data.is_dir() {
        return Err(catalogue::is_folder(&shown));
    }
    if !data.is_file() {
        return Err(catalogue::not_regular(&shown));
    }
    if data.len() > limit {
        return Err(catalogue::file_too_large(&shown, data.len(), limit));
    }
    std::fs::read(&name.path).map_err(|e| catalogue::unreadable(&shown, &e))
}

/// UTF-8 text of `bytes`, without a byte order mark.
pub(crate) fn text_of(name: &FileName, bytes: Vec<u8>) -> Result<Source, Box<Fault>> {
    match String::from_utf8(bytes) {
        Ok(text) => {
            let text = text.strip_prefix('\u{feff}').map(str::to_owned).unwrap_or(text);
            Ok(Source {
                name: name.clone(),
                text,
            })
        }
        Err(error) => {
            let at = error.utf8_error().valid_up_to();
            let text = String::from_utf8_lossy(error.as_bytes()).into_owned();
            let byte = error.as_bytes().get(at).copied().unwrap_or_default();
            let source = Source {
                name: name.clone(),
                text,
            };
            Err(Box::new(source.fault(&(at..at + 1), catalogue::not_utf8(byte))))
        }
    }
}

/// `path` without `.` and `..`, by text alone; `None` if it climbs above its start.
pub(crate) fn normalise(path: &Path) -> Option<PathBuf> {
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
