//! `policyc drm transfer`: the paper's procedure, from the simulation to converters that are not the simulated one

use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use closed_loop::transfer::{Findings, Means, PAGE, Setting, transfer};
use closed_loop::{Converter, Environment, Error, Scenario};
use plant::Parameters;
use spice::SpiceConverter;

use crate::arguments::drm::{Simulator, Transfer};
use crate::commands::controllers;
use crate::commands::foreign::opener;
use crate::commands::progress_line::{Pace, ProgressLine};
use crate::failure::Failure;
use crate::interruption;
use crate::made;
use crate::outcome::Outcome;
use crate::output;
use crate::talk;

/// Transfers, writes, reports.
pub fn run(options: &Transfer) -> Result<Outcome, Failure> {
    output::check_new_folder(&options.out)?;
    let mut scenario = Scenario::load(&options.scenario)?;
    if options.output.is_some() {
        scenario.output.clone_from(&options.output);
    }
    let policy = crate::commands::load_several_as(&options.policy, options.outside, None)?;
    let setting = Setting::new(&options.scenario, scenario, policy)?;
    let stop = interruption::stop_on_signal();
    let found = match options.simulator {
        Simulator::Plant => {
            let open = opener(options.foreign);
            let names_fmu = |path: &PathBuf| Parameters::nominal_from_file(path).is_ok_and(|(_, is_fmu)| is_fmu);
            let simulator = match options.real.iter().filter(|path| names_fmu(path)).count() {
                0 => "the plant of this program",
                n if n == options.real.len() => "FMUs",
                _ => "FMUs, and the plant of this program where a file names none",
            };
            at(options, setting, simulator, &|path, _| {
                Converter::open(path, &[], &open)
            })
        }
        Simulator::Ngspice => at(options, setting, "ngspice", &|path, _| {
            // read once more: ngspice has no FMU
            SpiceConverter::new(&Parameters::from_file(path)?)
        }),
    };
    if stop.load(Ordering::Relaxed) {
        talk::interrupted("nothing written");
        return Ok(Outcome::Interrupted);
    }
    let found = found?;
    let mut files = found.files()?;
    let real: Vec<String> = options.real.iter().map(|path| path.display().to_string()).collect();
    let read = [
        ("scenario", options.scenario.display().to_string()),
        ("policy", options.policy.display().to_string()),
        ("converters", real.join(", ")),
    ];
    made::signed(&mut files, &[("--out", "transfer")], &read)?;
    output::write_results(&options.out, &files)?;
    output::say_results(&options.out, &files, &found.summary(), PAGE)?;
    Ok(Outcome::Done)
}

/// Transfers to converters that are simulated so.
fn at<E: Environment>(
    options: &Transfer,
    setting: Setting,
    simulator: &'static str,
    simulate: &dyn Fn(&Path, &Parameters) -> Result<E, Error>,
) -> Result<Findings, Failure> {
    let (mut line, pace) = (ProgressLine::new(), Pace::new());
    let output = setting.output;
    let means = Means {
        simulator,
        simulate,
        start: &|policy| controllers::start(policy, output, options.controller),
        ideal: options.ideal,
        tell: &mut |next| line.next(next, pace),
    };
    let found = transfer(setting, &options.real, means)?;
    line.clear();
    Ok(found)
}
