//! Sound bounds of every value the controller computes, by interval arithmetic in binary32.
//!
//! Rounding to nearest is monotone, and so are sums, differences and products with a constant in each argument. The
//! image of a box under one rounded operation is therefore enclosed by the rounded operation at its corners: the
//! ends are computed in binary32 itself and need no slack. Only filters with feedback need an argument of their own.
//!
//! ```text
//! ranges of signals ─► expression ─► filter ... filter ─► observation ─► layer ─► ... ─► layer
//! (inwards, as the     (section 3)   (section 4)          (section 5)    (section 6, in binary64 with slack)
//!  sanitiser rounds)
//! ```
//!
//! In: a checked policy, part by part. Out: a [`Box32`] or the magnitude that is too large. The invariant: every box
//! has finite ends of at most [`MAX_MAGNITUDE`]; what the controller computes from any history of samples lies within.

mod observer;

pub(crate) use observer::observer;

use crate::activation::{Activation, Shape};
use crate::limits::MAX_MAGNITUDE;
use crate::model::{Estimate, Expr, Fallback, Filter, Input, Interval, Limits, Observer, Output, Signal};
use crate::rounding::{inward_f32, nearest_f32};

/// Closed interval of binary32 values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Box32 {
    pub low: f32,
    pub high: f32,
}

/// A magnitude that could leave the format.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Overflow(pub f64);

type Bounded = Result<Box32, Overflow>;

/// Unit roundoff of binary32.
const UNIT: f64 = 1.0 / 16_777_216.0;
/// More than the rounding errors of a few operations in the subnormal range.
// 71 steps of 2^-149; one operation there errs by at most half a step
const TINY: f64 = 1e-43;

impl Box32 {
    pub fn point(value: f32) -> Self {
        Box32 {
            low: value,
            high: value,
        }
    }

    pub fn nearest(interval: Interval) -> Self {
        Box32 {
            low: nearest_f32(interval.low),
            high: nearest_f32(interval.high),
        }
    }

    pub fn interval(self) -> Interval {
        Interval {
            low: f64::from(self.low),
            high: f64::from(self.high),
        }
    }

    fn hull(self, value: f32) -> Self {
        Box32 {
            low: self.low.min(value),
            high: self.high.max(value),
        }
    }

    fn magnitude(self) -> f64 {
        f64::from(self.low.abs().max(self.high.abs()))
    }

    fn checked(low: f32, high: f32) -> Bounded {
        let result = Box32 { low, high };
        let magnitude = result.magnitude();
        if magnitude <= MAX_MAGNITUDE {
            Ok(result)
        } else {
            Err(Overflow(magnitude))
        }
    }

    pub fn add(self, other: Box32) -> Bounded {
        Box32::checked(self.low + other.low, self.high + other.high)
    }

    pub fn sub(self, other: Box32) -> Bounded {
        Box32::checked(self.low - other.high, self.high - other.low)
    }

    pub fn times(self, other: Box32) -> Bounded {
        // both boxes are finite, so a corner may be infinite but is never a NaN, which `min` and `max` would pass over
        let corners = [
            self.low * other.low,
            self.low * other.high,
            self.high * other.low,
            self.high * other.high,
        ];
        let (low, high) = corners
            .iter()
            .fold((f32::INFINITY, f32::NEG_INFINITY), |(l, h), &x| (l.min(x), h.max(x)));
        Box32::checked(low, high)
    }

    pub fn scale(self, factor: f64) -> Bounded {
        self.times(Box32::point(nearest_f32(factor)))
    }

    fn clamp(self, low: f32, high: f32) -> Self {
        let one = |x: f32| {
            if x < low {
                low
            } else if x > high {
                high
            } else {
                x
            }
        };
        Box32 {
            low: one(self.low),
            high: one(self.high),
        }
    }

    /// Widened by `by` on both sides, outwards to the next binary32.
    fn widened(self, by: f64) -> Bounded {
        // the conversion may round inwards by half a unit: a whole one makes up for it
        let low = nearest_f32(f64::from(self.low) - by).next_down();
        Box32::checked(low, nearest_f32(f64::from(self.high) + by).next_up())
    }
}

/// Ranges of everything an expression can read.
pub(crate) struct Inputs {
    signals: Vec<Box32>,
    previous_duty: Box32,
    previous_command: Box32,
    /// The same of each of several outputs.
    outputs: Vec<[Box32; 2]>,
    estimates: Vec<[Box32; 4]>,
}

