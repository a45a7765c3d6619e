//! Settled points, and how a table of them is to be read.

use measured::ColumnMap;
use serde::Serialize;

use crate::formula::Losses;

/// The columns of a plan that say what shall be measured; beside the measurement they are no surprise.
pub(crate) const PLAN_COLUMNS: [&str; 4] = ["point", "duty", "load", "hold"];

/// One settled point of a converter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Point {
    /// Line of the file, from 1.
    pub line: usize,
    /// Commanded duty ratio, 0..1.
    pub d_real: f64,
    /// Output voltage, V.
    pub v_out: f64,
    /// Load current, A.
    pub i_out: f64,
    /// Input voltage, V.
    pub v_in: f64,
    /// The simulation that the policy was trained on.
    pub simulation: Losses,
    /// Whether the point had settled, as far as the table says so.
    pub settled: bool,
}

impl Point {
    /// The duty ratio with which the simulation has the same voltage at the same load current.
    #[must_use]
    pub fn d_sim(&self) -> f64 {
        self.simulation.d_real(self.v_out / self.simulation.v_in, self.i_out)
    }

    /// What a unit of d_sim is worth in the simulation at this load current, V.
    #[must_use]
    pub fn v_per_duty(&self) -> f64 {
        self.simulation.v_per_duty(self.i_out)
    }

    /// Measured voltage minus that of the simulation at the same duty ratio, V.
    #[must_use]
    pub fn without_v(&self) -> f64 {
        (self.d_sim() - self.d_real) * self.v_per_duty()
    }
}

/// The settled points of one converter.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Table {
    /// At least one, in the order of the file.
    pub points: Vec<Point>,
    /// Lines whose measurement is still to come: `d_real`, `v_out`, `i_out` and `v_in` are all empty.
    pub open: Vec<usize>,
    /// What a reader of the table should know.
    pub notes: Vec<String>,
}

/// How a table is read.
#[derive(Debug, Clone, Default)]
pub struct TableOptions {
    /// Where the quantities stand.
    pub columns: ColumnMap,
    /// Unsettled points are left out instead of refused.
    pub skip_unsettled: bool,
    /// The simulation that the policy was trained on; without it a loss-free one at the input voltage of each point, as in
    /// the paper.
    pub simulation: Option<Losses>,
    /// The table is still being filled in: too few points, or too equal ones, are no fault.
    pub partial: bool,
}

/// `line 3` or `lines 3, 4`.
pub(crate) fn lines(lines: &[usize]) -> String {
    let list: Vec<String> = lines.iter().map(usize::to_string).collect();
    let s = if lines.len() == 1 { "" } else { "s" };
    format!("line{s} {}", list.join(", "))
}
