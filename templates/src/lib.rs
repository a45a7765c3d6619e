//! askama templates and their view structs: layout only. Every string in a view is already target-language text.

pub mod c;
pub mod kit;

pub use askama::{Error, Template};
