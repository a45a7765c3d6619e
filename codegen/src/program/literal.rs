//! Constants by their bits.

use policy::{Interval, Scalar};

/// A constant of the program's format by the bits of its value in binary64, which holds every binary32 number and every
/// integer of 32 bits: -0 and +0 differ, and programs can be compared and ordered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Literal(u64);

impl Literal {
    /// The constant rounded to nearest.
    #[must_use]
    pub fn nearest(scalar: Scalar, value: f64) -> Self {
        Self(scalar.nearest(value).to_bits())
    }

    /// A binary32 number or an integer of at most 32 bits: binary64 holds both exactly.
    #[must_use]
    pub fn exact(value: impl Into<f64>) -> Self {
        Self(value.into().to_bits())
    }

    /// Both ends rounded inwards.
    #[must_use]
    pub fn inward(scalar: Scalar, interval: Interval) -> (Self, Self) {
        (
            Self(scalar.up(interval.low).to_bits()),
            Self::down(scalar, interval.high),
        )
    }

    /// The constant rounded down.
    #[must_use]
    pub fn down(scalar: Scalar, value: f64) -> Self {
        Self(scalar.down(value).to_bits())
    }

    /// The constant itself.
    #[must_use]
    pub fn value(self) -> f64 {
        f64::from_bits(self.0)
    }

    /// The shortest digits that give the constant again in the format.
    #[must_use]
    pub fn shortest(self, scalar: Scalar) -> String {
        match scalar {
            // `{:?}` and not `{}`: it keeps a point or an exponent, without which C and Rust read an integer
            Scalar::F32 => format!("{:?}", self.single()),
            Scalar::F64 => format!("{:?}", self.value()),
        }
    }

    /// The constant of a binary32 program.
    #[must_use]
    pub fn single(self) -> f32 {
        self.value() as f32
    }
}

/// The bits of a number; those of a binary32 number are the low ones.
pub fn bits(scalar: Scalar, value: f64) -> u64 {
    match scalar {
        Scalar::F32 => u64::from((value as f32).to_bits()),
        Scalar::F64 => value.to_bits(),
    }
}

/// The words of a number: the low one of a binary64 number first.
pub fn words(scalar: Scalar, value: f64) -> impl Iterator<Item = u32> {
    let bits = bits(scalar, value);
    [bits as u32, (bits >> 32) as u32].into_iter().take(scalar.words())
}
