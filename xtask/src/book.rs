//! The book in `docs/`, built by mdBook without a warning.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::process::{self, Output};
use crate::workspace::Workspace;

const PROGRAM: &str = "mdbook";

/// The version whose warnings [`warnings`] knows.
const VERSION: &str = "0.5.4";

/// What came of building it.
pub enum Built {
    /// The folder of pages.
    Pages(PathBuf),
    /// There is no mdBook here; what to type.
    NoTool(String),
}

/// Builds the book below the target folder.
///
/// # Errors
/// What mdBook says if it fails, or its warnings.
pub fn build(workspace: &Workspace, log: &Path) -> Result<Built, String> {
    let Some(program) = program(&workspace.target_dir) else {
        return Ok(Built::NoTool(format!(
            "{PROGRAM} was not found, the book is NOT built; type `cargo xtask setup` or `cargo install {PROGRAM} --locked`"
        )));
    };
    let pages = workspace.target_dir.join("book");
    let mut command = Command::new(program);
    command
        .arg("build")
        .arg(workspace.root.join("docs"))
        .arg("--dest-dir")
        .arg(&pages);
    // a level set by the user would hide warnings
    command.env_remove("MDBOOK_LOG").env_remove("RUST_LOG");
    process::run(&mut command, &Output::Log(log.to_path_buf()))?;
    let said = process::read_lossy(log);
    let warnings = warnings(&said);
    match warnings.is_empty() {
        true => Ok(Built::Pages(pages)),
        false => Err(warnings.join("\n")),
    }
}

fn program(target_dir: &Path) -> Option<PathBuf> {
    let own = tools(target_dir).join("bin").join(PROGRAM);
    [PathBuf::from(PROGRAM), own].into_iter().find(|program| works(program))
}

/// Debian has no mdBook, so cargo builds it beside the other products of the build.
fn tools(target_dir: &Path) -> PathBuf {
    target_dir.join("tools")
}

/// Builds mdBook unless there is one. Where that fails (offline, refused) the book is left out of the tests, which say so.
pub fn provide(target_dir: &Path, output: &Output) {
    if program(target_dir).is_some() {
        return;
    }
    let mut install = Command::new("cargo");
    install.args([
        "install",
        PROGRAM,
        "--version",
        VERSION,
        "--locked",
        "--no-default-features",
    ]);
    install.arg("--root").arg(tools(target_dir));
    let _ = process::run(&mut install, output);
}

fn works(program: &Path) -> bool {
    let output = Command::new(program).arg("--version").output();
    output.is_ok_and(|output| output.status.success())
}

/// Lines of a log that mdBook has marked, by a first word since 0.5 and in brackets behind the time before.
fn warnings(log: &str) -> Vec<&str> {
    let is_marked = |line: &&str| {
        let mut words = line.split_whitespace().take(3);
        let first = words.next().unwrap_or_default();
        ["WARN", "ERROR"].contains(&first) || words.any(|word| ["[WARN]", "[ERROR]"].contains(&word))
    };
    log.lines().filter(is_marked).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_warning_is_told_from_progress() {
        let log = " INFO Book building has started\n WARN unclosed HTML tag `<V>`\n INFO WARN is a word\n";
        assert_eq!(warnings(log), [" WARN unclosed HTML tag `<V>`"]);
        let older = "2026-01-01 00:00:00 [WARN] (mdbook): no such page";
        assert_eq!(warnings(older), [older]);
    }
}
