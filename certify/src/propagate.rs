//! Through the network: the real values, and the error of the format beside them, as forms over the same symbols.
//!
//! With a(x) the activation, x the real sum and e the error before it, the error behind is `a(x + e) - a(x) = l e`
//! for some slope l of a between x and x + e (mean value): where both lie on one side of a ReLU, l is known; elsewhere
//! it lies in `[l0, l1]`, and `l e` is within `(l1 - l0) / 2 * max |e|` of `(l0 + l1) / 2 * e`.
//!
//! ```text
//!  real   x ──W x + b──► sums ──line, radius──► x' ─► Q
//!         │               │
//!         │ same symbols  │ which side of the bend
//!         │               ▼
//!  error  e ──W' e + (W' - W) x + b' - b──► e before ──slope, spread, rounding──► e'
//! ```
//!
//! In: the observations of a cell. Out: a form of the real Q values and one of the error. The one invariant: both have the same
//! shared symbols, so a Q value of the format is their sum, and what moves together cancels in a difference.

use std::ops::Range;

use policy::activation::Curve;
use policy::{Activation, Interval, Shape};

use crate::form::{Form, Replacement};
use crate::network::{Layer, Network};

/// Real Q values over a set of observations, and what the format adds.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Enclosure {
    pub real: Form,
    pub error: Form,
}

impl Enclosure {
    /// Largest |Q in the format - real Q| of an action.
    pub fn error_bound(&self, action: usize) -> f64 {
        self.error.magnitude(action)
    }

    /// Whether the greedy action among some columns is this one everywhere, in the real network and in the format.
    pub fn decides(&self, columns: &Range<usize>, action: usize) -> bool {
        let beats = |other: usize, error: Option<&Form>| self.real.difference(error, action, other).low > 0.0;
        let mut others = columns.clone().filter(|other| *other != action);
        others.all(|other| beats(other, Some(&self.error)) && beats(other, None))
    }

    /// The column with the largest centre among some.
    pub fn candidate(&self, columns: &Range<usize>) -> usize {
        // no other can be proven: a difference that is positive over the cell is so at its centre
        let first = (columns.start, f64::NEG_INFINITY);
        let larger = |best: (usize, f64), column| match self.real.centre[column] {
            q if q > best.1 => (column, q),
            _ => best,
        };
        columns.clone().fold(first, larger).0
    }

    /// Enclosure of the real Q value of an action.
    pub fn q_value(&self, action: usize) -> Interval {
        self.real.bounds(action)
    }
}

impl Network {
    /// Real Q values alone.
    pub fn real(&self, observation: Form) -> Form {
        self.layers.iter().fold(observation, |x, layer| {
            let sums = layer.real(&x);
            let steps: Vec<Replacement> = (0..sums.len())
                .map(|output| relaxed(layer.activation, sums.bounds(output)))
                .collect();
            sums.replaced(&steps, true, 0)
        })
    }
}

/// Runs the network over a set of observations.
pub(crate) fn run(network: &Network, observation: Form) -> Enclosure {
    let mut state = start(network, observation);
    for layer in &network.layers {
        state = self::layer(layer, &state).0;
    }
    state
}

/// The observation in the format.
fn start(network: &Network, observation: Form) -> Enclosure {
    let shared = observation.shared.columns;
    let steps: Vec<Replacement> = network
        .input_rounding
        .iter()
        .map(|radius| Replacement::scaled(0.0, *radius))
        .collect();
    // symbols of its own: how an observation is rounded has nothing to do with where in the cell it lies
    let error = Form::zeros(observation.len(), shared).replaced(&steps, false, shared);
    Enclosure {
        real: observation,
        error,
    }
}

/// What the format adds up before each activation, layer by layer.
pub(crate) fn sums(network: &Network, observation: Form) -> Vec<Vec<Interval>> {
    let mut state = start(network, observation);
    let step = |layer| {
        let (next, sums) = self::layer(layer, &state);
        state = next;
        sums
    };
    network.layers.iter().map(step).collect()
}

/// Behind a layer, and the format's sums before its activation.
fn layer(layer: &Layer, input: &Enclosure) -> (Enclosure, Vec<Interval>) {
    // what the format multiplies is the real input and its error together
    let magnitudes: Vec<f64> = (0..input.real.len())
        .map(|i| input.real.magnitude(i) + input.error.magnitude(i))
        .collect();
    let real = layer.real(&input.real);
    let error = layer.error(&input.error, &input.real);
    let mut real_steps = Vec::with_capacity(real.len());
    let mut error_steps = Vec::with_capacity(real.len());
    let mut sums = Vec::with_capacity(real.len());
    for output in 0..real.len() {
        let (x, e) = (real.bounds(output), error.bounds(output));
        let magnitude = x.low.abs().max(x.high.abs()) + e.low.abs().max(e.high.abs());
        let rounding = layer.rounding(output, &magnitudes, magnitude);
        let before = rounding.before;
        let e = Interval {
            low: e.low - before,
            high: e.high + before,
        };
        // in the format, before the activation
        let y = Interval {
            low: (x.low + e.low).next_down(),
            high: (x.high + e.high).next_up(),
        };
        sums.push(y);
        real_steps.push(relaxed(layer.activation, x));
        let (low, high) = slopes(layer.activation, x, y);
        let spread = 0.5 * (high - low) * e.low.abs().max(e.high.abs());
        let factor = 0.5 * (low + high);
        // the activation of the format is off by more, the larger its argument, whose own rounding counts as well
        let after = rounding.after + rounding.after_relative * (magnitude + before);
        error_steps.push(Replacement::scaled(
            factor,
            // 1e-12: more than this line rounds
            (factor * before + spread + after) * (1.0 + 1e-12),
        ));
    }
    let real = real.replaced(&real_steps, true, 0);
    let error = error.replaced(&error_steps, false, real.shared.columns);
    (Enclosure { real, error }, sums)
}

