//! What a control step costs in the builds that firmware takes, for people and for the manifest.

use codegen::Language;
use policy::Policy;
use report::{bytes, grouped};
use serde::Serialize;
use targets::TargetSpec;

use crate::budget::{Budget, Clock, percents};
use crate::estimate::Estimate;
use crate::measure::{Costs, usual_builds};
use crate::session::Files;

/// Costs of one build.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(untagged)]
pub enum BuildCosts {
    /// It ran under the target's emulator.
    Measured(Costs),
    /// It was compiled and did not run.
    Estimated(Estimate),
}

impl BuildCosts {
    fn measured(&self) -> Option<&Costs> {
        match self {
            BuildCosts::Measured(costs) => Some(costs),
            BuildCosts::Estimated(_) => None,
        }
    }
}

/// Costs of the builds that could be made here, and what was not possible.
#[derive(Debug, Clone, Default)]
pub struct StepCosts {
    /// The builds, those that ran first.
    pub builds: Vec<BuildCosts>,
    /// Why others were not measured, one sentence each.
    pub notes: Vec<String>,
}

/// Costs of a build as an entry of the manifest ([`codegen::manifest::with_costs`]).
#[derive(Debug, Serialize)]
pub struct Entry<'a> {
    #[serde(flatten)]
    costs: &'a BuildCosts,
    #[serde(skip_serializing_if = "Option::is_none")]
    budget: Option<Budget>,
}

impl StepCosts {
    /// Builds and runs the files in each of the languages. Costs are an extra: that there are none is a note, not an error.
    #[must_use]
    pub fn of(policy: &Policy, target: &TargetSpec, languages: &[Language], files: &Files) -> Self {
        match usual_builds(policy, target, files, languages) {
            Ok(usual) => Self {
                builds: usual
                    .measured
                    .into_iter()
                    .map(BuildCosts::Measured)
                    .chain(usual.estimated.into_iter().map(BuildCosts::Estimated))
                    .collect(),
                notes: usual
                    .missing
                    .iter()
                    .map(|missing| format!("costs on {} not measured: {missing}", target.name))
                    .collect(),
            },
            Err(error) => Self {
                builds: Vec::new(),
                notes: vec![format!("costs on {} not measured: {error}", target.name)],
            },
        }
    }

    /// Costs of the builds that ran.
    pub fn measured(&self) -> impl Iterator<Item = &Costs> {
        self.builds.iter().filter_map(BuildCosts::measured)
    }

    /// As the manifest has them, with the budget at a clock.
    #[must_use]
    pub fn entries(&self, policy: &Policy, clock: Option<Clock>) -> Vec<Entry<'_>> {
        let budget = |build: &BuildCosts| Budget::of(build.measured()?, clock?, policy.sample_period);
        let entry = |costs| Entry {
            costs,
            budget: budget(costs),
        };
        self.builds.iter().map(entry).collect()
    }

    /// A block of lines for each build, then a line for each note. Cycles become shares of the control period at `clock`, or
    /// at the clock that the target is known by.
    #[must_use]
    pub fn texts(&self, policy: &Policy, target: &TargetSpec, clock: Option<Clock>) -> Vec<String> {
        let usual = target.clock_hz.map(f64::from);
        let is_asked = clock.is_some();
        let clock = clock.map(|clock| clock.hz).or(usual);
        let text = |build: &BuildCosts| match build {
            BuildCosts::Measured(costs) => measured(costs, policy, target, clock),
            BuildCosts::Estimated(estimate) => estimated(estimate, target),
        };
        let notes = self.notes.iter().map(|note| format!("note: {note}"));
        let period = clock.map_or(f64::INFINITY, |hz| hz * policy.sample_period);
        let may_miss = |build: &BuildCosts| match build {
            BuildCosts::Measured(costs) => costs.model_cycles.is_some_and(|(_, most)| most as f64 > period),
            BuildCosts::Estimated(_) => false,
        };
        // whoever gave the clock reads the verdict of the budget
        let is_late = !is_asked && self.builds.iter().any(may_miss);
        let late = is_late.then(|| {
            "note: a step may take longer than its control period; `--clock FREQUENCY` says whether it does at your processor's, and what would \
             fit"
            .to_owned()
        });
        self.builds.iter().map(text).chain(notes).chain(late).collect()
    }
}

fn estimated(estimate: &Estimate, target: &TargetSpec) -> String {
    format!(
        "{} on {}\n  flash {}, static RAM {}, stack about {} (estimated from the compiler's frames, nothing was run)",
        estimate.build,
        target.name,
        bytes(estimate.flash_bytes as usize),
        bytes(estimate.static_ram_bytes as usize),
        bytes(estimate.estimated_stack_bytes as usize)
    )
}

fn measured(costs: &Costs, policy: &Policy, target: &TargetSpec, clock: Option<f64>) -> String {
    let (fewest, most) = (costs.instructions_min, costs.instructions_max);
    let instructions = if fewest == most {
        format!("{} for every input", grouped(most))
    } else {
        format!("{} to {}, depends on the input", grouped(fewest), grouped(most))
    };
    let mut lines = vec![
        format!("{} on {}", costs.build, target.name),
        format!(
            "  flash {}, static RAM {}, stack {} (painted under the emulator)",
            bytes(costs.flash_bytes as usize),
            bytes(costs.static_ram_bytes as usize),
            bytes(costs.stack_bytes as usize)
        ),
        format!("  instructions per step: {instructions} (counted under the emulator)"),
    ];
    if let Some((least, most)) = costs.model_cycles {
        let mut line = format!(
            "  model, not measured: {} to {} cycles at 0 wait states",
            grouped(least),
            grouped(most)
        );
        if let Some(hz) = clock {
            // as the budget divides, for the same last digit
            let share = |cycles: u64| cycles as f64 / (hz * policy.sample_period);
            line += &format!(
                ", {} % of the control period at {}",
                percents((share(least), share(most))),
                Clock::shown(hz)
            );
        }
        lines.push(line);
    }
    lines.join("\n")
}
