//! Files: read once, within their limits, with the way from a byte back to line and column.

use std::ops::Range;
use std::path::{Component, Path, PathBuf};

use crate::fault::{Fault, Message, Place};
use crate::files::Files;
use crate::messages;

/// Byte range in a text.
pub type Span = Range<usize>;

/// Who named a file: what its path is relative to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Origin {
    /// A person at the command line or a program: the working folder.
    Caller,
    /// A macro or a build script: the folder of `Cargo.toml`.
    Crate,
    /// Another file: that file's folder.
    File,
}

impl Origin {
    pub(crate) fn relative_to(self) -> &'static str {
        match self {
            Origin::Caller => "the path is relative to the working folder",
            Origin::Crate => "the path is relative to the folder of Cargo.toml",
            Origin::File => {
                "paths are relative to the folder of the file that names them; where they belong to it, whoever gave you that file has the others \
                 too"
            }
        }
    }
}

/// A file by two names, where to open it and how to show it, and where its bytes come from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FileName {
    /// Path to open.
    pub path: PathBuf,
    /// Path as the user gave it, for messages.
    pub shown: PathBuf,
    /// Who named it.
    pub origin: Origin,
    /// The files that it is one of; nothing: those on disk.
    pub held: Option<Files>,
}

impl FileName {
    /// A file that the caller named, shown by the path it is opened with.
    #[must_use]
    pub fn new(path: &Path) -> Self {
        FileName {
            path: path.to_path_buf(),
            shown: path.to_path_buf(),
            origin: Origin::Caller,
            held: None,
        }
    }

    /// This name, to be opened among `files` and not on disk.
    #[must_use]
    pub fn among(self, files: Option<&Files>) -> Self {
        FileName {
            held: files.cloned(),
            ..self
        }
    }

    /// A file that another file named; `path` leads there from the working folder.
    #[must_use]
    pub fn named_by_a_file(path: &Path) -> Self {
        FileName {
            origin: Origin::File,
            ..FileName::new(path)
        }
    }

    /// The file that this one calls `text`: a path from its folder. It is shown without the way into that folder and out again.
    #[must_use]
    pub fn beside(&self, text: &str) -> Self {
        let join = |file: &Path| {
            file.parent()
                .map_or_else(|| PathBuf::from(text), |folder| folder.join(text))
        };
        FileName {
            path: join(&self.path),
            shown: self.shown_beside(text).unwrap_or_else(|| join(&self.shown)),
            origin: Origin::File,
            held: self.held.clone(),
        }
    }

    /// `plants/buck.toml` for `../plants/buck.toml` beside `train/train.toml`; nothing where that would lead elsewhere: behind a
    /// symbolic link.
    fn shown_beside(&self, text: &str) -> Option<PathBuf> {
        let own = self.shown.parent()?;
        let (mut folder, mut rest) = (own.to_path_buf(), Path::new(text));
        while let Ok(inner) = rest.strip_prefix("..")
            && matches!(folder.components().next_back(), Some(Component::Normal(_)))
        {
            folder.pop();
            rest = inner;
        }
        let short = folder.join(rest);
        let real = |path: &Path| Path::new(".").join(path.parent()?).canonicalize().ok();
        // what is not there is missing by either name
        let is_same = self.held.is_some() || real(&own.join(text)).is_none_or(|folder| real(&short) == Some(folder));
        is_same.then_some(short)
    }

    /// The file called `name` in the folder of this one, named by nobody yet.
    #[must_use]
    pub fn with_file_name(&self, name: &str) -> Self {
        FileName {
            path: self.path.with_file_name(name),
            shown: self.shown.with_file_name(name),
            ..self.clone()
        }
    }

    /// Whether there is such a file, a regular one.
    #[must_use]
    pub fn is_file(&self) -> bool {
        match &self.held {
            Some(files) => files.get(&self.path).is_some(),
            None => self.path.is_file(),
        }
    }