/// Line and radius around an activation over an interval.
fn relaxed(activation: Activation, x: Interval) -> Replacement {
    match activation.shape() {
        Shape::Hinge { .. } if activation.is_identity() => Replacement::IDENTITY,
        Shape::Hinge { below } => convex(x, below),
        Shape::Curve(curve) => between(curve, x),
    }
}

/// `x` above 0, `slope * x` below: never below the line through 0 of the chord's slope, and never above the chord.
fn convex(x: Interval, slope: f64) -> Replacement {
    // on one side of the bend the function is a line: nothing is lost, no symbol is added
    if x.low >= 0.0 {
        return Replacement::IDENTITY;
    }
    if x.high <= 0.0 {
        return Replacement::scaled(slope, 0.0);
    }
    // any slope between is sound with the gap of both ends
    let factor = ((x.high - slope * x.low) / (x.high - x.low)).clamp(slope, 1.0);
    // 1e-12, here and below: thousands of roundings, where a handful is made
    let gap = ((factor - slope) * -x.low).max((1.0 - factor) * x.high) * (1.0 + 1e-12);
    Replacement {
        factor,
        shift: 0.5 * gap,
        radius: 0.5 * gap,
    }
}

/// A curve less a line with its least slope over the interval does not fall: the ends enclose it.
fn between(curve: &Curve, x: Interval) -> Replacement {
    let (low, high) = ((curve.value)(x.low), (curve.value)(x.high));
    let factor = curve.slopes(x).0;
    let (start, end) = (low - factor * x.low, high - factor * x.high);
    Replacement {
        factor,
        shift: 0.5 * (start + end),
        radius: 0.5 * (end - start).abs() + 2.0 * curve.near.at(x.high) + 1e-12 * (x.low.abs() + x.high.abs()),
    }
}

/// Least and largest slope between a point of `x` and one of `y`.
fn slopes(activation: Activation, x: Interval, y: Interval) -> (f64, f64) {
    // the mean value lies between a point of x and one of y, wherever they are
    let hull = Interval {
        low: x.low.min(y.low),
        high: x.high.max(y.high),
    };
    let sides = |below: f64| {
        if hull.low >= 0.0 {
            (1.0, 1.0)
        } else if hull.high <= 0.0 {
            (below, below)
        } else {
            (below, 1.0)
        }
    };
    match activation.shape() {
        Shape::Hinge { below } => sides(below),
        Shape::Curve(curve) => curve.slopes(hull),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// In real arithmetic.
    fn real(activation: Activation, x: f64) -> f64 {
        match activation.shape() {
            Shape::Hinge { .. } if x > 0.0 => x,
            Shape::Hinge { below } => below * x,
            Shape::Curve(curve) => (curve.real)(x),
        }
    }

    fn encloses(step: Replacement, x: f64, y: f64) -> bool {
        (y - step.factor * x - step.shift).abs() <= step.radius + 1e-15
    }

    #[test]
    fn relaxations_enclose_the_activations() {
        for (low, high) in [
            (-3.0, 2.0),
            (-0.1, 5.0),
            (0.0, 1.0),
            (-2.0, 0.0),
            (0.5, 0.7),
            (-9.0, 12.0),
        ] {
            let interval = Interval { low, high };
            for n in 0..=1000 {
                let x = low + (high - low) * f64::from(n) / 1000.0;
                for each in Activation::EACH {
                    let step = relaxed(*each, interval);
                    assert!(encloses(step, x, real(*each, x)), "{each:?} {interval:?} {x}");
                }
            }
        }
    }

    #[test]
    fn slopes_enclose_difference_quotients() {
        let (x, y) = (Interval { low: -1.0, high: 0.5 }, Interval { low: -1.2, high: 0.9 });
        for activation in Activation::EACH {
            let (low, high) = slopes(*activation, x, y);
            let a = |x: f64| real(*activation, x);
            for (p, q) in [(-1.0, -1.2), (-0.3, 0.9), (0.5, 0.6), (0.1, -1.1)] {
                let slope = (a(q) - a(p)) / (q - p);
                assert!(low <= slope + 1e-12 && slope <= high + 1e-12, "{activation:?} {slope}");
            }
        }
    }
}
