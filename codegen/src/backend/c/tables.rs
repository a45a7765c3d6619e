//! Tables as arrays, and the data of the checks.

use policy::Scalar;
use templates::c::{CrcItem, CrcKind, SelfTestView, Table as TableView};

use super::number::{self, number};
use super::statements::unsigned;
use crate::lower::known_answers::{LCG, SEED, UNIT, VECTORS};
use crate::program::{Element, Literal, Program, Table};

/// Columns up to which literals of a table are gathered in a line.
// a convention: with the indentation within 120
const LINE: usize = 108;

/// A table as C has it: one array.
pub fn view(table: &Table) -> TableView {
    let literal = |value: &Literal| match table.element {
        Element::Float(scalar) => number(scalar, *value),
        Element::Integer { .. } => (value.value() as i64).to_string(),
        Element::Word => format!("0x{:08X}u", value.value() as u32),
    };
    TableView {
        element: element(table.element),
        name: table.name.clone(),
        length: table.values.len(),
        lines: wrap(table.values.iter().map(literal)),
        aligned: table.alignment.is_some(),
    }
}

/// C type of a value.
pub fn element(element: Element) -> &'static str {
    match element {
        Element::Float(scalar) => number::kind(scalar).name,
        Element::Integer { bytes: 1 } => "int8_t",
        Element::Integer { bytes: 2 } => "int16_t",
        Element::Integer { .. } => "int32_t",
        Element::Word => "uint32_t",
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

/// CRC function of tables of this element, in a program of that format.
fn crc(scalar: Scalar, element: Element) -> &'static str {
    match element {
        Element::Float(own) if own == scalar => "crc",
        Element::Integer { bytes: 4 } => "crc_bias",
        // a program has weights of one kind, so the name is taken once
        Element::Float(_) | Element::Integer { .. } | Element::Word => "crc_weights",
    }
}

/// Tables that the CRC covers, in order.
pub fn integrity(program: &Program) -> Vec<CrcItem> {
    let item = |table: &Table| CrcItem {
        function: crc(program.scalar(), table.element),
        table: table.name.clone(),
        length: table.values.len(),
    };
    program.checked_tables().map(item).collect()
}

/// CRC functions that [`integrity`] and the self test call, that of numbers first.
pub fn crc_kinds(program: &Program) -> Vec<CrcKind> {
    let (n, scalar) = (&program.name, program.scalar());
    let mut elements = vec![Element::Float(scalar)];
    for table in program.checked_tables() {
        if !elements.contains(&table.element) {
            elements.push(table.element);
        }
    }
    let kind = |of: Element| CrcKind {
        name: crc(scalar, of),
        element: element(of),
        words: match of {
            Element::Float(own) if own != scalar => vec![format!("{n}_weight_bits(words[i])")],
            Element::Float(Scalar::F32) => vec![format!("{n}_bits(words[i])")],
            Element::Float(Scalar::F64) => vec![
                format!("(uint32_t){n}_bits(words[i])"),
                format!("(uint32_t)({n}_bits(words[i]) >> 32)"),
            ],
            Element::Integer { .. } | Element::Word => vec!["(uint32_t)(int32_t)words[i]".to_owned()],
        },
    };
    elements.into_iter().map(kind).collect()
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
