//! The paper's procedure, from the simulation to converters that are not the simulated one: control them without a mapping,
//! acquire settled points, fit the mapping, control them with it.
//!
//! ```text
//! Scenario, Policy ─► Setting ─► transfer ─► Findings ─► files, summary
//!                                   ▲
//!  files of real converters, Means ─┘ what simulates them, what runs the policy
//! ```

mod files;
mod findings;
mod ideal;
mod pictures;
mod runs;

pub use files::PAGE;
pub use findings::{Findings, Means, Real, Run, Setting};
pub use runs::transfer;
