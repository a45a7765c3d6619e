//! What a diagnosis finds, as it is written to `diagnosis.json`.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::capture::estimates::Estimates;
use crate::compared::Compared;
use crate::gain::{Held, Shift};
use crate::rivals::RivalValue;
use crate::shape::Structure;
use crate::whiteness::Driven;
use crate::worth::Worth;

/// The answer in a word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The model explains the data.
    Consistent,
    /// Named causes explain the rest, and nothing else does.
    Explained,
    /// Causes explain the rest, and others would as well.
    Ambiguous,
    /// Causes explain all but one channel or one record.
    MostlyExplained,
    /// None of the known causes does.
    Unexplained,
}

impl Verdict {
    /// As in `diagnosis.json`.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Verdict::Consistent => "consistent",
            Verdict::Explained => "explained",
            Verdict::Ambiguous => "ambiguous",
            Verdict::MostlyExplained => "mostly_explained",
            Verdict::Unexplained => "unexplained",
        }
    }
}

/// A value with its 95 % interval.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Value {
    /// Best value.
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// SI unit.
    pub unit: &'static str,
    /// The model's own value.
    pub model: f64,
}

/// How sure a cause is.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Evidence {
    /// Chi-square lost without it, over the scatter of the noise.
    pub delta_chi2: f64,
    /// What one cause must reach.
    pub threshold: f64,
}

/// A named cause.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Named {
    /// Which.
    pub id: &'static str,
    /// In words.
    pub words: &'static str,
    /// Its parameters.
    pub parameters: BTreeMap<&'static str, Value>,
    /// How sure.
    pub evidence: Evidence,
    /// What would explain the data as well in its place; each a set of ids.
    pub rivals: Vec<Vec<&'static str>>,
    /// The values that each of `rivals` needs, in the same order.
    pub rival_values: Vec<Vec<RivalValue>>,
}

/// A cause that the records cannot show unless it is large.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Hidden {
    /// Which.
    pub id: &'static str,
    /// Parameter.
    pub parameter: &'static str,
    /// Smallest change that would be seen; nothing if none within the reach would.
    pub smallest: Option<f64>,
    /// Largest change that is tried: a cause beyond it is another converter.
    pub reach: f64,
    /// SI unit.
    pub unit: &'static str,
}

/// Noise and what was left out.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Noise {
    /// Standard deviation of each measured channel.
    pub sigma: BTreeMap<&'static str, f64>,
    /// Scatter of sums over that of independent noise: noise shared among records or correlated in time.
    pub inflation: f64,
    /// Rows left out, as `record:row:channel`.
    pub outliers: Vec<String>,
    /// What was repaired or assumed in each record.
    pub repairs: Vec<String>,
    /// Duty that the gate's edges seem to add, 1: within the accuracy of a model of ideal edges, no cause.
    pub trim: f64,
}

/// What the extension is worth.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Gain {
    /// Held-out errors.
    pub heldout: Vec<Held>,
    /// Mean square over that of the noise, all held-out records: before and after.
    pub mean_square: [f64; 2],
    /// Held-out records that the extended model fits much worse than the training records.
    pub shifts: Vec<Shift>,
    /// Closed loop with a policy, if one was given.
    pub closed_loop: Option<crate::control::ClosedLoop>,
    /// Why it is missing although one was given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub closed_loop_missing: Option<String>,
    /// A policy that was trained anew on the extended model, if that was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub retrained: Option<crate::retrain::judged::Retrained>,
    /// Why there is none although it was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub retrained_missing: Option<String>,
}

/// What was set aside because nothing on the list explains it, while causes explain all the rest.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Aside {
    /// The channel, of all records.
    pub channel: Option<&'static str>,
    /// Or the record, with all channels.
    pub record: Option<String>,
    /// Its errors without and with the causes, which no fit has seen.
    pub errors: Vec<Worth>,
}

impl Aside {
    /// Its name.
    #[must_use]
    pub fn name(&self) -> &str {
        self.channel.or(self.record.as_deref()).unwrap_or_default()
    }
}

/// What is written to `diagnosis.json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Findings {
    /// The answer.
    pub verdict: Verdict,
    /// The same in a sentence.
    pub sentence: String,
    /// Which channels it rests on.
    pub compared: Compared,
    /// Named causes; empty if none is needed or none explains the data.
    pub causes: Vec<Named>,
    /// What explains part of it where the verdict is `unexplained`.
    pub partial: Vec<Named>,
    /// What that part would gain.
    pub partial_gain: Vec<Worth>,
    /// What the verdict `mostly_explained` leaves out.
    pub set_aside: Option<Aside>,
    /// A term that describes what is left and explains nothing of it.
    pub empirical: Option<crate::empirical::Empirical>,
    /// Structure that is left.
    pub structure: Vec<Structure>,
    /// How well each channel of the training records is fitted, and whether the rest is noise.
    pub residuals: Vec<Driven>,
    /// Why causes are no explanation although they leave no structure, in words.
    pub doubts: Vec<String>,
    /// Causes that would have to be large to be seen.
    pub not_detectable: Vec<Hidden>,
    /// Experiments that would separate what is tied.
    pub next_experiments: Vec<crate::next::Experiment>,
    /// What was read off captures.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub captures: Vec<Estimates>,
    /// Noise.
    pub noise: Noise,
    /// Held-out gain.
    pub gain: Gain,
}

impl Findings {
    /// The verdict with what it does not speak for: `explained in i_l alone; v_out was not read`.
    #[must_use]
    pub fn headline(&self) -> String {
        format!("{}{}", self.verdict.word(), self.compared.limits())
    }
}
