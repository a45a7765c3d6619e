//! Checked-in files against what the policy yields today.

use std::collections::BTreeSet;
use std::path::Path;

use codegen::manifest;
use policy::Policy;
use serde::Serialize;

use crate::session::{Files, VerifyError};

/// How a folder differs from what the policy yields; all lists empty if it does not.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Drift {
    /// Files the policy yields that the folder lacks.
    pub missing: Vec<String>,
    /// Files with other content.
    pub changed: Vec<Changed>,
    /// Files of the policy's name and a generated kind that the policy does not yield.
    pub extra: Vec<String>,
}

impl Drift {
    /// Whether nothing differs.
    pub fn is_empty(&self) -> bool {
        self.missing.is_empty() && self.changed.is_empty() && self.extra.is_empty()
    }
}

/// A file with other content, at the first line that differs.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Changed {
    /// Relative path.
    pub path: String,
    /// Line number, from 1.
    pub line: usize,
    /// What the policy yields; `None` if the file goes on behind its end.
    pub expected: Option<String>,
    /// What the file says; `None` if it ends before.
    pub found: Option<String>,
}

impl Changed {
    /// Whether the line differs in nothing but the white space at its end.
    #[must_use]
    pub fn differs_at_its_end(&self) -> bool {
        let ends = |line: &Option<String>| line.as_deref().unwrap_or_default().trim_end().to_owned();
        self.found.is_some() && ends(&self.expected) == ends(&self.found)
    }
}

/// Compares `folder` with the files that the policy yields.
///
/// # Errors
/// If a file is there but cannot be read. A missing folder lacks all files.
pub fn drift(policy: &Policy, expected: &Files, folder: &Path) -> Result<Drift, VerifyError> {
    let found = read(expected, &policy.name, folder)?;
    Ok(compare(expected, &found))
}

/// Compares two sets of files.
pub fn compare(expected: &Files, found: &Files) -> Drift {
    let mut drift = Drift::default();
    for (path, text) in expected {
        match found.get(path) {
            None => drift.missing.push(path.clone()),
            Some(other) if other != text => drift.changed.push(changed(path, text, other)),
            Some(_) => {}
        }
    }
    // only files of our name and kind were read, so what is not expected was once generated
    drift.extra = found
        .keys()
        .filter(|path| !expected.contains_key(*path))
        .cloned()
        .collect();
    drift
}

fn changed(path: &str, expected: &str, found: &str) -> Changed {
    // lines with their ends, so that a changed line end counts
    let mut lines = expected.split_inclusive('\n').zip(found.split_inclusive('\n'));
    let same = lines.by_ref().take_while(|(a, b)| a == b).count();
    let line = |text: &str| {
        text.split_inclusive('\n')
            .nth(same)
            .map(|line| line.trim_end_matches('\n').to_owned())
    };
    Changed {
        path: path.to_owned(),
        line: same + 1,
        expected: line(expected),
        found: line(found),
    }
}

/// Largest text file that is read.
const MAX_TEXT_BYTES: u64 = 256 << 20;

/// Text of a regular file; bytes that are no UTF-8 become replacement characters.
///
/// # Errors
/// As `std::fs::read`, and for pipes, devices and files of more than 256 MiB, which would block or fill the memory.
pub fn read_text(path: &Path) -> std::io::Result<String> {
    let data = std::fs::metadata(path)?;
    if !data.is_file() {
        return Err(std::io::Error::other("is not a regular file"));
    }
    if data.len() > MAX_TEXT_BYTES {
        return Err(std::io::Error::other("is larger than 256 MiB"));
    }
    Ok(String::from_utf8_lossy(&std::fs::read(path)?).into_owned())
}

