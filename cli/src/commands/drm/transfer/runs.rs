//! Run, acquire, fit, run again.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use closed_loop::scenario::Finding;
use closed_loop::{Controller, Converter, Environment, LoadKind, LoadStep, follow};
use drm::acquire::{Hold, LoadSetting, Plan, PlanPoint, Protocol, measure};
use drm::formula::Losses;
use drm::{Conduction, DutyRatioMap, FitOptions, Table, TableOptions};
use plant::Parameters;
use policy::{Action, Interval};
use spice::SpiceConverter;
use toml_input::{FileName, Source};

use super::ideal::Ideal;
use super::{Course, Findings, IDENTITY, Real, Run, Setting, Transfer};
use crate::Failure;
use crate::commands::drm::bench::Simulator;
use crate::commands::progress_line::ProgressLine;
use crate::commands::simulate::{self, controllers, go_on};

/// Voltages that settled points are measured at, over the range of the policy's duties.
const VOLTAGES: usize = 5;
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
        go_on(self.stop)?;
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
        simulate::suits(&setting.policy, &parameters, setting.v_ref, &path.display())?;
        benches.push((path, parameters));
    }
    let mut progress = Progress {
        line: ProgressLine::new(),
        stop,
        at: SIMULATION.to_owned(),
    };
    let unmapped = controllers::start(&setting.with(&IDENTITY)?, setting.controller)?;
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
    let report = fit(setting, &points)?;
    let mut mapped = controllers::start(&setting.with(&report.fit.map)?, setting.controller)?;
    runs.push(at(setting, MAPPED, real, mapped.controller.as_mut(), progress)?);
    let mut notes = report.notes.clone();
    match Losses::of(real).filter(|_| setting.ideal) {
        Some(losses) => {
            let mut ideal = Ideal {
                inner: unmapped,
                trained_on: setting.trained_on,
                real: losses,
                limits: setting.policy.limits.duty,
            };
            runs.push(at(setting, EXACT, real, &mut ideal, progress)?);
        }
        None if setting.ideal => notes.push("a synchronous leg has no exact mapping to compare with".to_owned()),
        None => {}
    }
    notes.extend(runs.iter().flat_map(ended_early));
    let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
    Ok(Real {
        name: stem.unwrap_or_default(),
        points,
        remarks: beyond_repair(setting, real, &report.fit.map)?,
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
        let shown = shown.ok_or_else(|| Failure("internal fault: a load step at no instant".to_owned()))?;
        Ok(Course {
            step: *step,
            finding,
            shown,
        })
    };
    setting.scenario.load_steps.iter().map(course).collect()
}

/// Every load of the scenario, once.
fn loads(setting: &Setting) -> Vec<LoadSetting> {
    let mut loads = Vec::new();
    for step in &setting.scenario.load_steps {
        for value in step.values {
            let load = match step.kind {
                LoadKind::Power => LoadSetting::Power(value),
                LoadKind::Current => LoadSetting::Current(value),
                LoadKind::Resistance => LoadSetting::Resistor(value),
            };
            if !loads.contains(&load) {
                loads.push(load);
            }
        }
    }
    loads
}

/// Settled points: every load at voltages that span what the policy's duties reach on the converter of its training.
fn acquire(setting: &Setting, real: &Parameters, progress: &mut Progress<'_>) -> Result<String, Failure> {
    let v_in = setting.nominal.converter.v_in;
    let (low, high) = duties(&setting.policy.actions);
    let most = 0.97 * real.converter.v_in.min(v_in);
    let (low, high) = ((low * v_in).max(0.3 * setting.v_ref), (high * v_in).min(most));
    let mut plan = Plan::new(v_in, &[0.5], &[LoadSetting::Current(1.0)], 0.0)?;
    plan.points.clear();
    for load in loads(setting) {
        for k in 0..VOLTAGES {
            let v_out = low + (high - low) * k as f64 / (VOLTAGES - 1) as f64;
            let point = PlanPoint {
                duty: v_out / v_in,
                load,
                hold: Hold::ClosedLoop(v_out),
            };
            plan.points.push((point, None));
        }
    }
    let mut bench = setting.simulator.bench(real)?;
    let of = plan.points.len();
    for (index, (point, measurement)) in plan.points.iter_mut().enumerate() {
        progress.next(format!("point {} of {of}", index + 1))?;
        *measurement = Some(measure(bench.as_mut(), &setting.nominal, point, &Protocol::default())?);
    }
    Ok(plan.to_csv()?)
}

/// Smallest and largest duty of the actions.
fn duties(actions: &[Action]) -> (f64, f64) {
    let all = actions.iter().map(|action| action.duty);
    all.fold((1.0, 0.0), |(low, high), duty| (duty.min(low), duty.max(high)))
}

/// What is known at the bench beside the table is the converter of the training.
fn fit(setting: &Setting, points: &str) -> Result<drm::Report, Failure> {
    let name = FileName::new(&PathBuf::from("points.csv"));
    let source = Source::new(name, points.as_bytes().to_vec()).map_err(|fault| Failure(fault.to_string()))?;
    let options = TableOptions {
        simulation: Some(setting.trained_on),
        skip_unsettled: true,
        ..TableOptions::default()
    };
    let table = Table::parse(&source, &options)?;
    let options = FitOptions {
        conduction: Conduction::of(&setting.nominal),
        ..FitOptions::default()
    };
    Ok(drm::fit(&table, &options)?)
}

fn beyond_repair(setting: &Setting, real: &Parameters, map: &DutyRatioMap) -> Result<Vec<String>, Failure> {
    let limits = Some(setting.policy.limits.duty);
    let loads = loads(setting);
    let steady = drm::judge::against_plant(map, real, &setting.nominal, setting.v_ref, &loads, limits)?;
    let mut remarks = drm::judge::beyond_repair(&steady, setting.v_ref);
    remarks.extend(cut_off(setting, map));
    Ok(remarks)
}

/// Whether the policy's duty limits cut off what the mapping makes of its actions.
fn cut_off(setting: &Setting, map: &DutyRatioMap) -> Option<String> {
    let (low, high) = duties(&setting.policy.actions);
    let mapped = DutyRatioMap {
        valid_d_sim: Interval { low, high },
        ..*map
    }
    .duty_range();
    let limits = setting.policy.limits.duty;
    (mapped.low < limits.low || mapped.high > limits.high).then(|| {
        format!(
            "the policy's duties map to {:.4} .. {:.4}, but its limits are {} .. {}: what lies beyond is cut off in \
             transients; widen them",
            mapped.low, mapped.high, limits.low, limits.high
        )
    })
}
