//! Input files: TOML in which every value knows its place, and faults that say where and what to do.
//!
//! A reader asks a [`Table`] for its keys and a [`Value`] for what it should be. What is wrong is collected, not
//! first-come: a reader that returns nothing has left a [`Fault`] in the [`Sink`]. Keys that nobody asked for are faults as
//! well.
//!
//! ```
//! use std::path::Path;
//! use toml_input::{Document, Faults, Sink, Table};
//!
//! struct Step {
//!     at: f64,
//!     load: f64,
//! }
//!
//! struct Scenario {
//!     plant: String,
//!     periods: u32,
//!     steps: Vec<Step>,
//! }
//!
//! fn scenario(document: &Document) -> Result<Scenario, Faults> {
//!     document.read(|root, faults| {
//!         let hint = "the converter: `plant = \"plant.toml\"`";
//!         let plant = root.required("plant", hint, faults).and_then(|v| v.text(faults));
//!         let periods = root.with_default("periods", 1000, faults, |v, faults| v.integer(1..=1_000_000, faults));
//!         let steps = root.sections("step", faults, step);
//!         Some(Scenario { plant: plant?.to_owned(), periods, steps })
//!     })
//! }
//!
//! fn step(table: &mut Table<'_>, faults: &mut Sink) -> Option<Step> {
//!     let at = table.required("at", "time of the step, s", faults).and_then(|v| v.positive(faults));
//!     let load = table.required("load", "power, W", faults).and_then(|v| v.number_within(0.0..=1e4, faults));
//!     Some(Step { at: at?, load: load? })
//! }
//!
//! let text = "plant = \"buck.toml\"\n[[step]]\nat = 0.01\nload = 500\n";
//! let read = scenario(&Document::from_text(Path::new("steps.toml"), text)?)?;
//! assert_eq!((read.plant.as_str(), read.periods), ("buck.toml", 1000));
//! assert_eq!((read.steps[0].at, read.steps[0].load), (0.01, 500.0));
//!
//! let text = text.replace("load = 500", "loads = 500");
//! let faults = scenario(&Document::from_text(Path::new("steps.toml"), &text)?).err().unwrap();
//! assert_eq!(faults.list.len(), 2); // `load` is missing, and:
//! assert_eq!(
//!     faults.list[1].to_string(),
//!     "\
//! error: unknown key `loads` in [[step]]
//!  --> steps.toml:4:1
//!   |
//! 4 | loads = 500
//!   | ^^^^^
//!   = expected: one of at, load
//!   = hint: did you mean `load`?
//! "
//! );
//! # Ok::<(), Faults>(())
//! ```
//!
//! [`Document::open`] reads a file; [`FileName`] and [`Source`] are its parts for readers that must find files first.
//! A fault that is not among the [`messages`] is made as a [`Message`] and placed by [`Value::fault`],
//! [`Table::fault`] or [`FileName::fault`].

mod document;
mod fault;
mod files;
pub mod messages;
mod nearest;
mod node;
mod sink;
#[cfg(feature = "snippets")]
mod snippets;
mod source;
mod table;
mod value;

pub use document::{Document, MAX_SYNTAX_FAULTS, MAX_TOML_BYTES};
pub use fault::{Fault, Faults, Message, Place};
pub use files::Files;
pub use nearest::{did_you_mean, nearest};
pub use node::At;
pub use sink::Sink;
pub use source::{FileName, Origin, Source, Span};
pub use table::Table;
pub use value::Value;
