//! What Eva is told of a curve without an upper end, in integers: where its values lie for each neuron's sums.
//!
//! ```text
//!  weights, clamped inputs ─► least and largest sum of a neuron ─► [from, to] of x
//!  real function ± error of section 6 over [from, to] ─► [low, high] of y
//!
//!  x < from  or  x > to  or  low <= y <= high        a clause of the curve's contract for each neuron
//! ```
//!
//! Each clause is true of the curve whatever the neuron's sums are: that x lies in `[from, to]` is for Eva to find. So an end that is
//! computed wrongly here makes a proof fail, not a wrong one hold. What is taken for granted is that the function falls up to its
//! turn and rises behind it, and what the numeric contract says of the error, which `interp` tries with every number.

use policy::activation::Curve;
use policy::scales::{self, LayerScale, power_of_two, round_half_up};
use policy::{Activation, Layer};

use super::driver::Writer;

/// What rounding adds to the ends of x: a sum becomes a binary32 number, and ends are read as decimals.
// twice half a unit of the last of 24 digits
const WIDER: f64 = 1.0 / (1 << 23) as f64;
/// What reading decimals adds to the ends of y: far below half of what a value is rounded to behind the curve.
const DIGIT: f64 = 1e-9;

/// Most clauses of a curve: each is looked at for each neuron, which takes a thirtieth of a millisecond.
const MOST_CLAUSES: usize = 128;

/// An interval, both ends included.
type Ends = (f64, f64);

impl Writer<'_> {
    /// The contract of each curve without an upper end.
    pub fn curve_contracts(&mut self) {
        let Some(scales) = scales::of(self.policy) else {
            return;
        };
        let n = self.n().to_owned();
        for activation in self.curves() {
            let Some(curve) = activation.curve() else { continue };
            let word = activation.word();
            self.text
                .lines(["/*@".to_owned(), "  @ assigns \\result \\from x;".to_owned()]);
            let mut inputs: Vec<(i64, i64)> = scales.inputs.iter().map(|x| (x.low.into(), x.high.into())).collect();
            let mut neurons = Vec::new();
            for (layer, scale) in self.policy.layers.iter().zip(&scales.layers) {
                if layer.activation == activation {
                    neurons.extend(arguments(layer, scale, &inputs));
                }
                inputs.clone_from(&scale.ranges);
            }
            for (index, (from, to)) in together(neurons).into_iter().enumerate() {
                let (low, high) = image(curve, (from, to));
                self.text.line(format!(
                    "  @ admit ensures neuron_{index}: x < {from:?} || x > {to:?} || ({low:?} <= \\result && \\result <= {high:?});"
                ));
            }
            self.text.lines([
                "  @*/".to_owned(),
                format!("static float {n}_{word}(float x);"),
                String::new(),
            ]);
        }
    }

    /// The curves without an upper end of a network in integers.
    fn curves(&self) -> Vec<Activation> {
        let all = self.policy.layers.iter().map(|layer| layer.activation);
        let mut curves: Vec<Activation> = all
            .filter(|activation| activation.curve().is_some() && activation.range().is_none())
            .collect();
        curves.sort_unstable_by_key(|activation| activation.word());
        curves.dedup();
        curves
    }
}

/// Least and largest argument of the curve of each neuron (contract section 6b), by intervals of integers.
fn arguments(layer: &Layer, scale: &LayerScale, inputs: &[(i64, i64)]) -> Vec<Ends> {
    let rows = layer.weights.chunks_exact(layer.inputs.max(1));
    let neurons = rows.zip(&layer.bias).zip(&scale.accumulators);
    let argument = |((row, bias), exponent): ((&[f32], &f32), &i32)| {
        let bias = round_half_up(f64::from(*bias) * power_of_two(*exponent));
        let products = row
            .iter()
            .zip(&scale.inputs)
            .zip(inputs)
            .map(|((w, own), (low, high))| {
                let w = round_half_up(f64::from(*w) * power_of_two(exponent - own));
                (w * low, w * high)
            });
        let ends = products.fold((bias, bias), |sum, (a, b)| (sum.0 + a.min(b), sum.1 + a.max(b)));
        let number = |integer: i64| integer as f64 * power_of_two(-exponent);
        let (low, high) = (number(ends.0), number(ends.1));
        (low - low.abs() * WIDER, high + high.abs() * WIDER)
    };
    neurons.map(argument).collect()
}

/// Neurons whose largest arguments are near each other share a clause, where there are many.
fn together(mut neurons: Vec<Ends>) -> Vec<Ends> {
    if neurons.len() <= MOST_CLAUSES {
        return neurons;
    }
    neurons.sort_by(|x, y| x.1.total_cmp(&y.1));
    let chunks = neurons.chunks(neurons.len().div_ceil(MOST_CLAUSES));
    let hull = |all: Ends, one: &Ends| (all.0.min(one.0), all.1.max(one.1));
    let none = (f64::INFINITY, f64::NEG_INFINITY);
    chunks.map(|chunk| chunk.iter().fold(none, hull)).collect()
}

/// Where the curve's binary32 values lie over an interval.
fn image(curve: &Curve, (from, to): Ends) -> Ends {
    let ends = [from, to].map(|x| ((curve.real)(x), curve.error_32.at(x) + DIGIT));
    let low = ends.iter().map(|(y, error)| y - error).fold(f64::INFINITY, f64::min);
    let high = ends
        .iter()
        .map(|(y, error)| y + error)
        .fold(f64::NEG_INFINITY, f64::max);
    match curve.least {
        Some((turn, least)) if from <= turn && turn <= to => (low.min(least - curve.error_32.absolute - DIGIT), high),
        _ => (low, high),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_neurons_share_clauses_that_hold_each_of_them() {
        let neurons: Vec<Ends> = (0..1000)
            .map(|i| f64::from(i * 7919 % 1000))
            .map(|x| (-x / 3.0, x))
            .collect();
        let clauses = together(neurons.clone());
        assert!(clauses.len() <= MOST_CLAUSES, "{}", clauses.len());
        for (from, to) in &neurons {
            assert!(
                clauses.iter().any(|clause| clause.0 <= *from && *to <= clause.1),
                "{from} {to}"
            );
        }
        assert_eq!(together(neurons[..100].to_vec()), neurons[..100]);
    }

    /// By the definition: no value within an interval is outside of what is told of it.
    #[test]
    fn an_image_holds_all_values() {
        for activation in Activation::EACH.iter().filter(|each| each.range().is_none()) {
            let Some(curve) = activation.curve() else { continue };
            let places: Vec<f64> = (-60..=60).map(|i| f64::from(i) * 0.17).collect();
            for (index, from) in places.iter().enumerate() {
                for to in &places[index..] {
                    let (low, high) = image(curve, (*from, *to));
                    let steps = (0..=20).map(|i| from + (to - from) * f64::from(i) / 20.0);
                    for y in steps.map(curve.real) {
                        assert!(low <= y && y <= high, "{}: {y} over {from} to {to}", activation.word());
                    }
                }
            }
        }
    }
}