    /// Whether both are the same file, by whatever path.
    #[must_use]
    pub fn is_same(&self, other: &Self) -> bool {
        match (&self.held, &other.held) {
            (None, None) => {
                let real = |name: &Self| name.path.canonicalize();
                real(self).is_ok_and(|own| real(other).is_ok_and(|other| own == other))
            }
            (Some(_), Some(_)) => self.is_file() && Files::key(&self.path) == Files::key(&other.path),
            _ => false,
        }
    }

    /// A fault of the file as a whole.
    #[must_use]
    pub fn fault(&self, message: Message) -> Fault {
        Fault::new(&self.shown, Place::File, message)
    }

    /// A fault of a tensor in the file.
    #[must_use]
    pub fn tensor_fault(&self, tensor: &str, message: Message) -> Fault {
        Fault::new(&self.shown, Place::Tensor(tensor.to_owned()), message)
    }

    /// The whole content.
    ///
    /// # Errors
    /// If it is no regular file, is larger than `limit` bytes, or cannot be read.
    pub fn read(&self, limit: u64) -> Result<Vec<u8>, Message> {
        let shown = self.shown.display().to_string();
        if let Some(files) = &self.held {
            let missing = || messages::unreadable(&shown, self.origin, &std::io::ErrorKind::NotFound.into());
            let bytes = files.get(&self.path).ok_or_else(missing)?;
            return match bytes.len() as u64 {
                length if length > limit => Err(messages::file_too_large(&shown, length, limit)),
                _ => Ok(bytes.to_vec()),
            };
        }
        let data = std::fs::metadata(&self.path).map_err(|e| messages::unreadable(&shown, self.origin, &e))?;
        if data.is_dir() {
            return Err(messages::is_folder(&shown));
        }
        // a pipe would wait for its writer, and /dev/zero would never end
        if !data.is_file() {
            return Err(messages::not_regular(&shown));
        }
        // before it is read: a sparse file of 2 GB would fill the memory
        if data.len() > limit {
            return Err(messages::file_too_large(&shown, data.len(), limit));
        }
        std::fs::read(&self.path).map_err(|e| messages::unreadable(&shown, self.origin, &e))
    }
}

impl<P: AsRef<Path> + ?Sized> From<&P> for FileName {
    fn from(path: &P) -> Self {
        FileName::new(path.as_ref())
    }
}

/// A text file with its name.
#[derive(Debug, Clone)]
pub struct Source {
    /// The file.
    pub name: FileName,
    /// Its text, without a byte order mark.
    pub text: String,
}

impl Source {
    /// The text in `bytes`.
    ///
    /// # Errors
    /// If it is no text, or not UTF-8; the fault of a text shows the first byte that is not.
    pub fn new(name: FileName, bytes: Vec<u8>) -> Result<Self, Box<Fault>> {
        // no line of a program or a picture is worth showing
        if bytes.contains(&0) {
            return Err(Box::new(name.fault(messages::not_text())));
        }
        match String::from_utf8(bytes) {
            Ok(text) => {
                // a byte order mark would shift every column of the first line by one
                let text = text.strip_prefix('\u{feff}').map(str::to_owned).unwrap_or(text);
                Ok(Source { name, text })
            }
            Err(error) => {
                let at = error.utf8_error().valid_up_to();
                let byte = error.as_bytes().get(at).copied().unwrap_or_default();
                // nothing before `at` is replaced, so the place of the fault is right
                let text = String::from_utf8_lossy(error.as_bytes()).into_owned();
                let source = Source { name, text };
                Err(Box::new(source.fault(&(at..at + 1), messages::not_utf8(byte))))
            }
        }
    }

    /// A fault at `span` of this text; a span over several lines is shown on its first.
    #[must_use]
    pub fn fault(&self, span: &Span, message: Message) -> Fault {
        Fault::new(&self.name.shown, self.place(span), message)
    }

    fn place(&self, span: &Span) -> Place {
        let bytes = self.text.as_bytes();
        // the end of a span may lie within a replacement character, which has three bytes
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
