//! The network in floats: layers, blocks, rows.

use templates::c::{BlockView, LayerView, RealRowView, RealView, VectorView};

use super::statements::float;
use crate::backend::assembly::RealKernel;
use crate::program::{ActivationCode, LayerCode};

/// Functions of the layers and the calls of `q_values`.
pub fn view(name: &str, layers: &[LayerCode], fused: bool) -> RealView {
    let mut view = RealView {
        layers: Vec::new(),
        calls: Vec::new(),
    };
    let (before, streamed) = match layers {
        [before @ .., block, last] if last.is_streamed() => (before, Some((block, last))),
        _ => (layers, None),
    };
    for (index, layer) in before.iter().enumerate() {
        if index + 1 < layers.len() {
            view.calls.push(format!("float hidden{index}[{}];", layer.outputs));
        }
        view.layers.push(whole(name, index, layer, fused));
    }
    let source = |index: usize| match index {
        0 => "observation".to_owned(),
        _ => format!("hidden{}", index - 1),
    };
    let mut calls = Vec::new();
    for index in 0..before.len() {
        let sink = if index + 1 == layers.len() {
            "q".to_owned()
        } else {
            format!("hidden{index}")
        };
        calls.push(format!("{name}_layer{index}({}, {sink});", source(index)));
    }
    if let Some((block, last)) = streamed {
        let pieces = Pieces {
            name,
            fused,
            index: before.len(),
            block,
            last,
        };
        view.layers.extend(pieces.functions());
        view.calls.push(format!("float part[{}];", last.chunk));
        view.calls
            .push(format!("const float *sums = {name}_bias{};", before.len() + 1));
        if pieces.full() > 1 {
            view.calls.push("uint32_t block;".to_owned());
        }
        calls.extend(pieces.calls(&source(before.len())));
    }
    view.calls.extend(calls);
    view
}

/// The last two layers: a block of outputs of the one, then what it adds to the sums of the other.
struct Pieces<'a> {
    name: &'a str,
    fused: bool,
    /// Number of the first of the two.
    index: usize,
    block: &'a LayerCode,
    last: &'a LayerCode,
}

impl Pieces<'_> {
    fn full(&self) -> usize {
        self.last.inputs / self.last.chunk
    }

    /// Sizes of the blocks: the full one, and the shorter last one if there is one.
    fn sizes(&self) -> Vec<usize> {
        let tail = self.last.inputs % self.last.chunk;
        std::iter::once(self.last.chunk)
            .chain((tail > 0).then_some(tail))
            .collect()
    }

    fn functions(&self) -> Vec<LayerView> {
        let Self { name, fused, .. } = *self;
        let sizes = self.sizes().into_iter();
        let pairs = sizes.flat_map(|size| {
            let of_block = Function {
                index: self.index,
                suffix: format!("_{size}"),
                is_piece: true,
                inputs: self.block.inputs,
                outputs: size,
                blocks: vec![(1, size)],
            };
            let of_last = Function {
                index: self.index + 1,
                suffix: format!("_{size}"),
                is_piece: true,
                inputs: size,
                outputs: self.last.outputs,
                blocks: split(self.last),
            };
            [
                of_block.view(name, self.block, fused),
                of_last.view(name, self.last, fused),
            ]
        });
        pairs.collect()
    }

    fn calls(&self, source: &str) -> Vec<String> {
        let Self { name, index, .. } = *self;
        let next = index + 1;
        let (rows, full) = (self.last.chunk, self.full());
        let (weights, out) = (rows * self.block.inputs, rows * self.last.outputs);
        let call = |size: usize, block: &str| {
            [
                format!(
                    "{name}_layer{index}_{size}({source}, part, &{name}_weights{index}[{block}{weights}u], \
                     &{name}_bias{index}[{block}{rows}u]);"
                ),
                format!("{name}_layer{next}_{size}(part, q, &{name}_weights{next}[{block}{out}u], sums);"),
            ]
        };
        let mut lines = Vec::new();
        if full > 1 {
            lines.push(format!("for (block = 0u; block < {full}u; ++block) {{"));
            let inner = call(rows, "block * ").into_iter().chain(["sums = q;".to_owned()]);
            lines.extend(inner.map(|line| format!("    {line}")));
            lines.push("}".to_owned());
        } else {
            lines.extend(call(rows, "0u * "));
            lines.push("sums = q;".to_owned());
        }
        if let [_, tail] = self.sizes()[..] {
            lines.extend(call(tail, &format!("{full}u * ")));
        }
        lines
    }
}

/// Count and rows of the blocks of a layer.
fn split(layer: &LayerCode) -> Vec<(usize, usize)> {
    let (full, tail) = (layer.full_blocks(), layer.tail_rows());
    std::iter::once((full, layer.block_rows))
        .chain((tail > 0).then_some((1, tail)))
        .collect()
}

/// What a function computes of a layer.
struct Function {
    index: usize,
    suffix: String,
    is_piece: bool,
    inputs: usize,
    outputs: usize,
    /// Count and rows.
    blocks: Vec<(usize, usize)>,
}

fn whole(name: &str, index: usize, layer: &LayerCode, fused: bool) -> LayerView {
    let function = Function {
        index,
        suffix: String::new(),
        is_piece: false,
        inputs: layer.inputs,
        outputs: layer.outputs,
        blocks: split(layer),
    };
    function.view(name, layer, fused)
}

