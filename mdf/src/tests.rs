//! Files made here block by block, from the layout of the standard: what no recorder at hand writes.

use miniz_oxide::deflate::compress_to_vec_zlib;

use super::*;

const LIMITS: Limits = Limits {
    most_bytes: 1 << 20,
    most_channels: 100,
};

/// A file on its way; blocks are put one behind the other, those that others lead to first.
struct Made(Vec<u8>);

impl Made {
    /// The ID block, and room for the HD block at 64.
    fn new() -> Self {
        let mut bytes = b"MDF     4.10    made    ".to_vec();
        bytes.extend([0, 0, 0, 0, 154, 1]);
        bytes.resize(64 + 24 + 6 * 8 + 32, 0);
        Self(bytes)
    }

    fn block(&mut self, id: &str, links: &[u64], data: &[u8]) -> u64 {
        let at = self.0.len() as u64;
        let block = bytes_of(id, links, data);
        self.0.extend(block);
        self.0.resize(self.0.len().next_multiple_of(8), 0);
        at
    }

    fn text(&mut self, text: &str) -> u64 {
        self.block("TX", &[], &[text.as_bytes(), &[0]].concat())
    }

    /// CC: type, values.
    fn conversion(&mut self, kind: u8, values: &[f64]) -> u64 {
        let mut data = vec![kind, 0, 0, 0, 0, 0];
        data.extend((values.len() as u16).to_le_bytes());
        data.extend([0; 16]);
        data.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        self.block("CC", &[0; 4], &data)
    }

    /// CN before `next`: type and synchronisation, type of the data, first bit, first byte, bits.
    fn channel(
        &mut self,
        next: u64,
        name: &str,
        conversion: u64,
        [kind, sync, stored, bit]: [u8; 4],
        [byte, bits]: [u32; 2],
    ) -> u64 {
        let name = self.text(name);
        let mut data = vec![kind, sync, stored, bit];
        data.extend([byte.to_le_bytes(), bits.to_le_bytes()].concat());
        data.resize(72, 0);
        self.block("CN", &[next, 0, name, 0, conversion, 0, 0, 0], &data)
    }

    /// CG before `next`: number of its records, how many, bytes of one.
    fn group(&mut self, next: u64, channel: u64, id: u64, rows: u64, bytes: u32) -> u64 {
        let mut data = [id.to_le_bytes(), rows.to_le_bytes(), [0; 8]].concat();
        data.extend(bytes.to_le_bytes());
        data.extend([0; 4]);
        self.block("CG", &[next, channel, 0, 0, 0, 0], &data)
    }

    /// DG and HD; `id_size` bytes stand before each record.
    fn finish(mut self, group: u64, records: u64, id_size: u8) -> Vec<u8> {
        let data = self.block("DG", &[0, group, records, 0], &[id_size, 0, 0, 0, 0, 0, 0, 0]);
        let head = bytes_of("HD", &[data, 0, 0, 0, 0, 0], &[0; 32]);
        self.0[64..64 + head.len()].copy_from_slice(&head);
        self.0
    }
}

fn bytes_of(id: &str, links: &[u64], data: &[u8]) -> Vec<u8> {
    let length = 24 + 8 * links.len() + data.len();
    let mut bytes = [b"##", id.as_bytes(), &[0; 4]].concat();
    bytes.extend((length as u64).to_le_bytes());
    bytes.extend((links.len() as u64).to_le_bytes());
    bytes.extend(links.iter().flat_map(|link| link.to_le_bytes()));
    bytes.extend(data);
    bytes
}

/// One channel of bytes with this conversion.
fn converted(kind: u8, values: &[f64], stored: &[u8]) -> Vec<f64> {
    let mut file = Made::new();
    let conversion = file.conversion(kind, values);
    let channel = file.channel(0, "x", conversion, [0, 0, 0, 0], [0, 8]);
    let group = file.group(0, channel, 0, stored.len() as u64, 1);
    let records = file.block("DT", &[], stored);
    let found = read(&file.finish(group, records, 0), LIMITS).unwrap();
    assert_eq!(found.left_out, [""; 0]);
    found.groups[0].channels[0].values.clone()
}

#[test]
fn conversions_are_those_of_the_standard() {
    assert_eq!(converted(0, &[], &[7]), [7.0]);
    assert_eq!(converted(1, &[-3.0, 0.5], &[0, 10]), [-3.0, 2.0], "offset, then factor");
    // (x^2 + 2 x + 3) / (4 x + 5) at 1 and 2
    assert_eq!(
        converted(2, &[1.0, 2.0, 3.0, 0.0, 4.0, 5.0], &[1, 2]),
        [6.0 / 9.0, 11.0 / 13.0]
    );
    let table = [0.0, 100.0, 10.0, 200.0, 20.0, 0.0];
    assert_eq!(
        converted(4, &table, &[0, 5, 10, 15, 30]),
        [100.0, 150.0, 200.0, 100.0, 0.0]
    );
    assert_eq!(
        converted(5, &table, &[4, 5, 6, 30]),
        [100.0, 100.0, 200.0, 0.0],
        "the nearer key, in the middle the lower"
    );
    let ranges = [0.0, 9.0, 1.0, 10.0, 19.0, 2.0, -1.0];
    assert_eq!(converted(6, &ranges, &[0, 9, 10, 19, 20]), [1.0, 1.0, 2.0, 2.0, -1.0]);
}

