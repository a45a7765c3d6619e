//! What a record has: channels, and how many rows at least.

/// Channels: `v_o`, `i_l`, `i_o`, `v_in`.
pub const CHANNELS: usize = 4;
/// Of the load's current among them.
pub const LOAD_CURRENT: usize = 2;
/// Of the source's voltage.
pub const V_IN: usize = 3;
/// Their names.
pub const CHANNEL_NAMES: [&str; CHANNELS] = ["v_o", "i_l", "i_o", "v_in"];
/// What the columns of a table call them.
pub(crate) const QUANTITIES: [&str; CHANNELS] = ["v_out", "i_l", "i_out", "v_in"];
/// Their units.
pub const CHANNEL_UNITS: [&str; CHANNELS] = ["V", "A", "A", "V"];

/// Fewest rows of a record: two unknown initial states and a noise have to come out of it too.
pub(super) const FEWEST: usize = 20;
/// Fewest settled points: two determine a line, so that the third is the first that could disagree.
pub(super) const FEWEST_SETTLED: usize = 3;

/// Rows that are simulated in one go from an estimated state.
pub type Segment = std::ops::Range<usize>;
