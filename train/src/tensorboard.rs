//! Event files of TensorBoard, as far as scalars need them.
//!
//! ```text
//! file   = record*                                            TFRecord
//! record = length u64 | masked crc32c of these 8 bytes u32 | event | masked crc32c of the event u32     little-endian
//! event  = wall_time 1: double, step 2: int64, file_version 3: string | summary 5                       protobuf
//! summary = value 1*; value = tag 1: string, simple_value 2: float
//! ```
//!
//! The field numbers are those of `event.proto` and `summary.proto` in TensorBoard's `compat/proto`, the framing that of
//! `record_writer.cc` of TensorFlow. Own, because the crates that write them stand still or bring a protobuf compiler along.

use crate::progress::Look;
use crate::summary::Worst;

/// Castagnoli's polynomial, its bits mirrored.
const CASTAGNOLI: u32 = 0x82F6_3B78;
/// What TensorFlow adds to a rotated checksum, so that data that hold their own checksum do not check themselves.
const MASK: u32 = 0xA282_EAD8;

/// The record with which every event file begins; `wall_time` in seconds since 1970, here and below.
#[must_use]
pub fn opening(wall_time: f64) -> Vec<u8> {
    let mut event = Vec::new();
    double(&mut event, 1, wall_time);
    bytes(&mut event, 3, b"brain.Event:2");
    record(&event)
}

/// A record with values at one control period, by tag.
#[must_use]
pub fn scalars(wall_time: f64, step: u64, values: &[(&str, f64)]) -> Vec<u8> {
    let mut summary = Vec::new();
    for (tag, value) in values {
        let mut one = Vec::new();
        bytes(&mut one, 1, tag.as_bytes());
        key(&mut one, 2, 5);
        one.extend_from_slice(&(*value as f32).to_le_bytes());
        bytes(&mut summary, 1, &one);
    }
    let mut event = Vec::new();
    double(&mut event, 1, wall_time);
    key(&mut event, 2, 0);
    varint(&mut event, step);
    bytes(&mut event, 5, &summary);
    record(&event)
}

/// The values of a look; `best` is the least cost so far.
#[must_use]
pub fn of_look(look: &Look, best: f64) -> [(&'static str, f64); 6] {
    [
        ("train/reward", look.reward),
        ("train/error_V", look.error),
        ("train/loss", look.loss),
        ("train/epsilon", look.epsilon),
        ("selection/cost", look.cost),
        ("selection/best_cost", best),
    ]
}

/// The values of an evaluation.
#[must_use]
pub fn of_evaluation(worst: &Worst, cost: f64) -> [(&'static str, f64); 4] {
    [
        ("evaluation/deviation_V", worst.deviation),
        ("evaluation/settling_ms", 1e3 * worst.settling),
        ("evaluation/tail_V", worst.tail_max),
        ("evaluation/cost", cost),
    ]
}

fn record(event: &[u8]) -> Vec<u8> {
    let length = (event.len() as u64).to_le_bytes();
    let mut out = Vec::with_capacity(event.len() + 16);
    out.extend_from_slice(&length);
    out.extend_from_slice(&masked(&length).to_le_bytes());
    out.extend_from_slice(event);
    out.extend_from_slice(&masked(event).to_le_bytes());
    out
}

fn masked(data: &[u8]) -> u32 {
    crc32c(data).rotate_right(15).wrapping_add(MASK)
}

/// Bit by bit: a look has some hundred bytes and comes a few times a second.
fn crc32c(data: &[u8]) -> u32 {
    let mut crc = !0_u32;
    for byte in data {
        crc ^= u32::from(*byte);
        for _ in 0..8 {
            crc = (crc >> 1) ^ (CASTAGNOLI & 0_u32.wrapping_sub(crc & 1));
        }
    }
    !crc
}

fn key(out: &mut Vec<u8>, field: u64, wire: u64) {
    varint(out, field << 3 | wire);
}

fn varint(out: &mut Vec<u8>, mut x: u64) {
    while x >= 0x80 {
        out.push(x as u8 | 0x80);
        x >>= 7;
    }
    out.push(x as u8);
}

fn double(out: &mut Vec<u8>, field: u64, x: f64) {
    key(out, field, 1);
    out.extend_from_slice(&x.to_le_bytes());
}

fn bytes(out: &mut Vec<u8>, field: u64, data: &[u8]) {
    key(out, field, 2);
    varint(out, data.len() as u64);
    out.extend_from_slice(data);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// RFC 3720, B.4: 32 bytes of zeros, of ones, and ascending.
    #[test]
    fn crc32c_gives_the_check_values_of_iscsi() {
        assert_eq!(crc32c(&[0; 32]), 0x8A91_36AA);
        assert_eq!(crc32c(&[0xFF; 32]), 0x62A8_AB43);
        assert_eq!(crc32c(&(0..32).collect::<Vec<u8>>()), 0x46DD_794E);
    }

    #[test]
    fn a_step_that_needs_many_bytes_is_written_in_groups_of_seven_bits() {
        let mut out = Vec::new();
        varint(&mut out, 300);
        assert_eq!(out, [0xAC, 0x02]);
    }
}
