//! What can be wrong with the data of a chart or a table.

use std::fmt;

/// Why a chart or page cannot be drawn. The data are the caller's, so each variant names the part by its own label.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum ReportError {
    /// Nothing to draw: no value at all, or none that is finite (and positive, on a logarithmic axis).
    Empty {
        /// Label of the series, chart or axis.
        what: String,
    },
    /// Lists that belong together differ in length.
    Lengths {
        /// Label of the series, table or grid.
        what: String,
        /// Length the first list asks for.
        expected: usize,
        /// Length found.
        found: usize,
    },
    /// An axis range that is not finite, not ascending, or not positive on a logarithmic axis.
    Range {
        /// Label of the axis.
        axis: String,
        /// Lower end as given.
        low: f64,
        /// Upper end as given.
        high: f64,
    },
    /// Grid positions or levels that do not ascend strictly.
    Order {
        /// Label of the axis.
        axis: String,
    },
}

impl fmt::Display for ReportError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Empty { what } => write!(f, "`{what}` has no value that can be drawn"),
            Self::Lengths { what, expected, found } => {
                write!(f, "`{what}` needs {expected} values in each list, found {found}")
            }
            Self::Range { axis, low, high } => write!(f, "axis `{axis}` cannot run from {low} to {high}"),
            Self::Order { axis } => write!(f, "positions on `{axis}` must be finite and ascend strictly"),
        }
    }
}

impl std::error::Error for ReportError {}
