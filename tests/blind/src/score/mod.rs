//! How well a diagnosis found what was hidden.

pub mod diagnosis;
pub mod judge;
pub mod statistics;
pub mod table;

pub use diagnosis::Diagnosis;
pub use judge::{Judgement, judge};
pub use table::table;
