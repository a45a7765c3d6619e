//! CRC-32 (IEEE 802.3, reflected, 0xEDB88320) over 32-bit words taken little-endian.

/// The sixteen steps of the polynomial for one nibble; the generated code carries the same table.
#[must_use]
pub const fn nibble_table() -> [u32; 16] {
    // a nibble at a time: 64 bytes of flash where a table for bytes takes 1024, and it runs beside control
    let mut table = [0_u32; 16];
    let mut index = 0;
    while index < 16 {
        let mut crc = index as u32;
        let mut bit = 0;
        while bit < 4 {
            crc = if crc & 1 == 1 {
                (crc >> 1) ^ 0xEDB8_8320
            } else {
                crc >> 1
            };
            bit += 1;
        }
        table[index] = crc;
        index += 1;
    }
    table
}

/// CRC-32 of words serialised little-endian, independent of the machine's byte order.
#[must_use]
pub fn crc32_words(words: impl IntoIterator<Item = u32>) -> u32 {
    crc32_bytes(words.into_iter().flat_map(u32::to_le_bytes))
}

/// CRC-32 of bytes, as zlib's `crc32`.
#[must_use]
pub fn crc32_bytes(bytes: impl IntoIterator<Item = u8>) -> u32 {
    let table = nibble_table();
    // ones before and their complement behind, as in IEEE 802.3: leading zeros count
    let mut crc = u32::MAX;
    for byte in bytes {
        crc ^= u32::from(byte);
        for _ in 0..2 {
            crc = (crc >> 4) ^ table[(crc & 15) as usize];
        }
    }
    !crc
}

#[cfg(test)]
mod tests {
    use super::{crc32_bytes, crc32_words};

    #[test]
    fn check_value_of_the_catalogue_is_met() {
        assert_eq!(crc32_bytes(*b"123456789"), 0xCBF4_3926);
    }

    /// Values of zlib's `crc32`.
    #[test]
    fn every_length_is_counted_as_it_is() {
        assert_eq!(crc32_bytes(*b"1"), 0x83DC_EFB7);
        assert_eq!(crc32_bytes(*b"12"), 0x4F53_44CD);
        assert_eq!(crc32_bytes(*b"123"), 0x8848_63D2);
        assert_eq!(crc32_bytes(*b""), 0);
    }

    #[test]
    fn words_count_as_their_little_endian_bytes() {
        let words = [u32::from_le_bytes(*b"1234"), u32::from_le_bytes(*b"5678")];
        assert_eq!(crc32_words(words), 0x9AE0_DAAF);
    }
}
