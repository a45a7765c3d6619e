//! Contract section 6: how layers of floats are cut into blocks.

use policy::{Layer, NumericFormat, Policy, Scalar};
use targets::{RowBlock, TargetSpec};

use super::loops::{self, Plan, Style};
use super::tables;
use crate::output::Language;
use crate::program::{Arithmetic, Element, Kept, Literal, Network, Shape, Table};

/// Most outputs of a block in ARM assembly: their sums take half of the 32 single registers, weights in flight and inputs the
/// other.
const ASSEMBLY_ROWS: usize = 16;

/// One function takes the blocks of all inputs and all sums: nothing is written out.
const STYLE: Style = Style {
    lanes: 1,
    unrolled: 1,
    stretch: |_| 1,
    is_integer: false,
};

/// The network and its tables.
pub fn lower(policy: &Policy, target: &TargetSpec, language: Language) -> (Network, Vec<Table>) {
    let scalar = policy.numeric_format.scalar();
    let last = policy.layers.len().saturating_sub(1);
    // a first layer is never streamed: it reads the observation, which is there all at once
    let plan = |(index, layer)| plan(policy, layer, index == last && index > 0, target, language);
    let plans: Vec<Plan> = policy.layers.iter().enumerate().map(plan).collect();
    let mut tables = Vec::new();
    for ((index, plan), layer) in plans.iter().enumerate().zip(&policy.layers) {
        let weight = |output: usize, input: usize| Literal::exact(layer.weights[output * layer.inputs + input]);
        // weights stay binary32 in binary64, too: half of the memory, and converting one is exact
        let element = Element::Float(Scalar::F32);
        tables.push(tables::weights(
            (index, plan),
            &[0],
            (element, target.weights_alignment),
            weight,
        ));
        // sums start with a bias, so it has their type
        let biases = layer.bias.iter().map(|bias| Literal::nearest(scalar, f64::from(*bias)));
        tables.push(tables::bias((index, plan), Element::Float(scalar), biases.collect()));
    }
    let (loops, buffers) = loops::build(&plans, &STYLE);
    let network = Network {
        arithmetic: Arithmetic::Real {
            scalar,
            fused: policy.numeric_format == NumericFormat::F32Fma,
        },
        lanes: vec![0],
        has_assembly: plans.iter().any(|plan| plan.has_assembly),
        layers: plans.into_iter().map(|plan| plan.shape).collect(),
        buffers,
        loops,
    };
    (network, tables)
}

fn plan(policy: &Policy, layer: &Layer, may_stream: bool, target: &TargetSpec, language: Language) -> Plan {
    let blocks = row_block(policy.numeric_format, target, language);
    let rows = match blocks {
        RowBlock::All => layer.outputs,
        // a layer has outputs, or the check refuses it: the ends of the clamp are in order
        RowBlock::Rows(rows) | RowBlock::Vectors(rows) => rows.clamp(1, layer.outputs),
    };
    let chunk = match blocks {
        // where blocks are variables the last layer takes them one by one: half of the stack
        RowBlock::Rows(rows) if may_stream => rows.clamp(1, layer.inputs),
        _ => layer.inputs,
    };
    let kept = match (language, blocks) {
        // Rust's arrays are in registers or not, as LLVM sees fit
        (Language::Rust, _) | (_, RowBlock::Rows(_)) => Kept::Registers,
        (Language::C, RowBlock::All) => Kept::Memory,
        (Language::C, RowBlock::Vectors(_)) => Kept::Vectors,
    };
    Plan {
        shape: Shape {
            name: layer.name.clone(),
            inputs: layer.inputs,
            outputs: layer.outputs,
            shift: 0,
        },
        rows,
        chunk,
        kept,
        // the kernels round product and sum apart, in binary32, and keep the sums of a block in registers
        has_assembly: target.has_float_assembly
            && policy.numeric_format == NumericFormat::F32
            && matches!(blocks, RowBlock::Rows(_))
            && rows <= ASSEMBLY_ROWS,
        activation: layer.activation,
        cut: None,
    }
}

fn row_block(format: NumericFormat, target: &TargetSpec, language: Language) -> RowBlock {
    let blocks = match language {
        Language::C => target.c_row_block,
        Language::Rust => target.rust_row_block,
    };
    match (blocks, format) {
        // the fused operation is a function of scalars, and weights of another width than the sums need a conversion
        (RowBlock::Vectors(_), NumericFormat::F32Fma | NumericFormat::F64) => RowBlock::All,
        _ => blocks,
    }
}
