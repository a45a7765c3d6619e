//! `train.toml`: everything a training needs to know, in one file.

mod read;
mod spread;

use std::path::{Path, PathBuf};

use crate::faults::Error;
use crate::learner::LearnerSettings;
use closed_loop::scenario::Task;
use toml_input::{Document, Faults};

pub use spread::Spread;

/// A training, as its file says. Defaults are those of the paper (arXiv 2110.10490) and its authors' code.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Where the settings were read from.
    pub file: PathBuf,
    /// The plant's file, found from the folder of the settings.
    pub plant: PathBuf,
    /// Numbers of the plant's file that are replaced, by key (`pwm.duty_delay`).
    pub set: Vec<(String, f64)>,
    /// The contract, a `policy.toml` whose weights need not exist yet.
    pub contract: PathBuf,
    /// One training each.
    pub seeds: Vec<u64>,
    /// Control periods of training at most.
    pub steps: u64,
    /// Stop as soon as the selection scenarios meet the specification.
    pub early_stop: bool,
    /// Widths of the hidden layers.
    pub hidden: Vec<usize>,
    /// The algorithm.
    pub learning: Learning,
    /// What a control period is worth.
    pub reward: Reward,
    /// The course of an episode.
    pub episode: Episode,
    /// Loads of the beginning; the last stage is followed by `episode.loads`.
    pub curriculum: Vec<Stage>,
    /// Plant parameters drawn anew for each episode.
    pub randomise: Vec<Randomised>,
    /// Other converters on which a policy has to hold, in selection and evaluation.
    pub spread: Vec<Spread>,
    /// Which checkpoint is kept.
    pub selection: Selection,
    /// What the kept one is reported with.
    pub evaluation: Task,
    /// What a good policy does.
    pub specification: Vec<Requirement>,
    /// SHA-256 of the file's text, hexadecimal: a checkpoint belongs to one text.
    pub digest: String,
}

/// Exploration, replay and learner.
#[derive(Debug, Clone, PartialEq)]
pub struct Learning {
    /// Network update.
    pub learner: LearnerSettings,
    /// Adam's step size at the beginning.
    pub learning_rate: f64,
    /// Adam's step size at the end of the budget; linear between.
    pub final_learning_rate: f64,
    /// Transitions kept.
    pub replay: usize,
    /// Control periods before the first update.
    pub warm_up: u64,
    /// Updates per control period.
    pub updates_per_step: usize,
    /// Probability of a random action at the start.
    pub epsilon_start: f64,
    /// The same from `epsilon_steps` on.
    pub epsilon_end: f64,
    /// Control periods from start to end, linear.
    pub epsilon_steps: u64,
}

impl Learning {
    /// Probability of a random action in control period `step`.
    #[must_use]
    pub fn epsilon(&self, step: u64) -> f64 {
        let share = (step as f64 / self.epsilon_steps.max(1) as f64).min(1.0);
        self.epsilon_start + (self.epsilon_end - self.epsilon_start) * share
    }

    /// Adam's step size in control period `step` of `steps`.
    #[must_use]
    pub fn rate(&self, step: u64, steps: u64) -> f64 {
        let share = (step as f64 / steps.max(1) as f64).min(1.0);
        self.learning_rate + (self.final_learning_rate - self.learning_rate) * share
    }
}

/// The paper's reward: the first band that holds |e|, less a part in proportion to |e|.
#[derive(Debug, Clone, PartialEq)]
pub struct Reward {
    /// Voltage to hold, V.
    pub v_ref: f64,
    /// `(|e| at most, reward)`, narrowest first; strictly below in the first as the paper prints it makes no difference.
    pub bands: Vec<(f64, f64)>,
    /// beta3: taken off per volt of |e|.
    pub error_weight: f64,
    /// Taken off per unit of duty change.
    pub duty_change_weight: f64,
}

impl Reward {
    /// Reward of a control period that ended with the output at `v_out` and changed the duty by `duty_change`.
    #[must_use]
    pub fn of(&self, v_out: f64, duty_change: f64) -> f64 {
        // the paper prints a signed error with a weight of -10, which would reward an error
        let error = (v_out - self.v_ref).abs();
        let band = self
            .bands
            .iter()
            .find(|(within, _)| error <= *within)
            .map_or(0.0, |(_, reward)| *reward);
        band - self.error_weight * error - self.duty_change_weight * duty_change.abs()
    }
}

/// Where constant power loads come from, W.
#[derive(Debug, Clone, PartialEq)]
pub struct Loads {
    /// Drawn with probability `share`, each as likely as the others.
    pub values: Vec<f64>,
    /// Drawn otherwise, uniform.
    pub range: [f64; 2],
    /// Probability of one of `values`.
    pub share: f64,
}

