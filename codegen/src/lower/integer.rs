//! Contract section 6b: weights and biases rounded to integers, and how integer layers are cut into blocks.
//!
//! ```text
//!  scale   sum = weights * inputs + bias      32 bits, proven not to overflow; bias has half of the last bit kept
//!  cut     sum >> shift, activation           16 bits: the inputs of the next layer
//!  group   one 32-bit word of weights         two of 16 bits, or four of 8; buffers and rows are padded to whole groups
//! ```
//!
//! In: layers in floats and the scales that `policy` chose for them. Out: the same network as integers, its tables in reading
//! order. The one invariant: a padded input is 0 or meets a weight that is 0, so padding changes no sum.

use policy::scales::{self, LayerScale, Scales, power_of_two, round_half_up};
use policy::{Layer, NumericFormat, Policy, Scalar};
use targets::{IntegerBlock, IntegerLoop, TargetSpec};

use super::loops::{self, Plan, Style};
use super::tables;
use crate::output::Language;
use crate::program::{
    Arithmetic, Cut, Element, Inner, IntegerCode, IntegerInput, Kept, Literal, Network, Shape, Table,
};

/// Two 16-bit weights of a word, in memory order.
const PAIR: [usize; 2] = [0, 1];
/// Four 8-bit weights of a word: the even bytes, then the odd ones, widen to two pairs (ARM `SXTB16`).
const QUAD: [usize; 4] = [0, 2, 1, 3];

/// Exponent field of binary32 of a number whose mantissa of 24 bits is an integer.
// 127 is the bias of the exponent, 23 the bits behind the point
const MANTISSA_FIELD: i32 = 150;

/// Sums of a streamed layer that C takes at a time, where that leaves none over; else the last number of these.
const SUMS: [usize; 2] = [3, 4];

/// The network and its tables.
pub fn lower(policy: &Policy, scales: &Scales, target: &TargetSpec, language: Language) -> (Network, Vec<Table>) {
    let lanes: &[usize] = match policy.numeric_format {
        NumericFormat::I8 => &QUAD,
        _ => &PAIR,
    };
    let block = block(policy.numeric_format, target.integer_block, language);
    let layers = || policy.layers.iter().zip(&scales.layers);
    let plan = |(index, (layer, scale))| plan(layer, scale, split(policy, index, lanes.len(), block), block);
    let plans: Vec<Plan> = layers().enumerate().map(plan).collect();
    let weight_bytes = 4 / lanes.len();
    let mut tables = Vec::new();
    for ((index, plan), (layer, scale)) in plans.iter().enumerate().zip(layers()) {
        // aligned to words although the elements are smaller: inner loops load whole groups
        let element = (Element::Integer { bytes: weight_bytes }, Some(4));
        let weight = |output: usize, input: usize| Literal::exact(weight(layer, scale, output, input));
        tables.push(tables::weights((index, plan), lanes, element, weight));
        let biases = biases(layer, scale).into_iter().map(Literal::exact);
        tables.push(tables::bias(
            (index, plan),
            Element::Integer { bytes: 4 },
            biases.collect(),
        ));
    }
    let inputs: Vec<IntegerInput> = scales.inputs.iter().map(input).collect();
    if language == Language::C {
        // Rust has them in its code
        // one loop over a table takes less flash than a call written out for each input
        let ranges = inputs.iter().flat_map(|input| [input.unshifted, input.low, input.high]);
        tables.push(Table::plain(
            "ranges",
            Element::Integer { bytes: 2 },
            ranges.map(Literal::exact),
        ));
    }
    let (loops, buffers) = loops::build(&plans, &style(lanes.len(), block, language));
    let q_exponent = scales.layers.last().and_then(|layer| layer.outputs.first());
    let q_exponent = q_exponent.copied().unwrap_or_default();
    let streamed = plans.last().filter(|last| last.is_streamed());
    let network = Network {
        arithmetic: Arithmetic::Integer(IntegerCode {
            weight_bytes,
            inner: inner(block, weight_bytes),
            inputs,
            // a layer before the last two has used the observation up when these write the first sum
            shares: plans.len() > 2,
            output_shift: streamed.map_or(0, |last| last.shape.shift),
            q_unit: Literal::nearest(Scalar::F32, power_of_two(-q_exponent)),
            // one more than for 24 bits: an output may be 2^24 itself
            q_field: MANTISSA_FIELD + 1 - q_exponent,
            accumulator_bound: scales.accumulator_bound(),
        }),
        lanes: lanes.to_vec(),
        has_assembly: plans.iter().any(|plan| plan.has_assembly),
        layers: plans.into_iter().map(|plan| plan.shape).collect(),
        buffers,
        loops,
    };
    (network, tables)
}

