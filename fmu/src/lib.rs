//! An FMU for co-simulation as a converter under control.
//!
//! ```text
//! plant.toml with [fmu] ─► wiring ──────────────┐
//! converter.fmu ─► archive ─► description ──────┼─► FmuConverter, an `Outside` of closed-loop
//!                     └─────► binary, instances ┘
//! ```
//!
//! PLECS, Modelica tools and Simulink write such files (FMI 2.0 and 3.0). An FMU is foreign native code: it runs in this process, with
//! the rights of the user ([why](../docs/decisions/0014-fmu-import.md)).

mod archive;
mod converter;
mod description;
mod instance;
mod log;
mod model;
mod run;
mod state;
mod three;
mod two;
mod units;
mod wiring;

pub use converter::FmuConverter;
pub use description::Version;
pub use log::Tell;
pub use model::{look, look_at_description, open};
