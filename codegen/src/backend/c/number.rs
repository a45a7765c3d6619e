//! The C type of the numbers, and its literals.

use policy::Scalar;
use templates::c::NumberType;

use super::statements::float;
use crate::activation::C;
use crate::backend::literal;
use crate::program::{Literal, Program};

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
        },
    }
}

/// What the text of an activation needs to know of the program.
pub fn names(program: &Program) -> C<'_> {
    let scalar = program.scalar();
    let kind = kind(scalar);
    C {
        n: &program.name,
        u: program.name.to_uppercase(),
        scalar,
        number: kind.name,
        word: kind.word,
        suffix: kind.suffix,
        magnitude: kind.magnitude,
        sign: kind.sign,
        top: kind.top,
        has_fpu: program.has_fpu,
        literal: |scalar, value| number(scalar, Literal::nearest(scalar, value)),
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
        // as digits: `FLT_MAX` would need <float.h>, and the core includes <stdint.h> alone
        Scalar::F32 => "-3.40282347e+38f",
        Scalar::F64 => "-1.7976931348623157e+308",
    }
}
