//! The network in integers: tables, blocks, rows.

use templates::c::{IntegerBlockView, IntegerLayerView, IntegerPartView, IntegerView, RowView, Table};

use super::statements::{float, unsigned};
use super::tables::wrap;
use crate::backend::assembly::Kernel;
use crate::program::{ActivationCode, IntegerLayer, IntegerNetwork};

/// C type of a weight.
pub fn element(network: &IntegerNetwork) -> &'static str {
    if network.weight_bytes == 1 { "int8_t" } else { "int16_t" }
}

/// Weights and biases.
pub fn tables(network: &IntegerNetwork) -> Vec<Table> {
    let layers = network.layers.iter().enumerate().map(|(index, layer)| {
        let weights = Table {
            element: element(network),
            name: format!("weights{index}"),
            length: layer.table.len(),
            lines: wrap(layer.table.iter().map(ToString::to_string)),
            aligned: true,
        };
        let bias = Table {
            element: "int32_t",
            name: format!("bias{index}"),
            length: layer.bias.len(),
            lines: wrap(layer.bias.iter().map(ToString::to_string)),
            aligned: false,
        };
        [weights, bias]
    });
    layers.flatten().collect()
}

/// The network of a controller whose functions start with `prefix`.
pub fn view(prefix: &str, network: &IntegerNetwork) -> IntegerView {
    let lanes = network.lanes.len();
    let inputs = network.inputs.len();
    let padded = network.padded(inputs);
    let mut quantise: Vec<String> = Vec::new();
    for (i, input) in network.inputs.iter().enumerate() {
        quantise.push(format!(
            "input[{i}] = {prefix}_integer((observation[{i}] * {}) + 32768.5f, {}, {});",
            float(input.factor.value()),
            unsigned(input.low.0),
            unsigned(input.high.0)
        ));
    }
    quantise.extend((inputs..padded).map(|i| format!("input[{i}] = 0;")));
    let has = |wanted: fn(&ActivationCode) -> bool| network.layers.iter().any(|layer| wanted(&layer.activation));
    IntegerView {
        bound: network.accumulator_bound,
        weight: element(network),
        is_quad: lanes == 4,
        input_length: padded,
        quantise,
        q_unit: float(network.q_unit.value()),
        layers: layers(prefix, network),
        relu: has(|activation| *activation == ActivationCode::Relu),
        leaky_relu: has(|activation| matches!(activation, ActivationCode::LeakyRelu(_))),
        tanh: has(|activation| *activation == ActivationCode::Tanh),
    }
}

fn layers(prefix: &str, network: &IntegerNetwork) -> Vec<IntegerLayerView> {
    let last = network.layers.len() - 1;
    let hidden = |index: usize| format!("hidden{index}");
    let view = |(index, layer): (usize, &IntegerLayer)| {
        let length = network.padded(layer.outputs);
        let sink = if index == last { "q".to_owned() } else { hidden(index) };
        let padding = if index == last {
            layer.outputs..layer.outputs
        } else {
            layer.outputs..length
        };
        let blocks = blocks(prefix, network, layer, index == last);
        IntegerLayerView {
            index,
            comment: format!("{}: {} -> {}", layer.name, layer.inputs, layer.outputs),
            shift: layer.shift,
            has_loop: blocks.iter().any(|block| block.count > 1),
            has_turns: blocks.iter().flat_map(|block| &block.parts).any(|part| part.turns > 1),
            blocks,
            source: if index == 0 {
                "input".to_owned()
            } else {
                hidden(index - 1)
            },
            padding: padding.map(|i| format!("{sink}[{i}] = 0;")).collect(),
            sink,
            sink_element: if index == last { "int32_t" } else { "int16_t" },
            sink_length: length,
            is_hidden: index != last,
        }
    };
    network.layers.iter().enumerate().map(view).collect()
}

fn blocks(prefix: &str, network: &IntegerNetwork, layer: &IntegerLayer, is_last: bool) -> Vec<IntegerBlockView> {
    let block = |count: usize, height: usize| IntegerBlockView {
        count,
        height,
        assembly: assembly(network, layer, height),
        parts: parts(prefix, network, layer, height),
        rows: (0..height)
            .map(|index| RowView {
                index,
                result: result(prefix, layer, index, is_last),
            })
            .collect(),
    };
    let (full, tail) = (layer.outputs / layer.block_rows, layer.outputs % layer.block_rows);
    let mut views = vec![block(full, layer.block_rows)];
    if tail > 0 {
        views.push(block(1, tail));
    }
    views
}

/// Groups taken in one turn of the loop, so that its own instructions weigh less.
const UNROLL: usize = 4;

