//! Status bits of a command (contract section 9).

/// A measurement was invalid and has been bridged with held samples.
pub const HELD: u32 = 1 << 0;
/// The fallback duty is commanded: no usable measurement, or, with [`STATE`], no sound state. No other bit stands beside it.
pub const FALLBACK: u32 = 1 << 1;
/// This step primed the filters.
pub const PRIMED: u32 = 1 << 2;
/// At least one observation was clipped.
pub const CLIPPED: u32 = 1 << 3;
/// The duty or the load current lies outside the validity range of the mapping.
pub const MAPPING_RANGE: u32 = 1 << 4;
/// The slew limit was active.
pub const SLEW_LIMITED: u32 = 1 << 5;
/// The soft start was active.
pub const SOFT_START: u32 = 1 << 6;
/// The duty limits were active.
pub const LIMITED: u32 = 1 << 7;
/// The state was not one that the controller can have written, or the duty was no number: fallback until a reset.
pub const STATE: u32 = 1 << 8;

/// Name of every bit, bit 0 first.
pub const NAMES: [&str; 9] = [
    "HELD",
    "FALLBACK",
    "PRIMED",
    "CLIPPED",
    "MAPPING_RANGE",
    "SLEW_LIMITED",
    "SOFT_START",
    "LIMITED",
    "STATE",
];

/// The bits of `status` as `A | B`, or `-` if none is set. Bits without a name appear as a hexadecimal number.
pub fn names(status: u32) -> String {
    let mut parts: Vec<String> = NAMES
        .iter()
        .enumerate()
        .filter(|(bit, _)| status >> bit & 1 == 1)
        .map(|(_, name)| (*name).to_owned())
        .collect();
    // S-function and FMU add 65536 to the word while they ignore coefficients; it must not vanish from a log
    let unknown = status >> NAMES.len() << NAMES.len();
    if unknown != 0 {
        parts.push(format!("{unknown:#x}"));
    }
    if parts.is_empty() {
        "-".to_owned()
    } else {
        parts.join(" | ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_list_the_bits_that_are_set() {
        assert_eq!(names(0), "-");
        assert_eq!(names(HELD | LIMITED), "HELD | LIMITED");
        assert_eq!(names(PRIMED | 0x200), "PRIMED | 0x200");
    }
}
