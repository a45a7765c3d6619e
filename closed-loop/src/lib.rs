//! A simulated converter under control.
//!
//! ```text
//! plant.toml ──► Converter (an Environment) ──┐
//! Policy ──────► Agent (observation, duty) ───┼─► scenario: load steps at many instants ─► Metrics, Finding, Record
//! any FnMut(&Sample) -> duty ─────────────────┘
//! ```

pub mod agent;
pub mod baselines;
mod beyond;
pub mod chatter;
pub mod controller;
pub mod converter;
mod course;
pub mod design;
mod doubtful;
pub mod environment;
mod faults;
mod lead;
pub mod limit;
mod load_step;
mod map;
pub mod outside;
mod part;
pub mod read;
pub mod refit;
mod rest;
pub mod scenario;
mod scenario_file;
pub mod simulation;
mod suits;
mod tables;
pub mod time_optimal;
pub mod transfer;
mod unusable;

pub use agent::Agent;
pub use controller::{
    Answer, Call, Classical, Controller, External, Period, Trajectory, follow, interpreter, interpreter_driving,
};
pub use converter::Converter;
pub use course::{Course, Named, Next, Tell};
pub use doubtful::doubts;
pub use environment::{Environment, LoadPath, Start};
pub use faults::Error;
pub use load_step::{LoadKind, LoadStep};
pub use map::{DecisionMap, MapAxis, decision_map, decision_map_of};
pub use rest::{RestMap, rest_map};
pub use scenario_file::Scenario;
pub use simulation::band_text;
pub use suits::{driving, held_by, holds_power, reaches, suits, v_ref};
pub use tables::{
    AT_REST, COLUMNS, MetricsCsv, at_rest, cells, comparison, digits, evaluation_csv, limit_cells, limits, rest_cells,
    table, time_digits, trajectory_csv,
};
pub use unusable::unusable;