#[test]
fn integers_stand_at_any_bit_in_both_byte_orders_with_their_sign() {
    let one = |stored: u8, bit: u8, bits: u32, record: &[u8]| {
        let mut file = Made::new();
        let channel = file.channel(0, "x", 0, [0, 0, stored, bit], [0, bits]);
        let group = file.group(0, channel, 0, 1, record.len() as u32);
        let records = file.block("DT", &[], record);
        read(&file.finish(group, records, 0), LIMITS).unwrap().groups[0].channels[0].values[0]
    };
    assert_eq!(one(0, 3, 5, &[0b1010_1111]), 21.0);
    assert_eq!(one(0, 4, 12, &[0xf0, 0xab]), f64::from(0xabf));
    assert_eq!(one(1, 0, 16, &[0x12, 0x34]), f64::from(0x1234));
    assert_eq!(one(2, 4, 4, &[0xf0]), -1.0);
    assert_eq!(one(3, 0, 16, &[0xff, 0xfe]), -2.0);
    assert_eq!(one(0, 7, 64, &[0x80, 0, 0, 0, 0, 0, 0, 0, 0]), 1.0);
    assert_eq!(one(4, 0, 32, &1.5_f32.to_le_bytes()), 1.5);
    assert_eq!(one(5, 0, 64, &(-2.5_f64).to_be_bytes()), -2.5);
}

/// Records of two groups by turns, each with the number of its group in front, in a list of a plain and a transposed block.
#[test]
fn records_of_several_groups_are_told_apart_and_lists_are_joined() {
    let mut file = Made::new();
    let slow = file.channel(0, "slow", 0, [0, 0, 0, 0], [0, 8]);
    let value = file.channel(0, "fast", 0, [0, 0, 0, 0], [1, 8]);
    let time = file.channel(value, "time", 0, [2, 1, 0, 0], [0, 8]);
    let second = file.group(0, slow, 2, 2, 1);
    let first = file.group(second, time, 1, 3, 2);
    let bytes = [1, 10, 50, 2, 7, 1, 11, 51, 2, 8, 1, 12, 52];
    let (plain, rest) = bytes.split_at(5);
    let plain = file.block("DT", &[], plain);
    // eight bytes as two rows of three columns and two bytes more: column by column
    let turned = [rest[0], rest[3], rest[1], rest[4], rest[2], rest[5], rest[6], rest[7]];
    let packed = compress_to_vec_zlib(&turned, 6);
    let head = [
        &b"DT"[..],
        &[1, 0],
        &3_u32.to_le_bytes(),
        &8_u64.to_le_bytes(),
        &(packed.len() as u64).to_le_bytes(),
    ]
    .concat();
    let packed = file.block("DZ", &[], &[head, packed].concat());
    let list = file.block("DL", &[0, plain, packed], &[0; 24]);
    let found = read(&file.finish(first, list, 1), LIMITS).unwrap();
    let [fast, slow] = &found.groups[..] else {
        panic!("{found:?}")
    };
    let time = fast.master.as_ref().unwrap();
    assert_eq!((time.values.as_slice(), time.is_time), (&[10.0, 11.0, 12.0][..], true));
    assert_eq!(fast.channels[0].values, [50.0, 51.0, 52.0]);
    assert_eq!(slow.channels[0].values, [7.0, 8.0]);
    assert!(slow.master.is_none());
}

#[test]
fn what_would_fill_the_memory_or_never_end_is_refused() {
    // a list of channels that leads back to itself
    let mut file = Made::new();
    let at = file.0.len() as u64 + 24 + 8;
    let channel = file.channel(at, "a", 0, [0, 0, 0, 0], [0, 8]);
    assert_eq!(channel, at, "its text is one block of 32 bytes");
    let group = file.group(0, channel, 0, 1, 1);
    let records = file.block("DT", &[], &[1]);
    assert_eq!(read(&file.finish(group, records, 0), LIMITS), Err(Error::Parts));
    // a block that says it unpacks to more than a file may
    let mut file = Made::new();
    let channel = file.channel(0, "a", 0, [0, 0, 0, 0], [0, 8]);
    let group = file.group(0, channel, 0, 1, 1);
    let packed = compress_to_vec_zlib(&[0; 64], 6);
    let head = [
        &b"DT"[..],
        &[0, 0],
        &[0; 4],
        &u64::MAX.to_le_bytes(),
        &(packed.len() as u64).to_le_bytes(),
    ]
    .concat();
    let records = file.block("DZ", &[], &[head, packed].concat());
    let most = LIMITS.most_bytes;
    assert_eq!(
        read(&file.finish(group, records, 0), LIMITS),
        Err(Error::Unpacked { most })
    );
    // one that says less than it holds, or more
    for length in [63_u64, 65] {
        let mut file = Made::new();
        let channel = file.channel(0, "a", 0, [0, 0, 0, 0], [0, 8]);
        let group = file.group(0, channel, 0, 1, 1);
        let packed = compress_to_vec_zlib(&[0; 64], 6);
        let head = [
            &b"DT"[..],
            &[0, 0],
            &[0; 4],
            &length.to_le_bytes(),
            &(packed.len() as u64).to_le_bytes(),
        ]
        .concat();
        let records = file.block("DZ", &[], &[head, packed].concat());
        assert!(read(&file.finish(group, records, 0), LIMITS).is_err(), "{length}");
    }
}