fn parts(prefix: &str, network: &IntegerNetwork, layer: &IntegerLayer, height: usize) -> Vec<IntegerPartView> {
    let lanes = network.lanes.len();
    let groups = network.groups(layer.inputs);
    let part = |turns: usize, groups: usize| IntegerPartView {
        turns,
        inputs: groups * lanes,
        weights: groups * lanes * height,
        dsp: (0..groups)
            .flat_map(|group| dsp(prefix, network, group, height))
            .collect(),
        portable: (0..groups).flat_map(|group| portable(network, group, height)).collect(),
    };
    let mut parts = Vec::new();
    if groups >= UNROLL {
        parts.push(part(groups / UNROLL, UNROLL));
    }
    if !groups.is_multiple_of(UNROLL) {
        parts.push(part(1, groups % UNROLL));
    }
    parts
}

/// One group of inputs in a block of its own.
fn braced(lines: impl Iterator<Item = String>) -> Vec<String> {
    let indented = lines.map(|line| format!("    {line}"));
    std::iter::once("{".to_owned())
        .chain(indented)
        .chain(["}".to_owned()])
        .collect()
}

fn dsp(prefix: &str, network: &IntegerNetwork, group: usize, height: usize) -> Vec<String> {
    let lanes = network.lanes.len();
    let loads = (0..lanes).step_by(2).map(|lane| {
        let at = group * lanes + lane;
        format!("const int32_t x{lane}{} = {prefix}_word_at(&in[{at}]);", lane + 1)
    });
    let sums = (0..height).map(|row| {
        let at = (group * height + row) * lanes;
        if network.weight_bytes == 1 {
            format!("s{row} = {prefix}_quad(&w[{at}], x01, x23, s{row});")
        } else {
            format!("s{row} = __smlad({prefix}_word_at(&w[{at}]), x01, s{row});")
        }
    });
    braced(loads.chain(sums))
}

/// One asm statement over all groups of a block of up to four rows.
fn assembly(network: &IntegerNetwork, layer: &IntegerLayer, height: usize) -> Vec<String> {
    let operand = |name: &str| format!("%[{name}]");
    let kernel = Kernel {
        is_quad: network.weight_bytes == 1,
        groups: network.groups(layer.inputs),
        height,
        registers: ["r4", "r5", "r6", "r8"],
    };
    let mut lines = vec![
        format!("uint32_t turns = {}u;", kernel.turns()),
        "int32_t x01;".to_owned(),
    ];
    if kernel.is_quad {
        lines.extend(["int32_t x23;".to_owned(), "int32_t even;".to_owned()]);
    }
    lines.push("__asm__ volatile(".to_owned());
    let text = kernel.text(&operand);
    lines.extend(text.iter().map(|line| format!("    \"{line}\\n\\t\"")));
    let mut outputs: Vec<String> = (0..height).map(|row| format!("[s{row}] \"+r\"(s{row})")).collect();
    let pointers = [("w", "w"), ("input", "in"), ("turns", "turns")];
    outputs.extend(pointers.map(|(name, variable)| format!("[{name}] \"+r\"({variable})")));
    let temporaries: &[&str] = if kernel.is_quad {
        &["x01", "x23", "even"]
    } else {
        &["x01"]
    };
    outputs.extend(temporaries.iter().map(|name| format!("[{name}] \"=&r\"({name})")));
    lines.push(format!("    : {}", outputs.join(", ")));
    let clobbered: Vec<String> = kernel.clobbered().iter().map(|name| format!("\"{name}\"")).collect();
    lines.push("    :".to_owned());
    lines.push(format!("    : {}, \"cc\", \"memory\");", clobbered.join(", ")));
    std::iter::once("{".to_owned())
        .chain(lines.into_iter().map(|line| format!("    {line}")))
        .chain(["}".to_owned()])
        .collect()
}

fn portable(network: &IntegerNetwork, group: usize, height: usize) -> Vec<String> {
    let lanes = network.lanes.len();
    let loads = (0..lanes).map(|lane| format!("const int32_t x{lane} = in[{}];", group * lanes + lane));
    let sums = (0..height).map(|row| {
        let first = (group * height + row) * lanes;
        let products = network.lanes.iter().enumerate();
        let products: Vec<String> = products
            .map(|(at, lane)| format!("((int32_t)w[{}] * x{lane})", first + at))
            .collect();
        format!("s{row} = s{row} + {};", products.join(" + "))
    });
    braced(loads.chain(sums))
}

fn result(prefix: &str, layer: &IntegerLayer, index: usize, is_last: bool) -> String {
    let cut = if layer.shift == 0 {
        format!("s{index}")
    } else {
        format!("s{index} >> {}", layer.shift)
    };
    match layer.activation {
        ActivationCode::Identity if is_last => cut,
        ActivationCode::Identity => format!("(int16_t)({cut})"),
        ActivationCode::Relu => format!("{prefix}_positive({cut})"),
        ActivationCode::LeakyRelu(_) => format!("{prefix}_leaky_integer({cut}, {})", layer.slope),
        ActivationCode::Tanh => format!("{prefix}_tanh_integer(s{index}, {})", float(layer.unit.value())),
    }
}
