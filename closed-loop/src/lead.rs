//! Load steps from one lead: the periods before a step are run once, and every instant goes on from a copy.
//!
//! ```text
//! start ─► lead ─┬──────────── step at instant 0 ─► figures
//!                └─ a period ─┬─ step at instant 1 ─► figures
//!                             └─ a period ─ ...
//! ```
//!
//! Invariant: a run gives the figures of [`scenario::load_step`](crate::scenario::load_step) to the bit, in whatever order.

use plant::Sample;

use crate::environment::Environment;
use crate::faults::Error;
use crate::load_step::LoadStep;
use crate::scenario::{Finding, Instant, Loop, Metrics, Record, Task};

/// Converter and controller behind their lead, before any of the instants of a task.
#[derive(Debug, Clone)]
pub struct Lead<'t, E, C> {
    task: &'t Task,
    /// Element n has run n periods more than the first, which stands before the last period of the lead.
    loops: Vec<Loop<E, C>>,
}

fn quiet(_: Record) {}

fn start<E, C>(environment: &E, controller: &C, v_ref: f64, task: &Task, step: &LoadStep) -> Result<Loop<E, C>, Error>
where
    E: Environment,
    C: FnMut(&Sample) -> f64 + Clone,
{
    let [from, _] = step.loads();
    let before = step.source.map(|[before, _]| before);
    let (environment, controller) = (environment.clone(), controller.clone());
    let mut run = Loop::start(environment, controller, step.held(v_ref)[0], from, before)?;
    run.lead(task.lead - 1, task.tail, quiet);
    Ok(run)
}

impl<'t, E, C> Lead<'t, E, C>
where
    E: Environment,
    C: FnMut(&Sample) -> f64 + Clone,
{
    /// Runs the lead of `step`, which is that of every step from the same load, source and reference.
    ///
    /// # Errors
    /// If the converter cannot be started.
    pub fn new(environment: &E, controller: &C, v_ref: f64, task: &'t Task, step: &LoadStep) -> Result<Self, Error> {
        let run = start(environment, controller, v_ref, task, step)?;
        Ok(Self { task, loops: vec![run] })
    }

    /// The figures of a step at an instant; of the part up to where `go_on`, which is asked every few periods, says no
    /// ([`Loop::measure_while`]).
    ///
    /// # Errors
    /// If the source cannot step, or a converter from outside fails.
    pub fn run(
        &mut self,
        step: &LoadStep,
        instant: Instant,
        go_on: impl FnMut(&Metrics) -> bool,
    ) -> Result<Metrics, Error> {
        while self.loops.len() <= instant.periods {
            // never empty: `new` puts the first in
            let Some(mut next) = self.loops.last().cloned() else {
                break;
            };
            next.lead(1, self.task.tail, quiet);
            self.loops.push(next);
        }
        from_here(self.loops[instant.periods].clone(), self.task, step, instant, go_on)
    }
}

/// The step at an instant whose whole periods are over.
fn from_here<E, C>(
    mut run: Loop<E, C>,
    task: &Task,
    step: &LoadStep,
    instant: Instant,
    go_on: impl FnMut(&Metrics) -> bool,
) -> Result<Metrics, Error>
where
    E: Environment,
    C: FnMut(&Sample) -> f64,
{
    let ([_, to], phase) = (step.loads(), step.phase(instant.phase));
    run.last_before(to, phase, task.tail, quiet);
    run.disturb(step)?;
    let metrics = run.measure_while((to, phase), task.after, task.tail, go_on, quiet);
    run.environment.failure().map_or(Ok(metrics), Err)
}

/// Runs one load step at the given instants of `task`; the lead is run once and every instant goes on from a copy.
///
/// # Errors
/// If the converter cannot be started, or one from outside fails.
pub fn survey<E, C>(
    environment: &E,
    controller: &C,
    v_ref: f64,
    task: &Task,
    load_step: impl Into<LoadStep>,
    instants: &[Instant],
) -> Result<Finding, Error>
where
    E: Environment,
    C: FnMut(&Sample) -> f64 + Clone,
{
    let step = load_step.into();
    // one alone goes on, not a `Lead` with all of them: a converter from outside may be a program each
    let mut run = start(environment, controller, v_ref, task, &step)?;
    let mut finding = Finding::new(step);
    let last = instants.iter().map(|instant| instant.periods).max().unwrap_or(0);
    for period in 0..=last {
        for instant in instants.iter().filter(|instant| instant.periods == period) {
            finding.add(*instant, from_here(run.clone(), task, &step, *instant, |_| true)?);
        }
        run.lead(1, task.tail, quiet);
    }
    Ok(finding)
}

/// All load steps of a task.
///
/// # Errors
/// If the converter cannot be started, or one from outside fails.
pub fn survey_all<E, C>(
    environment: &E,
    controller: &C,
    v_ref: f64,
    task: &Task,
    instants: &[Instant],
) -> Result<Vec<Finding>, Error>
where
    E: Environment,
    C: FnMut(&Sample) -> f64 + Clone,
{
    let one = |&load_step| survey(environment, controller, v_ref, task, load_step, instants);
    task.load_steps.iter().map(one).collect()
}
