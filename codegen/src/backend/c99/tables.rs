//! Tables, layers and the data of the checks.

use templates::c::{BlockView, CrcItem, CrcKind, LayerView, Member, RealRowView, SelfTestView, Table};

use super::integer;
use super::statements::{float, unsigned};
use crate::backend::assembly::RealKernel;
use crate::crc::nibble_table;
use crate::lower::known_answers::{LCG, SEED, UNIT, VECTORS};
use crate::lower::network::{TANH_DENOMINATOR, TANH_NUMERATOR};
use crate::program::{ActivationCode, LayerCode, Literal, NetworkCode, Program};

/// Columns up to which literals of a table are gathered in a line.
const LINE: usize = 108;

/// All constant tables in the order of the file.
pub fn tables(program: &Program) -> Vec<Table> {
    let mut all = match &program.network {
        NetworkCode::Real { layers, .. } => real_tables(layers),
        NetworkCode::Integer(network) => integer::tables(network),
    };
    let duties: Vec<f32> = program.duties.iter().map(|duty| duty.value()).collect();
    all.push(floats("duties".into(), &duties));
    all.push(words("crc_steps", &nibble_table()));
    all.push(words("answers", &program.self_test.answers));
    let column = |pick: fn(&(Literal, Literal)) -> Literal| -> Vec<f32> {
        program
            .self_test
            .observation_box
            .iter()
            .map(|range| pick(range).value())
            .collect()
    };
    all.push(floats("box_low".into(), &column(|range| range.0)));
    all.push(floats("box_width".into(), &column(|range| range.1)));
    all
}

fn real_tables(layers: &[LayerCode]) -> Vec<Table> {
    let tables = layers.iter().enumerate().map(|(index, layer)| {
        [
            floats(format!("weights{index}"), &layer.table),
            floats(format!("bias{index}"), &layer.bias),
        ]
    });
    tables.flatten().collect()
}

/// A table of floats.
pub fn floats(name: String, values: &[f32]) -> Table {
    Table {
        element: "float",
        name,
        length: values.len(),
        lines: wrap(values.iter().map(|value| float(*value))),
        aligned: false,
    }
}

/// A table of 32-bit words.
pub fn words(name: &str, values: &[u32]) -> Table {
    let literals = values.iter().map(|word| format!("0x{word:08X}u"));
    Table {
        element: "uint32_t",
        name: name.to_owned(),
        length: values.len(),
        lines: wrap(literals),
        aligned: false,
    }
}

pub(super) fn wrap(literals: impl Iterator<Item = String>) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for literal in literals {
        match lines.last_mut() {
            Some(line) if line.len() + literal.len() + 2 <= LINE => {
                line.push(' ');
                line.push_str(&literal);
                line.push(',');
            }
            _ => lines.push(literal + ","),
        }
    }
    lines
}

/// Layers with their loops and buffers.
pub fn layers(name: &str, layers: &[LayerCode], fused: bool) -> Vec<LayerView> {
    let last = layers.len() - 1;
    let buffer = |index: usize| {
        if index == last {
            "q".to_owned()
        } else {
            format!("hidden{index}")
        }
    };
    let view = |(index, layer): (usize, &LayerCode)| LayerView {
        index,
        comment: format!("{}: {} -> {}", layer.name, layer.inputs, layer.outputs),
        inputs: layer.inputs,
        outputs: layer.outputs,
        in_memory: layer.in_memory,
        has_loop: layer.full_blocks() > 1,
        has_assembly: has_assembly(layer, fused),
        blocks: blocks(name, layer, fused),
        first: accumulated(name, fused, ["bias[o]", "w[o]", "x[0]"]),
        next: accumulated(name, fused, ["sum[o]", "column[o]", "input"]),
        activation: activation(name, layer.activation, "y[o]"),
        source: if index == 0 {
            "observation".to_owned()
        } else {
            buffer(index - 1)
        },
        sink: buffer(index),
        is_hidden: index != last,
    };
    layers.iter().enumerate().map(view).collect()
}

