//! `policyc simulate`

use std::collections::BTreeMap;
use std::path::PathBuf;

use closed_loop::baselines::Baseline;
use closed_loop::environment::Environment;
use closed_loop::limit::{Limit, Question};
use closed_loop::scenario::Finding;
use closed_loop::{Classical, Controller, Converter, LoadStep, Scenario, Trajectory, examine};
use policy::Policy;

use super::progress_line::ProgressLine;
use crate::arguments::{ControllerKind, Simulate};
use crate::{Failure, Outcome, output};

mod controllers;
mod files;
mod pictures;

use controllers::Named;

/// Name of the policy among the controllers.
const POLICY: &str = "policy";

/// A scenario with everything it needs, all of it sound.
struct Setting {
    scenario: Scenario,
    policy: Policy,
    plant: PathBuf,
    converter: Converter,
    v_ref: f64,
    notes: Vec<String>,
}

/// One controller on one load step.
struct Course {
    name: String,
    finding: Finding,
    /// At the first sampling instant.
    shown: Trajectory,
}

/// Everything found on one load step; the policy comes first.
struct Step {
    step: LoadStep,
    courses: Vec<Course>,
    limit: Option<Limit>,
}

/// The comparison of the controllers that should be one.
struct Check {
    /// Each of them.
    names: Vec<String>,
    /// Control periods of each, over all load steps and instants.
    periods: usize,
    /// The first difference of each that has one, in words.
    differences: Vec<String>,
}

/// Simulates, writes, reports.
pub fn run(options: &Simulate) -> Result<Outcome, Failure> {
    let mut setting = prepare(options)?;
    let mut named = vec![controllers::start(&setting.policy, options.controller)?];
    if options.check {
        use ControllerKind::{C, Interpreter, Rust};
        for kind in [Interpreter, Rust, C]
            .into_iter()
            .filter(|kind| *kind != options.controller)
        {
            named.push(controllers::start(&setting.policy, kind)?);
        }
    }
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
    let mut progress = ProgressLine::new();
    let mut steps = Vec::new();
    for step in setting.scenario.load_steps.clone() {
        let of = setting.scenario.load_steps.len();
        let mut tell = |name: &str| progress.show(|| format!("{step} ({} of {of}): {name}", steps.len() + 1));
        tell(POLICY);
        let mut courses = vec![policy_course(&setting, &mut named, step, check.as_mut(), &mut tell)?];
        for (name, baseline) in &mut baselines {
            tell(name);
            courses.push(course(&setting, name, baseline, step)?.0);
        }
        tell("limit");
        let limit = limit(&mut setting, step);
        steps.push(Step { step, courses, limit });
    }
    progress.clear();
    write(options, &setting, &named[0].name, &steps, check.as_ref())
}

fn write(
    options: &Simulate,
    setting: &Setting,
    controller: &str,
    steps: &[Step],
    check: Option<&Check>,
) -> Result<Outcome, Failure> {
    let summary = files::summary(setting, controller, steps, check);
    let mut all: BTreeMap<String, String> = files::tables(setting, controller, steps, check)?;
    all.insert("summary.txt".to_owned(), summary.clone());
    for step in steps {
        all.insert(
            format!("{}.svg", files::stem(step.step)),
            pictures::picture(setting, step)?,
        );
    }
    output::write_texts(&options.out, &all)?;
    output::say(&format!("{summary}\n{} files in {}", all.len(), options.out.display()))?;
    let equal = check.is_none_or(|check| check.differences.is_empty());
    Ok(if equal { Outcome::Done } else { Outcome::Different })
}

