//! Which channels an answer rests on, and which the records hold and nobody compared.
//!
//! A verdict speaks for the channels that were compared. Where one of them stands in the file under a name of its own, or never moves, half
//! of the causes leave no trace, and "explained" would say more than is known.

use serde::Serialize;

use crate::problem::Problem;
use crate::record::{CHANNEL_NAMES, CHANNELS, Record, quantity};

/// The output voltage, without which an answer is always said to be one.
const OUTPUT_VOLTAGE: usize = 0;

/// A channel of a record that was not compared.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Missing {
    /// Record.
    pub record: String,
    /// Channel.
    pub channel: &'static str,
    /// The column that holds it.
    pub column: String,
    /// Whether a column map would mend it; else the column never moves.
    pub by_name: bool,
    /// In words, with what to type.
    pub words: String,
    /// What a column map calls the channel.
    #[serde(skip)]
    pub quantity: &'static str,
}

/// What an answer rests on.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Compared {
    /// Channels that were compared in the training records, as a column map calls them.
    pub channels: Vec<&'static str>,
    /// Channels that the records hold and that were not compared.
    pub missing: Vec<Missing>,
}

/// What the answer to training records and held-out records rests on.
#[must_use]
pub fn of(problem: &Problem, train: &[Record], heldout: &[Record]) -> Compared {
    let shows = |record: &Record, n: usize| match &record.capture {
        Some(capture) => capture.mean(n).is_some(),
        None => record.measured[n].iter().any(|value| value.is_finite()),
    };
    let is_compared = |n: &usize| problem.records.iter().chain(train).any(|record| shows(record, *n));
    let missing = train.iter().chain(heldout).flat_map(|record| {
        record.unread.iter().map(|unread| Missing {
            record: record.name.clone(),
            channel: CHANNEL_NAMES[unread.channel],
            column: unread.column.clone(),
            by_name: unread.by_name,
            words: match unread.by_name {
                true => format!(
                    "column `{0}` of {1} looks like {2} and was not read: --map {2}={0}, or {2} = false in a map file if it is another signal",
                    unread.column,
                    record.name,
                    unread.quantity()
                ),
                false => format!("column `{}` of {} never moves", unread.column, record.name),
            },
            quantity: unread.quantity(),
        })
    });
    Compared {
        missing: missing.collect(),
        channels: (0..CHANNELS).filter(is_compared).map(quantity).collect(),
    }
}

impl Compared {
    /// What stands behind the verdict; nothing where all that the records hold was compared.
    #[must_use]
    pub fn limits(&self) -> String {
        let has_voltage = self.channels.contains(&quantity(OUTPUT_VOLTAGE));
        let mut unread: Vec<&str> = self.missing.iter().map(|one| one.quantity).collect();
        unread.sort_unstable();
        unread.dedup();
        if has_voltage && unread.is_empty() {
            return String::new();
        }
        let alone = match unread.iter().any(|name| self.channels.contains(name)) {
            // in some of the records
            true => String::new(),
            false => format!(" in {} alone", self.channels.join(" and ")),
        };
        let left = match &unread[..] {
            [] => "no record has v_out".to_owned(),
            [one] => format!("{one} was not read"),
            several => format!("{} were not read", several.join(" and ")),
        };
        let records = match alone.is_empty() {
            true => {
                let mut names: Vec<&str> = self.missing.iter().map(|one| one.record.as_str()).collect();
                names.dedup();
                format!(" in {}", names.join(" and "))
            }
            false => String::new(),
        };
        format!("{alone}; {left}{records}")
    }

    /// Whether a column was not read because of its name: the answer leaves out what the user gave.
    #[must_use]
    pub fn leaves_out(&self) -> bool {
        self.missing.iter().any(|one| one.by_name)
    }

    /// A sentence behind the verdict.
    #[must_use]
    pub fn sentence(&self) -> String {
        let limits = self.limits();
        let why: Vec<&str> = self.missing.iter().map(|one| one.words.as_str()).collect();
        match (limits.is_empty(), why.is_empty()) {
            (true, _) => String::new(),
            (false, true) => format!(" This holds{limits}."),
            (false, false) => format!(" This holds{limits}: {}.", why.join("; ")),
        }
    }
}
