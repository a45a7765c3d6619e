//! `policyc replay`

use std::path::Path;

use policy::{Golden, Policy};
use serde::Serialize;
use toml_input::Message;
use verify::replay::{self, Log, Wanted};

use super::progress_line::Working;
use crate::arguments::Replay;
use crate::failure::Failure;
use crate::outcome::Outcome;
use crate::output;
use crate::talk;

/// What `--json` prints.
#[derive(Serialize)]
struct Answer {
    equal: bool,
    #[serde(flatten)]
    replay: replay::Replay,
}

/// Compares and reports.
pub fn run(options: &Replay) -> Result<Outcome, Failure> {
    let policy = super::load_for_a_log(&options.policy, options.outside)?;
    let policy = match options.format {
        Some(format) => policy.with_format(format),
        None => policy,
    };
    let working = Working::new("replaying the log");
    let log = Log::open(&policy, &options.log, &options.map.join(","))?;
    if !log.compares() {
        let message = Message::new("the log has nothing to compare with").found(log.columns());
        let action = match policy.output_names().as_slice() {
            [] => "`action`".to_owned(),
            names => names
                .iter()
                .map(|name| format!("`action_{name}`"))
                .collect::<Vec<_>>()
                .join(", "),
        };
        return Err(message
            .expected(format!(
                "columns `obs_0`, `obs_1`, ... in the network's order, or {action}, beside the signals"
            ))
            .hint("columns of other names: --map obs_0=NAME,obs_1=NAME,action=NAME")
            .into());
    }
    let replay = replay::replay(
        &policy,
        &log,
        Wanted {
            tolerance: options.tolerance,
            exploring: options.exploring,
            skip: options.skip,
        },
    )?;
    drop(working);
    for note in &replay.notes {
        talk::note(&format!("{}: {note}", options.log.display()));
    }
    let equal = replay.equal();
    let golden = match &options.golden {
        Some(file) if equal || replay.format.is_some() => Some((file, replay::answers(&policy, &log)?)),
        _ => None,
    };
    if options.json {
        output::say_json(&Answer { equal, replay })?;
    } else {
        output::say(replay::text(&policy, &replay).trim_end())?;
    }
    if let Some((file, golden)) = golden {
        output::write_new_one(file, policy::golden_file(&policy, &golden)?, "--golden")?;
        talk::note(&kept(file, &policy, &golden));
    } else if let Some(file) = &options.golden {
        talk::note(&format!("{}: not written, since the log is not equal", file.display()));
    }
    Ok(if equal { Outcome::Done } else { Outcome::Different })
}

/// What is said of golden answers that were written.
fn kept(file: &Path, policy: &Policy, golden: &Golden) -> String {
    let tolerance = replay::tolerance(policy, golden);
    let tolerance = tolerance.map(|share| {
        format!(", and golden_tolerance = {share} beside it, for the digits of the log are farther off the network than the contract allows")
    });
    let rows = golden.count + golden.outside;
    let left_out = (golden.outside > 0).then(|| {
        format!(
            "; {} of {rows} rows are left out: a signal is outside its range there, or the observation is none that a plausible measurement \
             gives, and the controller never answers it",
            golden.outside
        )
    });
    format!(
        "{}: {} golden answers; name it in [network]: golden = \"{}\"{}{}",
        file.display(),
        golden.count,
        file.file_name().unwrap_or_default().display(),
        tolerance.unwrap_or_default(),
        left_out.unwrap_or_default()
    )
}
