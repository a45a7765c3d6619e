//! Tables, layers and the data of the checks.

use templates::c::{BlockView, LayerView, Member, SelfTestView, Table};

use super::statements::{float, unsigned};
use crate::crc::nibble_table;
use crate::lower::known_answers::{LCG, SEED, UNIT, VECTORS};
use crate::lower::network::{TANH_DENOMINATOR, TANH_NUMERATOR};
use crate::program::{ActivationCode, LayerCode, Literal, Program};

/// Columns up to which literals of a table are gathered in a line.
const LINE: usize = 108;

/// All constant tables in the order of the file.
pub fn tables(program: &Program) -> Vec<Table> {
    let mut all = Vec::new();
    for (index, layer) in program.layers.iter().enumerate() {
        all.push(floats(format!("weights{index}"), &layer.table));
        all.push(floats(format!("bias{index}"), &layer.bias));
    }
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

/// A table of floats.
pub fn floats(name: String, values: &[f32]) -> Table {
    Table {
        element: "float",
        name,
        length: values.len(),
        lines: wrap(values.iter().map(|value| float(*value))),
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
    }
}

fn wrap(literals: impl Iterator<Item = String>) -> Vec<String> {
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
pub fn layers(program: &Program) -> Vec<LayerView> {
    let last = program.layers.len() - 1;
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
        blocks: blocks(layer),
        activation: activation(&program.name, layer.activation),
        source: if index == 0 {
            "observation".to_owned()
        } else {
            buffer(index - 1)
        },
        sink: buffer(index),
        is_hidden: index != last,
    };
    program.layers.iter().enumerate().map(view).collect()
}

fn blocks(layer: &LayerCode) -> Vec<BlockView> {
    let full = layer.full_blocks();
    let rows = layer.block_rows;
    let block = |count, rows, first_output| BlockView {
        count,
        rows,
        first_output,
        first_weight: first_output * layer.inputs,
        stride: rows * layer.inputs,
    };
    let tail = layer.tail_rows();
    let mut views = vec![block(full, rows, 0)];
    if tail > 0 {
        views.push(block(1, tail, full * rows));
    }
    views
}

fn activation(name: &str, activation: ActivationCode) -> String {
    match activation {
        ActivationCode::Identity => String::new(),
        ActivationCode::Relu => format!("{name}_relu(y[o])"),
        ActivationCode::LeakyRelu(slope) => format!("{name}_leaky_relu(y[o], {})", float(slope.value())),
        ActivationCode::Tanh => format!("{name}_tanh(y[o])"),
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
pub fn integrity(program: &Program) -> Vec<(String, usize)> {
    let mut items = Vec::new();
    for (index, layer) in program.layers.iter().enumerate() {
        items.push((format!("weights{index}"), layer.table.len()));
        items.push((format!("bias{index}"), layer.bias.len()));
    }
    items.push(("duties".into(), program.duties.len()));
    items
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
