//! The digest of the sources of which `policyc` is built, as `POLICYC_SOURCES`: `+` and 16 hexadecimal digits.
//!
//! A version says which sources only in a release. While one works on them, every edit is another build under the same version. In a
//! package of a registry there is this crate alone, and the digest is empty: there the version is enough.

use std::io;
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

/// Folders beside this one that are in no `policyc`.
const ASIDE: [&str; 9] = [
    "bench", "docs", "examples", "firmware", "fuzz", "python", "target", "tests", "xtask",
];

/// What is left out of the folder of a crate.
const NOT_BUILT: [&str; 4] = ["tests", "examples", "benches", "README.md"];

fn main() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let lock = root.join("Cargo.lock");
    let digest = match lock.is_file() && root.join("cli/src/campaign").is_dir() {
        true => digest(&root, lock).unwrap_or_else(|error| {
            println!("cargo::error=cannot read the sources: {error}");
            String::new()
        }),
        false => String::new(),
    };
    println!("cargo::rustc-env=POLICYC_SOURCES={digest}");
    println!("cargo::rerun-if-changed=build.rs");
}

fn digest(root: &Path, lock: PathBuf) -> io::Result<String> {
    let mut files = vec![lock];
    for folder in sorted(root)? {
        let is_aside = named(&folder).starts_with('.') || ASIDE.contains(&named(&folder));
        if is_aside || !folder.join("Cargo.toml").is_file() {
            continue;
        }
        for entry in sorted(&folder)? {
            if !NOT_BUILT.contains(&named(&entry)) {
                println!("cargo::rerun-if-changed={}", entry.display());
                add(entry, &mut files)?;
            }
        }
    }
    println!("cargo::rerun-if-changed={}", root.join("Cargo.lock").display());
    let mut hash = Sha256::new();
    for file in files {
        let path = file
            .strip_prefix(root)
            .unwrap_or(&file)
            .to_string_lossy()
            .replace('\\', "/");
        // git may have changed the ends of lines
        let bytes: Vec<u8> = std::fs::read(&file)?
            .into_iter()
            .filter(|byte| *byte != b'\r')
            .collect();
        for part in [path.as_bytes(), &bytes] {
            hash.update((part.len() as u64).to_le_bytes());
            hash.update(part);
        }
    }
    let digits: String = hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect();
    Ok(format!("+{}", &digits[..16]))
}

fn add(path: PathBuf, files: &mut Vec<PathBuf>) -> io::Result<()> {
    if !path.is_dir() {
        files.push(path);
        return Ok(());
    }
    sorted(&path)?.into_iter().try_for_each(|path| add(path, files))
}

fn sorted(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let entries: io::Result<Vec<PathBuf>> = std::fs::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect();
    let mut entries = entries?;
    entries.sort();
    Ok(entries)
}

fn named(path: &Path) -> &str {
    path.file_name().and_then(|name| name.to_str()).unwrap_or_default()
}
