//! View of the back-to-back kit.

use askama::Template;

use crate::c::{Common, Table};

/// A controller that the kit drives.
#[derive(Debug, Clone)]
pub struct Subject {
    /// Prefix of its functions and types.
    pub name: String,
    /// Prefix of its macros.
    pub upper: String,
    /// Moves and expected answers.
    pub events: Table,
    /// Number of moves as C text.
    pub event_count: String,
    /// Number of control steps.
    pub steps: u32,
    /// Assignments that fill the measurement.
    pub measurement: Vec<String>,
    /// Words that they read.
    pub measurement_words: usize,
    /// Comparisons of the command.
    pub answer: Vec<String>,
    /// Comparison of the rest of the answer, and the way to the next move.
    pub rest: Vec<String>,
    /// The network for an observation, and the comparison of its Q values.
    pub network: Vec<String>,
    /// Checksum over the state.
    pub state_crc: String,
    /// Numbers in the state, before its two counters, as a literal.
    pub state_numbers: String,
    /// The mappings that can be set.
    pub mappings: Vec<Settable>,
    /// Lengths of the slices in which the tables are checked.
    pub slices: Vec<Slices>,
    /// What the sum of checksums is multiplied by before the next one, as a literal.
    pub slice_weight: String,
}

/// A length of slices of the integrity check.
#[derive(Debug, Clone)]
pub struct Slices {
    /// Numbers of a slice, as a literal.
    pub length: String,
    /// Weighted sum of the checksums behind all slices, as a literal.
    pub sum: String,
}

/// A mapping whose coefficients a move sets.
#[derive(Debug, Clone)]
pub struct Settable {
    /// First word of the move, as a literal.
    pub kind: String,
    /// Function that sets it, without the prefix.
    pub function: String,
    /// What is compared, for the report.
    pub what: String,
    /// Words of its coefficients.
    pub words: usize,
    /// Declarations of locals that hold them.
    pub locals: Vec<String>,
    /// The same as arguments.
    pub arguments: String,
}

/// `<name>_kit.c`
#[derive(Debug, Template)]
#[template(path = "kit/kit.c.jinja", escape = "none")]
pub struct Kit {
    /// Names of the kit itself and banner.
    pub common: Common,
    /// Name of the controller under test.
    pub controller: String,
    /// Rows of the table of arithmetic.
    pub probe_lines: Vec<String>,
    /// Number of rows.
    pub probe_count: usize,
    /// A third, as the probes divide by it.
    pub third: String,
    /// Constants as literals.
    pub literals: Table,
    /// The same as bits.
    pub literal_bits: Table,
    /// Whole text of each controller of the construct suite.
    pub suite: Vec<String>,
    /// The same, in the order in which they are driven.
    pub suite_subjects: Vec<Subject>,
    /// The policy's controller.
    pub policy_subject: [Subject; 1],
}
