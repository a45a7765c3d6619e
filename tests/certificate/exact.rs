//! The real network in double-double arithmetic (Dekker): about 100 bits, so its own error is far below every bound here.
//! Written from the formulas of a dense network alone.

use policy::{Policy, Shape};

/// High and low part.
#[derive(Clone, Copy)]
struct Double(f64, f64);

fn two_sum(a: f64, b: f64) -> Double {
    let sum = a + b;
    let other = sum - a;
    Double(sum, (a - (sum - other)) + (b - other))
}

impl Double {
    fn add(self, other: Double) -> Double {
        let sum = two_sum(self.0, other.0);
        two_sum(sum.0, sum.1 + self.1 + other.1)
    }

    fn times(self, factor: f64) -> Double {
        let product = self.0 * factor;
        let error = self.0.mul_add(factor, -product);
        two_sum(product, error + self.1 * factor)
    }
}

/// Real Q values of an observation.
pub fn q_values(policy: &Policy, observation: &[f32]) -> Vec<f64> {
    let mut x: Vec<Double> = observation.iter().map(|o| Double(f64::from(*o), 0.0)).collect();
    for layer in &policy.layers {
        let rows = layer.weights.chunks_exact(layer.inputs).zip(&layer.bias);
        x = rows
            .map(|(row, bias)| {
                let products = row.iter().zip(&x).map(|(w, x)| x.times(f64::from(*w)));
                products.fold(Double(f64::from(*bias), 0.0), Double::add)
            })
            .map(|sum| match layer.activation.shape() {
                Shape::Hinge { .. } if sum.0 > 0.0 => sum,
                Shape::Hinge { below } => sum.times(below),
                // its own error is far below that of any format
                Shape::Curve(curve) => Double((curve.real)(sum.0), 0.0),
            })
            .collect();
    }
    x.iter().map(|x| x.0 + x.1).collect()
}
