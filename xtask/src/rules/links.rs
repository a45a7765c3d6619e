//! Links between pages: every file and every heading that is linked to exists, and the book holds all its pages.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Component, Path, PathBuf};

use crate::markdown::{Link, Page};

const BOOK: &str = "docs";
const CONTENTS: &str = "docs/SUMMARY.md";

/// `pages` are the Markdown files, `files` all files, both relative to the root. Addresses on other machines are not
/// looked at: a test that needs the network fails for reasons that are none of ours.
pub fn check(pages: &BTreeMap<PathBuf, Page>, files: &[PathBuf]) -> Vec<String> {
    let known: BTreeSet<&Path> = files.iter().flat_map(|file| file.ancestors()).collect();
    let mut faults = Vec::new();
    for (path, page) in pages {
        for link in page.links.iter().filter(|link| is_ours(&link.target)) {
            if let Err(fault) = follow(path, link, pages, &known) {
                faults.push(format!("{}:{}: `{}`: {fault}", path.display(), link.line, link.target));
            }
        }
    }
    faults.extend(left_out(pages));
    faults
}

fn is_ours(target: &str) -> bool {
    !target.contains("://") && !target.starts_with("mailto:")
}

fn follow(from: &Path, link: &Link, pages: &BTreeMap<PathBuf, Page>, known: &BTreeSet<&Path>) -> Result<(), String> {
    let (file, heading) = link.target.split_once('#').unwrap_or((&link.target, ""));
    let target = match file {
        "" => from.to_path_buf(),
        file => normal(&from.with_file_name(file)).ok_or("leads out of the repository")?,
    };
    if !known.contains(target.as_path()) {
        return Err("there is no such file".into());
    }
    if from.starts_with(BOOK) && !target.starts_with(BOOK) {
        return Err("a page of the book links to a file outside of it; name the file instead".into());
    }
    let anchors = pages.get(&target).map(|page| page.anchors.as_slice());
    match heading.is_empty() || anchors.is_some_and(|all| all.iter().any(|anchor| anchor == heading)) {
        true => Ok(()),
        false => Err(format!("{} has no such heading", target.display())),
    }
}

/// The path without `.` and `..`; `None` where it leaves the repository.
fn normal(path: &Path) -> Option<PathBuf> {
    let mut parts = PathBuf::new();
    for part in path.components() {
        match part {
            Component::Normal(name) => parts.push(name),
            Component::ParentDir => parts.pop().then_some(())?,
            Component::CurDir => {}
            Component::RootDir | Component::Prefix(_) => return None,
        }
    }
    Some(parts)
}

/// Pages in the book's folder that its contents do not name: nobody would find them.
fn left_out(pages: &BTreeMap<PathBuf, Page>) -> Vec<String> {
    let Some(contents) = pages.get(Path::new(CONTENTS)) else {
        return Vec::new();
    };
    let named: BTreeSet<PathBuf> = contents
        .links
        .iter()
        .filter_map(|link| normal(&Path::new(BOOK).join(&link.target)))
        .collect();
    let in_book = pages
        .keys()
        .filter(|path| path.starts_with(BOOK) && *path != Path::new(CONTENTS));
    in_book
        .filter(|path| !named.contains(*path))
        .map(|path| format!("{}: not in {CONTENTS}", path.display()))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn faults(texts: &[(&str, &str)]) -> Vec<String> {
        let pages = texts.iter().map(|(path, text)| (PathBuf::from(path), Page::read(text)));
        let files: Vec<PathBuf> = texts.iter().map(|(path, _)| PathBuf::from(path)).collect();
        check(&pages.collect(), &files)
    }

    #[test]
    fn links_to_pages_headings_and_folders_are_followed() {
        let found = faults(&[
            ("README.md", "[a](docs/a.md#two) [b](docs) [c](https://example.org/x)"),
            ("docs/SUMMARY.md", "[a](a.md) [b](b/c.md)"),
            ("docs/a.md", "# One\n## Two\n[c](b/c.md) [up](#one)"),
            ("docs/b/c.md", "[a](../a.md)"),
        ]);
        assert_eq!(found, Vec::<String>::new());
    }

    #[test]
    fn dead_ends_are_named_with_their_place() {
        let found = faults(&[
            ("README.md", "[a](nowhere.md)\n[b](docs/a.md#three)\n[c](../../etc)"),
            ("docs/SUMMARY.md", "[a](a.md)"),
            ("docs/a.md", "# One\n[out](../README.md)"),
            ("docs/b.md", ""),
        ]);
        assert_eq!(
            found,
            [
                "README.md:1: `nowhere.md`: there is no such file",
                "README.md:2: `docs/a.md#three`: docs/a.md has no such heading",
                "README.md:3: `../../etc`: leads out of the repository",
                "docs/a.md:2: `../README.md`: a page of the book links to a file outside of it; name the file instead",
                "docs/b.md: not in docs/SUMMARY.md",
            ]
        );
    }
}
