//! Changes of words, numbers, cells and lines of a text, so that it stays a text of its kind.

use std::ops::Range;

use random::{Random, SplitMix};

/// What a person or a program may have put in the place of a value.
const VALUES: [&str; 44] = [
    "0",
    "-0",
    "-0.0",
    "1",
    "-1",
    "2",
    "0.5",
    "1.0",
    "1e-9",
    "1e9",
    "1e308",
    "1e-308",
    "5e-324",
    "1e999",
    "-1e999",
    "nan",
    "-nan",
    "inf",
    "-inf",
    "3.4028235e38",
    "127",
    "128",
    "255",
    "256",
    "1024",
    "1025",
    "32768",
    "65536",
    "2147483647",
    "-2147483648",
    "4294967296",
    "9007199254740993",
    "9223372036854775807",
    "9223372036854775808",
    "18446744073709551615",
    "0x7f",
    "1_000",
    "1,5",
    "true",
    "\"\"",
    "[]",
    "{}",
    "1979-05-27T07:32:00Z",
    "\"\u{e9}\u{1f600}\"",
];
/// Lines that one change copies at most.
const MOST_LINES: usize = 8;
/// Copies of a line at most; files of a thousand lines are usual.
const MOST_COPIES: usize = 300;

/// One change.
pub(super) fn edit(bytes: &mut Vec<u8>, words: &[&str], other: &[u8], random: &mut SplitMix) {
    match random.below(12) {
        0 | 1 => {
            let word = random.pick(words, "");
            replace_token(bytes, word.as_bytes(), random);
        }
        2 | 3 => {
            let value = random.pick(&VALUES, "0");
            replace_token(bytes, value.as_bytes(), random);
        }
        4 => {
            let from = token(other, random);
            replace_token(bytes, &other[from], random);
        }
        5 => replace_token(bytes, b"", random),
        6 => {
            let (one, two) = (token(bytes, random), token(bytes, random));
            let (first, second) = (bytes[one.clone()].to_vec(), bytes[two.clone()].to_vec());
            let (one, two, first, second) = match one.start <= two.start {
                true => (one, two, first, second),
                false => (two, one, second, first),
            };
            // the later one first, so that the earlier one stays where it is
            if one.end <= two.start {
                bytes.splice(two, first);
                bytes.splice(one, second);
            }
        }
        7 => {
            let word = random.pick(words, "");
            let place = token(bytes, random);
            bytes.splice(place.start..place.start, word.bytes().chain([b' ']));
        }
        8 => drop(bytes.drain(lines(bytes, random))),
        9 => copy_lines(bytes, &bytes.clone(), random),
        10 => copy_lines(bytes, other, random),
        _ => {
            let mark = random.pick(b",;\t\"'.=[]{}\n#-", b' ');
            let at = random.below(bytes.len() + 1);
            bytes.insert(at, mark);
        }
    }
}

fn replace_token(bytes: &mut Vec<u8>, by: &[u8], random: &mut SplitMix) {
    let place = token(bytes, random);
    bytes.splice(place, by.iter().copied());
}

/// The word, number or mark around a place.
fn token(bytes: &[u8], random: &mut SplitMix) -> Range<usize> {
    let at = random.below(bytes.len());
    let is_word = |byte: u8| byte.is_ascii_alphanumeric() || matches!(byte, b'_' | b'.' | b'+' | b'-' | 128..);
    if !bytes.get(at).is_some_and(|byte| is_word(*byte)) {
        return at..(at + 1).min(bytes.len());
    }
    let start = bytes[..at]
        .iter()
        .rposition(|byte| !is_word(*byte))
        .map_or(0, |before| before + 1);
    let end = bytes[at..]
        .iter()
        .position(|byte| !is_word(*byte))
        .map_or(bytes.len(), |length| at + length);
    start..end
}

/// Some lines from the one around a place.
fn lines(bytes: &[u8], random: &mut SplitMix) -> Range<usize> {
    let at = random.below(bytes.len());
    let start = bytes[..at]
        .iter()
        .rposition(|byte| *byte == b'\n')
        .map_or(0, |before| before + 1);
    let mut end = start;
    for _ in 0..1 + random.below(MOST_LINES) {
        end = bytes[end..]
            .iter()
            .position(|byte| *byte == b'\n')
            .map_or(bytes.len(), |length| end + length + 1);
    }
    start..end
}

fn copy_lines(bytes: &mut Vec<u8>, from: &[u8], random: &mut SplitMix) {
    let run = &from[lines(from, random)];
    let copies = if random.one_in(16) {
        1 + random.below(MOST_COPIES)
    } else {
        1
    };
    let at = lines(bytes, random).start;
    bytes.splice(at..at, run.repeat(copies));
}
