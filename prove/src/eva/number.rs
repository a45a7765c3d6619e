//! Numbers of a policy's format as C text.

use policy::{NumericFormat, Scalar};

/// The C type of the numbers around the network.
#[derive(Debug, Clone, Copy)]
pub(super) struct Number {
    scalar: Scalar,
}

impl Number {
    pub fn of(format: NumericFormat) -> Self {
        Self {
            scalar: format.scalar(),
        }
    }

    /// Name of the type.
    pub fn kind(self) -> &'static str {
        match self.scalar {
            Scalar::F32 => "float",
            Scalar::F64 => "double",
        }
    }

    /// Name of the unsigned integer of the same width.
    pub fn word(self) -> &'static str {
        match self.scalar {
            Scalar::F32 => "uint32_t",
            Scalar::F64 => "uint64_t",
        }
    }

    /// A number of the format as a literal that reads back to the bit.
    pub fn literal(self, x: f64) -> String {
        // the shortest decimal text of a number reads back as itself
        match self.scalar {
            Scalar::F32 => format!("{:?}f", x as f32),
            Scalar::F64 => format!("{x:?}"),
        }
    }

    pub fn nearest(self, x: f64) -> f64 {
        self.scalar.nearest(x)
    }

    pub fn up(self, x: f64) -> f64 {
        self.scalar.up(x)
    }

    pub fn down(self, x: f64) -> f64 {
        self.scalar.down(x)
    }

    /// The largest finite number.
    pub fn largest(self) -> f64 {
        match self.scalar {
            Scalar::F32 => f64::from(f32::MAX),
            Scalar::F64 => f64::MAX,
        }
    }
}