impl Inputs {
    /// Ranges after the sanitiser: signals inwards-rounded, remembered duties the hull of all they can be.
    pub fn new(
        signals: &[Signal],
        observers: &[Observer],
        duties: &[f64],
        outputs: &[Output],
        limits: &Limits,
        fallback: &Fallback,
    ) -> Self {
        let inward = |interval| {
            // never 0: `interval_f32` has refused what holds no binary32 number
            let (low, high) = inward_f32(interval).unwrap_or((0.0, 0.0));
            Box32 { low, high }
        };
        let remembered = |duties: &[f64], limits: &Limits, fallback: f64| {
            // `init` writes the initial duty; the fallback may lie outside of the limits
            let start = Box32::point(nearest_f32(limits.initial_duty)).hull(nearest_f32(fallback));
            let limit = inward(limits.duty);
            let duty = duties.iter().fold(start, |hull, duty| hull.hull(nearest_f32(*duty)));
            [duty, start.hull(limit.low).hull(limit.high)]
        };
        let [previous_duty, previous_command] = remembered(duties, limits, fallback.duty);
        Inputs {
            signals: signals.iter().map(|signal| inward(signal.range)).collect(),
            previous_duty,
            previous_command,
            outputs: outputs
                .iter()
                .map(|output| remembered(&output.head.duties(), &output.limits, output.fallback))
                .collect(),
            // the last thing that a step does with an estimate is the clamp
            estimates: observers
                .iter()
                .map(|observer| Estimate::ALL.map(|estimate| Box32::nearest(observer.range(estimate))))
                .collect(),
        }
    }

    pub fn signal(&self, index: usize) -> Option<Box32> {
        self.signals.get(index).copied()
    }

    /// What a command of the output of that index can be; of the only one where there is one.
    pub fn command(&self, output: usize) -> Bounded {
        match self.outputs.is_empty() {
            true => Ok(self.previous_command),
            false => self.output(output, 1),
        }
    }

    fn output(&self, index: usize, which: usize) -> Bounded {
        let ranges = self.outputs.get(index).map(|ranges| ranges[which]);
        ranges.ok_or(Overflow(f64::INFINITY))
    }

    fn estimate(&self, index: usize, estimate: Estimate) -> Option<Box32> {
        let ranges = self.estimates.get(index)?;
        let own = Estimate::ALL.iter().position(|each| *each == estimate)?;
        ranges.get(own).copied()
    }
}

/// Bound of a source expression (contract section 3).
pub(crate) fn expression(expr: &Expr, inputs: &Inputs) -> Bounded {
    match expr {
        // an index without a signal would be a fault of the parser: refused rather than taken as 0
        Expr::Input(Input::Signal(index)) => inputs.signal(*index).ok_or(Overflow(f64::INFINITY)),
        Expr::Input(Input::PreviousDuty) => Ok(inputs.previous_duty),
        Expr::Input(Input::PreviousCommand) => Ok(inputs.previous_command),
        Expr::Input(Input::OutputDuty(index)) => inputs.output(*index, 0),
        Expr::Input(Input::OutputCommand(index)) => inputs.output(*index, 1),
        Expr::Input(Input::Estimate(index, estimate)) => {
            inputs.estimate(*index, *estimate).ok_or(Overflow(f64::INFINITY))
        }
        Expr::Constant(value) => Ok(Box32::point(nearest_f32(*value))),
        Expr::Neg(e) => expression(e, inputs).map(|x| Box32 {
            low: -x.high,
            high: -x.low,
        }),
        Expr::Add(a, b) => expression(a, inputs)?.add(expression(b, inputs)?),
        Expr::Sub(a, b) => expression(a, inputs)?.sub(expression(b, inputs)?),
        Expr::Scale(k, e) => expression(e, inputs)?.scale(*k),
    }
}

/// Bound behind one filter (contract section 4), over all histories of inputs within `x`.
pub(crate) fn filter(filter: &Filter, x: Box32, period: f64) -> Bounded {
    match *filter {
        Filter::Delay { .. } => Ok(x),
        // the two samples differ: the whole width, not 0
        Filter::BackwardDifference => x.sub(x)?.scale(1.0 / period),
        Filter::LowPass { .. } => low_pass(x),
        Filter::FilteredDerivative { time_constant } => filtered_derivative(x, time_constant, period),
        Filter::MovingAverage { samples } => {
            // one by one, as the contract adds: each partial sum is rounded, and none may leave the format
            let mut sum = x;
            for _ in 1..samples {
                sum = sum.add(x)?;
            }
            sum.scale(1.0 / samples as f64)
        }
        Filter::Integrator { min, max, leak, .. } => {
            // the memory lies within the clamps after every step, so no history is needed
            let clamp = Box32::nearest(Interval { low: min, high: max });
            let kept = if leak == 1.0 { clamp } else { clamp.scale(leak)? };
            Ok(kept.add(x.scale(period)?)?.clamp(clamp.low, clamp.high))
        }
    }
}

