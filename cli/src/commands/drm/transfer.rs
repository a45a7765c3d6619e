//! `policyc drm transfer`: the paper's procedure, from the simulation to converters that are not the simulated one

use std::sync::atomic::Ordering;

use closed_loop::transfer::{Findings, Means, PAGE, Setting, transfer};
use closed_loop::{Converter, Environment, Error, Scenario};
use plant::Parameters;
use spice::SpiceConverter;

use crate::arguments::drm::{Simulator, Transfer};
use crate::commands::controllers;
use crate::commands::progress_line::ProgressLine;
use crate::failure::Failure;
use crate::interruption;
use crate::made;
use crate::outcome::Outcome;
use crate::output;
use crate::talk;

/// Transfers, writes, reports.
pub fn run(options: &Transfer) -> Result<Outcome, Failure> {
    output::check_new_folder(&options.out)?;
    let scenario = Scenario::load(&options.scenario)?;
    let policy = crate::commands::load(&options.policy, options.outside)?;
    let setting = Setting::new(&options.scenario, scenario, policy)?;
    let stop = interruption::stop_on_signal();
    let found = match options.simulator {
        Simulator::Plant => at(options, setting, "the plant of this program", Converter::new),
        Simulator::Ngspice => at(options, setting, "ngspice", SpiceConverter::new),
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
    simulate: fn(&Parameters) -> Result<E, Error>,
) -> Result<Findings, Failure> {
    let mut line = ProgressLine::new();
    let means = Means {
        simulator,
        simulate,
        start: &|policy| controllers::start(policy, options.controller),
        ideal: options.ideal,
        tell: &mut |what| line.next(what),
    };
    let found = transfer(setting, &options.real, means)?;
    line.clear();
    Ok(found)
}
