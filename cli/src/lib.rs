//! The command `policyc` as a library: the program calls [`main`], and so does the wheel, in process; [`api`] is what the wheel
//! calls beside it.

// both end the program where nobody listens any more, `policyc ... | head`: `output` writes answers, `talk` the rest
#![deny(clippy::print_stderr, clippy::print_stdout)]

pub mod api;
mod arguments;
mod campaign;
mod commands;
mod failure;
mod interruption;
mod look;
mod made;
mod one_of;
mod outcome;
mod output;
mod ownership;
mod staging;
mod studio;
mod talk;
mod welcome;

use std::ffi::OsString;
use std::time::Instant;

use clap::Parser;

use arguments::{Arguments, Command};
pub use failure::Failure;
use outcome::Outcome;

/// Runs the command line `arguments`, the program's name first, and returns its exit code: 0 done, 1 different, 2 a fault of the
/// input or of the command line, 130 interrupted. Prints as the program does. Once a process: it takes over the signals.
#[must_use]
pub fn main(arguments: impl IntoIterator<Item = OsString>) -> u8 {
    let arguments: Vec<OsString> = arguments.into_iter().collect();
    if let [_, only] = arguments.as_slice()
        && only == campaign::WORKER
    {
        return campaign::work() as u8;
    }
    look::choose(&arguments);
    if arguments.len() == 1 {
        welcome::print();
        return 2;
    }
    made::heed(arguments.iter().skip(1).cloned());
    let arguments = match Arguments::try_parse_from(arguments) {
        Ok(arguments) => arguments,
        Err(error) => {
            // a closed pipe is no reason for another exit code
            let _ = error.print();
            return u8::try_from(error.exit_code()).unwrap_or(2);
        }
    };
    talk::set(arguments.loudness);
    let begun = Instant::now();
    let result = run(&arguments.command);
    interruption::go_no_further_if_ending();
    let code = match result {
        Ok(outcome) => outcome as u8,
        Err(failure) => {
            failure.print();
            2
        }
    };
    talk::tell_more(|| format!("took {:.1} s", begun.elapsed().as_secs_f64()));
    code
}

fn run(command: &Command) -> Result<Outcome, Failure> {
    if command.ends_by_itself() {
        // before the first signal is heeded: one in between would end the program without a word
        interruption::stop_on_signal();
    }
    let _scratch = interruption::watch()?;
    dispatch(command)
}

/// The command itself, as often as is wanted in a process.
fn dispatch(command: &Command) -> Result<Outcome, Failure> {
    match command {
        Command::New(options) => commands::new::run(options),
        Command::Inspect(options) => commands::inspect::run(options),
        Command::Compile(options) => commands::compile::run(options),
        Command::Replay(options) => commands::replay::run(options),
        Command::Verify(options) => commands::verify::run(options),
        Command::Prove(options) => commands::prove::run(options),
        Command::Certify(options) => commands::certify::run(options),
        Command::Limit(options) => commands::limit::run(options),
        Command::Design(options) => commands::design::run(options),
        Command::Targets(options) => commands::targets::run(options),
        Command::Train(options) => commands::train::run(options),
        Command::Diagnose(options) => commands::diagnose::run(options),
        Command::Simulate(options) => commands::simulate::run(options),
        Command::Campaign(options) => commands::campaign::run(options),
        Command::Merge(options) => commands::merge::run(options),
        Command::Demo(options) => commands::demo::run(options),
        Command::Studio(options) => commands::studio::run(options),
        Command::Drm(command) => commands::drm::run(command),
        Command::Completions(options) => commands::completions::run(options),
        Command::Manpages(options) => commands::manpages::run(options),
    }
}