/// With 0 < k <= 1 the state moves towards the input and passes it by rounding errors of the difference only:
/// at most 3 units of the width plus one of the result, covered by 16 units of the largest magnitude.
fn low_pass(x: Box32) -> Bounded {
    let y = x.widened(16.0 * UNIT * x.magnitude() + TINY)?;
    // the difference is an operation of its own and has to stay in the format as well
    x.sub(y)?;
    Ok(y)
}

/// Without rounding `y = k (x_n - (1 - p) sum p^j x_(n-1-j))`, a difference of two means of x, so |y| <= k width
/// (Abel summation; holds for the rounded p and k too). The rounding error e of one step adds up to e / (1 - p).
fn filtered_derivative(x: Box32, time_constant: f64, period: f64) -> Bounded {
    let sum = time_constant + period;
    let p = f64::from(nearest_f32(time_constant / sum));
    let k = f64::from(nearest_f32(1.0 / sum));
    let width = f64::from(x.high) - f64::from(x.low);
    x.sub(x)?.scale(1.0 / sum)?;
    // two roundings act on the memory, those of p y1 and of the sum; the .1 is more than their product
    let decay = 1.0 - p - 2.1 * UNIT;
    if decay <= 0.0 {
        // a time constant of at most 1e6 periods leaves 16 units or more; where errors need not decay there is no bound
        return Err(Overflow(f64::INFINITY));
    }
    // the difference, its product with k and the sum: three roundings, and 4.1 units are more
    let error = (4.1 * UNIT * k * width + 4.0 * TINY * (1.0 + k)) / decay;
    Box32::point(0.0).widened(k * width + error)
}

/// Bound of an observation from the bound behind the filters (contract section 5).
pub(crate) fn observation(y: Box32, scale: f64, offset: f64, clip: Option<Interval>) -> Bounded {
    let mut o = y;
    // left out where the contract leaves the operation out, or the bound would be that of another computation
    if scale != 1.0 {
        o = o.scale(scale)?;
    }
    if offset != 0.0 {
        o = o.add(Box32::point(nearest_f32(offset)))?;
    }
    Ok(match clip.map(Box32::nearest) {
        Some(clip) => o.clamp(clip.low, clip.high),
        None => o,
    })
}

/// Bounds of a dense layer's outputs behind the activation, whatever the order of the sum and with or without
/// contraction: n products and n sums err by less than (n + 2) 2^-23 of the sum of magnitudes.
pub(crate) fn layer(
    inputs: &[Interval],
    weights: &[f32],
    bias: &[f32],
    activation: Activation,
) -> Result<Vec<Interval>, (usize, Overflow)> {
    let rows = weights.chunks_exact(inputs.len().max(1));
    let sums = rows.zip(bias).enumerate().map(|(output, (row, &bias))| {
        let bias = f64::from(bias);
        let (mut low, mut high, mut magnitude) = (bias, bias, bias.abs());
        for (&w, x) in row.iter().zip(inputs) {
            let (a, b) = (f64::from(w) * x.low, f64::from(w) * x.high);
            low += a.min(b);
            high += a.max(b);
            magnitude += a.abs().max(b.abs());
        }
        // the loop above adds in binary64: its own errors of 2^-53 drown in the slack
        let slack = 2.0 * UNIT * (inputs.len() + 2) as f64 * magnitude + TINY * inputs.len() as f64;
        // magnitudes and not the sum: no partial sum may overflow, in whatever order
        if magnitude + slack > MAX_MAGNITUDE {
            return Err((output, Overflow(magnitude + slack)));
        }
        Ok(activated(
            Interval {
                low: low - slack,
                high: high + slack,
            },
            activation,
        ))
    });
    sums.collect()
}

fn activated(x: Interval, activation: Activation) -> Interval {
    let below = match activation.shape() {
        Shape::Hinge { below } => below,
        Shape::Curve(curve) => return curve.image(x),
    };
    let one = |x: f64, sign: f64| {
        let y = below * x;
        if x > 0.0 || activation.is_identity() {
            x
        } else if activation.is_rectifier() {
            0.0
        } else {
            // the slope is rounded and so is the product; 4 units are more than both
            y + sign * (4.0 * UNIT * y.abs() + TINY)
        }
    };
    Interval {
        low: one(x.low, -1.0),
        high: one(x.high, 1.0),
    }
}

#[cfg(test)]
mod tests;
