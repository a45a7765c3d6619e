//! A controller on one load step at all its instants, as simulations and transfers run it.

use std::fmt::Display;

use toml_input::Message;

use crate::controller::{Controller, Trajectory};
use crate::faults::Error;
use crate::load_step::LoadStep;
use crate::scenario::{Finding, Instant, Task};

/// A policy's controller and what it is called, such as `interpreter` or `generated C (gcc -O2)`.
pub struct Named {
    /// For people.
    pub name: String,
    /// The controller, started.
    pub controller: Box<dyn Controller>,
}

/// What comes next, and how far the whole is.
pub struct Next<'a> {
    /// For people.
    pub what: &'a dyn Display,
    /// Pieces that are done: runs of one controller over one load step, and settled points. They take about the same time each.
    pub done: u64,
    /// Pieces that there are in all.
    pub all: u64,
}

/// Is told what comes next; an error from it ends the whole.
pub type Tell<'a> = dyn FnMut(&Next<'_>) -> Result<(), Error> + 'a;

/// A controller on one load step.
#[derive(Debug, Clone, PartialEq)]
pub struct Course {
    /// The worst of all instants, figure by figure.
    pub finding: Finding,
    /// At the first sampling instant.
    pub shown: Trajectory,
}

impl Course {
    /// All instants of a task; `run` runs one of them.
    ///
    /// # Errors
    /// The first of `run`.
    pub fn new(
        step: LoadStep,
        task: &Task,
        mut run: impl FnMut(Instant) -> Result<Trajectory, Error>,
    ) -> Result<Self, Error> {
        let mut finding = Finding::new(step);
        let mut shown = None;
        for instant in task.all_instants() {
            let trajectory = run(instant)?;
            finding.add(instant, trajectory.metrics);
            shown.get_or_insert(trajectory);
        }
        let shown = shown.ok_or_else(|| Message::new("internal fault: a load step at no instant"))?;
        Ok(Self { finding, shown })
    }
}
