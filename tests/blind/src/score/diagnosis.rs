//! What a scorer reads of `diagnosis.json`.

use std::collections::BTreeMap;

use serde::Deserialize;

/// The answer in a word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The model fits.
    Consistent,
    /// The causes explain the data.
    Explained,
    /// Several explanations do.
    Ambiguous,
    /// The causes explain all but a channel or a record.
    MostlyExplained,
    /// None does.
    Unexplained,
}

/// An answer.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Diagnosis {
    /// In a word.
    pub verdict: Verdict,
    /// Causes, the leading one first.
    #[serde(default)]
    pub causes: Vec<Cause>,
    /// What the extended model gains.
    #[serde(default)]
    pub gain: Gain,
    /// Noise and outliers.
    #[serde(default)]
    pub noise: Noise,
}

/// A named cause.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
pub struct Cause {
    /// Id.
    pub id: String,
    /// Found values by name.
    #[serde(default)]
    pub parameters: BTreeMap<String, Estimate>,
    /// What explains the data as well.
    #[serde(default)]
    pub rivals: Vec<Rival>,
}

/// A found value with its 95 % interval.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Estimate {
    /// Found.
    pub value: f64,
    /// Lower end; open where missing.
    #[serde(default)]
    pub low: Option<f64>,
    /// Upper end; open where missing.
    #[serde(default)]
    pub high: Option<f64>,
}

/// A cause or a combination of causes.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(untagged)]
pub enum Rival {
    /// An id.
    One(String),
    /// Ids that explain the data together.
    Several(Vec<String>),
}

impl Rival {
    /// Its ids.
    #[must_use]
    pub fn ids(&self) -> &[String] {
        match self {
            Rival::One(id) => std::slice::from_ref(id),
            Rival::Several(ids) => ids,
        }
    }
}

/// What was found about the data themselves.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
pub struct Noise {
    /// Rows taken for wrong.
    #[serde(default)]
    pub outliers: Vec<serde_json::Value>,
}

/// Errors before and after.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
pub struct Gain {
    /// Per held-out record and signal.
    #[serde(default)]
    pub heldout: Vec<Heldout>,
}

/// Error of a held-out record.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Heldout {
    /// Path or name of the record.
    pub record: String,
    /// With the given model.
    pub rmse_before: f64,
    /// With the extended one.
    pub rmse_after: f64,
    /// What the diagnosis takes for noise.
    #[serde(default)]
    pub floor: f64,
    /// V, A, or another for a scaled error.
    #[serde(default)]
    pub unit: String,
    /// Column; from the unit where missing.
    #[serde(default)]
    pub channel: Option<String>,
    /// Which rows: `all`, or a regime. The score takes all.
    #[serde(default = "all")]
    pub regime: String,
}

fn all() -> String {
    "all".to_owned()
}
