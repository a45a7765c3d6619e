//! Whose a file is: `policyc` replaces what it wrote, and nothing else unless it is told to.
//!
//! What it wrote bears its name near the beginning, or stands in the folder's record with its length and CRC-32. The record
//! is `manifest.json` of generated code, and [`RECORD`] for files that cannot bear a name: tables, pictures, archives, and
//! files that a user is meant to edit.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use clap::Args;
use codegen::manifest::{self, FileEntry};
use serde::{Deserialize, Serialize};
use toml_input::Message;

use crate::failure::Failure;
use crate::staging;

/// The record of what was written to a folder and does not say so itself.
pub const RECORD: &str = "policyc-files.json";

/// The mark: what the head of a generated file, a manifest or a unit, a mapping and a page say. A file of others may well
/// mention policyc, so the name alone is none.
const MARKS: [&[u8]; 4] = [b"by policyc ", b"\"policyc ", b"by `policyc ", b"content=\"policyc\""];

/// Where the mark stands in what `policyc` writes: the head of a page has its style before it.
const HEAD_BYTES: usize = 4096;

/// Whether files of others may be replaced.
#[derive(Debug, Clone, Copy, Default, Args)]
pub struct Replacing {
    /// Replace files, too, that policyc did not write or that were edited since
    #[arg(long, display_order = 900)]
    pub force: bool,
}

#[derive(Serialize, Deserialize, Default)]
struct Record {
    /// Says whose the record itself is.
    #[serde(default)]
    generator: String,
    /// The policy, in the manifest of generated code.
    #[serde(default, skip_serializing)]
    name: Option<String>,
    files: BTreeMap<String, FileEntry>,
}

/// What a folder says about its files.
#[derive(Default)]
struct Records {
    /// The policy whose code it holds.
    name: Option<String>,
    /// What its records say.
    standing: BTreeMap<String, Vec<FileEntry>>,
    /// What those of a run say which was killed while it replaced files. They vouch for a file and accuse none: what they speak of
    /// may never have come into its place.
    left: BTreeMap<String, Vec<FileEntry>>,
}

impl Records {
    /// Those of a folder; what cannot be read vouches for nothing.
    fn of(folder: &Path) -> Self {
        let read = |path: PathBuf| -> Option<Record> { serde_json::from_slice(&fs::read(path).ok()?).ok() };
        let add = |map: &mut BTreeMap<String, Vec<FileEntry>>, record: Record| {
            for (name, entry) in record.files {
                map.entry(name).or_default().push(entry);
            }
        };
        let mut all = Records::default();
        let standing = [manifest::FILE, RECORD].map(|name| folder.join(name));
        for record in standing.into_iter().filter_map(read) {
            all.name = all.name.or(record.name.clone());
            add(&mut all.standing, record);
        }
        let left = staging::leftovers(folder).into_iter().filter_map(read);
        left.for_each(|record| add(&mut all.left, record));
        all
    }

    /// Whether a file is policyc's, and what is said if not.
    fn judge(&self, name: &str, existing: &[u8]) -> (bool, &'static str) {
        let vouches = |map: &BTreeMap<String, Vec<FileEntry>>| {
            let mut entries = map.get(name).into_iter().flatten();
            entries.any(|entry| is_recorded(entry, existing))
        };
        // a record knows more than the mark, which an edit leaves in its place
        match self.standing.contains_key(name) {
            true => {
                let is_own = vouches(&self.standing) || vouches(&self.left);
                (is_own, "was edited since policyc wrote it")
            }
            false => (
                vouches(&self.left) || bears_mark(existing),
                "was not written by policyc",
            ),
        }
    }
}

fn bears_mark(content: &[u8]) -> bool {
    let head = &content[..content.len().min(HEAD_BYTES)];
    MARKS
        .iter()
        .any(|mark| head.windows(mark.len()).any(|window| window == *mark))
}

/// Whether a file is as recorded. Version control may have changed its line ends on the way: that is no edit.
fn is_recorded(entry: &FileEntry, existing: &[u8]) -> bool {
    if *entry == FileEntry::of(existing) {
        return true;
    }
    let ended_by_two = |at: &usize| existing[*at] == b'\r' && existing.get(at + 1) == Some(&b'\n');
    let kept = (0..existing.len()).filter(|at| !ended_by_two(at));
    let unix: Vec<u8> = kept.map(|at| existing[at]).collect();
    unix.len() < existing.len() && *entry == FileEntry::of(&unix)
}

/// Refuses to replace a file that is neither the same, nor written here, nor given up by `--force`.
///
/// # Errors
/// The first such file.
pub fn check(folder: &Path, files: &BTreeMap<String, Vec<u8>>, replacing: Replacing) -> Result<(), Failure> {
    if replacing.force {
        return Ok(());
    }
    let records = Records::of(folder);
    for (name, content) in files {
        let path = folder.join(name);
        let Ok(existing) = fs::read(&path) else { continue };
        let (is_own, what) = records.judge(name, &existing);
        if existing == *content || is_own {
            continue;
        }
        let message = Message::new(format!("{} {what}; nothing written", path.display()));
        return Err(message
            .hint("move it away, choose another --out, or give it up with --force")
            .into());
    }
    Ok(())
}

/// Refuses the folder of another policy's code, whose manifest would be lost: `verify` could not judge that code any more.
///
/// # Errors
/// If the manifest there names another policy, unless `--force` gives it up.
pub fn check_policy(folder: &Path, policy: &str, replacing: Replacing) -> Result<(), Failure> {
    match Records::of(folder).name {
        Some(other) if other != policy && !replacing.force => {
            let message = format!("{} holds the code of another policy; nothing written", folder.display());
            let hint = "give each policy a folder of its own, or give the other up with --force";
            Err(Message::new(message).found(other).expected(policy).hint(hint).into())
        }
        _ => Ok(()),
    }
}

