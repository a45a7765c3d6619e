//! Files in memory, in the place of those on disk.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

/// Files by their paths, all below one root, which has no name: `policy.toml`, `plants/buck.toml`. A copy shares them.
///
/// ```
/// use toml_input::{Document, FileName, Files};
///
/// let files: Files = [("steps.toml", &b"periods = 3"[..])].into_iter().collect();
/// let name = FileName::new("steps.toml".as_ref()).among(Some(&files));
/// let document = Document::open(name)?;
/// assert!(document.peek(&["periods"]).is_some());
/// # Ok::<(), toml_input::Faults>(())
/// ```
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Files(Arc<BTreeMap<PathBuf, Cow<'static, [u8]>>>);

impl Files {
    /// The content of `path`, in which `.` and `..` are followed.
    #[must_use]
    pub fn get(&self, path: &Path) -> Option<&[u8]> {
        self.0.get(&Self::key(path)?).map(AsRef::as_ref)
    }

    /// Puts a file among them, in the place of one of the same path. A path that leads out of the root is left out.
    pub fn insert(&mut self, path: &Path, bytes: impl Into<Cow<'static, [u8]>>) {
        if let Some(key) = Self::key(path) {
            Arc::make_mut(&mut self.0).insert(key, bytes.into());
        }
    }

    /// Takes a file away.
    pub fn remove(&mut self, path: &Path) {
        if let Some(key) = Self::key(path) {
            Arc::make_mut(&mut self.0).remove(&key);
        }
    }

    /// All paths, in order.
    pub fn paths(&self) -> impl Iterator<Item = &Path> {
        self.0.keys().map(PathBuf::as_path)
    }

    /// A path from the root, without `.` and `..`; nothing if it leads out of the root.
    pub(crate) fn key(path: &Path) -> Option<PathBuf> {
        let mut parts: Vec<Component<'_>> = Vec::new();
        for part in path.components() {
            match part {
                Component::CurDir => {}
                Component::ParentDir => drop(parts.pop()?),
                other => parts.push(other),
            }
        }
        Some(parts.iter().collect())
    }
}

impl<P: AsRef<Path>, B: Into<Cow<'static, [u8]>>> FromIterator<(P, B)> for Files {
    fn from_iter<I: IntoIterator<Item = (P, B)>>(files: I) -> Self {
        let mut all = Self::default();
        for (path, bytes) in files {
            all.insert(path.as_ref(), bytes);
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::FileName;

    fn files() -> Files {
        [("a/policy.toml", "x"), ("plants/b.toml", "yy")]
            .into_iter()
            .map(|(path, text)| (path, text.as_bytes()))
            .collect()
    }

    fn named(path: &str) -> FileName {
        FileName::new(Path::new(path)).among(Some(&files()))
    }

    fn problem(name: &FileName) -> String {
        name.fault(name.read(1).unwrap_err()).problem
    }

    #[test]
    fn a_file_beside_a_held_one_is_held_too() {
        let found = named("a/policy.toml").beside("../plants/./b.toml");
        assert_eq!(found.read(2).unwrap(), b"yy");
        assert!(found.is_same(&named("plants/b.toml")) && !found.is_same(&named("a/policy.toml")));
    }

    #[test]
    fn what_is_not_held_is_missing_even_if_it_lies_on_disk() {
        for path in ["Cargo.toml", "../toml-input/Cargo.toml"] {
            assert!(Path::new(path).is_file());
            assert!(!named(path).is_file());
            let held = problem(&named(path));
            assert_eq!(
                held,
                problem(&FileName::new(Path::new("no-such.toml"))).replace("no-such.toml", path)
            );
        }
    }

    #[test]
    fn a_held_file_has_the_limit_of_one_on_disk() {
        assert!(problem(&named("plants/b.toml")).contains("too large"));
    }
}
