//! Tables, layers and the data of the checks.

use templates::c::{CrcItem, CrcKind, Member, SelfTestView, Table};

use policy::Scalar;

use super::integer;
use super::number::{self, number};
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
        NetworkCode::Real { scalar, layers, .. } => real_tables(*scalar, layers),
        NetworkCode::Integer(network) => integer::tables(network),
    };
    let scalar = program.scalar();
    all.push(numbers("duties".into(), scalar, program.duties.iter().copied()));
    all.push(words("crc_steps", &nibble_table()));
    all.push(words("answers", &program.self_test.answers));
    let ranges = || program.self_test.observation_box.iter();
    all.push(numbers("box_low".into(), scalar, ranges().map(|range| range.0)));
    all.push(numbers("box_width".into(), scalar, ranges().map(|range| range.1)));
    all
}

/// Weights stay binary32 in either format; sums start with a bias.
fn real_tables(scalar: Scalar, layers: &[LayerCode]) -> Vec<Table> {
    let tables = layers.iter().enumerate().map(|(index, layer)| {
        [
            Table {
                aligned: layer.alignment.is_some(),
                ..floats(format!("weights{index}"), &layer.table)
            },
            numbers(
                format!("bias{index}"),
                scalar,
                layer.bias.iter().map(|b| Literal::nearest(scalar, f64::from(*b))),
            ),
        ]
    });
    tables.flatten().collect()
}

/// A table of numbers of the format.
pub fn numbers(name: String, scalar: Scalar, values: impl ExactSizeIterator<Item = Literal>) -> Table {
    Table {
        element: number::kind(scalar).name,
        name,
        length: values.len(),
        lines: wrap(values.map(|value| number(scalar, value))),
        aligned: false,
    }
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
pub fn tanh_steps(scalar: Scalar) -> Vec<Member> {
    let mut steps = Vec::new();
    for (letter, terms) in [('p', TANH_NUMERATOR), ('q', TANH_DENOMINATOR)] {
        for (power, term) in terms.iter().enumerate().rev() {
            let term = number(scalar, Literal::nearest(scalar, *term));
            let value = match power {
                4 => term,
                _ => format!("({letter}{} * z) + {term}", power + 1),
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
        NetworkCode::Real {
            scalar: Scalar::F64, ..
        } => ("crc_weights", "crc"),
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
    let n = &program.name;
    let kind = number::kind(program.scalar());
    let word = format!("{n}_bits(words[i])");
    let mut kinds = vec![CrcKind {
        name: "crc",
        element: kind.name,
        words: if kind.is_wide {
            vec![format!("(uint32_t){word}"), format!("(uint32_t)({word} >> 32)")]
        } else {
            vec![word]
        },
    }];
    let of_type = |name: &'static str, element: &'static str, word: String| CrcKind {
        name,
        element,
        words: vec![word],
    };
    match &program.network {
        NetworkCode::Real {
            scalar: Scalar::F64, ..
        } => {
            kinds.push(of_type("crc_weights", "float", format!("{n}_weight_bits(words[i])")));
        }
        NetworkCode::Real { .. } => {}
        NetworkCode::Integer(network) => {
            let word = || "(uint32_t)(int32_t)words[i]".to_owned();
            kinds.push(of_type("crc_weights", integer::element(network), word()));
            kinds.push(of_type("crc_bias", "int32_t", word()));
        }
    }
    kinds
}

/// Constants of the self test.
pub fn self_test(scalar: Scalar) -> SelfTestView {
    SelfTestView {
        vectors: VECTORS,
        seed: unsigned(SEED),
        multiplier: unsigned(LCG.0),
        increment: unsigned(LCG.1),
        unit: number(scalar, Literal::nearest(scalar, UNIT)),
    }
}
