//! What a training found, as data for programs: the figures of `seeds.txt` and of the best seed's evaluation, unrounded.

use closed_loop::scenario::{Finding, Metrics};
use serde::Serialize;

use crate::judge::{Judged, overall};
use crate::outcome::Outcome;
use crate::score::Score;
use crate::seeds::SeedRun;
use crate::settings::Settings;
use crate::trainer::Ended;
use crate::verdict::{Verdict, missed};

/// All seeds, and the evaluation of the best one. Figures that are not finite are null in JSON.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Whether the best seed's evaluation meets the specification; `None` without a specification.
    pub met: Option<bool>,
    /// The limits that the best seed's evaluation misses, the one that is exceeded most first.
    pub missed: Vec<Verdict>,
    /// The seed that goes out ([`crate::seeds::best`]); `None` before the first look.
    pub best_seed: Option<u64>,
    /// Of all seeds together.
    pub control_periods: u64,
    /// In the order of the training file.
    pub seeds: Vec<Seed>,
    /// The best seed's, load step by load step.
    pub evaluation: Vec<Evaluated>,
    /// The best seed's on the converters of `[[spread]]`; left out without one.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub spread: Vec<Elsewhere>,
    /// Of the law alone that the best seed's policy adds to, on all converters; left out without a law.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub law_alone: Option<Score>,
}

/// An evaluation on another converter than that of the plant's file.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Elsewhere {
    /// What is other, in words.
    pub converter: String,
    /// Against the specification of the converter.
    pub score: Score,
    /// Load step by load step.
    pub evaluation: Vec<Evaluated>,
}

/// One seed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Seed {
    /// Its number.
    pub seed: u64,
    /// Why it stopped.
    pub ended: Ended,
    /// Control periods so far.
    pub control_periods: u64,
    /// Its best policy; `None` before the first look.
    pub kept: Option<Kept>,
}

/// The best policy of a seed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Kept {
    /// Control periods after which it was found.
    pub after: u64,
    /// On the selection scenarios.
    pub selection: Score,
    /// On the evaluation scenarios.
    pub evaluation: Score,
    /// Largest figures of its evaluation.
    pub worst: Worst,
}

/// Largest figures over all load steps and instants.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Worst {
    /// V.
    pub deviation: f64,
    /// s.
    pub settling: f64,
    /// V.
    pub tail_max: f64,
}

/// One load step of the evaluation.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Evaluated {
    /// Load before the step.
    pub from: f64,
    /// Load after it.
    pub to: f64,
    /// Unit of both.
    pub unit: &'static str,
    /// Worst of the sampling instants.
    pub sample: Metrics,
    /// Worst of all instants.
    pub worst: Metrics,
}

impl Worst {
    /// Of an evaluation.
    #[must_use]
    pub fn of(findings: &[Finding]) -> Self {
        let largest = |figure: fn(&Metrics) -> f64| {
            let figures = findings.iter().map(|finding| figure(&finding.worst));
            figures.fold(0.0, f64::max)
        };
        Self {
            deviation: largest(|metrics| metrics.deviation),
            settling: largest(|metrics| metrics.settling),
            tail_max: largest(|metrics| metrics.tail_max),
        }
    }
}

impl Summary {
    /// Of runs in the order of the seeds of `settings`; `best` is one of their outcomes.
    #[must_use]
    pub fn new(settings: &Settings, runs: &[SeedRun], best: Option<&Outcome>) -> Self {
        let seeds = settings.seeds.iter().zip(runs);
        let met = best.map(|best| best.evaluated.met);
        Self {
            met: met.filter(|_| !settings.specification.is_empty()),
            missed: best.map_or_else(Vec::new, |best| missed(best.verdicts()).into_iter().cloned().collect()),
            best_seed: best.map(|best| best.seed),
            control_periods: runs.iter().map(|run| run.steps).sum(),
            seeds: seeds.map(|(seed, run)| Seed::of(*seed, run)).collect(),
            evaluation: best.map_or_else(Vec::new, |best| best.findings.iter().map(evaluated).collect()),
            spread: best.map_or_else(Vec::new, |best| best.judged.iter().skip(1).map(elsewhere).collect()),
            law_alone: best.filter(|best| !best.law.is_empty()).map(|best| overall(&best.law)),
        }
    }
}

impl Seed {
    fn of(seed: u64, run: &SeedRun) -> Self {
        Self {
            seed,
            ended: run.ended,
            control_periods: run.steps,
            kept: run.outcome.as_ref().map(|outcome| Kept {
                after: outcome.best_step,
                selection: outcome.selected,
                evaluation: outcome.evaluated,
                worst: Worst::of(&outcome.findings),
            }),
        }
    }
}

fn elsewhere(judged: &Judged) -> Elsewhere {
    Elsewhere {
        converter: judged.place.clone(),
        score: judged.score,
        evaluation: judged.findings.iter().map(evaluated).collect(),
    }
}

fn evaluated(finding: &Finding) -> Evaluated {
    let [from, to] = finding.load_step;
    Evaluated {
        from,
        to,
        unit: finding.kind.unit(),
        sample: finding.at_sample,
        worst: finding.worst,
    }
}
