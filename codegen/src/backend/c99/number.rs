//! The C type of the numbers, and its literals.

use policy::Scalar;
use templates::c::NumberType;

use super::statements::float;
use crate::backend::literal;
use crate::program::Literal;

/// The C type that holds a number of the format, and what goes with its width.
pub fn kind(scalar: Scalar) -> NumberType {
    match scalar {
        Scalar::F32 => NumberType {
            name: "float",
            format: "binary32",
            is_wide: false,
            suffix: "f",
            word: "uint32_t",
            magnitude: "0x7FFFFFFFu",
            sign: "0x80000000u",
            top: 31,
            nine: "0x41100000u",
            one: "0x3F800000u",
        },
        // C90 has no literals of 64 bits
        Scalar::F64 => NumberType {
            name: "double",
            format: "binary64",
            is_wide: true,
            suffix: "",
            word: "uint64_t",
            magnitude: "(((uint64_t)1 << 63) - 1u)",
            sign: "((uint64_t)1 << 63)",
            top: 63,
            nine: "(uint64_t)0x40220000u << 32",
            one: "(uint64_t)0x3FF00000u << 32",
        },
    }
}

/// A literal of that type.
pub fn number(scalar: Scalar, literal: Literal) -> String {
    match scalar {
        Scalar::F32 => float(literal.single()),
        Scalar::F64 => literal::number(scalar, literal),
    }
}

/// Below every number that is one.
pub fn lowest(scalar: Scalar) -> &'static str {
    match scalar {
        Scalar::F32 => "-3.40282347e+38f",
        Scalar::F64 => "-1.7976931348623157e+308",
    }
}
