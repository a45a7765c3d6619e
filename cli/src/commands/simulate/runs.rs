//! All controllers over all load steps.

use std::sync::atomic::AtomicBool;

use closed_loop::baselines::Baseline;
use closed_loop::limit::{Limit, Question};
use closed_loop::scenario::{Finding, Instant};
use closed_loop::{Classical, Controller, LoadStep, Trajectory, follow, unusable};
use toml_input::{Fault, Message};

use super::controllers::{self, Named};
use super::{Check, Course, Findings, POLICY, Setting, Step, go_on};
use crate::Failure;
use crate::arguments::{ControllerKind, Simulate};
use crate::commands::progress_line::ProgressLine;

/// Where a simulation stands.
struct Progress<'a> {
    line: ProgressLine,
    stop: &'a AtomicBool,
    of: usize,
    done: usize,
}

impl Progress<'_> {
    /// Tells what comes next.
    ///
    /// # Errors
    /// If there is to be no next.
    fn next(&mut self, step: LoadStep, what: &str) -> Result<(), Failure> {
        go_on(self.stop)?;
        let (number, of) = (self.done + 1, self.of);
        self.line.show(|| format!("{step} ({number} of {of}): {what}"));
        Ok(())
    }
}

/// Runs everything the scenario asks for.
pub fn all(options: &Simulate, mut setting: Setting, stop: &AtomicBool) -> Result<Findings, Failure> {
    let mut named = start(options, &setting, stop)?;
    let mut check = options.check.then(|| Check {
        names: named.iter().map(|named| named.name.clone()).collect(),
        periods: 0,
        differences: Vec::new(),
    });
    let mut baselines = Vec::new();
    for kind in &setting.scenario.baselines {
        let design = Baseline::new(*kind, setting.converter.parameters(), setting.v_ref)?;
        baselines.push((kind.name(), Classical::from(design)));
    }
    let load_steps = setting.scenario.load_steps.clone();
    let mut progress = Progress {
        line: ProgressLine::new(),
        stop,
        of: load_steps.len(),
        done: 0,
    };
    let mut steps = Vec::new();
    for step in load_steps {
        let mut courses = vec![policy_course(
            &setting,
            &mut named,
            step,
            check.as_mut(),
            &mut progress,
        )?];
        for (name, baseline) in &mut baselines {
            let one = |instant, progress: &mut Progress<'_>| {
                progress.next(step, name)?;
                run(&setting, baseline, step, instant)
            };
            courses.push(course(&setting, name, step, &mut progress, one)?);
        }
        let said = courses
            .first()
            .and_then(|policy| unusable(&policy.shown, &setting.policy));
        setting.notes.extend(said.map(|said| format!("{step}: {said}")));
        progress.next(step, "limit")?;
        let limits = limits(&mut setting, step);
        steps.push(Step { step, courses, limits });
        progress.done += 1;
    }
    progress.line.clear();
    Ok(Findings {
        controller: named.first().map(|named| named.name.clone()).unwrap_or_default(),
        setting,
        steps,
        check,
    })
}

/// The policy's controller; with `--check` the others behind it.
fn start(options: &Simulate, setting: &Setting, stop: &AtomicBool) -> Result<Vec<Named>, Failure> {
    use ControllerKind::{C, Interpreter, Rust};
    let others = [Interpreter, Rust, C].into_iter();
    let others = others.filter(|kind| options.check && *kind != options.controller);
    let mut named = Vec::new();
    for kind in [options.controller].into_iter().chain(others) {
        go_on(stop)?;
        named.push(controllers::start(&setting.policy, kind)?);
    }
    Ok(named)
}

fn run(
    setting: &Setting,
    controller: &mut dyn Controller,
    step: LoadStep,
    instant: Instant,
) -> Result<Trajectory, Failure> {
    let (environment, task) = (&setting.converter, &setting.scenario.task);
    Ok(follow(environment, controller, setting.v_ref, task, step, instant)?)
}

/// A controller at all instants; `one` runs one of them.
fn course(
    setting: &Setting,
    name: &str,
    step: LoadStep,
    progress: &mut Progress<'_>,
    mut one: impl FnMut(Instant, &mut Progress<'_>) -> Result<Trajectory, Failure>,
) -> Result<Course, Failure> {
    let mut finding = Finding::new(step);
    let mut shown = None;
    for instant in setting.scenario.task.all_instants() {
        let trajectory = one(instant, progress)?;
        finding.add(instant, trajectory.metrics);
        shown.get_or_insert(trajectory);
    }
    let name = name.to_owned();
    let shown = shown.ok_or_else(|| Message::new("internal fault: a load step at no instant"))?;
    Ok(Course { name, finding, shown })
}

/// The policy, by its first controller; the others are compared with it.
fn policy_course(
    setting: &Setting,
    named: &mut [Named],
    step: LoadStep,
    mut check: Option<&mut Check>,
    progress: &mut Progress<'_>,
) -> Result<Course, Failure> {
    let (first, others) = named
        .split_first_mut()
        .ok_or_else(|| Message::new("internal fault: no controller"))?;
    let mut different = vec![false; others.len()];
    course(setting, POLICY, step, progress, |instant, progress| {
        progress.next(step, &first.name)?;
        let reference = run(setting, first.controller.as_mut(), step, instant)?;
        let Some(check) = &mut check else {
            return Ok(reference);
        };
        check.periods += reference.periods.len();
        for (other, different) in others.iter_mut().zip(&mut different) {
            progress.next(step, &other.name)?;
            let trajectory = run(setting, other.controller.as_mut(), step, instant)?;
            let first = reference.first_difference(&trajectory);
            if let Some(period) = first.filter(|_| !*different) {
                *different = true;
                check
                    .differences
                    .push(difference(&other.name, step, &reference, period));
            }
        }
        Ok(reference)
    })
}

fn difference(name: &str, step: LoadStep, reference: &Trajectory, period: usize) -> String {
    let time = reference.periods.get(period).map(|period| period.record.time);
    let when = time.map_or("where one has ended".to_owned(), |time| {
        format!("{:.2} ms from the step", 1e3 * time)
    });
    format!("{name}: {step} differs from period {period} on, {when}")
}

/// The limits; a reason why there is none becomes a note.
fn limits(setting: &mut Setting, step: LoadStep) -> Vec<(String, Limit)> {
    let instants = setting.scenario.task.all_instants();
    let phases: Vec<f64> = instants.iter().map(|instant| instant.phase).collect();
    let mut limits = Vec::new();
    for range in setting.scenario.limits.clone() {
        let [low, high] = range;
        match Question::new(setting.converter.parameters(), setting.v_ref, step, range) {
            Ok(question) => limits.push((format!("limit {low}..{high}"), question.answer(&phases))),
            Err(error) => {
                let reason = |fault: &Fault| match &fault.found {
                    Some(found) => format!("{}: {found}", fault.problem),
                    None => fault.problem.clone(),
                };
                setting.notes.extend(error.iter().map(reason));
            }
        }
    }
    limits
}
