//! Tables, layers and the data of the checks.

use templates::c::{CrcItem, CrcKind, Member, SelfTestView, Table};

use super::integer;
use super::statements::{float, unsigned};
use crate::crc::nibble_table;
use crate::lower::known_answers::{LCG, SEED, UNIT, VECTORS};
use crate::lower::network::{TANH_DENOMINATOR, TANH_NUMERATOR};
use crate::program::{LayerCode, Literal, NetworkCode, Program};

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
            Table {
                aligned: layer.alignment.is_some(),
                ..floats(format!("weights{index}"), &layer.table)
            },
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
