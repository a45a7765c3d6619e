//! The one rounding from binary64 to the format, to nearest or inwards.

use crate::model::{Interval, Scalar};

/// Numbers of the format are given as binary64, which holds every binary32 number exactly.
impl Scalar {
    /// Nearest number of the format, ties to even; infinite beyond the largest finite one.
    #[must_use]
    pub fn nearest(self, x: f64) -> f64 {
        match self {
            Scalar::F32 => f64::from(nearest_f32(x)),
            // section 11: the constants of a contract are binary64 already
            Scalar::F64 => x,
        }
    }

    /// Smallest number of the format that is not below `x`: rounds a lower limit inwards.
    #[must_use]
    pub fn up(self, x: f64) -> f64 {
        match self {
            Scalar::F32 => f64::from(up_f32(x)),
            Scalar::F64 => x,
        }
    }

    /// Largest number of the format that is not above `x`: rounds an upper limit inwards.
    #[must_use]
    pub fn down(self, x: f64) -> f64 {
        match self {
            Scalar::F32 => f64::from(down_f32(x)),
            Scalar::F64 => x,
        }
    }

    /// The number of the format after `x`, which is one.
    #[must_use]
    pub fn next_up(self, x: f64) -> f64 {
        match self {
            Scalar::F32 => f64::from((x as f32).next_up()),
            Scalar::F64 => x.next_up(),
        }
    }

    /// The number of the format before `x`, which is one.
    #[must_use]
    pub fn next_down(self, x: f64) -> f64 {
        // the format is symmetric, so one direction suffices
        -self.next_up(-x)
    }
}

/// Nearest binary32, ties to even; infinite if `x` lies beyond the largest finite one.
#[must_use]
pub fn nearest_f32(x: f64) -> f32 {
    x as f32
}

/// Smallest binary32 that is not below `x`: rounds a lower limit inwards.
#[must_use]
pub fn up_f32(x: f64) -> f32 {
    // `as` rounds to nearest, ties to even: at most one step is to be corrected
    let nearest = x as f32;
    if f64::from(nearest) < x {
        nearest.next_up()
    } else {
        nearest
    }
}

/// Largest binary32 that is not above `x`: rounds an upper limit inwards.
#[must_use]
pub fn down_f32(x: f64) -> f32 {
    let nearest = x as f32;
    if f64::from(nearest) > x {
        nearest.next_down()
    } else {
        nearest
    }
}

/// Ends of `interval` rounded inwards; `None` if no binary32 lies inside.
#[must_use]
pub fn inward_f32(interval: Interval) -> Option<(f32, f32)> {
    let (low, high) = (up_f32(interval.low), down_f32(interval.high));
    (low <= high).then_some((low, high))
}
