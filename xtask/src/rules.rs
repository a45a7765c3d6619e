//! House rules that no compiler checks. One file per rule.

mod layers;
mod lengths;
mod portable;
mod source;
mod writers;

use std::path::Path;

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

/// Only `cli` and the test side write files.
pub fn writers(workspace: &Workspace) -> Result<Findings, String> {
    over_files(workspace, |path, bytes, findings| {
        if let (true, Ok(text)) = (writers::applies(path), std::str::from_utf8(bytes)) {
            findings.faults.extend(writers::check(path, text));
        }
    })
}

/// Lengths of files and functions.
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

fn over_files(workspace: &Workspace, rule: impl Fn(&Path, &[u8], &mut Findings)) -> Result<Findings, String> {
    let mut findings = Findings::default();
    for path in workspace.files()? {
        let bytes =
            std::fs::read(workspace.root.join(&path)).map_err(|e| format!("cannot read {}: {e}", path.display()))?;
        rule(&path, &bytes, &mut findings);
    }
    Ok(findings)
}
