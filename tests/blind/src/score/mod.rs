//! How well a diagnosis found what was hidden.

pub mod closed;
pub mod diagnosis;
pub mod judge;
pub mod statistics;
pub mod table;

pub use closed::{Closed, closed_table};
pub use diagnosis::Diagnosis;
pub use judge::{Judgement, judge};
pub use statistics::{interval, median};
pub use table::table;
