//! The number formats of the contract: binary32 and binary64.

use std::fmt::Debug;
use std::ops::{Add, Div, Mul, Neg, Sub};

use ndarray::{ArrayView1, ArrayView2, ArrayViewMut1};

// a third format would be a section of the contract first: nobody outside can add one
mod sealed {
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}

/// A number format in which a whole controller computes; `f32` and `f64` only.
///
/// Every operator is one rounding to nearest, ties to even. Only `accumulate_fused`, the network of `f32-fma`,
/// rounds product and sum together.
pub trait Real:
    sealed::Sealed
    + Copy
    + Debug
    + Default
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + Send
    + Sync
    + 'static
{
    /// +0.
    const ZERO: Self;
    /// Largest finite value.
    const MAX: Self;

    /// Rounded once to nearest, ties to even.
    fn nearest(value: f64) -> Self;

    /// Largest value of the format that is not above `value`.
    fn down(value: f64) -> Self;

    /// Smallest value of the format that is not below `value`.
    fn up(value: f64) -> Self;

    /// A binary32 number (weight or measurement), exact in both formats.
    fn widen(value: f32) -> Self;

    /// An ADC code, rounded once to nearest.
    fn from_code(code: i32) -> Self;

    /// The same number as binary64, exact in both formats.
    fn to_f64(self) -> f64;

    /// The bits; those of a binary32 number are the low ones.
    fn bits(self) -> u64;

    /// As many low bits as a number of the format has.
    fn low_bits(bits: u64) -> u64;

    /// Appends as many low bits as a number of the format has, as 32-bit words, the low one first.
    fn append_bits(bits: u64, words: &mut Vec<u32>);

    /// Appends the bits as 32-bit words, the low one of a binary64 number first.
    fn append_words(self, words: &mut Vec<u32>) {
        Self::append_bits(self.bits(), words);
    }

    /// `acc_o = fl(acc_o + fl(w_io * x_i))` for i = 0, 1, ...: the order within one output is that of contract
    /// section 6, outputs advance side by side. `weights` is `[inputs][outputs]`, `acc` enters as the bias.
    ///
    /// A method of the trait so that it is compiled in this crate, for concrete types.
    fn accumulate(weights: ArrayView2<'_, Self>, input: ArrayView1<'_, Self>, acc: ArrayViewMut1<'_, Self>);

    /// [`Real::accumulate`] with one rounding per product and sum: `acc_o = fl(acc_o + w_io * x_i)`.
    fn accumulate_fused(weights: ArrayView2<'_, Self>, input: ArrayView1<'_, Self>, acc: ArrayViewMut1<'_, Self>);
}

// written out for each type: a default method would be compiled in the crate that calls it, which tests build with
// less optimisation than this one
macro_rules! accumulate {
    () => {
        fn accumulate(weights: ArrayView2<'_, Self>, input: ArrayView1<'_, Self>, mut acc: ArrayViewMut1<'_, Self>) {
            for (row, &x) in weights.rows().into_iter().zip(input.iter()) {
                acc.zip_mut_with(&row, |acc, &w| *acc += w * x);
            }
        }

        fn accumulate_fused(
            weights: ArrayView2<'_, Self>,
            input: ArrayView1<'_, Self>,
            mut acc: ArrayViewMut1<'_, Self>,
        ) {
            for (row, &x) in weights.rows().into_iter().zip(input.iter()) {
                // one rounding on every machine; without the instruction it is a slower function of equal bits
                acc.zip_mut_with(&row, |acc, &w| *acc = w.mul_add(x, *acc));
            }
        }
    };
}

impl Real for f32 {
    const ZERO: Self = 0.0;
    const MAX: Self = f32::MAX;

    fn nearest(value: f64) -> Self {
        value as f32
    }

    fn down(value: f64) -> Self {
        let nearest = value as f32;
        if f64::from(nearest) > value {
            nearest.next_down()
        } else {
            nearest
        }
    }

    fn up(value: f64) -> Self {
        let nearest = value as f32;
        if f64::from(nearest) < value {
            nearest.next_up()
        } else {
            nearest
        }
    }

    fn widen(value: f32) -> Self {
        value
    }

    fn from_code(code: i32) -> Self {
        code as f32
    }

    fn to_f64(self) -> f64 {
        f64::from(self)
    }

    fn bits(self) -> u64 {
        u64::from(self.to_bits())
    }

    fn low_bits(bits: u64) -> u64 {
        u64::from(bits as u32)
    }

    fn append_bits(bits: u64, words: &mut Vec<u32>) {
        words.push(bits as u32);
    }

    accumulate!();
}

impl Real for f64 {
    const ZERO: Self = 0.0;
    const MAX: Self = f64::MAX;

    fn nearest(value: f64) -> Self {
        value
    }

    fn down(value: f64) -> Self {
        value
    }

    fn up(value: f64) -> Self {
        value
    }

    fn widen(value: f32) -> Self {
        f64::from(value)
    }

    fn from_code(code: i32) -> Self {
        f64::from(code)
    }

    fn to_f64(self) -> f64 {
        self
    }

    fn bits(self) -> u64 {
        self.to_bits()
    }

    fn low_bits(bits: u64) -> u64 {
        bits
    }

    fn append_bits(bits: u64, words: &mut Vec<u32>) {
        words.extend([bits as u32, (bits >> 32) as u32]);
    }

    accumulate!();
}

/// A closed interval in the format.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Range<T> {
    pub lo: T,
    pub hi: T,
}

impl<T: Real> Range<T> {
    /// Both ends rounded to nearest.
    pub fn nearest(interval: policy::Interval) -> Self {
        Self {
            lo: T::nearest(interval.low),
            hi: T::nearest(interval.high),
        }
    }

    /// Ends rounded inwards: low up, high down.
    pub fn inwards(interval: policy::Interval) -> Self {
        Self {
            lo: T::up(interval.low),
            hi: T::down(interval.high),
        }
    }

    /// `x >= lo and x <= hi`: false for NaN.
    pub fn contains(self, x: T) -> bool {
        x >= self.lo && x <= self.hi
    }

    /// `x < lo or x > hi`: whether a clamp is active, false for NaN.
    pub fn clamps(self, x: T) -> bool {
        x < self.lo || x > self.hi
    }

    /// `clamp` of contract section 4.
    pub fn clamp(self, x: T) -> T {
        // not `max` and `min`: these drop a NaN, which has to come through, so that section 9 can answer with STATE
        let t = if x < self.lo { self.lo } else { x };
        if t > self.hi { self.hi } else { t }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_rounded_inwards_by_at_most_one_ulp() {
        // 0.9 lies between two binary32 numbers; 0.9_f32 is the lower one, 0.1_f32 the upper one
        let range = Range::<f32>::inwards(policy::Interval {
            low: 0.9,
            high: 0.9000001,
        });
        assert_eq!(range.lo, 0.9_f32.next_up());
        assert!(f64::from(range.lo) >= 0.9 && f64::from(range.lo.next_down()) < 0.9);
        assert!(f64::from(range.hi) <= 0.9000001 && f64::from(range.hi.next_up()) > 0.9000001);
        assert_eq!(f32::down(0.1), 0.1_f32.next_down());
        assert_eq!(f32::up(0.1), 0.1_f32);
        assert_eq!((f32::up(0.5), f32::down(0.5)), (0.5, 0.5));
    }

    #[test]
    fn rounding_towards_a_side_stays_finite_or_subnormal_where_the_number_does() {
        assert_eq!(f32::down(1e300), f32::MAX);
        assert_eq!(f32::up(-1e300), f32::MIN);
        assert_eq!(f32::up(1e-300).to_bits(), 1);
        assert_eq!(f32::down(1e-300).to_bits(), 0);
    }

    #[test]
    fn a_range_holds_its_ends_and_no_nan() {
        let range = Range { lo: -1.0_f32, hi: 2.0 };
        assert!(range.contains(-1.0) && range.contains(2.0));
        assert!(!range.contains(f32::NAN) && !range.contains(2.0_f32.next_up()));
        assert!(!range.clamps(2.0) && range.clamps((-1.0_f32).next_down()));
        assert_eq!(range.clamp(7.0), 2.0);
        assert_eq!(range.clamp(-7.0), -1.0);
        // a zero at an end is not beyond it, whatever its sign: section 4 leaves it as it is
        let zeros = [
            Range { lo: -1.0_f32, hi: 0.0 }.clamp(-0.0),
            Range { lo: 0.0_f32, hi: 1.0 }.clamp(-0.0),
        ];
        assert_eq!(zeros.map(f32::to_bits), [(-0.0_f32).to_bits(); 2]);
    }
}
