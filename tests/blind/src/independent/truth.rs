//! What `truth.json` of an independent case says.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// What kind of case it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Family {
    /// The plant file is right.
    Healthy,
    /// One thing is wrong with it.
    Cause,
    /// The same, and one channel is disturbed in a way that no plant file states.
    Disturbed,
    /// Something went wrong between bench and file.
    Bench,
    /// The records are none of a converter.
    Nonsense,
    /// Physics that no plant file states.
    Unlisted,
    /// Two things are wrong with the plant file, in long records.
    Pair,
}

impl Family {
    /// All, in the order of the score.
    pub const ALL: [Family; 7] = [
        Family::Healthy,
        Family::Cause,
        Family::Disturbed,
        Family::Bench,
        Family::Nonsense,
        Family::Unlisted,
        Family::Pair,
    ];

    /// As in `--only`.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Family::Healthy => "healthy",
            Family::Cause => "cause",
            Family::Disturbed => "disturbed",
            Family::Bench => "bench",
            Family::Nonsense => "nonsense",
            Family::Unlisted => "unlisted",
            Family::Pair => "pair",
        }
    }
}

/// A case and what is true of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Truth {
    /// `independent`: the generator.
    pub world: String,
    /// Seed of the set.
    pub seed: u64,
    /// Number in the set.
    pub case: usize,
    /// Kind of the case.
    pub family: Family,
    /// The converter in words.
    pub converter: String,
    /// What is hidden; nothing in a healthy case.
    pub hidden: Vec<Hidden>,
    /// What a right answer is.
    pub expect: Expect,
    /// Squared distance of the noise-free training records from those of the plant file, in units of the noise.
    pub chi2: f64,
    /// The least that any one listed cause leaves of it; `chi2` where nobody looked.
    pub chi2_listed: f64,
    /// Listed causes that leave next to nothing: the data do not tell them from what is hidden.
    pub ties: Vec<Tie>,
    /// What a perfect model could gain in held-out records.
    pub records: Vec<Reducible>,
}

/// Something hidden.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Hidden {
    /// Id: of the diagnosis' list, or of this generator.
    pub id: String,
    /// Whether a plant file can state it.
    pub listed: bool,
    /// How it is wired and how large it is.
    pub what: String,
    /// Values by name.
    pub parameters: BTreeMap<String, f64>,
    /// The channel that it disturbs.
    pub channel: Option<String>,
    /// Squared distance that it makes by itself.
    pub chi2: f64,
}

/// What a right answer is.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Expect {
    /// Verdicts that are right.
    pub verdicts: Vec<String>,
    /// Causes that may be named; empty: none may.
    pub causes: Vec<String>,
    /// One of `causes` has to be named.
    pub must_name: bool,
    /// The channel that may be set aside.
    pub set_aside: Option<String>,
    /// Refusing the files is right.
    pub refusal: bool,
    /// Groups of words; an answer, note or message with all of a group names the fault.
    pub words: Vec<Vec<String>>,
    /// What would be wrong beside it, in words.
    pub wrong: String,
}

/// A listed cause that the data cannot tell from the truth.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Tie {
    /// Id.
    pub id: String,
    /// How it would be wired.
    pub wiring: String,
    /// What it leaves, in units of the noise's variance.
    pub left: f64,
}

/// Error of a held-out column, split into what a model can explain and what it cannot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Reducible {
    /// File name without extension.
    pub record: String,
    /// Channel.
    pub channel: String,
    /// Root mean square of noise and rounding.
    pub floor: f64,
    /// Root mean square distance of the noise-free record from that of the plant file.
    pub reducible: f64,
}