fn accumulated(prefix: &str, fused: bool, [sum, weight, input]: [&str; 3]) -> String {
    if fused {
        format!("{prefix}_fma({weight}, {input}, {sum})")
    } else {
        format!("{sum} + ({weight} * {input})")
    }
}

fn blocks(name: &str, layer: &LayerCode, fused: bool) -> Vec<BlockView> {
    let full = layer.full_blocks();
    let rows = layer.block_rows;
    let block = |count, rows, first_output| BlockView {
        count,
        rows,
        first_output,
        first_weight: first_output * layer.inputs,
        assembly: if has_assembly(layer, fused) {
            assembly(name, layer, rows)
        } else {
            Vec::new()
        },
        row_views: (0..rows).map(|index| row(name, layer, index, fused)).collect(),
    };
    let tail = layer.tail_rows();
    let mut views = vec![block(full, rows, 0)];
    if tail > 0 {
        views.push(block(1, tail, full * rows));
    }
    views
}

/// Whether the blocks of a layer have a form in assembly.
pub fn has_assembly(layer: &LayerCode, fused: bool) -> bool {
    !fused && !layer.in_memory && layer.block_rows <= RealKernel::MAX_HEIGHT
}

/// One asm statement for a block, then what it leaves of the activation.
fn assembly(name: &str, layer: &LayerCode, height: usize) -> Vec<String> {
    let kernel = RealKernel {
        inputs: layer.inputs,
        height,
        relu: layer.activation == ActivationCode::Relu,
    };
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
        lines.extend((0..height).map(|row| format!("done[{row}] = {};", activated(row))));
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

/// Horner steps of numerator and denominator, each one rounding per operation.
pub fn tanh_steps() -> Vec<Member> {
    let mut steps = Vec::new();
    for (letter, terms) in [('p', TANH_NUMERATOR), ('q', TANH_DENOMINATOR)] {
        for (power, term) in terms.iter().enumerate().rev() {
            let value = match power {
                4 => float(*term),
                _ => format!("({letter}{} * z) + {}", power + 1, float(*term)),
            };
            steps.push(Member {
                declaration: format!("{letter}{power}"),
                comment: value,
            });
        }
    }
    steps
}

/// Tables that the CRC covers, in the order of [`Program::table_words`].
pub fn integrity(program: &Program) -> Vec<CrcItem> {
    let (weights, bias) = match program.network {
        NetworkCode::Real { .. } => ("crc", "crc"),
        NetworkCode::Integer(_) => ("crc_weights", "crc_bias"),
    };
    let mut items: Vec<CrcItem> = tables(program)
        .into_iter()
        .filter_map(|table| {
            let function = if table.name.starts_with("weights") {
                weights
            } else if table.name.starts_with("bias") {
                bias
            } else {
                return None;
            };
            Some(CrcItem {
                function,
                table: table.name,
                length: table.length,
            })
        })
        .collect();
    items.push(CrcItem {
        function: "crc",
        table: "duties".into(),
        length: program.duties.len(),
    });
    items
}

/// CRC functions that [`integrity`] and the self test call.
pub fn crc_kinds(program: &Program) -> Vec<CrcKind> {
    let mut kinds = vec![CrcKind {
        name: "crc",
        element: "float",
        word: format!("{}_bits(words[i])", program.name),
    }];
    if let NetworkCode::Integer(network) = &program.network {
        let word = "(uint32_t)(int32_t)words[i]";
        for (name, element) in [("crc_weights", integer::element(network)), ("crc_bias", "int32_t")] {
            kinds.push(CrcKind {
                name,
                element,
                word: word.into(),
            });
        }
    }
    kinds
}

/// Constants of the self test.
pub fn self_test() -> SelfTestView {
    SelfTestView {
        vectors: VECTORS,
        seed: unsigned(SEED),
        multiplier: unsigned(LCG.0),
        increment: unsigned(LCG.1),
        unit: float(UNIT),
    }
}
