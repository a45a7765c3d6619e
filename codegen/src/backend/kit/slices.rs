//! The checksum behind every slice of the integrity check.
//!
//! ```text
//! tables ─► words of number 1, 2, 3, ... ─► CRC behind each number ─► those at the ends of slices ─► one weighted sum a length
//! ```
//!
//! A slice that takes more than it was asked for ends with the same checksum as one that does not. Only what stands between two
//! slices tells them apart. One word a length, in the place of one a slice: the kit lies in flash.

use templates::kit::Slices;

use super::unsigned;
use crate::crc::crc32_words;
use crate::program::Program;

/// Numbers of a slice: each alone, so that the end of every table is among the ends; a few, whose slices reach over small tables;
/// more than a small table has.
const LENGTHS: [usize; 3] = [1, 7, 64];

/// What the sum so far is multiplied by. Odd, so that no difference is lost; a product, because a checksum of checksums would be
/// linear in the same way as these, and differences could cancel.
pub const WEIGHT: u32 = 1_664_525;

/// Each length with its sum.
pub fn of(program: &Program) -> Vec<Slices> {
    let behind = checksums(program);
    let slices = |length: usize| Slices {
        length: unsigned(length as u32),
        sum: unsigned(sum(&behind, length)),
    };
    LENGTHS.map(slices).to_vec()
}

/// The checksum behind each number of the tables, before the inversion at its end.
fn checksums(program: &Program) -> Vec<u32> {
    let mut crc = u32::MAX;
    let numbers = program.checked_tables().flat_map(|table| {
        let words = |value| table.element.words(value).collect::<Vec<u32>>();
        table.values.iter().map(move |value| words(*value))
    });
    let mut behind = |words: Vec<u32>| {
        // what goes on from a state is what starts with its bits in the first word: the CRC is linear
        let mut words = words.into_iter();
        let first = words.next().map(|word| word ^ crc ^ u32::MAX);
        crc = !crc32_words(first);
        for word in words {
            crc = !crc32_words([word ^ crc ^ u32::MAX]);
        }
        crc
    };
    numbers.map(&mut behind).collect()
}

/// Of slices of that length; the last one may be shorter.
fn sum(behind: &[u32], length: usize) -> u32 {
    let ends = behind.chunks(length).filter_map(|slice| slice.last());
    ends.fold(0, |sum: u32, crc| sum.wrapping_mul(WEIGHT).wrapping_add(*crc))
}
