//! The network in integers: tables, blocks, rows.

use templates::c::{
    AddedView, IntegerBlockView, IntegerLayerView, IntegerPartView, IntegerView, NextView, RowView, Table,
};

use targets::IntegerLoop;

use super::statements::float;
use super::tables::wrap;
use crate::backend::assembly::{Kernel, has_kernels};
use crate::program::{ActivationCode, IntegerLayer, IntegerNetwork};

/// C type of a weight.
pub fn element(network: &IntegerNetwork) -> &'static str {
    if network.weight_bytes == 1 { "int8_t" } else { "int16_t" }
}

/// Weights and biases, and how the inputs are rounded.
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
    let ranges = network
        .inputs
        .iter()
        .flat_map(|input| [input.unshifted, input.low, input.high]);
    let ranges = Table {
        element: "int16_t",
        name: "ranges".to_owned(),
        length: 3 * network.inputs.len(),
        lines: wrap(ranges.map(|number| number.to_string())),
        aligned: false,
    };
    layers.flatten().chain([ranges]).collect()
}

/// The network of a controller whose functions start with `prefix`.
pub fn view(prefix: &str, network: &IntegerNetwork, has_fpu: bool) -> IntegerView {
    let lanes = network.lanes.len();
    let inputs = network.inputs.len();
    let padded = network.padded(inputs);
    let has = |wanted: fn(&ActivationCode) -> bool| network.layers.iter().any(|layer| wanted(&layer.activation));
    IntegerView {
        bound: network.accumulator_bound,
        weight: element(network),
        is_quad: lanes == 4,
        input_length: padded,
        padding: (inputs..padded).map(|i| format!("input[{i}] = 0;")).collect(),
        output: output(network, "i"),
        q_unit: float(network.q_unit.single()),
        q_field: network.q_field,
        has_fpu,
        special: special(network),
        has_assembly: is_in_assembly(network),
        shares: network.layers.len() > 2,
        layers: layers(prefix, network),
        relu: has(|activation| *activation == ActivationCode::Relu),
        leaky_relu: has(|activation| matches!(activation, ActivationCode::LeakyRelu(_))),
        tanh: has(|activation| *activation == ActivationCode::Tanh),
    }
}

