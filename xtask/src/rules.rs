//! House rules that no compiler checks. One file per rule.

mod comments;
mod layers;
mod lengths;
mod links;
mod portable;
mod words;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::markdown::Page;
use crate::workspace::Workspace;

/// What a rule found, one line each.
#[derive(Debug, Default)]
pub struct Findings {
    pub faults: Vec<String>,
    pub warnings: Vec<String>,
}

/// Dependencies between our crates, and what the macro pulls in.
pub fn layers(workspace: &Workspace) -> Result<Findings, String> {
    let mut faults = layers::check(&workspace.crates);
    if workspace.crates.iter().any(|c| c.name == layers::MACRO) {
        let tree = workspace.cargo_output(&layers::MACRO_TREE)?;
        faults.extend(layers::check_macro_closure(&tree));
    }
    Ok(Findings {
        faults,
        warnings: Vec::new(),
    })
}

/// Lengths of files and templates.
pub fn lengths(workspace: &Workspace) -> Result<Findings, String> {
    over_files(workspace, |path, bytes, findings| {
        if let Ok(text) = std::str::from_utf8(bytes) {
            lengths::check(path, text, findings);
        }
    })
}

/// No path or host of one machine.
pub fn portable(workspace: &Workspace) -> Result<Findings, String> {
    over_files(workspace, |path, bytes, findings| {
        findings.faults.extend(portable::check(path, bytes));
    })
}

/// Links between pages, the contents of the book, the length of the README.
pub fn pages(workspace: &Workspace) -> Result<Findings, String> {
    let mut faults = links::check(&read_pages(workspace)?, &workspace.files()?);
    let readme = workspace.root.join("README.md");
    let text = std::fs::read_to_string(&readme).map_err(|e| format!("cannot read {}: {e}", readme.display()))?;
    faults.extend(words::check_readme(&text));
    Ok(Findings {
        faults,
        warnings: Vec::new(),
    })
}

/// Words and figures of each page, one line each.
pub fn words(workspace: &Workspace) -> Result<Vec<String>, String> {
    Ok(words::report(&read_pages(workspace)?))
}

/// How much of each crate says why, one line each.
pub fn comments(workspace: &Workspace) -> Result<Vec<String>, String> {
    let mut counts: BTreeMap<String, comments::Count> = BTreeMap::new();
    over_files(workspace, |path, bytes, _| {
        if let (Some(name), Ok(text)) = (comments::crate_of(path), std::str::from_utf8(bytes)) {
            let found = comments::count(text);
            let count = counts.entry(name.to_owned()).or_default();
            count.lines += found.lines;
            count.comments += found.comments;
        }
    })?;
    Ok(comments::report(&counts))
}

fn read_pages(workspace: &Workspace) -> Result<BTreeMap<PathBuf, Page>, String> {
    let files = workspace.files()?;
    let markdown = files
        .into_iter()
        .filter(|file| file.extension().is_some_and(|e| e == "md"));
    let read = |file: PathBuf| match std::fs::read_to_string(workspace.root.join(&file)) {
        Ok(text) => Ok((file, Page::read(&text))),
        Err(error) => Err(format!("cannot read {}: {error}", file.display())),
    };
    markdown.map(read).collect()
}

fn over_files(workspace: &Workspace, mut rule: impl FnMut(&Path, &[u8], &mut Findings)) -> Result<Findings, String> {
    let mut findings = Findings::default();
    for path in workspace.files()? {
        let bytes =
            std::fs::read(workspace.root.join(&path)).map_err(|e| format!("cannot read {}: {e}", path.display()))?;
        rule(&path, &bytes, &mut findings);
    }
    Ok(findings)
}
