//! A policy in words, for people.

mod formula;
mod sections;

pub use formula::{expression, formula};
pub use sections::{actions, digests, head, hull, limits, mapping, network, observation, observers, range, signals};
