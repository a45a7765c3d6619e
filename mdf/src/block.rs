//! Blocks: `##XX`, their length, links to others, content.

use std::cell::Cell;

use crate::{Error, broken};

/// Blocks that are looked at, at most: a file whose lists run in circles ends here.
// a record of an hour with a block each second and 10,000 channels of six blocks has a tenth of it
const MOST_VISITS: usize = 1_000_000;
/// Bytes of a text that are looked at.
const MOST_TEXT: usize = 4096;
/// Unpacked bytes and values for each byte of the file, beyond the first two million.
// a channel that stands still packs to a thousandth
const MOST_GROWTH: usize = 1000;

/// Where a block starts, in bytes from the start of the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Link(pub u64);

/// A file whose blocks are followed.
pub struct Blocks<'a> {
    bytes: &'a [u8],
    visits: Cell<usize>,
    /// Bytes of records that may still be unpacked.
    bytes_left: Cell<usize>,
    /// The bound of them.
    pub most_bytes: usize,
    /// Values that may still be decoded.
    values_left: Cell<usize>,
}

/// A block.
#[derive(Debug, Clone, Copy)]
pub struct Block<'a> {
    /// Without its `##`.
    pub id: &'a [u8],
    links: &'a [u8],
    /// What stands behind the links.
    pub data: &'a [u8],
    at: u64,
}

impl<'a> Blocks<'a> {
    pub fn new(bytes: &'a [u8], most_bytes: usize) -> Self {
        let grown = bytes.len().saturating_mul(MOST_GROWTH).saturating_add(2_000_000);
        Self {
            bytes,
            visits: Cell::new(MOST_VISITS),
            bytes_left: Cell::new(grown.min(most_bytes)),
            most_bytes,
            // a value is held in eight bytes, and few are stored in one
            values_left: Cell::new(grown.min(most_bytes / 2)),
        }
    }

    /// The block there, which is one of these.
    pub fn at(&self, link: Link, ids: &[&'static str]) -> Result<Block<'a>, Error> {
        let wanted = ids.first().copied().unwrap_or_default();
        let visits = self.visits.get().checked_sub(1).ok_or(Error::Parts)?;
        self.visits.set(visits);
        let block = self.any(link).ok_or(broken(wanted, link.0))?;
        match ids.iter().any(|id| id.as_bytes() == block.id) {
            true => Ok(block),
            false => Err(broken(wanted, link.0)),
        }
    }

    fn any(&self, link: Link) -> Option<Block<'a>> {
        let start = usize::try_from(link.0).ok()?;
        let rest = self.bytes.get(start..)?;
        let (head, _) = rest.split_first_chunk::<24>()?;
        let id = match head {
            [b'#', b'#', ..] => rest.get(2..4)?,
            _ => return None,
        };
        let length = usize::try_from(number(rest, 8)?).ok()?;
        let links = usize::try_from(number(rest, 16)?).ok()?.checked_mul(8)?;
        let content = rest.get(24..length)?;
        let (links, data) = content.split_at_checked(links)?;
        Some(Block {
            id,
            links,
            data,
            at: link.0,
        })
    }

    /// The text of a TX or MD block; of an XML what stands in its first `TX`.
    pub fn text(&self, link: Option<Link>) -> Result<String, Error> {
        let Some(link) = link else { return Ok(String::new()) };
        let block = self.at(link, &["TX", "MD"])?;
        let bytes = block.data.get(..MOST_TEXT).unwrap_or(block.data);
        let end = bytes.iter().position(|byte| *byte == 0).unwrap_or(bytes.len());
        let text = String::from_utf8_lossy(bytes.get(..end).unwrap_or_default());
        Ok(match block.id {
            b"MD" => inner(&text),
            _ => text.trim().to_owned(),
        })
    }
}

/// What stands in the first `<TX>` of an XML.
fn inner(xml: &str) -> String {
    let behind = xml.split_once("<TX").and_then(|(_, rest)| rest.split_once('>'));
    let text = behind
        .and_then(|(_, rest)| rest.split_once("</TX>"))
        .map_or("", |(text, _)| text);
    let text = text.replace("&lt;", "<").replace("&gt;", ">").replace("&quot;", "\"");
    text.replace("&apos;", "'").replace("&amp;", "&").trim().to_owned()
}

impl Blocks<'_> {
    /// Takes so many values from those that may still be decoded.
    pub fn take_values(&self, count: usize) -> Result<(), Error> {
        self.take(&self.values_left, count)
    }

    /// Takes so many bytes of records from those that may still be unpacked.
    pub fn take_bytes(&self, count: usize) -> Result<(), Error> {
        self.take(&self.bytes_left, count)
    }

    fn take(&self, from: &Cell<usize>, count: usize) -> Result<(), Error> {
        let most = self.most_bytes;
        from.set(from.get().checked_sub(count).ok_or(Error::Unpacked { most })?);
        Ok(())
    }
}

impl Block<'_> {
    /// A link, if it leads anywhere.
    pub fn link(&self, index: usize) -> Option<Link> {
        number(self.links, index.checked_mul(8)?)
            .filter(|at| *at != 0)
            .map(Link)
    }

    /// How many links there are.
    pub fn links(&self) -> usize {
        self.links.len() / 8
    }

    pub fn byte(&self, at: usize) -> Result<u8, Error> {
        self.data.get(at).copied().ok_or(self.short())
    }

    pub fn half(&self, at: usize) -> Result<u16, Error> {
        let two = self.data.get(at..).and_then(|rest| rest.first_chunk::<2>());
        two.map(|two| u16::from_le_bytes(*two)).ok_or(self.short())
    }

    pub fn word(&self, at: usize) -> Result<u32, Error> {
        let four = self.data.get(at..).and_then(|rest| rest.first_chunk::<4>());
        four.map(|four| u32::from_le_bytes(*four)).ok_or(self.short())
    }

    pub fn long(&self, at: usize) -> Result<u64, Error> {
        number(self.data, at).ok_or(self.short())
    }

    pub fn real(&self, at: usize) -> Result<f64, Error> {
        self.long(at).map(f64::from_bits)
    }

    /// A fault of this block.
    pub fn short(&self) -> Error {
        broken("content of a", self.at)
    }
}

fn number(bytes: &[u8], at: usize) -> Option<u64> {
    let eight = bytes.get(at..)?.first_chunk::<8>()?;
    Some(u64::from_le_bytes(*eight))
}
