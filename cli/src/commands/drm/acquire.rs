//! `policyc drm acquire`

use std::path::PathBuf;

use clap::Args;
use drm::Table;
use drm::acquire::{Plan, Protocol, measure};
use measured::Sheet;
use plant::Parameters;

use super::Loads;
use super::bench::Simulator;
use crate::commands::progress_line::ProgressLine;
use crate::{Failure, Outcome, output};

#[derive(Debug, Args)]
pub struct Acquire {
    /// The converter to measure, simulated; without it a plan for the bench is written
    #[arg(long, value_name = "FILE")]
    pub plant: Option<PathBuf>,
    /// What simulates it
    #[arg(long, value_enum, default_value_t = Simulator::Plant, requires = "plant")]
    pub simulator: Simulator,
    /// Nominal input voltage in V; with --plant the plant's unless given
    #[arg(long, value_name = "V", required_unless_present = "plant")]
    pub v_in: Option<f64>,
    /// Duty ratios: a list 0.4,0.5,0.6 or FROM:STEP:TO
    #[arg(long, value_name = "LIST", value_parser = duties)]
    pub duties: Duties,
    #[command(flatten)]
    pub loads: Loads,
    /// Table to write
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// Take measured points over from this table and go on with the others
    #[arg(long, value_name = "TABLE")]
    pub resume: Option<PathBuf>,
    /// Pause after each point at the bench, in s; a simulated converter has no temperature and is not waited for
    #[arg(long, value_name = "S", default_value_t = 0.0)]
    pub cool_down: f64,
    /// Periods whose mean is one figure
    #[arg(long, value_name = "N", default_value_t = 500, value_parser = clap::value_parser!(u32).range(2..=1_000_000))]
    pub window: u32,
    /// After so many windows a point counts as unsettled
    #[arg(long, value_name = "N", default_value_t = 40, value_parser = clap::value_parser!(u32).range(3..=100_000))]
    pub most_windows: u32,
}

/// Duty ratios on the command line.
#[derive(Debug, Clone)]
pub struct Duties(Vec<f64>);

fn duties(text: &str) -> Result<Duties, String> {
    let number = |text: &str| {
        let number = text.trim().parse::<f64>().ok().filter(|number| number.is_finite());
        number.ok_or_else(|| format!("`{text}` is not a number"))
    };
    let parts: Vec<&str> = text.split(':').collect();
    let [from, step, to] = parts[..] else {
        return Ok(Duties(text.split(',').map(number).collect::<Result<_, _>>()?));
    };
    let (from, step, to) = (number(from)?, number(step)?, number(to)?);
    let count = ((to - from) / step + 1e-9).floor();
    if !(step > 0.0 && (0.0..1000.0).contains(&count)) {
        return Err("expected FROM:STEP:TO with STEP > 0, FROM below TO and at most 1000 duties".to_owned());
    }
    // in steps of 1e-9, so that 0.1 + 0.2 is written 0.3
    let tidy = |duty: f64| (duty * 1e9).round() / 1e9;
    Ok(Duties(
        (0..=count as u32).map(|k| tidy(from + f64::from(k) * step)).collect(),
    ))
}

/// Measures or plans.
pub fn run(options: &Acquire) -> Result<Outcome, Failure> {
    let parameters = options.plant.as_deref().map(super::plant_parameters).transpose()?;
    let nominal = parameters.as_ref().map(|parameters| parameters.converter.v_in);
    let v_in = options.v_in.or(nominal).unwrap_or_default();
    let mut plan = Plan::new(v_in, &options.duties.0, &options.loads.settings(), options.cool_down)?;
    let kept = match &options.resume {
        Some(path) => plan.resume(&Sheet::open(path, &Table::file_options())?)?,
        None => 0,
    };
    let measured = match &parameters {
        Some(parameters) => measure_open(options, parameters, &mut plan)?,
        None => 0,
    };
    output::write_one(&options.out, &plan.to_csv()?)?;
    output::say(&summary(options, &plan, kept, measured))?;
    Ok(Outcome::Done)
}

/// Measures what is open; in ngspice, where it takes long, the table is written after each point, so that an
/// interrupted run can be resumed.
fn measure_open(options: &Acquire, parameters: &Parameters, plan: &mut Plan) -> Result<usize, Failure> {
    let mut bench = options.simulator.bench(parameters)?;
    let protocol = Protocol {
        window: options.window as usize,
        most_windows: options.most_windows as usize,
    };
    let mut progress = ProgressLine::new();
    let mut measured = 0;
    for index in 0..plan.points.len() {
        let (point, None) = plan.points[index] else { continue };
        progress.show(|| format!("point {} of {}: {}", index + 1, plan.points.len(), point.load));
        plan.points[index].1 = Some(measure(bench.as_mut(), parameters, &point, &protocol)?);
        measured += 1;
        if options.simulator == Simulator::Ngspice {
            output::write_one(&options.out, &plan.to_csv()?)?;
        }
    }
    progress.clear();
    Ok(measured)
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
