//! A second world of blind cases, written from physics and from the bench alone.
//!
//! ```text
//!   draw (a converter) ──► causes, odd (what is hidden) ──► records (what is done) ──► simulate ──► instruments
//!        │                                                                                             │
//!        └── files: plant.toml                       ties: what else would show the same ◄──── tables ─┤
//!                                                                                        faults ◄──────┘
//! ```
//!
//! It knows of a plant file what its reference page says, and of the diagnosis its command line and its answer. Circuit, devices,
//! cores, dielectrics and instruments have parameters of their own. Nothing here may be taken from the crates `plant` and `diagnose`.

mod algebra;
mod bench;
mod board;
mod causes;
mod circuit;
mod draft;
mod draw;
mod families;
mod faults;
mod files;
mod gates;
mod instruments;
mod intervals;
mod judge;
mod odd;
mod pairs;
#[cfg(test)]
mod physics;
mod program;
mod records;
mod set;
mod simulate;
mod survey;
mod tally;
mod ties;
mod truth;

pub use draft::Case;
pub use judge::{Answer, Judgement, Outcome, judge};
pub use set::{Set, make};
pub use survey::{Group, Surveyed, surveyed};
pub use tally::{json, markdown};
pub use truth::{Expect, Family, Hidden, Reducible, Tie, Truth};
