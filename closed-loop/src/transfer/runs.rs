//! Run, acquire, fit, run again.

use std::path::{Path, PathBuf};

use drm::DutyRatioMap;
use drm::formula::Losses;
use plant::Parameters;
use toml_input::{Fault, Message};

use super::findings::{EXACT, Findings, MAPPED, Means, Real, Run, SIMULATION, Setting, UNMAPPED};
use super::ideal::Ideal;
use crate::controller::{Controller, follow};
use crate::converter::Converter;
use crate::course::{Course, Next};
use crate::environment::Environment;
use crate::faults::{Error, told};
use crate::load_step::LoadStep;
use crate::refit::AtEnvironment;
use crate::suits::suits;

/// Where a transfer stands.
struct Progress<'a, 'b, E> {
    means: &'a mut Means<'b, E>,
    at: String,
    /// Runs and points that are begun, and that there are in all.
    pieces: [u64; 2],
}

impl<E> Progress<'_, '_, E> {
    fn next(&mut self, what: impl std::fmt::Display) -> Result<(), Error> {
        let [done, all] = self.pieces;
        self.pieces[0] += 1;
        let what = &format_args!("{}: {what}", self.at);
        (self.means.tell)(&Next { what, done, all })
    }
}

/// The whole procedure at every real converter, of each of which `real` is the plant's file.
///
/// # Errors
/// If a file is no plant that suits the policy, which is found before anything runs; if a controller or a simulator fails,
/// the points determine no mapping, or the caller, being told what comes next, ends it.
pub fn transfer<E: Environment>(
    setting: Setting,
    real: &[PathBuf],
    mut means: Means<'_, E>,
) -> Result<Findings, Error> {
    let mut benches = Vec::new();
    for path in real {
        let (parameters, is_outside) = Parameters::nominal_buck_from_file(path.as_path(), "a transfer")?;
        suits(&setting.policy, &parameters, setting.v_ref, path)?;
        if is_outside && means.ideal {
            let message = Message::new("the exact mapping of this converter is not known").found("an FMU");
            let message = message.hint("it is the formula of a plant's losses; leave --ideal out");
            return Err(Fault::in_file(path, message).into());
        }
        let simulated = (means.simulate)(path, &parameters)?;
        benches.push(Bench {
            path,
            parameters,
            is_outside,
            simulated,
        });
    }
    let unmapped = (means.start)(&setting.refit().with(&DutyRatioMap::IDENTITY)?)?;
    let (controller, mut unmapped) = (unmapped.name, unmapped.controller);
    let all = pieces(&setting, &benches, means.ideal)?;
    let mut progress = Progress {
        means: &mut means,
        at: SIMULATION.to_owned(),
        pieces: [0, all],
    };
    let simulation = Converter::new(&setting.nominal)?;
    let simulation = run(SIMULATION, &setting, &simulation, unmapped.as_mut(), &mut progress)?;
    let mut found = Findings {
        simulation,
        simulator: progress.means.simulator,
        setting,
        controller,
        real: Vec::new(),
    };
    for bench in &benches {
        let real = one(&found.setting, bench, unmapped.as_mut(), &mut progress)?;
        found.real.push(real);
    }
    Ok(found)
}

/// Runs and points of a whole transfer.
fn pieces<E>(setting: &Setting, benches: &[Bench<'_, E>], ideal: bool) -> Result<u64, Error> {
    let runs = setting.scenario.load_steps.len() * setting.scenario.task.all_instants().len();
    // without the mapping, with it, with the exact one
    let each = runs * (2 + usize::from(ideal));
    let points = |bench: &Bench<'_, E>| Ok(setting.refit().plan(bench.parameters.converter.v_in)?.points.len());
    let points: usize = benches.iter().map(points).sum::<Result<usize, Error>>()?;
    Ok((runs + each * benches.len() + points) as u64)
}

/// A real converter before its runs.
struct Bench<'a, E> {
    path: &'a Path,
    /// Its numbers; of one that no plant computes the nominal ones.
    parameters: Parameters,
    is_outside: bool,
    simulated: E,
}

/// The procedure at one converter: without a mapping, acquire, fit, with it.
fn one<E: Environment>(
    setting: &Setting,
    bench: &Bench<'_, E>,
    unmapped: &mut dyn Controller,
    progress: &mut Progress<'_, '_, E>,
) -> Result<Real, Error> {
    let Bench {
        path,
        parameters: real,
        is_outside,
        simulated,
    } = bench;
    path.display().to_string().clone_into(&mut progress.at);
    let mut runs = vec![run(UNMAPPED, setting, simulated, unmapped, progress)?];
    let points = acquire(setting, real, simulated, progress)?;
    let report = setting.refit().fit(&points)?;
    let mut mapped = (progress.means.start)(&setting.refit().with(&report.fit.map)?)?;
    runs.push(run(MAPPED, setting, simulated, mapped.controller.as_mut(), progress)?);
    let mut notes = report.notes.clone();
    if progress.means.ideal {
        let mut ideal = Ideal {
            inner: unmapped,
            trained_on: setting.trained_on,
            real: Losses::of(real)?,
            limits: setting.policy.path(setting.output).limits.duty,
        };
        runs.push(run(EXACT, setting, simulated, &mut ideal, progress)?);
    }
    notes.extend(runs.iter().flat_map(ended_early));
    let remarks = if *is_outside {
        notes.push(
            "what no mapping repairs is not known of an FMU: it is told from the formula of a plant's losses"
                .to_owned(),
        );
        Vec::new()
    } else {
        setting.refit().beyond_repair(real, &report.fit.map)?
    };
    let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
    Ok(Real {
        name: stem.unwrap_or_default(),
        points,
        remarks,
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
        .map(|course| course.finding.step().to_string())
        .collect();
    let list = steps.join(", ");
    (!steps.is_empty()).then(|| {
        format!(
            "{}: the simulator gave up, or the voltage ran away, at {list}",
            run.name
        )
    })
}

/// A controller over all load steps and instants.
fn run<R, E: Environment>(
    name: &'static str,
    setting: &Setting,
    environment: &E,
    controller: &mut dyn Controller,
    progress: &mut Progress<'_, '_, R>,
) -> Result<Run, Error> {
    let task = &setting.scenario.task;
    let course = |step: &LoadStep| {
        Course::new(*step, task, |instant| {
            progress.next(step)?;
            follow(environment, controller, setting.v_ref, task, *step, instant)
        })
    };
    let courses = setting
        .scenario
        .load_steps
        .iter()
        .map(course)
        .collect::<Result<_, _>>()?;
    Ok(Run { name, courses })
}

/// Settled points at a real converter as CSV.
fn acquire<E: Environment>(
    setting: &Setting,
    real: &Parameters,
    simulated: &E,
    progress: &mut Progress<'_, '_, E>,
) -> Result<String, Error> {
    let refit = setting.refit();
    let mut plan = refit.plan(real.converter.v_in)?;
    let mut bench = AtEnvironment(simulated.clone());
    let of = plan.points.len();
    for (index, entry) in plan.points.iter_mut().enumerate() {
        progress.next(format_args!("point {} of {of}", index + 1))?;
        refit.measure(&mut bench, entry)?;
    }
    plan.to_csv().map_err(told)
}
