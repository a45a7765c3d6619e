//! What a simulation gets wrong, why, a better model, and the gain.

pub mod columns;
pub mod csv;
pub mod record;
pub mod causes;
pub mod drive;
pub mod fit;
mod parallel;
pub mod problem;
pub mod attribute;
pub mod noise;
mod spectrum;
pub mod diagnosis;
pub mod extend;
pub mod gain;
pub mod next;
pub mod page;
pub mod profile;
pub mod shape;
