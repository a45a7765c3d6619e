//! Numbers of a policy's format as C text.

use policy::{Head, NumericFormat, Residual, Scalar, Schedule};

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

    /// The duties of all actions, those of a continuous head at both ends of its squash (contract section 7b), or the limits of a law.
    pub fn duties(self, head: &Head) -> Vec<f64> {
        match head {
            Head::Choice(actions) => actions.iter().map(|action| self.nearest(action.duty)).collect(),
            Head::Residual(Residual { limits, .. }) | Head::Schedule(Schedule { limits, .. }) => {
                vec![self.up(limits.low), self.down(limits.high)]
            }
            Head::Continuous(head) => {
                let (ends, scale, offset) = (head.squashed(), self.nearest(head.scale), self.nearest(head.offset));
                // binary64 has more than twice the digits of binary32: what is rounded to it first is rounded no other way
                let duty = |s: f64| self.nearest(self.nearest(self.nearest(s) * scale) + offset);
                vec![duty(ends.low), duty(ends.high)]
            }
            Head::Several(outputs) => outputs.iter().flat_map(|output| self.duties(&output.head)).collect(),
        }
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
