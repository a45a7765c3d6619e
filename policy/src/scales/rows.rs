//! Row exponents of the hidden neurons (contract section 6b): a network in which one neuron computes in thousands and its
//! neighbour in thousandths would leave the second no bits, for they share a scale. What is not bent by scaling (a ReLU is
//! not) lets a neuron's row of weights be multiplied by 2^r and its column in the next layer by 2^-r: the same
//! function, at no cost at run time.
//!
//! The choice balances the two, as in Nagel et al., "Data-Free Quantization Through Weight Equalization and Bias
//! Correction" (2019), section 4.1, with 4-norms instead of ranges: one outlier does not decide alone.

use crate::model::{Layer, Policy};

use super::power_of_two;

/// More sweeps change nothing that matters; most networks are settled after three.
const SWEEPS: usize = 16;
/// Largest distance of a row exponent from the layer's median.
// the digits of binary32: a neuron that much smaller than the others is lost in their sums, whatever its exponent
const LARGEST: i32 = 24;

/// Row exponent of every output of every layer; 0 in the last layer and before what is not homogeneous.
pub(super) fn balanced(policy: &Policy, inputs: &[i32]) -> Vec<Vec<i32>> {
    let layers = &policy.layers;
    let ranges = ranges(policy);
    let mut rows: Vec<Vec<i32>> = layers.iter().map(|layer| vec![0; layer.outputs]).collect();
    for _ in 0..SWEEPS {
        let before = rows.clone();
        for (index, pair) in layers.windows(2).enumerate() {
            let [layer, next] = pair else { continue };
            // a factor in front of a curve is another curve: its rows stay
            if !layer.activation.is_homogeneous() {
                continue;
            }
            // the exponents of this very sweep: a change runs on to the layers behind at once
            let columns = match index.checked_sub(1) {
                Some(previous) => &rows[previous],
                None => inputs,
            };
            let incoming = incoming(layer, columns, &ranges[index]);
            let outgoing = outgoing(next, &rows[index + 1]);
            rows[index] = incoming
                .iter()
                .zip(&outgoing)
                .map(|(row, column)| balance(*row, *column))
                .collect();
        }
        if rows == before {
            break;
        }
    }
    for row in &mut rows {
        centre(row);
    }
    rows
}

/// Largest magnitude of the inputs of each layer by the norms of the weights: `h_o = |b_o| + sum |w_oi| h_i`.
fn ranges(policy: &Policy) -> Vec<Vec<f64>> {
    let features = policy.features.iter();
    let mut inputs: Vec<f64> = features.map(|f| f.bound.low.abs().max(f.bound.high.abs())).collect();
    let mut ranges = Vec::with_capacity(policy.layers.len());
    for layer in &policy.layers {
        let outputs = rows_of(layer).map(|(row, bias)| {
            let products = row.iter().zip(&inputs).map(|(w, x)| f64::from(*w).abs() * x);
            products.fold(f64::from(bias).abs(), |sum, product| sum + product)
        });
        let outputs: Vec<f64> = match layer.activation.range() {
            // behind a curve its bound counts, however large the sum
            Some(range) => vec![range.low.abs().max(range.high); layer.outputs],
            None => outputs.collect(),
        };
        ranges.push(std::mem::replace(&mut inputs, outputs));
    }
    ranges
}

/// Per output the mean fourth power of what comes in: the weights, and the bias at the largest input.
fn incoming(layer: &Layer, columns: &[i32], ranges: &[f64]) -> Vec<f64> {
    let scaled = columns.iter().zip(ranges);
    let largest = scaled
        .map(|(column, range)| power_of_two(*column) * range)
        .fold(0.0, f64::max);
    let fourth = |(row, bias): (&[f32], f32)| {
        let weights = row.iter().zip(columns);
        let weights = weights.map(|(w, column)| fourth_power(f64::from(*w) * power_of_two(-column)));
        // without an input that moves there is nothing to measure the bias by
        let bias = if largest > 0.0 { f64::from(bias) / largest } else { 0.0 };
        weights.fold(fourth_power(bias), |sum, weight| sum + weight) / layer.inputs as f64
    };
    rows_of(layer).map(fourth).collect()
}

/// Per input the mean fourth power of the weights that it meets.
fn outgoing(layer: &Layer, rows: &[i32]) -> Vec<f64> {
    let mut sums = vec![0.0; layer.inputs];
    for ((row, _), exponent) in rows_of(layer).zip(rows) {
        for (sum, w) in sums.iter_mut().zip(row) {
            *sum += fourth_power(f64::from(*w) * power_of_two(*exponent));
        }
    }
    sums.iter().map(|sum| sum / layer.outputs as f64).collect()
}

fn rows_of(layer: &Layer) -> impl Iterator<Item = (&[f32], f32)> {
    let rows = layer.weights.chunks_exact(layer.inputs.max(1));
    rows.zip(layer.bias.iter().copied())
}

fn fourth_power(x: f64) -> f64 {
    let square = x * x;
    square * square
}

/// The r at which row * 2^r and column * 2^-r are nearest: an eighth of the logarithm of the quotient of fourth powers, rounded.
fn balance(row: f64, column: f64) -> i32 {
    let quotient = column / row;
    if quotient.is_normal() {
        // a neuron that nothing enters or leaves has a quotient of 0, infinity or NaN
        // adding 4 rounds to nearest, halves upwards; `/` would round negative ones towards 0
        (exponent(quotient) + 4).div_euclid(8)
    } else {
        0
    }
}

/// `floor(log2(x))` of a normal number above 0.
fn exponent(x: f64) -> i32 {
    // exact, from the bits: a computed log2 could round across a power of two
    (x.to_bits() >> 52) as i32 - 1023
}

/// Around the median, within the limit: only differences between rows matter, the layer's exponent takes the rest.
fn centre(rows: &mut [i32]) {
    let mut sorted = rows.to_vec();
    sorted.sort_unstable();
    let median = sorted.get(sorted.len() / 2).copied().unwrap_or_default();
    for row in rows {
        *row = (*row - median).clamp(-LARGEST, LARGEST);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// From the definition: r is the integer nearest to log2(column / row) / 8, halves upwards.
    #[test]
    fn row_and_column_meet_half_way() {
        // norms 1 and 16: row * 4 = column / 4, and their fourth powers are 1 and 2^16
        assert_eq!(balance(1.0, 65_536.0), 2);
        assert_eq!(balance(65_536.0, 1.0), -2);
        // the borders at r = 1/2 and -1/2: quotients of 2^4 and 2^-4
        assert_eq!([15.9, 16.0].map(|column| balance(1.0, column)), [0, 1]);
        assert_eq!([16.0, 16.1].map(|row| balance(row, 1.0)), [0, -1]);
    }

    #[test]
    fn a_neuron_that_nothing_enters_or_leaves_stays() {
        assert_eq!([(0.0, 0.0), (0.0, 1.0), (1.0, 0.0)].map(|(r, c)| balance(r, c)), [0; 3]);
        assert_eq!(balance(1e-300, 1e300), 0, "far outside of anything trained");
    }

    #[test]
    fn rows_lie_around_their_median() {
        // in no order: the one in the middle of the list is not the median
        let mut rows = [5, 7, -40, 6, 60];
        centre(&mut rows);
        assert_eq!(rows, [-1, 1, -24, 0, 24]);
    }
}
