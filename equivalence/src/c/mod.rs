//! The emitted C: read and walked through.

mod condition;
mod controller;
mod execute;
mod parse;
mod syntax;
mod tokens;
mod unit;
mod values;

pub(crate) use controller::C;
pub(crate) use unit::{Unit, defined};
