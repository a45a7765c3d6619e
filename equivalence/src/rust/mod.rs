//! The emitted Rust: read and walked through.

mod calls;
mod controller;
mod execute;
mod literals;
mod unit;

pub(crate) use controller::Rust;
pub(crate) use unit::Unit;
