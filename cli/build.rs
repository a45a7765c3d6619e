//! Puts the page of `policyc studio` into the program, if there is one: the folder that `cargo xtask studio` makes, named by
//! `POLICYC_STUDIO`. Without it the command says how to get it.

use std::fmt::Write;
use std::path::{Path, PathBuf};

/// The folder is named by this variable.
const FOLDER: &str = "POLICYC_STUDIO";
/// What a page runs.
const MODULES: [&str; 4] = ["studio.wasm", "code.wasm", "records.wasm", "simulate.wasm"];

fn main() -> Result<(), String> {
    println!("cargo::rerun-if-env-changed={FOLDER}");
    let mut files = Vec::new();
    if let Some(folder) = std::env::var_os(FOLDER).map(PathBuf::from) {
        let folder = folder
            .canonicalize()
            .map_err(|error| format!("{FOLDER}: {}: {error}", folder.display()))?;
        println!("cargo::rerun-if-changed={}", folder.display());
        walk(&folder, &mut files)?;
        files.sort();
        let missing = MODULES.into_iter().find(|name| !files.contains(&folder.join(name)));
        if let Some(missing) = missing {
            let folder = folder.display();
            return Err(format!(
                "{FOLDER}: {folder} holds no {missing}: `cargo xtask studio` makes it"
            ));
        }
        return write(&folder, &files);
    }
    write(Path::new(""), &files)
}

fn write(folder: &Path, files: &[PathBuf]) -> Result<(), String> {
    let mut text = String::from("pub(super) const EMBEDDED: &[(&str, &[u8])] = &[\n");
    for file in files {
        let name = file.strip_prefix(folder).map_err(|error| error.to_string())?;
        let name = name.to_string_lossy().replace('\\', "/");
        writeln!(
            text,
            "    ({name:?}, include_bytes!({:?})),",
            file.display().to_string()
        )
        .map_err(|error| error.to_string())?;
    }
    text.push_str("];\n");
    let out = std::env::var_os("OUT_DIR").ok_or("no OUT_DIR")?;
    std::fs::write(Path::new(&out).join("studio.rs"), text).map_err(|error| error.to_string())
}

fn walk(folder: &Path, files: &mut Vec<PathBuf>) -> Result<(), String> {
    for entry in std::fs::read_dir(folder).map_err(|error| error.to_string())? {
        let path = entry.map_err(|error| error.to_string())?.path();
        match path.is_dir() {
            true => walk(&path, files)?,
            false => files.push(path),
        }
    }
    Ok(())
}
