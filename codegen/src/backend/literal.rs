//! Decimal literals that survive the round trip to the bit.

use policy::Scalar;

use crate::program::Literal;

/// Decimal text of a finite constant of the format with at least one of `.` and `e`, as C and Rust read it.
pub fn number(scalar: Scalar, literal: Literal) -> String {
    match scalar {
        Scalar::F32 => decimal(literal.single()),
        // the shortest digits that round-trip; nothing lies between them and the value
        Scalar::F64 => literal.shortest(scalar),
    }
}

/// [`number`] of a binary32 value.
///
/// The shortest digits that round-trip, unless a compiler that reads them through binary64 would round twice to a
/// neighbour; then nine significant digits, which are too close to the value for that.
pub fn decimal(value: f32) -> String {
    let shortest = format!("{value:?}");
    let through_double = shortest.parse::<f64>().map(|double| (double as f32).to_bits());
    if through_double == Ok(value.to_bits()) {
        shortest
    } else {
        format!("{value:.8e}")
    }
}

#[cfg(test)]
mod tests {
    use super::decimal;

    #[test]
    fn literals_round_trip_directly_and_through_double() {
        let mut bits: u32 = 1;
        for _ in 0..200_000 {
            bits = bits.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let value = f32::from_bits(bits);
            if value.is_finite() {
                let text = decimal(value);
                assert!(text.contains(['.', 'e']), "{text}");
                assert_eq!(text.parse::<f32>().map(f32::to_bits), Ok(bits), "{text}");
                assert_eq!(text.parse::<f64>().map(|x| (x as f32).to_bits()), Ok(bits), "{text}");
            }
        }
        assert_eq!(decimal(-0.0), "-0.0");
        assert_eq!(decimal(1e-45), "1e-45");
    }
}