/// The expected files that exist, and files beside them that look generated for a policy of this name.
fn read(expected: &Files, name: &str, folder: &Path) -> Result<Files, VerifyError> {
    // expected files by their paths, which may lead into folders; strangers beside them in the folder itself
    let mut paths: BTreeSet<String> = expected.keys().cloned().collect();
    let extensions: BTreeSet<_> = expected.keys().filter_map(|path| Path::new(path).extension()).collect();
    let mine = |file: &str| {
        // `-` begins neither an extension nor an ending: the file is somebody else's
        let rest = file.strip_prefix(name).unwrap_or("-");
        rest.starts_with(['.', '_']) && Path::new(file).extension().is_some_and(|e| extensions.contains(e))
    };
    if folder.is_dir() {
        let error = |error| VerifyError::Io(folder.to_owned(), error);
        for file in std::fs::read_dir(folder).map_err(error)? {
            paths.extend(
                file.map_err(error)?
                    .file_name()
                    .into_string()
                    .ok()
                    .filter(|file| mine(file)),
            );
        }
    }
    let mut files = Files::new();
    for path in paths {
        let place = folder.join(&path);
        match read_text(&place) {
            // what a step costs depends on the compilers of a machine
            Ok(text) if path == manifest::FILE => drop(files.insert(path, manifest::without_costs(&text))),
            Ok(text) => drop(files.insert(path, text)),
            // what is not there is found missing by the comparison
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {}
            Err(error) => return Err(VerifyError::Io(place, error)),
        }
    }
    Ok(files)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn files(list: &[(&str, &str)]) -> Files {
        list.iter()
            .map(|(path, text)| ((*path).to_owned(), (*text).to_owned()))
            .collect()
    }

    #[test]
    fn equal_files_do_not_drift() {
        let a = files(&[("x.c", "1\n2\n"), ("x.h", "")]);
        assert!(compare(&a, &a).is_empty());
    }

    #[test]
    fn the_first_line_that_differs_is_named() {
        let drift = compare(&files(&[("x.c", "1\n2\n3\n")]), &files(&[("x.c", "1\n2\n4\n")]));
        let [changed] = drift.changed.as_slice() else {
            panic!("{drift:?}")
        };
        assert_eq!(
            (changed.line, changed.expected.as_deref(), changed.found.as_deref()),
            (3, Some("3"), Some("4"))
        );
    }

    #[test]
    fn a_file_that_ends_early_or_goes_on_is_changed() {
        let short = compare(&files(&[("x.c", "1\n2\n")]), &files(&[("x.c", "1\n")]));
        assert_eq!((short.changed[0].line, short.changed[0].found.as_deref()), (2, None));
        let long = compare(&files(&[("x.c", "1\n")]), &files(&[("x.c", "1\n2")]));
        assert_eq!((long.changed[0].line, long.changed[0].found.as_deref()), (2, Some("2")));
    }

    #[test]
    fn a_changed_line_end_is_a_change() {
        let drift = compare(&files(&[("x.c", "1\n2\n")]), &files(&[("x.c", "1\r\n2\r\n")]));
        assert_eq!(
            (drift.changed[0].line, drift.changed[0].found.as_deref()),
            (1, Some("1\r"))
        );
    }

    #[test]
    fn missing_and_extra_files_are_told_apart_and_strangers_ignored() {
        let folder = tempfile::tempdir().unwrap();
        for (file, text) in [
            ("buck.c", "a"),
            ("buck_old.c", "b"),
            ("bucket.c", "c"),
            ("README.md", "d"),
        ] {
            std::fs::write(folder.path().join(file), text).unwrap();
        }
        let expected = files(&[("buck.c", "a"), ("buck.h", "h")]);
        let found = read(&expected, "buck", folder.path()).unwrap();
        let drift = compare(&expected, &found);
        assert_eq!(
            (drift.missing, drift.extra),
            (vec!["buck.h".to_owned()], vec!["buck_old.c".to_owned()])
        );
        assert!(drift.changed.is_empty());
    }

    #[test]
    fn a_folder_that_is_not_there_lacks_everything() {
        let expected = files(&[("buck.c", "a")]);
        let found = read(&expected, "buck", Path::new("/nonexistent/folder")).unwrap();
        assert_eq!(compare(&expected, &found).missing, ["buck.c"]);
    }
}
