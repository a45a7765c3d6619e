//! The page of `policyc studio`: the compiler as WebAssembly, the page's own files, and the examples that it offers.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::time::Duration;

use serde_json::Value;

use crate::process::{self, Output};
use crate::tools;
use crate::workspace::Workspace;

/// What the step needs beyond Rust; its name among the tools.
pub const TARGET: &str = "wasm32-unknown-unknown";

/// The modules of the page, and the features of `studio-wasm` that each holds: the first is what a visitor loads, the others come when
/// they are wanted.
const MODULES: [(&str, &str); 4] = [
    ("studio", "first"),
    ("code", "code"),
    ("records", "records"),
    ("simulate", "simulate"),
];

/// Where the page is made: `policyc studio --from target/studio`.
pub fn folder(workspace: &Workspace) -> PathBuf {
    workspace.target_dir.join("studio")
}

/// Builds the page; what there is to say of it. `Err` of the first is why it is left out.
///
/// # Errors
/// What failed.
pub fn build(workspace: &Workspace, output: &Output, limit: Duration) -> Result<Result<Vec<String>, String>, String> {
    if !tools::lacking(&workspace.target_dir, &[TARGET]).is_empty() {
        return Ok(Err(format!(
            "not there: {TARGET}; the studio is NOT built, and its page is NOT tested"
        )));
    }
    // before the page of an earlier build goes
    let modules = modules(workspace, output, limit)?;
    let out = folder(workspace);
    if out.exists() {
        std::fs::remove_dir_all(&out).map_err(|error| told(&out, &error))?;
    }
    let page = workspace.root.join("studio/page");
    let mut copied = 0;
    let mut copy = |from: &Path, name: &str| -> Result<(), String> {
        copied += 1;
        let bytes = std::fs::read(from).map_err(|error| told(from, &error))?;
        match Path::new(name).extension() {
            Some(end) if end == "js" => write(
                &out.join(name),
                without_comments(&String::from_utf8_lossy(&bytes)).as_bytes(),
            ),
            _ => write(&out.join(name), &bytes),
        }
    };
    for entry in std::fs::read_dir(&page).map_err(|error| told(&page, &error))? {
        let path = entry.map_err(|error| told(&page, &error))?.path();
        copy(&path, &path.file_name().unwrap_or_default().to_string_lossy())?;
    }
    // one style for what the command writes and what the page shows
    copy(&workspace.root.join("report/src/page.css"), "report.css")?;
    let mut lengths = Vec::new();
    for (name, bytes) in &modules {
        write(&out.join(name), bytes)?;
        lengths.push(format!("{name} of {} kB", bytes.len() / 1000));
    }
    for example in examples(&page)? {
        copy(
            &workspace.root.join("examples").join(&example),
            &format!("examples/{example}"),
        )?;
    }
    Ok(Ok(vec![format!("{copied} files, and {}", lengths.join(", "))]))
}

/// A script without the lines that are comments alone, a tenth of what the scripts take compressed; the others keep their numbers.
fn without_comments(script: &str) -> String {
    let kept = |line: &str| match line.trim_start().starts_with("//") {
        true => "\n".to_owned(),
        false => format!("{line}\n"),
    };
    script.lines().map(kept).collect()
}

/// The modules with their names.
fn modules(workspace: &Workspace, output: &Output, limit: Duration) -> Result<Vec<(String, Vec<u8>)>, String> {
    let built = workspace.target_dir.join(TARGET).join("studio/studio_wasm.wasm");
    let build = |(name, feature): (&str, &str)| {
        let arguments = ["build", "-p", "studio-wasm", "--profile", "studio", "--target", TARGET];
        let parts = ["--no-default-features", "--features", feature];
        process::run_within(&mut workspace.cargo(&[&arguments[..], &parts].concat()), output, limit)?;
        let bytes = std::fs::read(&built).map_err(|error| told(&built, &error))?;
        Ok((format!("{name}.wasm"), bytes))
    };
    MODULES.into_iter().map(build).collect()
}

fn write(to: &Path, bytes: &[u8]) -> Result<(), String> {
    let parent = to.parent().unwrap_or(to);
    std::fs::create_dir_all(parent).map_err(|error| told(parent, &error))?;
    std::fs::write(to, bytes).map_err(|error| told(to, &error))
}

/// Every file that an example names, below `examples/`.
fn examples(page: &Path) -> Result<BTreeSet<String>, String> {
    let file = page.join("examples.json");
    let text = std::fs::read_to_string(&file).map_err(|error| told(&file, &error))?;
    let list: Value = serde_json::from_str(&text).map_err(|error| format!("{}: {error}", file.display()))?;
    let files = list.as_array().into_iter().flatten();
    let files = files.flat_map(|example| example["files"].as_array().into_iter().flatten());
    Ok(files.filter_map(Value::as_str).map(str::to_owned).collect())
}

fn told(path: &Path, error: &std::io::Error) -> String {
    format!("{}: {error}", path.display())
}
