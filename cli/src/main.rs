//! `policyc`: from a trained policy to verified controller code.

mod arguments;
mod commands;
mod failure;
mod interruption;
mod one_of;
mod outcome;
mod output;
mod ownership;
mod staging;

use std::process::ExitCode;

use clap::Parser;

use arguments::{Arguments, Command};
use failure::Failure;
use outcome::Outcome;

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let result = run(&arguments.command);
    interruption::go_no_further_if_ending();
    match result {
        Ok(outcome) => ExitCode::from(outcome as u8),
        Err(failure) => {
            failure.print();
            ExitCode::from(2)
        }
    }
}

fn run(command: &Command) -> Result<Outcome, Failure> {
    if command.ends_by_itself() {
        // before the first signal is heeded: one in between would end the program without a word
        interruption::stop_on_signal();
    }
    let _scratch = interruption::watch()?;
    match command {
        Command::New(options) => commands::new::run(options),
        Command::Inspect(options) => commands::inspect::run(options),
        Command::Compile(options) => commands::compile::run(options),
        Command::Replay(options) => commands::replay::run(options),
        Command::Verify(options) => commands::verify::run(options),
        Command::Prove(options) => commands::prove::run(options),
        Command::Certify(options) => commands::certify::run(options),
        Command::Targets(options) => commands::targets::run(options),
        Command::Train(options) => commands::train::run(options),
        Command::Diagnose(options) => commands::diagnose::run(options),
        Command::Simulate(options) => commands::simulate::run(options),
        Command::Demo(options) => commands::demo::run(options),
        Command::Drm(command) => commands::drm::run(command),
    }
}
