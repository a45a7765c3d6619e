//! The numbers of a format on the host, for known answers.

use std::ops::{Add, Div, Mul, Neg, Sub};

use policy::Scalar;

use super::text::Text;

/// The format in which the answers are computed: `f32` or `f64`.
pub(crate) trait Number:
    Copy
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    const SCALAR: Scalar;
    fn nearest(value: f64) -> Self;
    fn fused(self, by: Self, plus: Self) -> Self;
    fn wide(self) -> f64;
    fn activated(self, text: &dyn Text) -> Self;
}

impl Number for f32 {
    const SCALAR: Scalar = Scalar::F32;
    fn nearest(value: f64) -> Self {
        value as f32
    }
    fn fused(self, by: Self, plus: Self) -> Self {
        self.mul_add(by, plus)
    }
    fn wide(self) -> f64 {
        self.into()
    }
    fn activated(self, text: &dyn Text) -> Self {
        text.single(self)
    }
}

impl Number for f64 {
    const SCALAR: Scalar = Scalar::F64;
    fn nearest(value: f64) -> Self {
        value
    }
    fn fused(self, by: Self, plus: Self) -> Self {
        self.mul_add(by, plus)
    }
    fn wide(self) -> f64 {
        self
    }
    fn activated(self, text: &dyn Text) -> Self {
        text.double(self)
    }
}