fn prepare(options: &Simulate) -> Result<Setting, Failure> {
    let scenario = Scenario::load(&options.scenario)?;
    let policy = super::load(&options.policy)?;
    let file = options.scenario.display();
    let Some(plant) = options.plant.clone().or(scenario.plant.clone()) else {
        return Err(Failure(format!(
            "{file}: no plant\n   = hint: plant = \"../plants/paper-model.toml\", or --plant PLANT"
        )));
    };
    let converter = Converter::load(&plant, &scenario.set)?;
    let of_policy = policy.parameters.get("v_ref").copied();
    let Some(v_ref) = scenario.v_ref.or(of_policy) else {
        return Err(Failure(format!(
            "{file}: no voltage to hold\n   = hint: v_ref = 100.0, as the policy has no parameter `v_ref`"
        )));
    };
    let v_in = converter.parameters().converter.v_in;
    if v_ref >= v_in {
        return Err(Failure(format!(
            "{file}: a buck converter cannot hold this voltage\n   = found: v_ref = {v_ref} V, v_in = {v_in} V at the plant"
        )));
    }
    let (ours, theirs) = (policy.sample_period, converter.t_sample());
    if (ours - theirs).abs() > 1e-9 * theirs {
        return Err(Failure(format!(
            "policy and plant have different control periods\n   = found: sample_period = {ours} s in the policy, \
             {theirs} s at the plant\n   = hint: f_sw of the plant is 1 / sample_period"
        )));
    }
    let mut notes = Vec::new();
    if let Some(theirs) = of_policy.filter(|theirs| *theirs != v_ref) {
        notes.push(format!(
            "the policy holds {theirs} V, but errors are counted from {v_ref} V"
        ));
    }
    Ok(Setting {
        scenario,
        policy,
        plant,
        converter,
        v_ref,
        notes,
    })
}

fn course(
    setting: &Setting,
    name: &str,
    controller: &mut dyn Controller,
    step: LoadStep,
) -> Result<(Course, Vec<Trajectory>), Failure> {
    let (finding, trajectories) = examine(
        &setting.converter,
        controller,
        setting.v_ref,
        &setting.scenario.task,
        step,
    )?;
    let Some(shown) = trajectories.first().cloned() else {
        return Err(Failure("internal fault: a load step at no instant".to_owned()));
    };
    let name = name.to_owned();
    Ok((Course { name, finding, shown }, trajectories))
}

/// The policy, by its first controller; the others are compared with it.
fn policy_course(
    setting: &Setting,
    named: &mut [Named],
    step: LoadStep,
    mut check: Option<&mut Check>,
    tell: &mut dyn FnMut(&str),
) -> Result<Course, Failure> {
    let mut first: Option<(Course, Vec<Trajectory>)> = None;
    for Named { name, controller } in named {
        tell(name);
        let (found, trajectories) = course(setting, POLICY, controller.as_mut(), step)?;
        let Some((_, reference)) = &first else {
            if let Some(check) = &mut check {
                check.periods += trajectories
                    .iter()
                    .map(|trajectory| trajectory.periods.len())
                    .sum::<usize>();
            }
            first = Some((found, trajectories));
            continue;
        };
        let pairs = reference.iter().zip(&trajectories);
        let difference = pairs.filter_map(|(a, b)| Some((a, a.first_difference(b)?))).next();
        if let (Some(check), Some((trajectory, period))) = (&mut check, difference) {
            let when = trajectory
                .periods
                .get(period)
                .map_or(0.0, |period| 1e3 * period.record.time);
            check.differences.push(format!(
                "{name}: {step} differs from period {period} on, {when:.2} ms from the step"
            ));
        }
    }
    first
        .map(|(course, _)| course)
        .ok_or_else(|| Failure("internal fault: no controller".to_owned()))
}

/// The limit; a reason why there is none becomes a note.
fn limit(setting: &mut Setting, step: LoadStep) -> Option<Limit> {
    let range = setting.scenario.limit?;
    match Question::new(setting.converter.parameters(), setting.v_ref, step, range) {
        Ok(question) => {
            let instants = setting.scenario.task.all_instants();
            let phases: Vec<f64> = instants.iter().map(|instant| instant.phase).collect();
            Some(question.answer(&phases))
        }
        Err(error) => {
            setting.notes.push(error.to_string());
            None
        }
    }
}
