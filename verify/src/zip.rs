//! Archives in the zip format, enough of it for an FMU: the same bytes on every machine, and fewer lines than a crate would
//! need around it to leave out times and attributes.
//!
//! Every member is a deflate stream (RFC 1951) of stored blocks, because FMI 2.0 asks for that method. Nothing is compressed.

use codegen::crc::crc32_bytes;

/// Longest stored block of deflate.
const BLOCK: usize = 0xffff;
/// 1 January 1980, the first day of the format: the time of writing is nobody's business.
const DATE: u16 = 0x0021;
const DEFLATE: u16 = 8;
/// Names are UTF-8.
const UTF8: u16 = 1 << 11;

/// An archive of these members: path and content, in that order.
///
/// Sizes are 32-bit words in this format; `None` if they do not suffice.
#[must_use]
pub fn archive(members: &[(String, Vec<u8>)]) -> Option<Vec<u8>> {
    let mut out = Vec::new();
    let mut directory = Vec::new();
    for (name, content) in members {
        let start = u32::try_from(out.len()).ok()?;
        let header = header(name, content)?;
        out.extend(b"PK\x03\x04");
        out.extend(&header);
        out.extend(name.as_bytes());
        out.extend(stored(content));
        directory.extend(b"PK\x01\x02");
        directory.extend(VERSION.to_le_bytes());
        directory.extend(&header);
        // comment, disk, internal and external attributes
        directory.extend([0; 10]);
        directory.extend(start.to_le_bytes());
        directory.extend(name.as_bytes());
    }
    let count = u16::try_from(members.len()).ok()?.to_le_bytes();
    let start = u32::try_from(out.len()).ok()?;
    let length = u32::try_from(directory.len()).ok()?;
    out.extend(&directory);
    out.extend(b"PK\x05\x06");
    out.extend([0; 4]);
    out.extend([count, count].concat());
    out.extend([length.to_le_bytes(), start.to_le_bytes()].concat());
    out.extend([0; 2]);
    Some(out)
}

/// Version 2.0 of the format, written for no system in particular.
const VERSION: u16 = 20;

/// What the header of a member and its entry in the directory have in common.
fn header(name: &str, content: &[u8]) -> Option<Vec<u8>> {
    let words = [VERSION, UTF8, DEFLATE, 0, DATE];
    let mut header: Vec<u8> = words.into_iter().flat_map(u16::to_le_bytes).collect();
    // an empty member is one empty block; each has five bytes before its content
    let blocks = content.len().div_ceil(BLOCK).max(1);
    header.extend(crc32_bytes(content.iter().copied()).to_le_bytes());
    header.extend(u32::try_from(content.len() + 5 * blocks).ok()?.to_le_bytes());
    header.extend(u32::try_from(content.len()).ok()?.to_le_bytes());
    header.extend(u16::try_from(name.len()).ok()?.to_le_bytes());
    // no extra field
    header.extend([0; 2]);
    Some(header)
}

/// Deflate without compression.
fn stored(content: &[u8]) -> Vec<u8> {
    let mut out = Vec::with_capacity(content.len() + 16);
    let mut rest = content;
    loop {
        let (block, behind) = rest.split_at(rest.len().min(BLOCK));
        // at most BLOCK, which fits
        let length = block.len() as u16;
        out.push(u8::from(behind.is_empty()));
        out.extend(length.to_le_bytes());
        // RFC 1951, 3.2.4: the length and its complement
        out.extend((!length).to_le_bytes());
        out.extend(block);
        rest = behind;
        if rest.is_empty() {
            return out;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand, after RFC 1951: last block, length 2, its complement.
    #[test]
    fn a_short_content_is_one_stored_block() {
        assert_eq!(stored(b"ab"), [1, 2, 0, 0xfd, 0xff, b'a', b'b']);
        assert_eq!(stored(b""), [1, 0, 0, 0xff, 0xff]);
    }

    #[test]
    fn a_long_content_is_several_blocks_of_which_the_last_says_so() {
        let content = vec![7; BLOCK + 1];
        let blocks = stored(&content);
        assert_eq!((blocks[0], blocks.len()), (0, content.len() + 10));
        assert_eq!(blocks[5 + BLOCK..], [1, 1, 0, 0xfe, 0xff, 7]);
    }
}
