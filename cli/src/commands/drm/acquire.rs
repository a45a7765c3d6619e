//! `policyc drm acquire`

use std::path::Path;

use closed_loop::outside::Outside;
use closed_loop::refit::AtEnvironment;
use closed_loop::{Converter, Error};
use drm::Table;
use drm::acquire::{Bench, Plan, Protocol, measure};
use measured::Sheet;
use plant::Parameters;
use spice::SpiceConverter;

use crate::arguments::drm::{Acquire, Simulator};
use crate::commands::foreign::opener;
use crate::commands::progress_line::{Pace, ProgressLine};
use crate::failure::Failure;
use crate::outcome::Outcome;
use crate::output;
use crate::talk;

/// Measures or plans.
pub fn run(options: &Acquire) -> Result<Outcome, Failure> {
    let plant = options.plant.as_deref();
    let parameters = plant
        .map(|path| Parameters::nominal_buck_from_file(path, "`drm acquire`"))
        .transpose()?;
    let nominal = parameters.as_ref().map(|(parameters, _)| parameters.converter.v_in);
    let v_in = options.v_in.or(nominal).unwrap_or_default();
    let mut plan = Plan::new(v_in, &options.duties.0, &options.loads.settings(), options.cool_down)?;
    let kept = match &options.resume {
        Some(path) => plan.resume(&Sheet::open(path, &Table::file_options())?)?,
        None => 0,
    };
    let measured = match (&parameters, plant) {
        (Some((parameters, _)), Some(path)) => measure_open(options, path, parameters, &mut plan)?,
        _ => 0,
    };
    output::write_one(&options.out, &plan.to_csv()?)?;
    output::say(&summary(options, &plan, kept, measured))?;
    Ok(Outcome::Done)
}

/// Measures what is open; in ngspice, where it takes long, the table is written after each point, so that an
/// interrupted run can be resumed.
fn measure_open(options: &Acquire, path: &Path, parameters: &Parameters, plan: &mut Plan) -> Result<usize, Failure> {
    let mut bench = bench(options, path, parameters)?;
    let protocol = Protocol {
        window: options.window as usize,
        most_windows: options.most_windows as usize,
    };
    let mut progress = ProgressLine::new();
    let mut measured = 0;
    let (pace, open) = (Pace::new(), plan.open() as u64);
    for index in 0..plan.points.len() {
        let (point, None) = plan.points[index] else { continue };
        progress.show(|| {
            let left = pace.left(measured as u64, open);
            format!("point {} of {}: {}{left}", index + 1, plan.points.len(), point.load)
        });
        plan.points[index].1 = Some(measure(bench.as_mut(), parameters, &point, &protocol)?);
        measured += 1;
        if options.simulator == Simulator::Ngspice {
            output::write_one(&options.out, &plan.to_csv()?)?;
        }
    }
    progress.clear();
    Ok(measured)
}

/// A simulated converter as one that settled points are measured at.
fn bench(options: &Acquire, path: &Path, parameters: &Parameters) -> Result<Box<dyn Bench<Error = Error>>, Error> {
    Ok(match options.simulator {
        Simulator::Plant => {
            let converter = Converter::open(path, &[], &opener(options.foreign))?;
            converter
                .outside()
                .map(Outside::notes)
                .into_iter()
                .flatten()
                .for_each(|note| talk::note(&note));
            Box::new(AtEnvironment(converter))
        }
        Simulator::Ngspice => {
            // read once more: ngspice has no FMU
            Parameters::from_file(path)?;
            Box::new(AtEnvironment(SpiceConverter::new(parameters)?))
        }
    })
}

fn summary(options: &Acquire, plan: &Plan, kept: usize, measured: usize) -> String {
    let path = options.out.display();
    let total = plan.points.len();
    let mut text = format!("wrote {path}: {total} points, {kept} taken over, {measured} measured");
    let unsettled: Vec<String> = plan
        .points
        .iter()
        .enumerate()
        .filter(|(_, (_, measurement))| measurement.is_some_and(|m| !m.settled))
        .map(|(index, _)| (index + 1).to_string())
        .collect();
    if !unsettled.is_empty() {
        let list = unsettled.join(", ");
        text +=
            &format!("\nnot settled: point {list}; raise --most-windows, or leave them out with fit --skip-unsettled");
    }
    let changed = plan
        .points
        .iter()
        .filter(|(point, m)| m.is_some_and(|m| m.hold != point.hold))
        .count();
    if changed > 0 {
        text += &format!("\n{changed} points did not settle in open loop and were held in closed loop (column hold)");
    }
    match plan.open() {
        0 => text += &format!("\nnow: policyc drm fit {path}"),
        open => {
            text += &format!("\n{open} points to measure: fill in {path}, then policyc drm fit {path}");
            text += &format!("\nto go on another day: the same command with --resume {path}");
        }
    }
    text
}
