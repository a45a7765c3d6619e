//! Inner loops in ARM assembly: the same text for C and Rust, behind a switch of the build, with the bits of the loops they
//! stand for.
//!
//! Nothing here decides anything about a layer: a kernel is what a block of the program's loops says, written for a core.
//! `real` and `integer` hold the instructions, `c` and `rust` what a language wraps around them.

#[cfg(feature = "c")]
pub mod c;
pub mod integer;
pub mod real;
pub mod rust;
