//! The one rounding from binary64 to binary32, to nearest or inwards.

use crate::model::Interval;

/// Nearest binary32, ties to even; infinite if `x` lies beyond the largest finite one.
#[must_use]
pub fn nearest_f32(x: f64) -> f32 {
    x as f32
}

/// Smallest binary32 that is not below `x`: rounds a lower limit inwards.
#[must_use]
pub fn up_f32(x: f64) -> f32 {
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
