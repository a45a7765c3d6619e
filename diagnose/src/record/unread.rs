//! Columns of a channel that the model predicts and that no fit is compared with.

use super::channels::{CHANNELS, QUANTITIES};

/// The output voltage, the current of the inductor and that of the load: what a model predicts whatever its source is.
const PREDICTED: [usize; 3] = [0, 1, 2];
/// A load current stands still with the load, and is not missed then.
const MAY_REST: usize = 2;

/// A channel that stands in a record and is not compared.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Unread {
    /// Which channel.
    pub channel: usize,
    /// The column's name.
    pub column: String,
    /// Whether it was not read because of its name; else it never moves.
    pub by_name: bool,
}

impl Unread {
    /// A column that looks like a quantity; nothing if that is no channel that the model predicts.
    pub(super) fn looks_like(quantity: &str, column: &str) -> Option<Self> {
        let channel = (0..CHANNELS).find(|n| QUANTITIES[*n] == quantity)?;
        PREDICTED.contains(&channel).then(|| Unread {
            channel,
            column: column.to_owned(),
            by_name: true,
        })
    }

    /// A column that never moves.
    pub(super) fn stuck(channel: usize, column: &str) -> Option<Self> {
        (PREDICTED.contains(&channel) && channel != MAY_REST).then(|| Unread {
            channel,
            column: column.to_owned(),
            by_name: false,
        })
    }

    /// What a column map calls the channel.
    #[must_use]
    pub fn quantity(&self) -> &'static str {
        quantity(self.channel)
    }
}

/// What a column map calls a channel.
#[must_use]
pub fn quantity(channel: usize) -> &'static str {
    QUANTITIES[channel]
}
