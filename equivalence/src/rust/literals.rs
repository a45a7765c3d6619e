//! Literals and operators of the emitted Rust.

use syn::{BinOp, Expr, Lit, UnOp};

use super::unit::scalar;
use crate::machine::{Binary, Kind, Machine, Number, Wrong};

/// A literal takes the type of its suffix, else that of its neighbour.
pub(super) fn literal(machine: &Machine<'_>, literal: &Lit, hint: Option<Kind>) -> Result<Number, Wrong> {
    match literal {
        Lit::Int(digits) => {
            let kind = if digits.suffix().is_empty() {
                hint
            } else {
                scalar(digits.suffix())
            };
            let value: u64 = digits.base10_parse().map_err(|_| "an integer beyond 64 bits")?;
            match kind {
                Some(kind @ Kind::Integer { bits, .. }) if value <= crate::term::mask(bits) => {
                    Ok(machine.integer(value, kind))
                }
                _ => Err(format!("the integer {value} without a type")),
            }
        }
        Lit::Float(digits) => {
            let kind = if digits.suffix().is_empty() {
                hint
            } else {
                scalar(digits.suffix())
            };
            match kind {
                Some(Kind::Float(format)) => machine.decimal(digits.base10_digits(), format),
                // the only numbers with a point around the network are those of the format
                None => machine.decimal(digits.base10_digits(), machine.float.format),
                Some(_) => Err("a decimal number where an integer is needed".into()),
            }
        }
        Lit::Bool(value) => Ok(machine.truth(machine.terms.truth(value.value))),
        _ => Err("a literal that is no number".into()),
    }
}

/// The operation, and whether its result is assigned to the left side.
pub(super) fn operator(op: &BinOp) -> Option<(Binary, bool)> {
    Some(match op {
        BinOp::Add(_) => (Binary::Add, false),
        BinOp::Sub(_) => (Binary::Sub, false),
        BinOp::Mul(_) => (Binary::Mul, false),
        BinOp::Div(_) => (Binary::Div, false),
        BinOp::BitAnd(_) => (Binary::And, false),
        BinOp::BitOr(_) => (Binary::Or, false),
        BinOp::BitXor(_) => (Binary::Xor, false),
        BinOp::Shl(_) => (Binary::Shl, false),
        BinOp::Shr(_) => (Binary::Shr, false),
        BinOp::Lt(_) => (Binary::Less, false),
        BinOp::Le(_) => (Binary::LessOrEqual, false),
        BinOp::Gt(_) => (Binary::Greater, false),
        BinOp::Ge(_) => (Binary::GreaterOrEqual, false),
        BinOp::Eq(_) => (Binary::Equal, false),
        BinOp::Ne(_) => (Binary::NotEqual, false),
        BinOp::AddAssign(_) => (Binary::Add, true),
        BinOp::SubAssign(_) => (Binary::Sub, true),
        BinOp::MulAssign(_) => (Binary::Mul, true),
        BinOp::BitAndAssign(_) => (Binary::And, true),
        BinOp::BitOrAssign(_) => (Binary::Or, true),
        BinOp::BitXorAssign(_) => (Binary::Xor, true),
        _ => return None,
    })
}

/// A number without a suffix, with its sign.
pub(super) fn is_literal(expr: &Expr) -> bool {
    match expr {
        Expr::Lit(literal) => match &literal.lit {
            Lit::Int(digits) => digits.suffix().is_empty(),
            Lit::Float(digits) => digits.suffix().is_empty(),
            _ => false,
        },
        Expr::Unary(unary) => matches!(unary.op, UnOp::Neg(_)) && is_literal(&unary.expr),
        Expr::Paren(inner) => is_literal(&inner.expr),
        _ => false,
    }
}
