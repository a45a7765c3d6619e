//! A controller that a build script has generated.
#![no_std]
#![forbid(unsafe_code)]

#[allow(clippy::all)]
pub mod buck12 {
    //! The policy of `examples/buck12`.
    include!(concat!(env!("OUT_DIR"), "/buck12.rs"));
}
