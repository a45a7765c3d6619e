//! The archive of an FMU: members by name, with bounds on names and sizes.
//!
//! Nothing is unpacked before the whole directory has been looked at. A hostile archive is refused as a whole, for no tool
//! writes one by accident.

use std::collections::BTreeMap;
use std::path::Path;

use miniz_oxide::inflate::decompress_to_vec_with_limit;
use rawzip::{CompressionMethod, ZipArchive, ZipArchiveEntryWayfinder, ZipSliceArchive, ZipVerification, crc32};
use tempfile::TempDir;
use toml_input::Message;

/// Largest archive, bytes.
// FMUs of Modelica tools with sources and binaries of three systems have tens of MB; those that bring a runtime, hundreds
pub(crate) const LARGEST: u64 = 512 << 20;
/// Largest sum of what its members unpack to, bytes.
const LARGEST_INSIDE: u64 = 2 << 30;
/// Most members.
// documentation as HTML has thousands
const MOST_MEMBERS: u64 = 100_000;

/// An archive whose directory is sound.
#[derive(Debug)]
pub(crate) struct Archive {
    zip: ZipSliceArchive<Vec<u8>>,
    members: BTreeMap<String, Member>,
}

#[derive(Debug)]
struct Member {
    place: ZipArchiveEntryWayfinder,
    method: CompressionMethod,
    size: u64,
}

impl Archive {
    /// Reads the directory.
    ///
    /// # Errors
    /// If it is no sound zip archive, or has a hostile name or size.
    pub fn new(bytes: Vec<u8>) -> Result<Self, Message> {
        let zip = ZipArchive::from_slice(bytes).map_err(|error| broken(&error.to_string()))?;
        if zip.entries_hint() > MOST_MEMBERS {
            return Err(broken(&format!("{} members", zip.entries_hint())));
        }
        let (mut members, mut ranges, mut inside) = (BTreeMap::new(), Vec::new(), 0_u64);
        let mut entries = zip.entries();
        while let Some(entry) = entries.next_entry().map_err(|error| broken(&error.to_string()))? {
            let path = entry.file_path();
            let name = std::str::from_utf8(path.as_bytes()).map_err(|_| broken("a name that is not UTF-8"))?;
            check_name(name)?;
            if entry.is_dir() {
                continue;
            }
            let place = entry.wayfinder();
            let local = zip
                .get_entry(place)
                .map_err(|error| broken(&format!("`{name}`: {error}")))?;
            let range = local.compressed_data_range();
            if range.1 > range.0 {
                ranges.push(range);
            }
            let size = entry.uncompressed_size_hint();
            inside = inside.saturating_add(size);
            if inside > LARGEST_INSIDE {
                return Err(broken(&format!(
                    "members of more than {} MiB together",
                    LARGEST_INSIDE >> 20
                )));
            }
            let member = Member {
                place,
                method: entry.compression_method(),
                size,
            };
            if members.insert(name.to_owned(), member).is_some() {
                return Err(broken(&format!("`{}` twice", name.escape_debug())));
            }
            if members.len() as u64 > MOST_MEMBERS {
                return Err(broken(&format!("more than {MOST_MEMBERS} members")));
            }
        }
        // bombs share one stretch of bytes among many members
        ranges.sort_unstable();
        if ranges.windows(2).any(|pair| pair[0].1 > pair[1].0) {
            return Err(broken("members that lie in each other"));
        }
        Ok(Self { zip, members })
    }

    /// Names of all members, in order.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.members.keys().map(String::as_str)
    }

    /// The content of a member of at most `limit` bytes; nothing if there is none.
    ///
    /// # Errors
    /// If it is too large, compressed in another way than by deflate, or damaged.
    pub fn get(&self, name: &str, limit: u64) -> Result<Option<Vec<u8>>, Message> {
        let Some(member) = self.members.get(name) else {
            return Ok(None);
        };
        let shown = name.escape_debug();
        if member.size > limit {
            return Err(broken(&format!("`{shown}` of {} bytes", member.size)).expected(format!("at most {limit}")));
        }
        let entry = self.zip.get_entry(member.place);
        let entry = entry.map_err(|error| broken(&format!("`{shown}`: {error}")))?;
        let size = usize::try_from(member.size).map_err(|_| broken("a size beyond this machine"))?;
        let content = match member.method {
            CompressionMethod::STORE => entry.data().to_vec(),
            CompressionMethod::DEFLATE => decompress_to_vec_with_limit(entry.data(), size)
                .map_err(|error| broken(&format!("`{shown}` does not unpack: {error}")))?,
            other => {
                let message = Message::new(format!(
                    "`{shown}` in the FMU is compressed in a way that FMI does not allow"
                ));
                return Err(message.found(format!("{other:?}")).expected("stored or deflated"));
            }
        };
        let found = ZipVerification {
            crc: crc32(&content),
            uncompressed_size: content.len() as u64,
        };
        let sound = entry.claim_verifier().valid(found);
        sound.map_err(|error| broken(&format!("`{shown}`: {error}")))?;
        Ok(Some(content))
    }

    /// Unpacks the members whose names begin with one of `folders` into a new temporary folder.
    ///
    /// # Errors
    /// If one is damaged, or cannot be written.
    pub fn unpack(&self, folders: &[&str]) -> Result<TempDir, Message> {
        let failed = |error: &std::io::Error| Message::new("the FMU cannot be unpacked").found(error.to_string());
        let target = tempfile::Builder::new().prefix("policyc-fmu-").tempdir();
        let target = target.map_err(|error| failed(&error))?;
        let wanted = |name: &&str| folders.iter().any(|folder| name.starts_with(folder));
        for name in self.names().filter(wanted) {
            let content = self.get(name, LARGEST_INSIDE)?.unwrap_or_default();
            let path = target.path().join(name);
            let folder = path.parent().unwrap_or(Path::new(""));
            std::fs::create_dir_all(folder).map_err(|error| failed(&error))?;
            std::fs::write(&path, content).map_err(|error| failed(&error))?;
        }
        Ok(target)
    }
}

/// A path that stays in the folder it is unpacked to, on every system.
fn check_name(name: &str) -> Result<(), Message> {
    let trimmed = name.strip_suffix('/').unwrap_or(name);
    let inside = |part: &str| !part.is_empty() && part != "." && part != "..";
    // a backslash, a drive and a stream of NTFS are ordinary letters here and none on Windows
    let plain = !name.contains(['\\', ':']) && !name.chars().any(char::is_control);
    if plain && trimmed.split('/').all(inside) {
        return Ok(());
    }
    Err(broken(&format!("a member called `{}`", name.escape_debug())).expected("paths that stay inside the archive"))
}

fn broken(found: &str) -> Message {
    Message::new("this is not a sound FMU")
        .found(found)
        .expected("a zip archive with modelDescription.xml in it")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_leave_the_folder_are_refused() {
        for bad in [
            "../a",
            "a/../../b",
            "/etc/passwd",
            "a//b",
            "c:\\x",
            "a\\..\\b",
            "a:b",
            "",
            "a/./b",
            "a\nb",
        ] {
            assert!(check_name(bad).is_err(), "{bad:?}");
        }
        for good in ["modelDescription.xml", "binaries/linux64/", "resources/a b.mat", "a..b"] {
            assert!(check_name(good).is_ok(), "{good:?}");
        }
    }
}
