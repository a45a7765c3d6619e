//! askama templates and their view structs: layout only. Every string in a view is already target-language text.

pub mod block;
pub mod c;
pub mod fmu;
pub mod kit;
pub mod sfunction;

pub use askama::{Error, Template};