/// Output `action` of the network as the contract has it: sums of a streamed layer are shifted where they are used.
pub fn output(network: &IntegerNetwork, action: &str) -> String {
    match network.pieces() {
        (_, Some((_, last))) if last.shift > 0 => format!("q[{action}] >> {}", last.shift),
        _ => format!("q[{action}]"),
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
    let (before, streamed) = network.pieces();
    let mut views: Vec<IntegerLayerView> = before
        .iter()
        .enumerate()
        .map(|(index, layer)| whole(prefix, network, index, layer))
        .collect();
    if let Some((block, last)) = streamed {
        let index = before.len();
        let mut view = whole(prefix, network, index, block);
        view.comment += &format!(
            "; each block goes at once into the sums of {}: {} -> {}, cut by {} bits",
            last.name, last.inputs, last.outputs, last.shift
        );
        view.next = Some(NextView {
            index: index + 1,
            outputs: last.outputs,
            has_turns: stretches(last).iter().any(|(turns, _)| *turns > 1),
        });
        view.has_assembly = has_kernels(network, block);
        view.sink = "values->q".to_owned();
        view.sink_element = "int32_t";
        view.padding = Vec::new();
        view.is_hidden = false;
        view.blocks = blocks(prefix, network, index, block, Some(last));
        views.push(view);
    }
    views
}

fn whole(prefix: &str, network: &IntegerNetwork, index: usize, layer: &IntegerLayer) -> IntegerLayerView {
    let is_last = index + 1 == network.layers.len();
    let hidden = |index: usize| format!("hidden{index}");
    let length = network.padded(layer.outputs);
    let sink = if is_last { "values->q".to_owned() } else { hidden(index) };
    let padding = if is_last { 0..0 } else { layer.outputs..length };
    let blocks = blocks(prefix, network, index, layer, None);
    IntegerLayerView {
        index,
        comment: format!(
            "{}: {} -> {}, cut by {} bits",
            layer.name, layer.inputs, layer.outputs, layer.shift
        ),
        has_assembly: has_kernels(network, layer),
        has_loop: blocks.iter().any(|block| block.count > 1),
        has_turns: blocks
            .iter()
            .flat_map(|block| block.special.iter().chain(&block.portable))
            .any(|part| part.turns > 1),
        blocks,
        source: match index {
            0 => "values->input".to_owned(),
            _ => hidden(index - 1),
        },
        padding: padding.map(|i| format!("{sink}[{i}] = 0;")).collect(),
        sink,
        sink_element: if is_last { "int32_t" } else { "int16_t" },
        sink_length: length,
        is_hidden: !is_last,
        next: None,
    }
}

/// The blocks of a layer; with `last` each goes into the sums of that layer.
fn blocks(
    prefix: &str,
    network: &IntegerNetwork,
    index: usize,
    layer: &IntegerLayer,
    last: Option<&IntegerLayer>,
) -> Vec<IntegerBlockView> {
    let is_last = index + 1 == network.layers.len();
    let weights = network.padded(layer.inputs);
    let mut first = 0;
    let mut views = Vec::new();
    for (count, height) in layer.blocks() {
        let kernel = Kernel::of(network, layer, (count, height), is_last, last);
        views.push(IntegerBlockView {
            count,
            height,
            first: (first, first * weights),
            assembly: kernel.as_ref().map(assembly).unwrap_or_default(),
            special: match special(network) {
                "" => Vec::new(),
                "DSP" => parts(network, layer, &|groups| dsp(prefix, network, groups, height)),
                _ => parts(network, layer, &|groups| halves(prefix, network, groups, height)),
            },
            portable: parts(network, layer, &|groups| portable(network, groups, height)),
            rows: (0..height)
                .map(|row| RowView {
                    index: row,
                    result: result(prefix, layer, row),
                })
                .collect(),
            added: last.map(|last| added(prefix, network, layer, last, first, height)),
        });
        first += count * height;
    }
    views
}

/// Turns and groups of the loops over the inputs of a block.
fn parts(network: &IntegerNetwork, layer: &IntegerLayer, lines: &dyn Fn(usize) -> Vec<String>) -> Vec<IntegerPartView> {
    let unrolled = network.block.unrolled;
    let groups = network.groups(layer.inputs);
    let part = |turns: usize, groups: usize| IntegerPartView {
        turns,
        lines: lines(groups),
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

/// Sums of a last layer that are taken at a time, where that leaves none over; else the last number of these.
const SUMS: [usize; 2] = [3, 4];

/// Turns and sums of the loops over the sums of a last layer.
fn stretches(last: &IntegerLayer) -> Vec<(usize, usize)> {
    let even = SUMS.into_iter().find(|n| last.outputs.is_multiple_of(*n));
    let width = even.unwrap_or(SUMS[1].min(last.outputs));
    [(last.outputs / width, width), (1, last.outputs % width)]
        .into_iter()
        .filter(|(_, width)| *width > 0)
        .collect()
}

/// What a block of `height` outputs from `first` of `layer` adds to the sums of the last layer.
fn added(
    prefix: &str,
    network: &IntegerNetwork,
    layer: &IntegerLayer,
    last: &IntegerLayer,
    first: usize,
    height: usize,
) -> AddedView {
    let lanes = network.lanes.len();
    let part = |(turns, sums), lines: Vec<String>| IntegerPartView {
        turns,
        lines: lines.into_iter().chain([format!("sum = &sum[{sums}];")]).collect(),
    };
    let output = |at: usize| if at < height { format!("y{at}") } else { "0".to_owned() };
    let pairs: Vec<usize> = (0..network.padded(height)).step_by(2).collect();
    let dual = |sums: usize| {
        let words = network.groups(height);
        let uses = (0..sums).flat_map(|row| (0..words).map(move |word| (row, word)));
        let lines = uses.map(|(row, word)| match lanes {
            4 => format!("sum[{row}] = {prefix}_quad({WORD}, y01, y23, sum[{row}]);"),
            _ => format!(
                "sum[{row}] = __smlad({WORD}, y{}{}, sum[{row}]);",
                2 * word,
                2 * word + 1
            ),
        });
        by_twos(prefix, "next", "v", &lines.collect::<Vec<_>>())
    };
    let portable = |sums: usize| {
        let padded = network.padded(height);
        let rows = (0..sums).map(|row| {
            let products = (0..padded).filter_map(|at| {
                let lane = at / lanes * lanes + network.lanes[at % lanes];
                (lane < height).then(|| format!(" + ((int32_t)next[{}] * y{lane})", row * padded + at))
            });
            format!("sum[{row}] = sum[{row}]{};", products.collect::<String>())
        });
        rows.chain([format!("next = &next[{}];", sums * padded)]).collect()
    };
    let stretches = stretches(last);
    AddedView {
        first: first * last.outputs,
        pairs: pairs
            .iter()
            .map(|at| {
                let (low, high) = (output(*at), output(at + 1));
                // a rectified one has no sign that would reach into the upper half
                let pair = match layer.activation {
                    ActivationCode::Relu => format!("{low} | (int32_t)((uint32_t){high} << 16)"),
                    _ => format!("{prefix}_pair({low}, {high})"),
                };
                format!("const int32_t y{at}{} = {pair};", at + 1)
            })
            .collect(),
        special: match special(network) {
            "DSP" => stretches.iter().map(|s| part(*s, dual(s.1))).collect(),
            _ => Vec::new(),
        },
        portable: stretches.iter().map(|s| part(*s, portable(s.1))).collect(),
    }
}

/// Statements in a block of their own.
fn braced(lines: impl IntoIterator<Item = String>) -> Vec<String> {
    let indented = lines.into_iter().map(|line| format!("    {line}"));
    std::iter::once("{".to_owned())
        .chain(indented)
        .chain(["}".to_owned()])
        .collect()
}

/// Where a statement for [`by_twos`] has its word.
const WORD: &str = "@";

/// Statements that take one word each from `pointer`, which is advanced: two words with one load.
fn by_twos(prefix: &str, pointer: &str, name: &str, uses: &[String]) -> Vec<String> {
    let taken = |at: usize, line: &String| line.replace(WORD, &format!("{name}{at}"));
    let lines = uses.chunks(2).flat_map(|chunk| {
        let load = if chunk.len() == 2 {
            vec![
                format!("int32_t {name}0;"),
                format!("int32_t {name}1;"),
                format!("{prefix}_two(&{pointer}, &{name}0, &{name}1);"),
            ]
        } else {
            vec![format!("const int32_t {name}0 = {prefix}_one(&{pointer});")]
        };
        braced(
            load.into_iter()
                .chain(chunk.iter().enumerate().map(|(at, line)| taken(at, line))),
        )
    });
    lines.collect()
}

fn dsp(prefix: &str, network: &IntegerNetwork, groups: usize, height: usize) -> Vec<String> {
    let is_quad = network.lanes.len() == 4;
    // inputs by two words, too: a group of four, or two groups of two
    let step = if is_quad { 1 } else { 2 };
    let lines = (0..groups).step_by(step).flat_map(|group| {
        let taken = step.min(groups - group);
        let load = if is_quad || taken == 2 {
            vec![
                "int32_t x0;".to_owned(),
                "int32_t x1;".to_owned(),
                format!("{prefix}_two(&in, &x0, &x1);"),
            ]
        } else {
            vec![format!("const int32_t x0 = {prefix}_one(&in);")]
        };
        let sums = (0..taken).flat_map(|x| (0..height).map(move |row| (x, row)));
        let sums = sums.map(|(x, row)| {
            if is_quad {
                format!("s{row} = {prefix}_quad({WORD}, x0, x1, s{row});")
            } else {
                format!("s{row} = __smlad({WORD}, x{x}, s{row});")
            }
        });
        let sums = by_twos(prefix, "w", "w", &sums.collect::<Vec<_>>());
        braced(load.into_iter().chain(sums))
    });
    lines.collect()
}

/// Behind the statements of some groups whose inputs and weights are taken by index.
fn advance(network: &IntegerNetwork, groups: usize, height: usize) -> [String; 2] {
    let inputs = groups * network.lanes.len();
    [format!("in = &in[{inputs}];"), format!("w = &w[{}];", inputs * height)]
}

fn halves(prefix: &str, network: &IntegerNetwork, groups: usize, height: usize) -> Vec<String> {
    let lines = (0..groups).flat_map(|group| {
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
    });
    lines.chain(advance(network, groups, height)).collect()
}

/// Literals of the body of a function over all blocks of a height.
fn assembly(kernel: &Kernel) -> Vec<String> {
    let text = kernel.text(&|registers| format!("{{{registers}}}"));
    text.iter().map(|line| format!("\"{line}\\n\\t\"")).collect()
}

fn portable(network: &IntegerNetwork, groups: usize, height: usize) -> Vec<String> {
    let lanes = network.lanes.len();
    let lines = (0..groups).flat_map(|group| {
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
    });
    lines.chain(advance(network, groups, height)).collect()
}

/// What is left of sum `index`, 32 bits wide; a hidden one fits 16.
fn result(prefix: &str, layer: &IntegerLayer, index: usize) -> String {
    let cut = if layer.shift == 0 {
        format!("s{index}")
    } else {
        format!("s{index} >> {}", layer.shift)
    };
    match layer.activation {
        ActivationCode::Identity => cut,
        ActivationCode::Relu => format!("{prefix}_positive({cut})"),
        ActivationCode::LeakyRelu(_) => format!("{prefix}_leaky_integer({cut}, {})", layer.slope),
        ActivationCode::Tanh => format!("{prefix}_tanh_integer(s{index}, {})", float(layer.unit.single())),
    }
}
