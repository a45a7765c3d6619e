//! A controller in C that a build script has generated and compiled. The interface is the one of the Rust controller.
#![no_std]

#[allow(clippy::all)]
pub mod buck12 {
    //! The policy of `examples/buck12`.
    include!(concat!(env!("OUT_DIR"), "/buck12_ffi.rs"));
}
