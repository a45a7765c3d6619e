//! Numbers of several converters side by side, for the lanes of the vector unit.

use std::ops::{Add, Div, Mul, Neg, Sub};

use crate::plain::Number;

/// Converters computed together.
// a convention from before it was measured: on x86-64 with SSE2, 1024 converters make 17.9 M periods a second with 2
// lanes, 22.2 with 4, 16.6 with 8, 15.3 with 16, and 7.7 one by one
pub(crate) const LANES: usize = 8;

/// One number of each.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lane(pub [f64; LANES]);

/// 1 or 0 for each: as wide as a number, so that what asks for it is computed side by side as well.
pub(crate) type Mask = [u64; LANES];

impl Lane {
    /// What `of` says of each.
    #[inline(always)]
    pub fn each(of: impl FnMut(usize) -> f64) -> Self {
        Lane(std::array::from_fn(of))
    }

    #[inline(always)]
    pub fn sqrt(self) -> Self {
        Lane(self.0.map(f64::sqrt))
    }

    /// `other` where `mask` is 0.
    #[inline(always)]
    pub fn or(mut self, mask: &Mask, other: Lane) -> Self {
        for (own, (mask, other)) in self.0.iter_mut().zip(mask.iter().zip(&other.0)) {
            *own = if *mask == 0 { *other } else { *own };
        }
        self
    }

    #[inline(always)]
    pub fn largest(&self) -> f64 {
        self.0.iter().fold(f64::NEG_INFINITY, |largest, x| largest.max(*x))
    }
}

/// Where `of` holds.
#[inline(always)]
pub(crate) fn mask(of: impl Fn(usize) -> bool) -> Mask {
    std::array::from_fn(|n| u64::from(of(n)))
}

impl Number for Lane {
    #[inline(always)]
    fn of(value: f64) -> Self {
        Lane([value; LANES])
    }
}

macro_rules! lane_by_lane {
    ($operation:ident, $function:ident, $symbol:tt) => {
        impl $operation for Lane {
            type Output = Lane;
            #[inline(always)]
            fn $function(mut self, other: Lane) -> Lane {
                for n in 0..LANES {
                    self.0[n] $symbol other.0[n];
                }
                self
            }
        }
    };
}
lane_by_lane!(Add, add, +=);
lane_by_lane!(Sub, sub, -=);
lane_by_lane!(Mul, mul, *=);
lane_by_lane!(Div, div, /=);

impl Neg for Lane {
    type Output = Lane;
    #[inline(always)]
    fn neg(self) -> Lane {
        Lane(self.0.map(|x| -x))
    }
}
