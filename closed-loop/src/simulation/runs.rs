//! All controllers over all load steps.

use std::fmt::Display;

use policy::Scalar;
use toml_input::{Fault, Message};

use super::findings::{Check, Findings, LAW, POLICY, Setting, Step};
use super::spread;
use crate::agent::Agent;
use crate::baselines::{Baseline, Kind, observed};
use crate::beyond::beyond;
use crate::controller::{Classical, Controller, Trajectory, follow};
use crate::course::{Course, Named, Next, Tell};
use crate::faults::Error;
use crate::limit::{Limit, Question};
use crate::load_step::LoadStep;
use crate::scenario::Instant;
use crate::unusable::unusable;

/// Where a simulation stands.
pub(super) struct Progress<'a, 'b> {
    tell: &'a mut Tell<'b>,
    /// Load steps.
    of: usize,
    done: usize,
    /// Runs that are done, and that there are in all.
    runs: [u64; 2],
}

impl Progress<'_, '_> {
    /// Tells what comes next.
    ///
    /// # Errors
    /// If there is to be no next.
    fn next(&mut self, step: LoadStep, what: &str) -> Result<(), Error> {
        let (number, of) = (self.done + 1, self.of);
        self.say(&format_args!("{step} ({number} of {of}): {what}"))
    }

    /// Tells what comes next, whatever it is.
    ///
    /// # Errors
    /// If there is to be no next.
    pub(super) fn say(&mut self, what: &dyn Display) -> Result<(), Error> {
        let [done, all] = self.runs;
        (self.tell)(&Next { what, done, all })
    }

    /// So many runs more are done.
    pub(super) fn ran(&mut self, runs: usize) {
        self.runs[0] += runs as u64;
    }
}

/// Runs everything the scenario asks for. `named` are controllers of the policy: the first counts, the others are compared
/// with it to the bit. `tell` is called before each run.
///
/// # Errors
/// If there is no controller or one fails, a classical controller has no design for the converter, or `tell` ends it.
pub fn simulate(mut setting: Setting, mut named: Vec<Named>, tell: &mut Tell<'_>) -> Result<Findings, Error> {
    let mut check = (named.len() > 1).then(|| Check {
        names: named.iter().map(|named| named.name.clone()).collect(),
        periods: 0,
        differences: Vec::new(),
    });
    let mut beside: Vec<Beside> = law(&setting)?.into_iter().collect();
    beside.extend(classical(&mut setting));
    let load_steps = setting.scenario.load_steps.clone();
    let mut names = vec![POLICY; named.len()];
    names.extend(beside.iter().map(|(name, _)| name.as_str()));
    let runs = runs_of(&setting, &names, setting.scenario.task.all_instants().len());
    let mut progress = Progress {
        tell,
        of: load_steps.len(),
        done: 0,
        runs: [
            0,
            (runs + spread::runs(&setting, &names[named.len().saturating_sub(1)..])) as u64,
        ],
    };
    let mut steps = Vec::new();
    for step in load_steps {
        let course = policy_course(&setting, &mut named, step, check.as_mut(), &mut progress)?;
        let said = [
            unusable(&course.shown, &setting.policy),
            beyond(&course.shown, setting.converter.parameters()),
        ];
        let mut courses = vec![(POLICY.to_owned(), course)];
        // the classical controllers hold one voltage
        let beside = beside.iter_mut().filter(|(name, _)| knows(name, step));
        for (name, controller) in beside {
            let course = Course::new(step, &setting.scenario.task, |instant| {
                progress.next(step, name)?;
                let found = run(&setting, controller.as_mut(), step, instant);
                progress.ran(1);
                found
            });
            courses.push(((*name).to_owned(), course?));
        }
        let said = said.into_iter().flatten();
        setting.notes.extend(said.map(|said| format!("{step}: {said}")));
        progress.next(step, "limit")?;
        let limits = limits(&mut setting, step);
        steps.push(Step { step, courses, limits });
        progress.done += 1;
    }
    let mut all: Vec<(&str, &mut Box<dyn Controller>)> = Vec::new();
    all.extend(named.first_mut().map(|first| (POLICY, &mut first.controller)));
    all.extend(beside.iter_mut().map(|(name, controller)| (name.as_str(), controller)));
    let spread = spread::run(&setting, &mut all, &mut progress)?;
    Ok(Findings {
        spread,
        controller: named.first().map(|named| named.name.clone()).unwrap_or_default(),
        setting,
        steps,
        check,
    })
}

/// Runs of controllers of these names over all load steps, at so many instants each.
pub(super) fn runs_of(setting: &Setting, names: &[&str], instants: usize) -> usize {
    let steps = &setting.scenario.load_steps;
    let of = |name: &&str| steps.iter().filter(|step| knows(name, **step)).count();
    instants * names.iter().map(of).sum::<usize>()
}

