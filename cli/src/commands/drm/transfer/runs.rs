//! Run, acquire, fit, run again.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use closed_loop::scenario::Finding;
use closed_loop::{Controller, Converter, Environment, LoadStep, follow};
use drm::formula::Losses;
use plant::Parameters;
use spice::SpiceConverter;
use toml_input::Message;

use super::ideal::Ideal;
use super::{Course, Findings, Real, Run, Setting, Transfer};
use crate::Failure;
use crate::commands::drm::bench::Simulator;
use crate::commands::progress_line::ProgressLine;
use crate::commands::simulate::{self, controllers};

/// Names of the runs.
const SIMULATION: &str = "simulation";
const UNMAPPED: &str = "no mapping";
pub const MAPPED: &str = "mapped";
pub const EXACT: &str = "exact mapping";

/// Where a transfer stands.
struct Progress<'a> {
    line: ProgressLine,
    stop: &'a AtomicBool,
    at: String,
}

impl Progress<'_> {
    fn next(&mut self, what: impl std::fmt::Display) -> Result<(), Failure> {
        crate::interruption::go_on()?;
        let at = &self.at;
        self.line.show(|| format!("{at}: {what}"));
        Ok(())
    }
}

/// The whole procedure at every real converter.
pub fn all(options: &Transfer, setting: Setting, stop: &AtomicBool) -> Result<Findings, Failure> {
    let mut benches = Vec::new();
    for path in &options.real {
        let parameters = super::super::plant_parameters(path)?;
        simulate::suits(&setting.policy, &parameters, setting.v_ref, path)?;
        benches.push((path, parameters));
    }
    let mut progress = Progress {
        line: ProgressLine::new(),
        stop,
        at: SIMULATION.to_owned(),
    };
    let unmapped = controllers::start(&setting.refit().with(&drm::DutyRatioMap::IDENTITY)?, setting.controller)?;
    let (controller, mut unmapped) = (unmapped.name, unmapped.controller);
    let simulation = Converter::new(&setting.nominal)?;
    let courses = courses(&setting, &simulation, unmapped.as_mut(), &mut progress)?;
    let mut found = Findings {
        simulation: Run {
            name: SIMULATION,
            courses,
        },
        setting,
        controller,
        real: Vec::new(),
    };
    for (path, parameters) in &benches {
        let real = one(&found.setting, path, parameters, unmapped.as_mut(), &mut progress)?;
        found.real.push(real);
    }
    progress.line.clear();
    Ok(found)
}

/// The procedure at one converter: without a mapping, acquire, fit, with it.
fn one(
    setting: &Setting,
    path: &Path,
    real: &Parameters,
    unmapped: &mut dyn Controller,
    progress: &mut Progress<'_>,
) -> Result<Real, Failure> {
    path.display().to_string().clone_into(&mut progress.at);
    let mut runs = vec![at(setting, UNMAPPED, real, unmapped, progress)?];
    let points = acquire(setting, real, progress)?;
    let report = setting.refit().fit(&points)?;
    let mut mapped = controllers::start(&setting.refit().with(&report.fit.map)?, setting.controller)?;
    runs.push(at(setting, MAPPED, real, mapped.controller.as_mut(), progress)?);
    let mut notes = report.notes.clone();
    if setting.ideal {
        let mut ideal = Ideal {
            inner: unmapped,
            trained_on: setting.trained_on,
            real: Losses::of(real),
            limits: setting.policy.limits.duty,
        };
        runs.push(at(setting, EXACT, real, &mut ideal, progress)?);
    }
    notes.extend(runs.iter().flat_map(ended_early));
    let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
    Ok(Real {
        name: stem.unwrap_or_default(),
        points,
        remarks: setting.refit().beyond_repair(real, &report.fit.map)?,
        report,
        runs,
        notes,
    })
}

/// Load steps at which the voltage was not a number in the end.
fn ended_early(run: &Run) -> Option<String> {
    let lost = |course: &&Course| course.finding.worst.deviation.is_infinite();
    let steps: Vec<String> = run
        .courses
        .iter()
        .filter(lost)
        .map(|course| course.step.to_string())
        .collect();
    let list = steps.join(", ");
    (!steps.is_empty()).then(|| {
        format!(
            "{}: the simulator gave up, or the voltage ran away, at {list}",
            run.name
        )
    })
}

/// A controller at a real converter.
fn at(
    setting: &Setting,
    name: &'static str,
    real: &Parameters,
    controller: &mut dyn Controller,
    progress: &mut Progress<'_>,
) -> Result<Run, Failure> {
    let courses = match setting.simulator {
        Simulator::Plant => courses(setting, &Converter::new(real)?, controller, progress),
        Simulator::Ngspice => courses(setting, &SpiceConverter::new(real)?, controller, progress),
    }?;
    Ok(Run { name, courses })
}

/// A controller over all load steps and instants.
fn courses<E: Environment>(
    setting: &Setting,
    environment: &E,
    controller: &mut dyn Controller,
    progress: &mut Progress<'_>,
) -> Result<Vec<Course>, Failure> {
    let task = &setting.scenario.task;
    let course = |step: &LoadStep| {
        let mut finding = Finding::new(*step);
        let mut shown = None;
        for instant in task.all_instants() {
            progress.next(step)?;
            let trajectory = follow(environment, controller, setting.v_ref, task, *step, instant)?;
            finding.add(instant, trajectory.metrics);
            shown.get_or_insert(trajectory);
        }
        let shown = shown.ok_or_else(|| Message::new("internal fault: a load step at no instant"))?;
        Ok(Course {
            step: *step,
            finding,
            shown,
        })
    };
    setting.scenario.load_steps.iter().map(course).collect()
}

/// Settled points at a real converter as CSV.
fn acquire(setting: &Setting, real: &Parameters, progress: &mut Progress<'_>) -> Result<String, Failure> {
    let refit = setting.refit();
    let mut plan = refit.plan(real.converter.v_in)?;
    let mut bench = setting.simulator.bench(real)?;
    let of = plan.points.len();
    for (index, entry) in plan.points.iter_mut().enumerate() {
        progress.next(format!("point {} of {of}", index + 1))?;
        refit.measure(bench.as_mut(), entry)?;
    }
    Ok(plan.to_csv()?)
}
