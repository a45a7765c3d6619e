//! What the commands make, as data: the wheel hands it to its user in the place of files.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

use clap::{CommandFactory, Parser};
use policy::{NumericFormat, Policy};
use toml_input::Message;

use crate::arguments::drm::Drm;
use crate::arguments::{Arguments, Command, Engine, Outside};
use crate::commands;
use crate::failure::Failure;
use crate::made;
pub use crate::ownership::Replacing;

pub use crate::campaign::{
    Finished as FinishedCampaign, Local, Performed, Progress, Session, check as check_campaign, perform, set_program,
};
pub use commands::campaign::summary as campaign_summary;

pub use commands::certify::{Made as Certified, Request as CertifyRequest, make as certify};
pub use commands::compile::{Made as Compiled, Request as CompileRequest, make as compile};
pub use commands::inspect::json as inspect_json;
pub use verify::text::inspection as inspect_text;

/// All commands with their options, as clap knows them.
#[must_use]
pub fn command() -> clap::Command {
    Arguments::command()
}

/// The policy at `path`, with one output or several, which is a contract or its folder, in another numeric format if one is asked for.
///
/// # Errors
/// All faults of its files.
pub fn load(path: &Path, allow_outside: bool, format: Option<NumericFormat>) -> Result<Policy, Failure> {
    commands::load_several_as(path, Outside { allow_outside }, format)
}

/// What `policyc simulate`, `policyc diagnose` or `policyc drm fit` would write for the command line `arguments`, the command's
/// name first. Of a fit: `drm.toml`, `report.html`, `report.txt`, `report.json`.
///
/// # Errors
/// A fault of the command line or of the files that it names; another command.
pub fn files<'a>(arguments: impl IntoIterator<Item = &'a str>) -> Result<BTreeMap<String, String>, Failure> {
    let arguments: Vec<&str> = arguments.into_iter().collect();
    made::heed(arguments.iter().map(OsString::from));
    let line = std::iter::once("policyc").chain(arguments);
    let arguments = Arguments::try_parse_from(line).map_err(|error| {
        let text = error.to_string();
        // the rest is how to call the command
        let first = text.lines().next().unwrap_or_default();
        Message::new(first.trim_start_matches("error: "))
    })?;
    match &arguments.command {
        Command::Simulate(options) => commands::simulate::files(options),
        Command::Diagnose(options) => commands::diagnose::files(options),
        Command::Drm(Drm::Fit(options)) => {
            let made = commands::drm::fit::make(options, true)?;
            let page = commands::drm::fit::signed(options, &made)?;
            let files = [
                ("drm.toml", Some(made.mapping)),
                ("report.html", page),
                ("report.json", Some(made.json)),
                ("report.txt", Some(made.text)),
            ];
            let named = files.into_iter().map(|(name, text)| Some((name.to_owned(), text?)));
            Ok(named.flatten().collect())
        }
        _ => Err(Message::new("this command has no files to hand over").into()),
    }
}

/// A campaign that was asked for on a cluster.
#[derive(Debug, Clone)]
pub struct OnRay {
    /// The plan's path.
    pub plan: PathBuf,
    /// Folder of the results.
    pub out: PathBuf,
    /// The cluster; without one it is Ray's to find.
    pub address: Option<String>,
    /// Whether files of others may be replaced.
    pub force: bool,
    /// Whether the answer is for a program.
    pub json: bool,
    /// Whether progress is left out.
    pub quiet: bool,
}

/// What is asked for, if the command line (the program's name first) is one of `policyc campaign --engine ray` that runs tasks.
/// Whatever else it is, and whatever is wrong with it, is the command's to say.
#[must_use]
pub fn on_ray(arguments: impl IntoIterator<Item = OsString>) -> Option<OnRay> {
    let arguments = Arguments::try_parse_from(arguments).ok()?;
    let Command::Campaign(campaign) = arguments.command else {
        return None;
    };
    let runs = campaign.engine == Engine::Ray && !campaign.list && campaign.write.is_none();
    runs.then_some(OnRay {
        plan: campaign.plan,
        out: campaign.out,
        address: campaign.address,
        force: campaign.replacing.force,
        json: campaign.json,
        quiet: arguments.loudness.quiet,
    })
}
