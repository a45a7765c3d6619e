//! What a training on the extended model starts from, and what it was worth.
//!
//! ```text
//!   Diagnosis ─► plan ─► corrections ─► contract::corrected   policy.toml with the sensors' errors taken out
//!                   │    the files ───► settings::moved       train.toml on the extended plant
//!                   └──► plants of the tie ─┐
//!   policies, old and new ──────────────────┴─► judged        the closed loop on each of them
//! ```
//!
//! An error of a sensor is no business of a network: it goes into the contract, where it stays readable. All else that was found goes
//! into the plant that the network learns on. The training itself is the caller's.

pub mod contract;
pub mod judged;
pub mod settings;

use std::collections::BTreeSet;

use plant::Parameters;
use serde::Serialize;

use crate::diagnosis::Diagnosis;
use crate::extend::{as_plant, extended_plant};
use crate::findings::Verdict;
use crate::fit::Fit;

/// Signals whose sensors may be off, by their names in plants and contracts.
const SIGNALS: [&str; 4] = ["v_out", "i_l", "i_out", "v_in"];

/// An error of a sensor that was found: it shows `gain` times the signal, and `offset` more.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Correction {
    /// The signal in the contract.
    pub signal: &'static str,
    /// Shown over true, 1.
    pub gain: f64,
    /// What is shown at 0, in `unit`.
    pub offset: f64,
    /// V or A.
    pub unit: &'static str,
}

impl Correction {
    /// In words.
    #[must_use]
    pub fn words(&self) -> String {
        let Correction {
            signal,
            gain,
            offset,
            unit,
        } = self;
        format!("{signal} is shown {gain:.5} times as large, and {offset:.4} {unit} more")
    }
}

/// Another member of a tie.
#[derive(Debug, Clone)]
pub struct Rival {
    /// Its causes, such as `r_ds_on`.
    pub causes: String,
    /// The plant if it is the one that is true.
    pub plant: Parameters,
}

/// What is trained on.
#[derive(Debug, Clone)]
pub struct Plan {
    /// The extended model.
    pub plant: Parameters,
    /// What else it may be: no reason to train on, but to look at.
    pub rivals: Vec<Rival>,
    /// What goes into the contract.
    pub corrections: Vec<Correction>,
}

/// Why there is nothing to train on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Refusal {
    /// The model is right: the policy was trained on it.
    Nothing,
    /// Nothing explains the records: a policy would learn an error by heart.
    Unexplained,
    /// Explanations that want different things of the contract.
    Tie(String),
}

impl Refusal {
    /// In a sentence.
    #[must_use]
    pub fn words(&self) -> String {
        match self {
            Refusal::Nothing => "The model agrees with the records: there is nothing to train anew for.".to_owned(),
            Refusal::Unexplained => {
                "No cause explains the records: a policy that is trained on this model learns its error by heart."
                    .to_owned()
            }
            Refusal::Tie(words) => words.clone(),
        }
    }
}

/// What to train on after this diagnosis.
///
/// # Errors
/// Where no cause is named, or the members of a tie want different things: one says that a sensor is off, another that the
/// converter is.
pub fn plan(diagnosis: &Diagnosis) -> Result<Plan, Refusal> {
    match diagnosis.findings.verdict {
        Verdict::Consistent => return Err(Refusal::Nothing),
        Verdict::Unexplained => return Err(Refusal::Unexplained),
        Verdict::Explained | Verdict::Ambiguous | Verdict::MostlyExplained => {}
    }
    let attribution = &diagnosis.attribution;
    // a step of a converter is read off, and no cause beside it: the plant has it all the same
    let own = attribution
        .best
        .as_ref()
        .map_or_else(BTreeSet::new, |best| sensors(diagnosis, best));
    let name = |fit: &Fit| {
        let ids: Vec<&str> = fit.causes.iter().map(|cause| attribution.id(*cause)).collect();
        ids.join(" + ")
    };
    let mut rivals: Vec<Rival> = Vec::new();
    for rival in attribution.rivals.iter().flatten() {
        let causes = name(rival);
        if sensors(diagnosis, rival) != own {
            let best = attribution.best.as_ref().map_or_else(String::new, name);
            return Err(Refusal::Tie(format!(
                "{best} and {causes} explain the records as well as each other. One takes the error for a sensor's, which belongs into the \
                 contract, the other for the converter's, which a policy has to learn: what is trained on the wrong one is worse than before."
            )));
        }
        if rivals.iter().all(|known| known.causes != causes) {
            let model = &rival.state.model;
            let trim = rival.state.starts.trim_or_none(model.plant.converter.f_sw);
            rivals.push(Rival {
                causes,
                plant: as_plant(model, trim),
            });
        }
    }
    let plant = extended_plant(diagnosis);
    Ok(Plan {
        corrections: corrections(&plant, &own),
        rivals,
        plant,
    })
}

/// The signals whose gain or offset a fit moves.
fn sensors(diagnosis: &Diagnosis, fit: &Fit) -> BTreeSet<&'static str> {
    let candidates = &diagnosis.attribution.candidates;
    let knobs = fit.causes.iter().flat_map(|cause| candidates[*cause].form.knobs);
    let keys = knobs.flat_map(|knob| knob.keys);
    keys.filter_map(|key| {
        let (signal, what) = key.strip_prefix("sensors.")?.split_once('.')?;
        let known = SIGNALS.iter().find(|known| **known == signal)?;
        ["gain", "offset"].contains(&what).then_some(*known)
    })
    .collect()
}

/// The numbers of a plant whose sensors show these signals as they are, by key.
#[must_use]
pub fn true_sensors(signals: &[&'static str]) -> Vec<(String, f64)> {
    let of = |signal: &&str| {
        [("gain", 1.0), ("offset", 0.0)].map(|(what, value)| (format!("sensors.{signal}.{what}"), value))
    };
    signals.iter().flat_map(of).collect()
}

fn corrections(plant: &Parameters, signals: &BTreeSet<&'static str>) -> Vec<Correction> {
    let number = |signal: &str, what: &str| {
        let key = format!("sensors.{signal}.{what}");
        plant::parameter(&key).map(|parameter| (parameter.get(plant), parameter.unit))
    };
    let of = |signal: &&'static str| {
        let ((gain, _), (offset, unit)) = (number(signal, "gain")?, number(signal, "offset")?);
        Some(Correction {
            signal,
            gain,
            offset,
            unit,
        })
    };
    signals.iter().filter_map(of).collect()
}