/// Whether a controller has a part in a step: of the reference only those know that are told.
pub(super) fn knows(name: &str, step: LoadStep) -> bool {
    step.reference.is_none() || [POLICY, LAW].contains(&name)
}

/// The classical controllers of the scenario; a reason why there is no design of one becomes a note.
fn classical(setting: &mut Setting) -> Vec<Beside> {
    let v_ref = setting.v_ref;
    let loads = setting.scenario.load_steps.iter().flat_map(LoadStep::loads);
    let i_out = loads.map(|load| load.at(v_ref)).fold(0.0, f64::max);
    let mut found: Vec<Beside> = Vec::new();
    for kind in setting.scenario.baselines.clone() {
        for observer in places(setting) {
            match one(setting, kind, observer, (v_ref, i_out)) {
                Ok(own) => found.push(own),
                // the same reason behind each observer
                Err(error) => {
                    let reasons = error.iter().map(reason).filter(|said| !setting.notes.contains(said));
                    setting.notes.extend(reasons.collect::<Vec<_>>());
                }
            }
        }
    }
    found
}

/// Where a classical controller stands: behind each observer of the scenario, by index into the contract, or at the sensors.
fn places(setting: &Setting) -> Vec<Option<usize>> {
    let index = |name: &String| setting.policy.observers.iter().position(|own| own.name == *name);
    match setting.scenario.observers.as_slice() {
        [] => vec![None],
        names => names.iter().map(index).collect(),
    }
}

fn one(setting: &Setting, kind: Kind, observer: Option<usize>, wanted: (f64, f64)) -> Result<Beside, Error> {
    let (v_ref, i_out) = wanted;
    let Some(observer) = observer else {
        let design = Baseline::new(kind, &setting.designed_on, v_ref, i_out)?;
        return Ok((kind.name().to_owned(), Box::new(Classical::from(design))));
    };
    let name = match setting.scenario.observers.len() {
        0 | 1 => kind.name().to_owned(),
        _ => format!("{kind} {}", setting.policy.observers[observer].name),
    };
    Ok((
        name,
        observed(&setting.policy, observer, kind, &setting.designed_on, wanted)?,
    ))
}

fn reason(fault: &Fault) -> String {
    match &fault.found {
        Some(found) => format!("{}: {found}", fault.problem),
        None => fault.problem.clone(),
    }
}

/// What stands beside the policy in every table.
type Beside = (String, Box<dyn Controller>);

/// The law that a policy adds to, on its own: what the network gains is the difference to it.
fn law(setting: &Setting) -> Result<Option<Beside>, Error> {
    let Some(law) = setting.policy.law_alone() else {
        return Ok(None);
    };
    let controller: Box<dyn Controller> = match law.numeric_format.scalar() {
        Scalar::F32 => Box::new(Agent::<f32>::told(&law)?),
        Scalar::F64 => Box::new(Agent::<f64>::told(&law)?),
    };
    Ok(Some((LAW.to_owned(), controller)))
}

fn run(
    setting: &Setting,
    controller: &mut dyn Controller,
    step: LoadStep,
    instant: Instant,
) -> Result<Trajectory, Error> {
    let (environment, task) = (&setting.converter, &setting.scenario.task);
    follow(environment, controller, setting.v_ref, task, step, instant)
}

/// The policy, by its first controller; the others are compared with it.
fn policy_course(
    setting: &Setting,
    named: &mut [Named],
    step: LoadStep,
    mut check: Option<&mut Check>,
    progress: &mut Progress<'_, '_>,
) -> Result<Course, Error> {
    let (first, others) = named
        .split_first_mut()
        .ok_or_else(|| Message::new("internal fault: no controller"))?;
    let mut different = vec![false; others.len()];
    Course::new(step, &setting.scenario.task, |instant| {
        progress.next(step, &first.name)?;
        let reference = run(setting, first.controller.as_mut(), step, instant)?;
        progress.ran(1);
        let Some(check) = &mut check else {
            return Ok(reference);
        };
        check.periods += reference.periods.len();
        for (other, different) in others.iter_mut().zip(&mut different) {
            progress.next(step, &other.name)?;
            let trajectory = run(setting, other.controller.as_mut(), step, instant)?;
            progress.ran(1);
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
    // a note of the setting says so
    if step.keeps_load() {
        return Vec::new();
    }
    let instants = setting.scenario.task.all_instants();
    let phases: Vec<f64> = instants.iter().map(|instant| instant.phase).collect();
    let mut limits = Vec::new();
    for range in setting.scenario.limits.clone() {
        let [low, high] = range;
        match Question::new(setting.converter.parameters(), setting.v_ref, step, range) {
            Ok(question) => limits.push((format!("limit {low}..{high}"), question.answer(&phases))),
            Err(error) => {
                setting.notes.extend(error.iter().map(reason));
            }
        }
    }
    limits
}
