//! DC-DC converters (buck, boost, buck-boost): switched and averaged, with the effects that make a bench differ from a simulation.
//!
//! ```
//! use plant::{Load, Parameters, Plant};
//!
//! let mut plant = Plant::new(&Parameters::paper_model())?;
//! let load = Load::power(200.0);
//! let settled = plant.settle(100.0, &load);
//! let sample = plant.step(settled.duty, &load);
//! assert!((sample.v_out - 100.0).abs() < 1e-3);
//! # Ok::<(), plant::Faults>(())
//! ```
//!
//! - [`Parameters`] say what the converter is made of, [`effects`] what each of them means and may be.
//! - [`Plant::step`] goes from sampling instant to sampling instant, [`Batch`] does so for many plain converters at once.
//! - [`Parameters::from_toml`] reads a `plant.toml`.
//!
//! No function of the machine's libm is used but the square root, which is exact; the exponential is that of the libm crate, which is
//! Rust. Equal input gives equal bits on every machine.

mod batch;
mod catalogue;
mod check;
mod effects;
mod entry;
mod full;
mod gates;
mod lag;
mod lane;
mod legs;
mod parameters;
mod plain;
mod plant;
mod rate;
mod reader;
mod sensing;
mod settle;
mod signals;
mod surroundings;
mod topology;
mod walk;
mod waveform;

pub use batch::Batch;
pub use catalogue::{effects, parameter, parameters};
pub use check::{check, check_load};
pub use entry::{Effect, Parameter, Way};
pub use full::steps_per_period;
pub use parameters::{
    Cable, Capacitor, Carrier, Converter, Empirical, Inductor, LoadBox, Model, Parameters, Pwm, Rectifier, Sensor,
    Sensors, ShortPulse, Source, Switch, Topology,
};
pub use plant::{Plant, PlantState};
pub use rate::Pace;
pub use reader::REQUIRED;
pub use settle::{Regulator, Rest, Settled};
pub use signals::{Load, Sample, Signals};
pub use surroundings::Surroundings;
pub use toml_input::{Fault, Faults, Place};
pub use waveform::Waveform;
