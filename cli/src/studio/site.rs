//! The files of the page.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::Path;

use toml_input::{Faults, FileName, Message};

// `EMBEDDED`: what build.rs found
include!(concat!(env!("OUT_DIR"), "/studio.rs"));

/// Largest file that a page may have: several times the compiler, the largest there is.
const MOST_BYTES: u64 = 64 << 20;
/// Files of a folder at most: that of the page has some thirty.
const MOST_FILES: usize = 1000;
/// What a folder of the page must hold.
const NEEDED: [&str; 5] = [
    "index.html",
    "studio.wasm",
    "code.wasm",
    "records.wasm",
    "simulate.wasm",
];

/// Files by their paths, with `/` between folders.
#[derive(Debug, Clone)]
pub struct Site {
    files: BTreeMap<String, Cow<'static, [u8]>>,
}

impl Site {
    /// The page that this program carries.
    ///
    /// # Errors
    /// If it was built without.
    pub fn embedded() -> Result<Self, Faults> {
        if EMBEDDED.is_empty() {
            return Err(Message::new("this build of policyc carries no studio")
                .expected("a release, or a folder that `cargo xtask studio` has made in a checkout")
                .hint("cargo xtask studio, then policyc studio --from target/studio; POLICYC_STUDIO=target/studio while it is built puts it into policyc")
                .into());
        }
        let files = EMBEDDED
            .iter()
            .map(|(name, bytes)| ((*name).to_owned(), Cow::Borrowed(*bytes)));
        Ok(Site { files: files.collect() })
    }

    /// The page in `folder`.
    ///
    /// # Errors
    /// If it is none.
    pub fn from(folder: &Path) -> Result<Self, Faults> {
        let mut files = BTreeMap::new();
        walk(folder, "", &mut files)?;
        let missing: Vec<&str> = NEEDED.into_iter().filter(|name| !files.contains_key(*name)).collect();
        if missing.is_empty() {
            return Ok(Site { files });
        }
        let message =
            Message::new("this folder holds no page of the studio").found(format!("no {}", missing.join(", no ")));
        let message = message.hint("`cargo xtask studio` makes it in target/studio of a checkout");
        Err(FileName::new(folder).fault(message).into())
    }

    /// A file by its path.
    pub fn get(&self, path: &str) -> Option<&[u8]> {
        self.files.get(path).map(AsRef::as_ref)
    }

    /// All files, to be written.
    pub fn into_files(self) -> BTreeMap<String, Vec<u8>> {
        self.files
            .into_iter()
            .map(|(name, bytes)| (name, bytes.into_owned()))
            .collect()
    }
}

fn walk(folder: &Path, before: &str, files: &mut BTreeMap<String, Cow<'static, [u8]>>) -> Result<(), Faults> {
    let name = FileName::new(folder);
    let told = |error: std::io::Error| name.fault(Message::new("this folder cannot be read").found(error.to_string()));
    for entry in std::fs::read_dir(folder).map_err(told)? {
        let path = entry.map_err(told)?.path();
        let Some(own) = path.file_name().and_then(|own| own.to_str()) else {
            continue;
        };
        let shown = format!("{before}{own}");
        if path.is_dir() {
            walk(&path, &format!("{shown}/"), files)?;
        } else {
            let file = FileName::new(&path);
            files.insert(
                shown,
                file.read(MOST_BYTES).map_err(|message| file.fault(message))?.into(),
            );
        }
        if files.len() > MOST_FILES {
            return Err(name
                .fault(Message::new("this folder holds too many files for a page"))
                .into());
        }
    }
    Ok(())
}
