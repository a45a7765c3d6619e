//! What a simulation gets wrong, why, a better model, and the gain.

pub mod attribute;
pub mod causes;
pub mod columns;
pub mod csv;
pub mod diagnosis;
pub mod drive;
pub mod extend;
pub mod fit;
pub mod gain;
pub mod next;
pub mod noise;
pub mod page;
mod parallel;
pub mod problem;
pub mod profile;
pub mod record;
pub mod shape;
mod spectrum;
