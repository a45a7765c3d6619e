//! `policyc new`

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use closed_loop::limits;
use plant::Parameters;
use policy::seen_from;
use toml_input::Fault;
use train::start::{SCENARIO, Start, TRAINING, Wanted};

use super::progress_line::Working;
use crate::arguments::New;
use crate::failure::Failure;
use crate::outcome::Outcome;
use crate::output;
use crate::talk;

/// Writes a contract skeleton for what a trainer saved, and weights beside it where they had to be changed; or what a
/// training on a plant starts from.
pub fn run(options: &New) -> Result<Outcome, Failure> {
    match (&options.weights, &options.plant, options.v_ref.zip(options.loads)) {
        (_, Some(plant), Some((v_ref, loads))) => for_plant(options, plant, Wanted { v_ref, loads }),
        (Some(weights), ..) => for_weights(options, weights),
        // the parser has asked for one of both
        _ => Ok(Outcome::Done),
    }
}

/// The name of a TOML file is that of the contract; every other is that of a folder, as with every other `--out`, `buck-3.3` too.
fn contract(out: &Path) -> PathBuf {
    match out.extension() {
        Some(extension) if extension.eq_ignore_ascii_case("toml") => out.to_owned(),
        _ => out.join("policy.toml"),
    }
}

fn for_weights(options: &New, weights: &Path) -> Result<Outcome, Failure> {
    let out = &contract(&options.out);
    let known = import::Options {
        actions: options.actions,
        output: options.output,
        outputs: options.outputs.clone(),
        gains: options.gains,
        inside: options.inside.clone(),
        vecnormalize: options.vecnormalize.clone(),
    };
    let working = Working::new("reading what the trainer saved");
    let new = import::new_policy(weights, out, &known)?;
    drop(working);
    output::write_new_all(out, &new.contract, &new.beside)?;
    for line in &new.said {
        output::say(line)?;
    }
    for name in new.beside.keys() {
        output::say(&format!("wrote {}", out.with_file_name(name).display()))?;
    }
    let path = out.display();
    output::say(&format!(
        "wrote {path}: fill in what says TODO, look at what says check, then\n  policyc inspect {path}"
    ))?;
    Ok(Outcome::Done)
}

fn for_plant(options: &New, file: &Path, wanted: Wanted) -> Result<Outcome, Failure> {
    // beside an FMU the nominal numbers: they are what is designed on
    let (plant, is_fmu) = Parameters::nominal_from_file(file)?;
    let working = Working::new("designing, and searching the limit");
    let start = Start::new(&plant, file, wanted).map_err(|faults| faults.in_file(file))?;
    drop(working);
    let out = &contract(&options.out);
    let from_there = |path: &Path| -> Result<String, Failure> {
        seen_from(out, path).map_err(|message| Fault::in_file(path, message).into())
    };
    let (plant, contract) = (from_there(file)?, from_there(out)?);
    let beside = BTreeMap::from([
        (TRAINING.to_owned(), start.training(&contract, &plant).into_bytes()),
        (SCENARIO.to_owned(), start.scenario(&plant).into_bytes()),
    ]);
    output::write_new_all(out, &start.contract(), &beside)?;
    output::say(&format!(
        "What no controller can beat on this plant, at sampling instants / at the worst instant:\n\n{}\n",
        limits(start.limits()).trim_end()
    ))?;
    start.notes().iter().for_each(|note| talk::note(note));
    let [training, scenario] = [TRAINING, SCENARIO].map(|name| out.with_file_name(name));
    let folder = out.with_file_name("trained");
    let allowed = if is_fmu { " --run-fmu" } else { "" };
    output::say(&format!(
        "wrote {}, {} and {}: signals, loads and limits are yours to change, then\n  policyc train {}{allowed} --out {}\n  policyc simulate \
         {}{allowed} --policy {} --out {}",
        out.display(),
        training.display(),
        scenario.display(),
        training.display(),
        folder.display(),
        scenario.display(),
        folder.display(),
        out.with_file_name("loop").display(),
    ))?;
    Ok(Outcome::Done)
}