/// The target's blocks, with the height that suits the language's compilers.
fn block(format: NumericFormat, block: IntegerBlock, language: Language) -> IntegerBlock {
    let (of_16, of_8) = block.rust_rows;
    let rows = match (language, format) {
        (Language::C, _) => block.rows,
        (Language::Rust, NumericFormat::I8) => of_8,
        (Language::Rust, _) => of_16,
    };
    IntegerBlock { rows, ..block }
}

fn style(lanes: usize, block: IntegerBlock, language: Language) -> Style {
    let (unrolled, stretch): (usize, fn(usize) -> usize) = match language {
        Language::C => (block.unrolled, |sums| {
            let even = SUMS.into_iter().find(|width| sums.is_multiple_of(*width));
            even.unwrap_or(SUMS[1].min(sums))
        }),
        // LLVM unrolls by itself
        Language::Rust => (1, |_| 1),
    };
    Style {
        lanes,
        unrolled,
        stretch,
        is_integer: true,
    }
}

fn inner(block: IntegerBlock, weight_bytes: usize) -> Inner {
    match block.inner {
        IntegerLoop::Dual => Inner::Dual,
        IntegerLoop::Halves if weight_bytes == 2 => Inner::Halves,
        IntegerLoop::Halves | IntegerLoop::Plain => Inner::Plain,
    }
}

fn input(input: &scales::InputScale) -> IntegerInput {
    IntegerInput {
        unshifted: MANTISSA_FIELD - input.exponent,
        low: input.low,
        high: input.high,
    }
}

/// Outputs side by side and inputs at a time of a layer. A last layer that is streamed takes blocks of the layer before.
fn split(policy: &Policy, index: usize, lanes: usize, block: IntegerBlock) -> (usize, usize) {
    let layer = &policy.layers[index];
    let is_plain_last = index + 1 == policy.layers.len() && layer.activation.is_identity();
    // a group of inputs must not lie in two blocks
    let streams = block.streams && is_plain_last && index > 0 && block.rows.is_multiple_of(lanes);
    // one block alone would be no stream, only a sum in memory instead of registers
    if streams && block.rows < layer.inputs {
        (1, block.rows)
    } else {
        (block.rows.clamp(1, layer.outputs), layer.inputs)
    }
}

fn plan(layer: &Layer, scale: &LayerScale, (rows, chunk): (usize, usize), block: IntegerBlock) -> Plan {
    let activation = layer.activation;
    let exponent = scale.accumulators.first().copied().unwrap_or_default();
    let behind = scale.outputs.first().copied().unwrap_or_default();
    Plan {
        shape: Shape {
            name: layer.name.clone(),
            inputs: layer.inputs,
            outputs: layer.outputs,
            shift: scale.shift,
        },
        rows,
        chunk,
        kept: Kept::Registers,
        // the kernels have `SMLAD`, and of the activations those that are a shift and a saturation
        has_assembly: block.inner == IntegerLoop::Dual && (activation.is_identity() || activation.is_rectifier()),
        cut: Some(Cut {
            shift: scale.shift,
            // of a layer behind which no scale passes and of the last: there all rows have one exponent
            unit: Literal::nearest(Scalar::F32, power_of_two(-exponent)),
            scale: Literal::nearest(Scalar::F32, power_of_two(behind)),
        }),
        activation,
    }
}

/// A weight as integer; the scales were chosen so that every one fits.
fn weight(layer: &Layer, scale: &LayerScale, output: usize, input: usize) -> i16 {
    let weight = f64::from(layer.weights[output * layer.inputs + input]);
    // a power of two changes the exponent alone: this rounding is the only one
    round_half_up(weight * power_of_two(scale.accumulators[output] - scale.inputs[input])) as i16
}

/// Biases as integers, with half of the last bit that the cut keeps: so it rounds half up.
fn biases(layer: &Layer, scale: &LayerScale) -> Vec<i32> {
    let rows = layer.bias.iter().zip(&scale.accumulators);
    let bias = |(bias, exponent): (&f32, &i32)| {
        let integer = round_half_up(f64::from(*bias) * power_of_two(*exponent));
        (integer + scales::half(scale.shift)) as i32
    };
    rows.map(bias).collect()
}