/// The course of an episode.
#[derive(Debug, Clone, PartialEq)]
pub struct Episode {
    /// Control periods; an episode is cut short there, not terminated.
    pub steps: u64,
    /// Control periods between changes of the load.
    pub load_every: u64,
    /// The loads.
    pub loads: Loads,
    /// A load changes anywhere in a period instead of at the sampling instant.
    pub any_phase: bool,
    /// Output voltage at the start, V, uniform.
    pub initial_voltage: [f64; 2],
    /// Inductor current at the start beside the load's, A, uniform.
    pub initial_current: [f64; 2],
    /// The episode is cut short when |e| exceeds this, V.
    pub max_error: f64,
}

/// A stage of the curriculum.
#[derive(Debug, Clone, PartialEq)]
pub struct Stage {
    /// First control period behind the stage.
    pub until: u64,
    /// Loads of the stage; those of the episode unless given.
    pub loads: Option<Loads>,
    /// Share of the randomisation that is in force, 0..1.
    pub randomise: f64,
}

/// A plant parameter that is drawn anew for each episode.
#[derive(Debug, Clone, PartialEq)]
pub struct Randomised {
    /// `converter.inductance`, `switch.v_f`, ... as in the plant's file.
    pub key: String,
    /// Limits of what is drawn, uniform.
    pub draw: Draw,
}

/// What is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Draw {
    /// The value itself, in the parameter's unit.
    Value([f64; 2]),
    /// A factor on the plant's value.
    Factor([f64; 2]),
}

/// When and with what the checkpoint to keep is chosen.
#[derive(Debug, Clone, PartialEq)]
pub struct Selection {
    /// Control periods between two looks.
    pub every: u64,
    /// The limits of the specification are multiplied by this.
    pub margin: f64,
    /// Scenarios, apart from those of the evaluation.
    pub task: Task,
}

/// A line of the specification; a policy meets it if each given figure is at most this.
#[derive(Debug, Clone, PartialEq)]
pub struct Requirement {
    /// Loads before and after, W; every load step unless given.
    pub load_step: Option<[f64; 2]>,
    /// Over all instants, or for the step at the sampling instant only.
    pub instants: Instants,
    /// What may not be exceeded.
    pub limits: Limits,
}

/// Largest figures that are allowed; those not given are free.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Limits {
    /// Largest |e| after the step, V.
    pub deviation: Option<f64>,
    /// From the step to the last sample outside half a percent of `v_ref`, s.
    pub settling: Option<f64>,
    /// Largest |e| in the tail, V.
    pub tail: Option<f64>,
    /// Root of the mean square of the duty's changes in the tail.
    pub duty_activity: Option<f64>,
    /// Peak to peak of the sampled inductor current in the tail, over the ripple of a loss-free converter.
    pub current_swing: Option<f64>,
    /// Amplitude of the strongest subharmonic line of the duty in the tail.
    pub subharmonic: Option<f64>,
}

/// Which of a load step's instants a requirement speaks of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Instants {
    /// The first: the load changes at a sampling instant.
    Sample,
    /// The worst of all.
    Worst,
}

impl Settings {
    /// Reads and checks `path`.
    ///
    /// # Errors
    /// If the file cannot be read, or all its faults with their places.
    pub fn load(path: &Path) -> Result<Self, Error> {
        read::settings(&Document::open(path)?)
    }

    /// Checks the text of a training file; `path` names it in faults, and paths in it start from its folder.
    ///
    /// # Errors
    /// All faults with their places.
    pub fn parse(text: &str, path: &Path) -> Result<Self, Faults> {
        read::settings(&Document::from_text(path, text)?)
    }

    /// What is doubtful of a training on this converter, a sentence without a full stop each: numbers that no converter has, and
    /// load steps that the training never meets.
    #[must_use]
    pub fn remarks(&self, converter: &plant::Parameters) -> Vec<String> {
        let loads = &self.episode.loads;
        let met = loads.values.iter().chain(&loads.range);
        let (low, high) = met.fold((f64::INFINITY, 0.0_f64), |(low, high), w| (low.min(*w), high.max(*w)));
        let mut remarks = closed_loop::doubts(converter, self.reward.v_ref, &[low, high].map(plant::Load::power));
        for (table, task) in [
            ("[selection]", &self.selection.task),
            ("[evaluation]", &self.evaluation),
        ] {
            // a judged load may lie a little outside of those that are trained
            let is_beyond = |watts: &&f64| **watts < 0.9 * low || **watts > 1.1 * high;
            if let Some(watts) = task.load_steps.iter().flatten().find(is_beyond) {
                remarks.push(format!(
                    "{table} judges at {watts} W, and the loads of [episode] are {low} to {high} W: no policy has learnt it"
                ));
            }
        }
        remarks
    }

    /// Loads and share of randomisation in control period `step`.
    #[must_use]
    pub fn stage(&self, step: u64) -> (&Loads, f64) {
        match self.curriculum.iter().find(|stage| step < stage.until) {
            Some(stage) => (stage.loads.as_ref().unwrap_or(&self.episode.loads), stage.randomise),
            None => (&self.episode.loads, 1.0),
        }
    }
}
