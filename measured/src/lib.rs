//! The one reader of measurements: files of `drm`, `diagnose` and the recorded traces of `verify`.
//!
//! ```text
//! bytes ──► Sheet::parse ──► Sheet ──► Sheet::locate(quantities, map) ──► Located: signals in SI units
//!           csv, ...         columns of values with places               what is left over is named
//! ```
//!
//! A [`Sheet`] is what every file format is read into: columns of numbers that know their line and column in the file.
//! [`VOCABULARY`] names the quantities (`v_out`, `duty`, `t`, ...) with their short forms, a [`ColumnMap`] says where
//! they stand in a table that names them otherwise, and [`Sheet::locate`] finds them, with the unit behind the name
//! (`v_out [mV]`, `t_us`) turned into SI. What is wrong is a [`Fault`](toml_input::Fault) with file, line and column.
//! What only one reader of measurements can suspect, such as a voltage that a buck converter does not have, is no
//! business of this crate. The format for users: docs/reference/measurements.md.
//!
//! ```
//! use std::path::Path;
//! use measured::{ColumnMap, Options, Sheet, VOCABULARY};
//!
//! let text = "t_ms;v_o [mV];lamp\n0,5;1500;on\n0,6;1600;off\n";
//! let sheet = Sheet::parse(Path::new("run.csv"), text.as_bytes().to_vec(), &Options::default())?;
//! let located = sheet.locate(&VOCABULARY, &ColumnMap::default())?;
//! let v_out = located.signal("v_out").unwrap();
//! assert_eq!(v_out.number(&sheet, 1), Some(1.6));
//! assert_eq!(located.notes(&sheet, &[]), ["decimal commas read as points", "column not used: `lamp`"]);
//! # Ok::<(), toml_input::Faults>(())
//! ```
//!
//! To add a file format: a file beside `csv` that makes a [`Sheet`] with [`Sheet::numbered`], and its arm in `format`.

mod csv;
mod format;
mod guess;
mod locate;
mod logged;
mod map;
mod mat;
mod mdf;
mod metered;
mod newer;
mod quantity;
mod sheet;
mod signal;
mod time_like;

pub use format::Options;
pub use guess::{argument, proposal};
pub use locate::Located;
pub use map::{ColumnMap, DutyIs, Sampled};
pub use metered::is_metered;
pub use quantity::{Quantity, VOCABULARY};
pub use sheet::{Cell, Column, Sheet, table_faults};
pub use signal::Signal;