/// `files` with the record of those that do not bear the mark, if there are any.
///
/// # Errors
/// If the record cannot be written as JSON.
pub fn recorded(mut files: BTreeMap<String, Vec<u8>>) -> Result<BTreeMap<String, Vec<u8>>, Failure> {
    let unmarked = files.iter().filter(|(_, content)| !bears_mark(content));
    let record = Record {
        generator: codegen::TOOL.to_owned(),
        name: None,
        files: unmarked
            .map(|(name, content)| (name.clone(), FileEntry::of(content)))
            .collect(),
    };
    if !record.files.is_empty() {
        let text = serde_json::to_string_pretty(&record)? + "\n";
        files.insert(RECORD.to_owned(), text.into_bytes());
    }
    Ok(files)
}

#[cfg(test)]
mod tests {
    use super::*;

    const KEEP: Replacing = Replacing { force: false };

    fn files(list: &[(&str, &str)]) -> BTreeMap<String, Vec<u8>> {
        let own = |(name, text): &(&str, &str)| ((*name).to_owned(), text.as_bytes().to_vec());
        list.iter().map(own).collect()
    }

    fn put(folder: &Path, files: &BTreeMap<String, Vec<u8>>) {
        for (name, content) in files {
            fs::write(folder.join(name), content).unwrap();
        }
    }

    #[test]
    fn what_others_wrote_is_kept() {
        let folder = tempfile::tempdir().unwrap();
        put(folder.path(), &files(&[("a.c", "/* for policyc */ int main(void);")]));
        let new = files(&[("a.c", "/* Generated by policyc */")]);
        let Err(Failure(faults)) = check(folder.path(), &new, KEEP) else {
            panic!("must fail")
        };
        assert!(faults.to_string().contains("not written by policyc"), "{faults}");
        assert!(check(folder.path(), &new, Replacing { force: true }).is_ok());
        assert!(
            check(
                folder.path(),
                &files(&[("a.c", "/* for policyc */ int main(void);")]),
                KEEP
            )
            .is_ok(),
            "the same"
        );
        assert!(check(folder.path(), &files(&[("b.c", "")]), KEEP).is_ok(), "another");
    }

    #[test]
    fn what_bears_the_mark_or_stands_in_the_record_is_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let old = recorded(files(&[("a.c", "/* by policyc 0 */ 1"), ("t.csv", "1,2")])).unwrap();
        assert!(
            !String::from_utf8_lossy(&old[RECORD]).contains("a.c"),
            "it says so itself"
        );
        put(folder.path(), &old);
        let new = files(&[("a.c", "/* by policyc 0 */ 2"), ("t.csv", "3,4")]);
        let new = recorded(new).unwrap();
        assert!(check(folder.path(), &new, KEEP).is_ok(), "the record, too");
        put(folder.path(), &files(&[("t.csv", "1,2 # mine")]));
        let Err(Failure(faults)) = check(folder.path(), &new, KEEP) else {
            panic!("must fail")
        };
        assert!(faults.to_string().contains("edited since"), "{faults}");
    }

    /// The manifest of generated code has an entry for each file.
    #[test]
    fn an_edited_file_of_generated_code_is_kept_but_other_line_ends_are_no_edit() {
        let folder = tempfile::tempdir().unwrap();
        let written = "/* Generated by policyc 0 */\nint a;\n";
        let record = Record {
            files: BTreeMap::from([("a.c".to_owned(), FileEntry::of(written.as_bytes()))]),
            ..Record::default()
        };
        let manifest = serde_json::to_string(&record).unwrap();
        put(folder.path(), &files(&[("a.c", written), (manifest::FILE, &manifest)]));
        let new = files(&[("a.c", "/* Generated by policyc 1 */\nint b;\n")]);
        assert!(check(folder.path(), &new, KEEP).is_ok());
        put(folder.path(), &files(&[("a.c", &written.replace('\n', "\r\n"))]));
        assert!(check(folder.path(), &new, KEEP).is_ok());
        put(
            folder.path(),
            &files(&[("a.c", &(written.to_owned() + "/* mine */\n"))]),
        );
        let Err(Failure(faults)) = check(folder.path(), &new, KEEP) else {
            panic!("must fail")
        };
        assert!(faults.to_string().contains("edited since"), "{faults}");
    }

    /// A killed run had staged its record, and another version of this file that never came into its place.
    #[test]
    fn what_a_killed_run_meant_to_write_accuses_nobody() {
        let folder = tempfile::tempdir().unwrap();
        let meant = Record {
            files: BTreeMap::from([("a.rs".to_owned(), FileEntry::of(b"// by policyc 0: newer"))]),
            ..Record::default()
        };
        let meant = serde_json::to_string(&meant).unwrap();
        put(
            folder.path(),
            &files(&[("a.rs", "// by policyc 0"), (".policyc-tmp-1-0-0", &meant)]),
        );
        let new = files(&[("a.rs", "// by policyc 0: newest")]);
        assert!(check(folder.path(), &new, KEEP).is_ok());
        put(folder.path(), &files(&[("a.rs", "// mine")]));
        assert!(check(folder.path(), &new, KEEP).is_err());
    }

    #[test]
    fn where_every_file_bears_the_mark_there_is_no_record() {
        let own = files(&[("a.c", "/* by policyc 0 */")]);
        assert_eq!(recorded(own.clone()).unwrap(), own);
    }
}
