//! What is true of an activation that is not made of two straight lines: value, slope and errors.

use crate::interval::Interval;

/// A real function, with what bounds, certificates and training need of it.
///
/// No function here is that of a machine's libm, which differs from another's.
#[derive(Debug)]
pub struct Curve {
    /// Value of the contract's formula (section 6), computed in binary64.
    pub value: fn(f64) -> f64,
    /// Slope of the real function.
    pub slope: fn(f64) -> f64,
    /// More than |`slope` - derivative of `real`|, except at a jump of it.
    pub slope_near: f64,
    /// Slope from the value, as training multiplies it in binary32; `None` where the value does not tell it.
    pub slope_of_value: Option<fn(f32) -> f32>,
    /// Where the slope jumps, or turns between rising and falling. Between two of them, and outside of all, it only rises or
    /// only falls.
    pub bends: &'static [Bend],
    /// Where the function turns from falling to rising, and its value there.
    pub least: Option<(f64, f64)>,
    /// Least and largest value of the contract's formula in every format, if it has both.
    pub range: Option<Interval>,
    /// More than |`value` - `real`|.
    pub near: Error,
    /// More than |contract's binary32 value - `real`|, for every number that the check of a policy lets arise.
    pub error_32: Error,
    /// The real function: what tests compare with, never part of a result.
    pub real: fn(f64) -> f64,
}

/// A place where the slope jumps or turns.
#[derive(Debug, Clone, Copy)]
pub struct Bend {
    /// Argument.
    pub x: f64,
    /// Least and largest slope beside it.
    pub slopes: (f64, f64),
}

/// Bound of an error at x: `absolute + relative * max(x, 0)`. Below 0 no curve goes on rising, and nothing is left to round.
#[derive(Debug, Clone, Copy)]
pub struct Error {
    /// At every x.
    pub absolute: f64,
    /// Times the part of x above 0.
    pub relative: f64,
}

impl Error {
    /// The bound at an argument of at most x.
    #[must_use]
    pub fn at(self, x: f64) -> f64 {
        self.absolute + self.relative * x.max(0.0)
    }
}

impl Curve {
    /// More than |contract's binary32 value - `value`| at an argument of at most x, by the triangle inequality.
    #[must_use]
    pub fn apart(&self, x: f64) -> f64 {
        self.near.at(x) + self.error_32.at(x)
    }

    /// Enclosure of the contract's values over an interval, in binary32 and in binary64.
    pub(crate) fn image(&self, x: Interval) -> Interval {
        let ends = [x.low, x.high].map(|end| ((self.value)(end), self.apart(end)));
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for (value, apart) in ends {
            low = low.min(value - apart);
            high = high.max(value + apart);
        }
        if let Some((turn, least)) = self.least
            && x.low <= turn
            && turn <= x.high
        {
            // the turn is rounded, and the function flat there: both drown in the error
            low = low.min(least - self.apart(turn));
        }
        match self.range {
            Some(range) => Interval {
                low: low.max(range.low),
                high: high.min(range.high),
            },
            None => Interval { low, high },
        }
    }

    /// Least and largest of `real(x) - max(x, 0)` over all x, for a curve without an upper end.
    ///
    /// Each of these is even (`f(x) - x = f(-x)`) or 0 above 0, and below 0 it turns at most where the function does: what is
    /// extreme is at 0, at the turn or far below.
    #[must_use]
    pub fn beside_relu(&self) -> Interval {
        let far = (self.real)(-1e6);
        let turn = self.least.map_or(far, |(_, least)| least);
        let zero = (self.real)(0.0);
        Interval {
            low: zero.min(far).min(turn),
            high: zero.max(far).max(turn),
        }
    }

    /// Least and largest slope of the real function over an interval.
    #[must_use]
    pub fn slopes(&self, x: Interval) -> (f64, f64) {
        // between two bends the slope is monotone: it is extreme at a bend or at an end
        let ends = [x.low, x.high].map(|end| {
            let slope = (self.slope)(end);
            (slope - self.slope_near, slope + self.slope_near)
        });
        let inside = self.bends.iter().filter(|bend| x.low <= bend.x && bend.x <= x.high);
        let (low, high) = ends
            .into_iter()
            .chain(inside.map(|bend| bend.slopes))
            .fold((f64::INFINITY, f64::NEG_INFINITY), |all, one| {
                (all.0.min(one.0), all.1.max(one.1))
            });
        let (least, largest) = self.steepest();
        (low.max(least), high.min(largest))
    }

    /// Least and largest slope anywhere.
    fn steepest(&self) -> (f64, f64) {
        // far out every curve is flat or rises as x does: 0 and, where it has no upper end, 1
        let far = if self.range.is_some() { (0.0, 0.0) } else { (0.0, 1.0) };
        self.bends.iter().fold(far, |all: (f64, f64), bend| {
            (all.0.min(bend.slopes.0), all.1.max(bend.slopes.1))
        })
    }
}
