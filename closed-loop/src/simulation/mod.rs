//! A scenario: a policy over load steps at a simulated converter, with classical controllers and the physical limit beside it.
//!
//! ```text
//! Scenario, Policy ─► Setting::new ─► Setting ─► simulate ─► Findings ─► files, summary
//!                                                   ▲
//!                     the policy's controllers ─────┘ the first counts, others must do the same to the bit
//! ```

mod files;
mod findings;
mod outputs;
mod page;
mod pictures;
mod runs;
mod spread;
mod words;

pub use files::PAGE;
pub use findings::{Check, Findings, POLICY, Setting, Step};
pub use outputs::OutputUse;
pub use runs::simulate;
pub use spread::{Cell, Draws, Spread, Spreads};
pub use words::band_text;
