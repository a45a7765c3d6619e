//! What a simulation gets wrong: measured records in, the cause of the discrepancy named, a better model out.
//!
//! ```no_run
//! use std::path::Path;
//! use diagnose::{diagnosis::diagnose, extend::extended_toml, record::Record};
//! use measured::ColumnMap;
//!
//! let model = plant::Parameters::from_file(Path::new("plant.toml"))?;
//! let open = |file: &str| Record::open(Path::new(file), &ColumnMap::default(), &model);
//! let found = diagnose(&model, vec![open("a.csv")?], &[open("b.csv")?], &|what| eprintln!("{what:?}"));
//! println!("{}\n{}", found.findings.sentence, extended_toml(&found));
//! # Ok::<(), plant::Faults>(())
//! ```
//!
//! The way: [`record`] (from a table that `measured` read) and [`drive`] make simulated rows of a model, [`problem`] a
//! least-squares problem with initial states as unknowns, [`fit`] moves the parameters of [`causes`], [`attribute`]
//! chooses among them, [`profile`], [`shape`], [`gain`] and [`next`] say how sure that is, [`control`] what it is worth under control, [`diagnosis`] holds the
//! answer and [`extend`] and [`page`] write it down. [`retrain`] is what a policy makes of it. A [`capture`] is a record whose residuals come from inside a period. See docs/reference/diagnosis.md.

mod aside;
pub mod attribute;
mod backward;
mod balance;
pub mod basis;
pub mod beside;
pub mod capture;
pub mod causes;
mod clocks;
mod coloured;
pub mod compared;
pub mod control;
mod counters;
pub mod diagnosis;
mod doubts;
pub mod drive;
mod duty_steps;
pub mod empirical;
mod exact;
mod examine;
pub mod extend;
pub mod fast;
pub mod findings;
pub mod fit;
mod flicker;
pub mod gain;
mod held_out;
mod held_table;
pub mod ideal;
mod in_front;
mod inside;
mod instants;
mod judge;

mod left_open;
mod left_out;
mod level;
mod median;
pub mod next;
pub mod noise;
mod normal;
pub mod page;
mod parallel;
pub mod played;
pub mod preflight;
pub mod problem;
pub mod profile;
pub mod progress;
mod quantised;
pub mod record;
pub mod resistors;
pub mod results;
pub mod retrain;
mod rising;
pub mod rivals;
mod sampling;
mod search;
pub mod shape;
mod sides;
mod slopes;
mod small;
mod spectrum;
pub mod supply;
mod taken_out;
pub mod ties;
pub mod timing;
mod unseen;
mod unsure_levels;
pub mod whiteness;
mod words;
mod work;
pub mod worth;
