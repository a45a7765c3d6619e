//! A build that answers one event at a time, for a loop that is closed around it.

use std::process::Command;
use std::time::Duration;

use codegen::Language;
use interp::{Controller, Sample};
use policy::{Policy, Scalar};
use toml_input::{Faults, Message};

use crate::protocol::{self, Layout};
use crate::runner::{ProcessRunner, Runner};
use crate::session::COMPILER_TIMEOUT;
use crate::toolchain::{self, Build, BuildError, Purpose, Sources};
use crate::traces::Event;

/// What a build commands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LiveCommand {
    /// Duty, 0..1.
    pub duty: f64,
    /// Index of the chosen action.
    pub action_index: u32,
    /// Bits of [`interp::status`].
    pub status: u32,
}

/// The generated code of a policy as a running program.
#[derive(Debug)]
pub struct Live {
    name: String,
    runner: ProcessRunner,
    layout: Layout,
    words: Vec<u32>,
    /// Places of the first duty, the first action, status and purity in the answer to a step.
    places: [usize; 4],
    /// Duties of a command: one for each output.
    duties: usize,
    /// Holds the program until it has ended.
    _folder: tempfile::TempDir,
}

/// A build that is silent for so long has failed.
// a step of a native build takes microseconds; seconds are a machine under load
const TIMEOUT: Duration = Duration::from_secs(20);
/// The level that is built of each compiler.
// of C and of Rust: a level of each that firmware is built with
const LEVELS: [&str; 2] = ["-O2", "-O"];

impl Live {
    /// Generates the policy's code for this machine, builds it optimised with the first compiler of `language` on `PATH`
    /// and starts it.
    ///
    /// # Errors
    /// If there is no compiler, it refuses the code, or the program does not start as it should.
    pub fn start(policy: &Policy, language: Language) -> Result<Self, Faults> {
        let target = targets::host();
        let files = codegen::sources(policy, target, &[language.core()], None)?;
        let build = build_for(language)?;
        let folder =
            tempfile::tempdir().map_err(|error| Message::new(format!("cannot make a temporary folder: {error}")))?;
        let sources = Sources {
            purpose: Purpose::Compare,
            policy,
            files: &files.files,
            target,
            extra_flags: &[],
            extra_rust_flags: &[],
            timeout: COMPILER_TIMEOUT,
        };
        let name = build.name();
        let executable = toolchain::compile(&build, sources, folder.path()).map_err(|error| refused(&name, error))?;
        let layout = match policy.numeric_format.scalar() {
            Scalar::F32 => Layout::new(policy, Controller::<f32>::new(policy).state_names()),
            Scalar::F64 => Layout::new(policy, Controller::<f64>::new(policy).state_names()),
        };
        let mut runner = ProcessRunner::new(apart(Command::new(executable)), TIMEOUT, target.endianness);
        let hello = runner
            .start(layout.hello().len())
            .map_err(|error| Message::new(format!("{name}: {}", error.reason)))?;
        // a program whose tables or arithmetic are wrong must not close a loop
        if hello != layout.hello() {
            let problem = format!("{name}: self-test, integrity or sizes of the generated code are wrong");
            return Err(Message::new(problem).into());
        }
        // the layout depends on the kind of the event alone
        let step = layout.answer(&Event::Step(Vec::new()));
        // of several outputs each of these words has the output's name behind it, and the first counts
        let is = |word: &str, name: &str| word.split_once(' ').map_or(word, |(stem, _)| stem) == name || word == name;
        let place = |name: &str| step.iter().position(|word| is(&word.name, name));
        let places = match ["duty", "action_index", "status", "purity"].map(place) {
            [Some(a), Some(b), Some(c), Some(d)] => [a, b, c, d],
            _ => return Err(Message::new("internal fault: the answer to a step lacks a word").into()),
        };
        Ok(Self {
            name,
            runner,
            layout,
            words: Vec::new(),
            places,
            duties: policy.paths().len(),
            _folder: folder,
        })
    }

    /// Compiler and level, such as `gcc -O2`.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// A new controller.
    ///
    /// # Errors
    /// If the program does not answer.
    pub fn restart(&mut self) -> Result<(), Faults> {
        self.ask(&Event::Init).map(|_| ())
    }

    /// One control step; one sample per signal. Of several outputs the first.
    ///
    /// # Errors
    /// If the program does not answer, or its `eval` and `commit` contradict its `step`.
    pub fn step(&mut self, samples: &[Sample]) -> Result<LiveCommand, Faults> {
        let all = self.step_all(samples)?;
        let first = all.first().copied();
        first.ok_or_else(|| Message::new("internal fault: a command without a duty").into())
    }

    /// [`Live::step`] with a command for each output, in their order.
    ///
    /// # Errors
    /// As [`Live::step`].
    pub fn step_all(&mut self, samples: &[Sample]) -> Result<Vec<LiveCommand>, Faults> {
        let answer = self.ask(&Event::Step(samples.to_vec()))?;
        let [duty, action, status, purity] = self.places;
        // the duties stand before those without mapping, and these before the actions
        let numbers = protocol::numbers(self.layout.scalar(), &answer[duty..action]);
        let actions = &answer[action..status];
        let [status, purity] = [status, purity].map(|place| answer[place]);
        if purity != 0 {
            return Err(Message::new(format!("{}: eval and commit contradict step", self.name)).into());
        }
        let command = |(duty, action): (&f64, &u32)| LiveCommand {
            duty: *duty,
            action_index: *action,
            status,
        };
        Ok(numbers.iter().take(self.duties).zip(actions).map(command).collect())
    }

    fn ask(&mut self, event: &Event) -> Result<Vec<u32>, Faults> {
        self.words.clear();
        protocol::encode(event, self.layout.scalar(), &mut self.words);
        let expected = self.layout.answer_len(event);
        let answer = self.runner.exchange(&self.words, expected);
        answer.map_err(|error| Message::new(format!("{}: {}", self.name, error.reason)).into())
    }
}

/// Ctrl-C is the caller's business, not the program's.
#[cfg(unix)]
fn apart(mut command: Command) -> Command {
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    command
}

#[cfg(not(unix))]
fn apart(command: Command) -> Command {
    command
}

fn build_for(language: Language) -> Result<Build, Faults> {
    let builds = toolchain::builds(targets::host(), &[], &[]);
    let suits = |build: &&Build| build.language() == language && LEVELS.contains(&build.level);
    let found = builds.iter().filter(suits).find(|build| build.missing.is_empty());
    found.cloned().ok_or_else(|| {
        let names: Vec<&str> = builds.iter().filter(suits).map(|build| build.compiler).collect();
        let message = Message::new(format!("no compiler for {} on PATH", language.name()));
        message.expected(names.join(" or ")).into()
    })
}

fn refused(name: &str, error: BuildError) -> Message {
    match error {
        BuildError::NoFiles | BuildError::NoSanitiser => Message::new(format!("{name}: nothing to build")),
        BuildError::Io(error) => Message::new(format!("{name}: could not compile: {error}")),
        BuildError::Refused(text) | BuildError::TooLarge(text) => {
            Message::new(format!("{name} refused the generated code")).found(text)
        }
    }
}
