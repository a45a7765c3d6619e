//! Changes of bytes.

use random::{Random, SplitMix};

/// Numbers at which sizes, counts and offsets go wrong.
const INTERESTING: [u64; 18] = [
    0,
    1,
    2,
    0x7f,
    0x80,
    0xff,
    0x100,
    0x7fff,
    0x8000,
    0xffff,
    0x1_0000,
    0x7fff_ffff,
    0x8000_0000,
    0xffff_ffff,
    0x1_0000_0000,
    0x7fff_ffff_ffff_ffff,
    0x8000_0000_0000_0000,
    0xffff_ffff_ffff_ffff,
];
/// Longest run of bytes that one change inserts, removes or copies.
const LONGEST: usize = 64;
/// Copies of a run at most: enough to pass the limits of counts, of which the largest is 1024.
const MOST_COPIES: usize = 1_100;

/// One change.
pub(super) fn edit(bytes: &mut Vec<u8>, words: &[&str], other: &[u8], random: &mut SplitMix) {
    let at = random.below(bytes.len() + 1);
    let end = (at + 1 + random.below(LONGEST)).min(bytes.len());
    match random.below(14) {
        0 | 1 => change(bytes, at, |byte, random| byte ^ (1 << random.below(8)), random),
        2 => change(bytes, at, |_, random| random.bits() as u8, random),
        3 => change(
            bytes,
            at,
            |byte, random| byte.wrapping_add(random.below(9) as u8).wrapping_sub(4),
            random,
        ),
        4 | 5 => number(bytes, at, random),
        6 => insert(
            bytes,
            at,
            &(0..1 + random.below(8))
                .map(|_| random.bits() as u8)
                .collect::<Vec<u8>>(),
        ),
        7 => insert(bytes, at, random.pick(words, "").as_bytes()),
        8 => drop(bytes.drain(at.min(end)..end)),
        9 => {
            let run = bytes[at.min(end)..end].to_vec();
            insert(bytes, random.below(bytes.len() + 1), &run);
        }
        10 if random.one_in(8) => {
            let run = bytes[at.min(end)..end].to_vec();
            insert(bytes, at, &run.repeat(1 + random.below(MOST_COPIES)));
        }
        11 => {
            // a run of another input, in place or between
            let from = random.below(other.len() + 1);
            let run = &other[from..(from + 1 + random.below(LONGEST)).min(other.len())];
            let replaced = if random.one_in(2) { run.len() } else { 0 };
            let end = (at + replaced).min(bytes.len());
            bytes.splice(at..end, run.iter().copied());
        }
        12 if random.one_in(4) => bytes.truncate(at),
        13 => bytes[at.min(end)..end].fill(if random.one_in(2) { 0 } else { 0xff }),
        _ => change(bytes, at, |byte, _| !byte, random),
    }
}

fn change(bytes: &mut [u8], at: usize, to: impl Fn(u8, &mut SplitMix) -> u8, random: &mut SplitMix) {
    if let Some(byte) = bytes.get_mut(at) {
        *byte = to(*byte, random);
    }
}

fn insert(bytes: &mut Vec<u8>, at: usize, run: &[u8]) {
    let at = at.min(bytes.len());
    bytes.splice(at..at, run.iter().copied());
}

/// A number of one to eight bytes: an interesting one, or one near what was there. Lengths are such numbers.
fn number(bytes: &mut [u8], at: usize, random: &mut SplitMix) {
    let width = 1 << random.below(4);
    let Some(place) = bytes.get_mut(at..at + width) else {
        return;
    };
    let is_big = random.one_in(4);
    let mut word = [0; 8];
    word[..width].copy_from_slice(place);
    if is_big {
        word[..width].reverse();
    }
    let there = u64::from_le_bytes(word);
    let number = match random.below(3) {
        0 => there.wrapping_add(random.below(33) as u64).wrapping_sub(16),
        1 => random.pick(&INTERESTING, 0).wrapping_sub(random.below(3) as u64),
        _ => random.pick(&INTERESTING, 0),
    };
    word = number.to_le_bytes();
    if is_big {
        word[..width].reverse();
    }
    place.copy_from_slice(&word[..width]);
}
