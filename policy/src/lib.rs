//! The contract of a trained policy.
#![doc = ""]
pub mod model;
pub use model::*;
