//! What a control step costs on the target, measured under its emulator after `compile`.

use ::targets::TargetSpec;
use codegen::Language;
use policy::Policy;
use serde::Serialize;
use verify::Files;
use verify::estimate::Estimate;
use verify::measure::{Costs, usual_builds};

use super::budget::{Budget, Clock};
use crate::{Failure, output};
use report::{bytes, grouped};

/// Costs of one build.
#[derive(Serialize)]
#[serde(untagged)]
pub enum Report {
    Measured(Costs),
    Estimated(Estimate),
}

impl Report {
    fn measured(&self) -> Option<&Costs> {
        match self {
            Report::Measured(costs) => Some(costs),
            Report::Estimated(_) => None,
        }
    }
}

/// Costs of the builds that could be made here, and what was not possible.
#[derive(Default)]
pub struct Measured {
    pub costs: Vec<Report>,
    notes: Vec<String>,
}

/// Costs of a build in the manifest.
#[derive(Serialize)]
pub struct Entry<'a> {
    #[serde(flatten)]
    costs: &'a Report,
    #[serde(skip_serializing_if = "Option::is_none")]
    budget: Option<Budget>,
}

impl Measured {
    /// Builds and runs the files. The report is an extra: that it cannot be made is a note, not a failure.
    pub fn of(policy: &Policy, target: &TargetSpec, languages: &[Language], files: &Files) -> Self {
        match usual_builds(policy, target, files, languages) {
            Ok(usual) => Self {
                costs: usual
                    .measured
                    .into_iter()
                    .map(Report::Measured)
                    .chain(usual.estimated.into_iter().map(Report::Estimated))
                    .collect(),
                notes: usual
                    .missing
                    .iter()
                    .map(|missing| format!("costs on {} not measured: {missing}", target.name))
                    .collect(),
            },
            Err(error) => Self {
                costs: Vec::new(),
                notes: vec![format!("costs on {} not measured: {error}", target.name)],
            },
        }
    }

    /// Costs of the builds that ran.
    pub fn measured(&self) -> impl Iterator<Item = &Costs> {
        self.costs.iter().filter_map(Report::measured)
    }

    /// As the manifest has them, with the budget at a clock.
    pub fn entries(&self, policy: &Policy, clock: Option<Clock>) -> Vec<Entry<'_>> {
        let budget = |report: &Report| Budget::of(report.measured()?, clock?, policy.sample_period);
        let entry = |costs| Entry {
            costs,
            budget: budget(costs),
        };
        self.costs.iter().map(entry).collect()
    }

    /// Prints a block per build.
    pub fn say(&self, policy: &Policy, target: &TargetSpec, clock: Option<Clock>) -> Result<(), Failure> {
        let clock = clock.map(|clock| clock.hz).or(target.clock_hz.map(f64::from));
        for report in &self.costs {
            output::say(&match report {
                Report::Measured(costs) => text(costs, policy, target, clock),
                Report::Estimated(estimate) => estimated(estimate, target),
            })?;
        }
        for note in &self.notes {
            output::say(&format!("note: {note}"))?;
        }
        Ok(())
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

fn text(costs: &Costs, policy: &Policy, target: &TargetSpec, clock: Option<f64>) -> String {
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
            let share = |cycles: u64| 100.0 * cycles as f64 / hz / policy.sample_period;
            line += &format!(
                ", {:.0} to {:.0} % of the control period at {}",
                share(least),
                share(most),
                Clock { hz }
            );
        }
        lines.push(line);
    }
    lines.join("\n")
}
