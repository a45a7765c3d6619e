//! What the state is compared with before a step answers.
//!
//! ```text
//!  state ─► Guarded ... ─► sign bit set if outside ─┐
//!                                                   ├─ or ─► sound: 1, or 0 and the step answers with the fallback
//!  coefficients, their check word ─► flipped bits ──┤
//!  bad_count, primed ───────────────────────────────┘
//! ```
//!
//! Numbers are compared by their bits as integers: that is a subtraction where a comparison of floats with its move of flags
//! takes four instructions, and a NaN, whose magnitude is above that of every number, is outside of everything. Coefficients
//! are not compared: their check word sees every flipped bit, also one that an interval has inside.

use policy::Scalar;

use super::literal::{Literal, bits};

/// What a sound state lies within (contract section 1).
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Guard {
    /// Numbers.
    pub numbers: Vec<Guarded>,
    /// Largest `bad_count`.
    pub bad_count: u32,
}

/// A number of the state, or several of one bound, and what it lies within.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Guarded {
    /// Where it stands.
    pub place: Place,
    /// Its range.
    pub within: Within,
}

/// A place in the state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// Last good sample of a signal.
    Held(usize),
    /// Words of the filter memory.
    Memory {
        /// First word.
        first: usize,
        /// Words.
        count: usize,
    },
    /// Duty of the last chosen action, of the output of that index.
    PreviousDuty(usize),
    /// Last command, of the output of that index.
    PreviousCommand(usize),
    /// Rising upper limit, of the output of that index.
    SoftCap(usize),
}

/// A range by the bits of its ends; the fewer instructions the more is known of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Within {
    /// `|x| <= bound`
    Magnitude {
        /// Bits of the bound.
        bound: u64,
    },
    /// `low <= x <= high`, where low is not above 0 and high not below; zeros of both signs are inside.
    Around {
        /// Bits of the lower end, with its sign: of 0 they are those of -0.
        low: u64,
        /// Bits of the upper end, without a sign.
        high: u64,
    },
    /// `low <= x <= low + width`, counted in bits, of a positive number.
    Beyond {
        /// Bits of the lower end.
        low: u64,
        /// Numbers of the format above it that are inside.
        width: u64,
        /// Whether `-x` is meant.
        negated: bool,
    },
}

impl Within {
    /// The range from `low` to `high`.
    #[must_use]
    pub fn of(scalar: Scalar, (low, high): (Literal, Literal)) -> Self {
        let bits = |value| bits(scalar, value);
        let (low, high) = (low.value(), high.value());
        // the cheapest form first: clear the sign, subtract
        if low == -high {
            return Self::Magnitude {
                bound: bits(high.abs()),
            };
        }
        // on one side of 0 the bits count numbers in their order, so that one unsigned range is enough
        if low > 0.0 || high < 0.0 {
            let negated = high < 0.0;
            let near = bits(low.abs().min(high.abs()));
            let far = bits(low.abs().max(high.abs()));
            let width = far - near;
            return Self::Beyond {
                low: near,
                width,
                negated,
            };
        }
        // 0 lies inside or is an end: each sign has its bound, and zeros of both signs are within it
        Self::Around {
            low: bits(-low.abs()),
            high: bits(high.abs()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// In bits of binary32: 0.25, 0.5 and 2 are 0x3E80_0000, 0x3F00_0000 and 0x4000_0000.
    #[test]
    fn a_range_has_the_cheapest_form_that_holds_it() {
        let of = |low, high| Within::of(Scalar::F32, (Literal::exact(low), Literal::exact(high)));
        assert_eq!(of(-0.5, 0.5), Within::Magnitude { bound: 0x3F00_0000 });
        let beyond = |negated| Within::Beyond {
            low: 0x3E80_0000,
            width: 0x0080_0000,
            negated,
        };
        assert_eq!(of(0.25, 0.5), beyond(false));
        assert_eq!(of(-0.5, -0.25), beyond(true));
        let around = |low, high| Within::Around { low, high };
        assert_eq!(of(-0.5, 2.0), around(0xBF00_0000, 0x4000_0000));
        // an end that is 0 holds zeros of both signs
        assert_eq!(of(0.0, 0.5), around(0x8000_0000, 0x3F00_0000));
        assert_eq!(of(-2.0, 0.0), around(0xC000_0000, 0));
    }
}
