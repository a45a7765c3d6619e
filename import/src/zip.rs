//! Zip archives as torch and stable-baselines3 write them: every member stored, not compressed.
//!
//! ```text
//!   local header, name, extra, data   ...   central directory: a row a member   end record: where the directory is
//! ```
//!
//! A stored member is a slice of the file, so an archive cannot be larger inside than it is: no crate and no bound on
//! unpacked sizes is needed. A compressed member is refused with the line that stores it.

use std::collections::BTreeMap;

use toml_input::Message;

/// The members of an archive: name to content.
#[derive(Debug)]
pub(crate) struct Archive<'a> {
    pub members: BTreeMap<&'a str, &'a [u8]>,
    /// Bytes of the archive.
    pub size: usize,
}

/// Whether `bytes` begin as an archive does.
pub(crate) fn is_archive(bytes: &[u8]) -> bool {
    bytes.starts_with(b"PK\x03\x04")
}

const END: &[u8] = b"PK\x05\x06";
const ROW: &[u8] = b"PK\x01\x02";
const LOCAL: &[u8] = b"PK\x03\x04";
/// Most bytes behind the end record: a comment's length has 16 bits.
const MOST_COMMENT: usize = 65_535;

impl<'a> Archive<'a> {
    /// Opens an archive.
    pub fn open(bytes: &'a [u8]) -> Result<Self, Message> {
        let from = bytes.len().saturating_sub(MOST_COMMENT + 22);
        let tail = bytes.get(from..).unwrap_or_default();
        let at = tail.windows(4).rposition(|four| four == END);
        let end = at
            .and_then(|at| tail.get(at..))
            .ok_or_else(|| broken("no end record: cut off"))?;
        let count = u16_at(end, 10)?;
        let mut at = u32_at(end, 16)?;
        let mut members = BTreeMap::new();
        for _ in 0..count {
            let row = bytes.get(at..).filter(|row| row.starts_with(ROW));
            let row = row.ok_or_else(|| broken("a directory that leads elsewhere"))?;
            let (names, extra, comment) = (u16_at(row, 28)?, u16_at(row, 30)?, u16_at(row, 32)?);
            let name = row.get(46..46 + names).and_then(|name| std::str::from_utf8(name).ok());
            let name = name.ok_or_else(|| broken("a name that is not UTF-8"))?;
            let data = member(bytes, row, name)?;
            if members.insert(name, data).is_some() {
                return Err(broken(&format!("`{}` twice", name.escape_debug())));
            }
            at += 46 + names + extra + comment;
        }
        Ok(Archive {
            members,
            size: bytes.len(),
        })
    }

    /// The content of a member.
    pub fn get(&self, name: &str) -> Option<&'a [u8]> {
        self.members.get(name).copied()
    }
}

fn member<'a>(bytes: &'a [u8], row: &[u8], name: &str) -> Result<&'a [u8], Message> {
    let shown = name.escape_debug();
    if u16_at(row, 10)? != 0 {
        return Err(Message::new(format!("`{shown}` in the archive is compressed"))
            .expected("stored members, as torch.save and stable-baselines3 write them")
            .hint("store it anew: `unzip FILE -d f && cd f && zip -0 -r ../stored.zip .`"));
    }
    let (packed, size, local) = (u32_at(row, 20)?, u32_at(row, 24)?, u32_at(row, 42)?);
    let header = bytes.get(local..).filter(|header| header.starts_with(LOCAL));
    let header = header.ok_or_else(|| broken(&format!("`{shown}` at a place that is not in the file")))?;
    let start = 30 + u16_at(header, 26)? + u16_at(header, 28)?;
    let data = (packed == size).then(|| header.get(start..start + size)).flatten();
    data.ok_or_else(|| broken(&format!("`{shown}` of {size} bytes in a file of {}", bytes.len())))
}

fn u16_at(bytes: &[u8], at: usize) -> Result<usize, Message> {
    let two = bytes.get(at..).and_then(|rest| rest.first_chunk::<2>());
    two.map(|two| u16::from_le_bytes(*two).into())
        .ok_or_else(|| broken("a record cut off"))
}

fn u32_at(bytes: &[u8], at: usize) -> Result<usize, Message> {
    let four = bytes.get(at..).and_then(|rest| rest.first_chunk::<4>());
    let number = four
        .map(|four| u32::from_le_bytes(*four))
        .ok_or_else(|| broken("a record cut off"))?;
    usize::try_from(number).map_err(|_| broken("a size beyond this machine"))
}

fn broken(found: &str) -> Message {
    Message::new("this is not a sound zip archive")
        .found(found)
        .expected("an archive as torch.save or stable-baselines3 writes it, of less than 4 GB")
        .hint("copy or download the file again")
}
