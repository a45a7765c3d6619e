//! The tables of a network in the order in which its loops read them, and those beside it.

use super::loops::Plan;
use crate::program::{Element, Literal, Part, Slice, Strip, Table};

/// The weights of a layer: blocks of inputs, within those blocks of outputs, within those by group of inputs, then by output,
/// then in the order of `lanes`. Inputs that the last group lacks have weight 0.
pub fn weights(
    (index, plan): (usize, &Plan),
    lanes: &[usize],
    (element, alignment): (Element, Option<u32>),
    weight: impl Fn(usize, usize) -> Literal,
) -> Table {
    let (inputs, outputs) = (plan.shape.inputs, plan.shape.outputs);
    let mut values = Vec::with_capacity(inputs * outputs);
    for first_input in (0..inputs).step_by(plan.chunk) {
        let end = (first_input + plan.chunk).min(inputs);
        for first in (0..outputs).step_by(plan.rows) {
            for group in (first_input..end).step_by(lanes.len()) {
                for output in first..(first + plan.rows).min(outputs) {
                    // in the order in which a word is taken apart: with bytes in it that is not the order of the inputs
                    let lane = |lane: &usize| match group + lane {
                        input if input < inputs => weight(output, input),
                        _ => Literal::exact(0),
                    };
                    values.extend(lanes.iter().map(lane));
                }
            }
        }
    }
    Table {
        name: format!("weights{index}"),
        element,
        values,
        strips: match element {
            Element::Integer { .. } => integer_strips(plan, lanes.len()),
            _ => float_strips(plan),
        },
        alignment,
        is_checked: true,
    }
}

/// The biases of a layer, in order.
pub fn bias((index, plan): (usize, &Plan), element: Element, values: Vec<Literal>) -> Table {
    // the sums of a streamed layer start from all biases at once: one array, no blocks
    let strips = if plan.is_streamed() {
        vec![Strip::of("", plan.shape.outputs, Vec::new())]
    } else {
        let blocks = plan.blocks().into_iter();
        let strip = |(part, count, rows)| match (part, element) {
            (Part::Full, _) => Strip::of("", count, vec![rows]),
            (Part::Rest, Element::Integer { .. }) => Strip::of("TAIL_", count, vec![rows]),
            (Part::Rest, _) => Strip::of("TAIL_", rows, Vec::new()),
        };
        blocks.map(strip).collect()
    };
    Table {
        name: format!("bias{index}"),
        element,
        values,
        strips,
        alignment: None,
        is_checked: true,
    }
}

/// Weights of integers: every kind of block is an array of blocks.
fn integer_strips(plan: &Plan, lanes: usize) -> Vec<Strip> {
    let prefix = |part| if part == Part::Full { "" } else { "TAIL_" };
    if plan.is_streamed() {
        let chunks = plan.chunks().into_iter();
        let strip = |(part, count, inputs): (_, _, usize)| {
            Strip::of(
                prefix(part),
                count,
                vec![plan.shape.outputs, inputs.next_multiple_of(lanes)],
            )
        };
        return chunks.map(strip).collect();
    }
    let groups = plan.shape.inputs.div_ceil(lanes);
    let blocks = plan.blocks().into_iter();
    let strip = |(part, count, rows)| Strip::of(prefix(part), count, vec![groups, rows, lanes]);
    blocks.map(strip).collect()
}

/// Weights of floats: the full blocks are an array of blocks, the shorter last one stands alone.
fn float_strips(plan: &Plan) -> Vec<Strip> {
    let mut strips = Vec::new();
    for (chunk, chunks, inputs) in plan.chunks() {
        let mut slices = Vec::new();
        for (block, count, rows) in plan.blocks() {
            let prefix = match (chunk, block) {
                (Part::Full, Part::Full) => "",
                (Part::Full, Part::Rest) => "TAIL_",
                (Part::Rest, Part::Full) => "LAST_",
                (Part::Rest, Part::Rest) => "LAST_TAIL_",
            };
            let item = match block {
                Part::Full => vec![count, inputs, rows],
                Part::Rest => vec![inputs, rows],
            };
            slices.push(Slice { prefix, item });
        }
        // of a streamed layer the full chunks alternate: blocks of one, its shorter last block, blocks of the next
        if plan.is_streamed() && chunk == Part::Full {
            strips.push(Strip { times: chunks, slices });
            continue;
        }
        strips.extend(slices.into_iter().map(|slice| {
            let (times, item) = slice
                .item
                .split_first()
                .map_or((1, &[][..]), |(times, item)| (*times, item));
            Strip::of(slice.prefix, times, item.to_vec())
        }));
    }
    strips
}
