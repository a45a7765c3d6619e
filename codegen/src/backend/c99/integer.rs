//! The network in integers: tables, blocks, rows.

use templates::c::{IntegerBlockView, IntegerLayerView, IntegerPartView, IntegerView, RowView, Table};

use targets::IntegerLoop;

use super::statements::float;
use super::tables::wrap;
use crate::backend::assembly::{Kernel, has_kernels};
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
pub fn view(prefix: &str, network: &IntegerNetwork, has_fpu: bool) -> IntegerView {
    let lanes = network.lanes.len();
    let inputs = network.inputs.len();
    let padded = network.padded(inputs);
    let mut quantise: Vec<String> = Vec::new();
    for (i, input) in network.inputs.iter().enumerate() {
        quantise.push(format!(
            "input[{i}] = {prefix}_integer(observation[{i}], {}, {}, {});",
            input.unshifted, input.low, input.high
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
        q_unit: float(network.q_unit.single()),
        q_field: network.q_field,
        has_fpu,
        special: special(network),
        has_assembly: is_in_assembly(network),
        layers: layers(prefix, network),
        relu: has(|activation| *activation == ActivationCode::Relu),
        leaky_relu: has(|activation| matches!(activation, ActivationCode::LeakyRelu(_))),
        tanh: has(|activation| *activation == ActivationCode::Tanh),
    }
}

/// Macro of the inner loop that suits the target.
fn special(network: &IntegerNetwork) -> &'static str {
    match network.block.inner {
        IntegerLoop::Dual => "DSP",
        IntegerLoop::Halves if network.weight_bytes == 2 => "HALVES",
        IntegerLoop::Halves | IntegerLoop::Plain => "",
    }
}

/// Whether any layer is there in assembly, too.
pub fn is_in_assembly(network: &IntegerNetwork) -> bool {
    network.layers.iter().any(|layer| has_kernels(network, layer))
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
            has_assembly: has_kernels(network, layer),
            has_loop: blocks.iter().any(|block| block.count > 1),
            has_turns: blocks
                .iter()
                .flat_map(|block| block.special.iter().chain(&block.portable))
                .any(|part| part.turns > 1),
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
    let weights = network.padded(layer.inputs);
    let block = |count: usize, height: usize, first: usize| IntegerBlockView {
        count,
        height,
        first: (first, first * weights),
        assembly: assembly(network, layer, count, height, is_last),
        special: match special(network) {
            "" => Vec::new(),
            macro_name => parts(network, layer, height, &|group| match macro_name {
                "DSP" => dsp(prefix, network, group, height),
                _ => halves(prefix, group, height),
            }),
        },
        portable: parts(network, layer, height, &|group| portable(network, group, height)),
        rows: (0..height)
            .map(|index| RowView {
                index,
                result: result(prefix, layer, index, is_last),
            })
            .collect(),
    };
    let (full, tail) = (layer.outputs / layer.block_rows, layer.outputs % layer.block_rows);
    let mut views = vec![block(full, layer.block_rows, 0)];
    if tail > 0 {
        views.push(block(1, tail, full * layer.block_rows));
    }
    views
}

fn parts(
    network: &IntegerNetwork,
    layer: &IntegerLayer,
    height: usize,
    lines: &dyn Fn(usize) -> Vec<String>,
) -> Vec<IntegerPartView> {
    let lanes = network.lanes.len();
    let unrolled = network.block.unrolled;
    let groups = network.groups(layer.inputs);
    let part = |turns: usize, groups: usize| IntegerPartView {
        turns,
        inputs: groups * lanes,
        weights: groups * lanes * height,
        lines: (0..groups).flat_map(lines).collect(),
    };
    let mut parts = Vec::new();
    if groups >= unrolled {
        parts.push(part(groups / unrolled, unrolled));
    }
    if !groups.is_multiple_of(unrolled) {
        parts.push(part(1, groups % unrolled));
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

fn halves(prefix: &str, group: usize, height: usize) -> Vec<String> {
    let at = 2 * group;
    let loads = [
        format!("const int32_t x01 = {prefix}_word_at(&in[{at}]);"),
        "const int32_t x0 = (int16_t)x01;".to_owned(),
        "const int32_t x1 = x01 >> 16;".to_owned(),
    ];
    let sums = (0..height).map(|row| {
        let at = 2 * (group * height + row);
        format!("s{row} = {prefix}_halves({prefix}_word_at(&w[{at}]), x0, x1, s{row});")
    });
    braced(loads.into_iter().chain(sums))
}

/// Literals of the body of a function over all blocks of a height; empty where there is none.
fn assembly(network: &IntegerNetwork, layer: &IntegerLayer, count: usize, height: usize, is_last: bool) -> Vec<String> {
    let Some(kernel) = Kernel::of(network, layer, count, height, is_last) else {
        return Vec::new();
    };
    let text = kernel.text(&|registers| format!("{{{registers}}}"));
    text.iter().map(|line| format!("\"{line}\\n\\t\"")).collect()
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
        ActivationCode::Tanh => format!("{prefix}_tanh_integer(s{index}, {})", float(layer.unit.single())),
    }
}
