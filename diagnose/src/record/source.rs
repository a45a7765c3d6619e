//! Where a quantity of a record comes from.

/// A channel's column.
pub struct Source {
    /// What to call it.
    pub label: String,
    /// Its header in the file.
    pub header: String,
    /// SI units over units of the file.
    pub scale: f64,
    /// The map has a factor for it: the user knows.
    pub stated: bool,
}
