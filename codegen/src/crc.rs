//! CRC-32 (IEEE 802.3, reflected, 0xEDB88320) over 32-bit words taken little-endian.

/// The sixteen steps of the polynomial for one nibble; the generated code carries the same table.
#[must_use]
pub const fn nibble_table() -> [u32; 16] {
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
    let table = nibble_table();
    let mut crc = u32::MAX;
    for word in words {
        crc ^= word;
        for _ in 0..8 {
            crc = (crc >> 4) ^ table[(crc & 15) as usize];
        }
    }
    !crc
}

#[cfg(test)]
mod tests {
    use super::crc32_words;

    #[test]
    fn check_value_of_the_catalogue_is_met() {
        // "123456789" has CRC-32 0xCBF43926; padded to words it is the CRC of "12345678" here
        let words = [u32::from_le_bytes(*b"1234"), u32::from_le_bytes(*b"5678")];
        assert_eq!(crc32_words(words), 0x9AE0_DAAF);
    }
}
