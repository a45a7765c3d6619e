//! Self-contained SVG charts and HTML pages. Knows nothing of what it shows, writes no file.
//!
//! [`Chart`] draws series in panels over a shared x axis. [`Page`] puts charts, tables and text into one HTML file
//! without fonts or anything loaded. A page with charts has one script, which is this crate's: values under the pointer, zoom, series
//! that come and go. Where it does not run the pictures say the same, and a policy in the page lets no other run.
//!
//! The same input gives the same bytes on every machine: places are rounded to a tenth of a pixel, logarithms come from
//! a library in plain Rust, order is the caller's, and there is no clock. Long series are thinned to what one column of
//! pixels can show; the extremes of each column stay.
//!
//! Pictures bring their own white background and an Okabe-Ito palette, so they can be read on a dark page and with any
//! colour vision.

mod alt;
mod axis;
mod bars;
mod chart;
mod colour;
mod command;
mod error;
mod font;
mod frame;
mod heat;
mod live;
mod marks;
mod markup;
mod number;
mod page;
mod path;
mod series;
mod table;

pub use axis::Axis;
pub use bars::{BarChart, BarPanel};
pub use chart::{Chart, Panel};
pub use colour::{Colour, Ramp};
pub use command::{CommandLine, made};
pub use error::ReportError;
pub use frame::Svg;
pub use heat::HeatMap;
pub use number::{bytes, grouped, quantity};
pub use page::{Page, Section, Verdict};
pub use series::Series;
pub use table::{Cell, Table};