impl Function {
    fn view(&self, name: &str, layer: &LayerCode, fused: bool) -> LayerView {
        let extent = if self.is_piece {
            format!(", {} -> {} of them", self.inputs, self.outputs)
        } else {
            String::new()
        };
        LayerView {
            index: self.index,
            function: format!("layer{}{}", self.index, self.suffix),
            is_piece: self.is_piece,
            comment: format!("{}: {} -> {}{extent}", layer.name, layer.inputs, layer.outputs),
            inputs: self.inputs,
            outputs: self.outputs,
            in_memory: layer.in_memory,
            has_vectors: layer.has_vectors,
            has_loop: self.blocks.iter().any(|(count, _)| *count > 1),
            has_assembly: RealKernel::is_for(layer),
            blocks: self
                .blocks
                .iter()
                .map(|(count, rows)| self.block(name, layer, fused, *count, *rows))
                .collect(),
            first: accumulated(name, fused, ["bias[o]", "w[o]", "x[0]"]),
            next: accumulated(name, fused, ["out[o]", "w[o]", "input"]),
            activation: activation(name, layer.activation, "y[o]"),
        }
    }

    fn block(&self, name: &str, layer: &LayerCode, fused: bool, count: usize, rows: usize) -> BlockView {
        BlockView {
            count,
            rows,
            assembly: RealKernel::of(layer, self.inputs, rows)
                .map_or_else(Vec::new, |kernel| assembly(name, layer, &kernel)),
            vectors: if layer.has_vectors {
                LANES.map(|lanes| vectors(name, lanes, rows)).to_vec()
            } else {
                Vec::new()
            },
            row_views: (0..rows).map(|index| row(name, layer, index, fused)).collect(),
        }
    }
}

fn accumulated(prefix: &str, fused: bool, [sum, weight, input]: [&str; 3]) -> String {
    if fused {
        format!("{prefix}_fma({weight}, {input}, {sum})")
    } else {
        format!("{sum} + ({weight} * {input})")
    }
}

/// Floats in a vector: SSE2 and NEON, AVX, AVX-512.
const LANES: [usize; 3] = [4, 8, 16];

/// The sums of a block as vectors of `lanes`, then of four, then as scalars.
fn vectors(name: &str, lanes: usize, rows: usize) -> VectorView {
    let mut view = VectorView {
        lanes,
        start: Vec::new(),
        turn: Vec::new(),
        end: Vec::new(),
    };
    let mut first = 0;
    while first < rows {
        let width = [lanes, 4, 1]
            .into_iter()
            .find(|width| first + width <= rows)
            .unwrap_or(1);
        let kind = if width == 1 {
            "float".to_owned()
        } else {
            format!("{name}_lanes{width}")
        };
        let at = |array: &str, kind: &str, first: usize| {
            if width == 1 {
                format!("{array}[{first}]")
            } else {
                format!("*({kind} *)&{array}[{first}]")
            }
        };
        let constant = format!("const {kind}");
        view.start
            .push(format!("{kind} s{first} = {};", at("bias", &constant, first)));
        view.turn.push(format!(
            "s{first} = s{first} + ({} * input);",
            at("w", &constant, first)
        ));
        view.end.push(format!("{} = s{first};", at("out", &kind, first)));
        first += width;
    }
    view
}

/// One asm statement for a block, then what it leaves of the activation.
fn assembly(name: &str, layer: &LayerCode, kernel: &RealKernel) -> Vec<String> {
    let activated = |row: usize| activation(name, layer.activation, &format!("done[{row}]"));
    let applied = !kernel.relu && !activated(0).is_empty();
    let mut lines = vec![
        "const float *input = x;".to_owned(),
        format!("uint32_t turns = {}u;", kernel.turns()),
    ];
    if kernel.relu {
        lines.push("uint32_t low, high;".to_owned());
    }
    if applied {
        lines.push("float *const done = out;".to_owned());
    }
    lines.push("__asm__ volatile(".to_owned());
    let text = kernel.text(&|operand| format!("%[{operand}]"), &|list| format!("{{{list}}}"));
    lines.extend(text.iter().map(|line| format!("    \"{line}\\n\\t\"")));
    let advanced = ["w", "input", "bias", "out", "turns"].map(|name| format!("[{name}] \"+r\"({name})"));
    let mut outputs = advanced.to_vec();
    if kernel.relu {
        outputs.extend(["low", "high"].map(|name| format!("[{name}] \"=&r\"({name})")));
    }
    lines.push(format!("    : {}", outputs.join(", ")));
    lines.push("    :".to_owned());
    let clobbered = RealKernel::clobbered().into_iter().map(|name| format!("\"{name}\""));
    let clobbered: Vec<String> = clobbered.collect();
    lines.push(format!("    : {}, \"cc\", \"memory\");", clobbered.join(", ")));
    if applied {
        lines.extend((0..kernel.height).map(|row| format!("done[{row}] = {};", activated(row))));
    }
    std::iter::once("{".to_owned())
        .chain(lines.into_iter().map(|line| format!("    {line}")))
        .chain(["}".to_owned()])
        .collect()
}

fn row(name: &str, layer: &LayerCode, index: usize, fused: bool) -> RealRowView {
    let sum = format!("s{index}");
    let activated = activation(name, layer.activation, &sum);
    RealRowView {
        index,
        next: accumulated(name, fused, [sum.as_str(), &format!("w[{index}]"), "input"]),
        result: if activated.is_empty() { sum } else { activated },
    }
}

/// Expression of the activation over `x`; empty for none.
fn activation(name: &str, activation: ActivationCode, x: &str) -> String {
    match activation {
        ActivationCode::Identity => String::new(),
        ActivationCode::Relu => format!("{name}_relu({x})"),
        ActivationCode::LeakyRelu(slope) => format!("{name}_leaky_relu({x}, {})", float(slope.value())),
        ActivationCode::Tanh => format!("{name}_tanh({x})"),
    }
}
