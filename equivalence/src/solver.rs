//! Solvers of SMT-LIB 2 that are installed, and one run of one.

use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

/// A program that reads SMT-LIB 2 from its standard input.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Solver {
    /// `bitwuzla`, `cvc5` or `z3`.
    pub name: &'static str,
    /// As the program says it.
    pub version: String,
    program: PathBuf,
    arguments: Vec<String>,
    /// What it may do for one goal, in a unit of its own; nothing if it has no such limit.
    work: Option<&'static str>,
}

/// Fastest on these goals first; the measurements are in `docs/reference/equivalence.md`.
const KNOWN: [(&str, &[&str], Option<&str>); 3] = [
    ("bitwuzla", &["--lang", "smt2"], None),
    (
        "cvc5",
        &["--lang", "smt2", "--produce-models", "--rlimit-per=10000000"],
        Some("10000000 of cvc5's resource units"),
    ),
    (
        "z3",
        &["-in", "-smt2", "rlimit=500000000"],
        Some("500000000 of z3's resource units"),
    ),
];

/// Bitwuzla as a Python package: its own parser, over a pipe. Its search asks now and then whether to go on, and always as often for the
/// same goal: so a count of that is a limit that does not depend on the machine.
// fifteen times what the slowest goal of the random policies takes
const PYTHON: &str = "import sys, bitwuzla
options = bitwuzla.Options()
options.set(bitwuzla.Option.PRODUCE_MODELS, True)
parser = bitwuzla.Parser(bitwuzla.TermManager(), options)
asked = 0
def is_over():
    global asked
    asked += 1
    return asked > 4000000
parser.configure_terminator(is_over)
parser.parse(sys.stdin.read(), parse_only=False, parse_file=False)
";
const PYTHON_WORK: &str = "4000000 questions of Bitwuzla's search whether to go on";
const PYTHON_VERSION: &str = "import bitwuzla, importlib.metadata as m; print(m.version('bitwuzla'))";

/// cvc5 as a Python package, which brings no program along: command by command, with the limit of the program.
const PYTHON_CVC5: &str = "import sys, cvc5
solver = cvc5.Solver(cvc5.TermManager())
solver.setOption('produce-models', 'true')
solver.setOption('rlimit-per', '10000000')
parser = cvc5.InputParser(solver)
parser.setStringInput(cvc5.InputLanguage.SMT_LIB_2_6, sys.stdin.read(), 'goal')
symbols = parser.getSymbolManager()
while not (command := parser.nextCommand()).isNull():
    print(command.invoke(solver, symbols), end='')
";
const PYTHON_CVC5_VERSION: &str = "import cvc5, importlib.metadata as m; print(m.version('cvc5'))";

/// How often a running solver is looked at.
const LOOK: Duration = Duration::from_millis(2);
/// A program that does not say its version by then is not used.
const VERSION_TIME: Duration = Duration::from_secs(10);

impl Solver {
    /// All solvers that are there, fastest first.
    #[must_use]
    pub fn find() -> Vec<Solver> {
        let mut found = Vec::new();
        for (name, arguments, work) in KNOWN {
            let program = PathBuf::from(name);
            let arguments = arguments.iter().map(|argument| (*argument).to_owned()).collect();
            found.extend(said(&program, &["--version"]).map(|said| Solver {
                name,
                version: number_in(&said),
                program,
                arguments,
                work,
            }));
            if found.iter().all(|solver| solver.name != name) {
                let python = Path::new("python3");
                found.extend(match name {
                    "bitwuzla" => Solver::in_python(python),
                    "cvc5" => Solver::package(python, (name, work), PYTHON_CVC5_VERSION, PYTHON_CVC5),
                    // its package has the program
                    _ => None,
                });
            }
        }
        found
    }

    /// The Python package `bitwuzla`, if that interpreter has it.
    #[must_use]
    pub fn in_python(python: &Path) -> Option<Solver> {
        Solver::package(python, ("bitwuzla", Some(PYTHON_WORK)), PYTHON_VERSION, PYTHON)
    }

    /// A solver that a Python program drives.
    fn package(
        python: &Path,
        (name, work): (&'static str, Option<&'static str>),
        version: &str,
        text: &str,
    ) -> Option<Solver> {
        let version = said(python, &["-c", version])?;
        Some(Solver {
            name,
            version: format!("{} in Python", number_in(&version)),
            program: python.to_owned(),
            arguments: vec!["-c".into(), text.into()],
            work,
        })
    }

    /// Name and version.
    #[must_use]
    pub fn title(&self) -> String {
        format!("{} {}", self.name, self.version)
    }

    /// The work after which it gives a goal up, wherever it runs; nothing if the clock alone ends it.
    #[must_use]
    pub fn work(&self) -> Option<&'static str> {
        self.work
    }

    /// What the solver answers to `text`, within `limit`; the process ends with the call.
    pub(crate) fn ask(&self, text: &str, limit: Duration, interrupt: &AtomicBool) -> Result<String, Silence> {
        let mut command = Command::new(&self.program);
        command.args(&self.arguments);
        answer(&mut command, text, limit, interrupt)
    }
}

/// Why there is no answer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Silence {
    TimeOut,
    Interrupted,
    /// The program could not be started, or ended without a word.
    Failed(String),
}

/// Ends its process when it is dropped, so that none outlives its goal.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn answer(command: &mut Command, text: &str, limit: Duration, interrupt: &AtomicBool) -> Result<String, Silence> {
    let failed = |error: std::io::Error| Silence::Failed(error.to_string());
    command
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    let start = Instant::now();
    let mut running = Running(command.spawn().map_err(failed)?);
    let input = running.0.stdin.take();
    let (output, errors) = (running.0.stdout.take(), running.0.stderr.take());
    thread::scope(|scope| {
        scope.spawn(move || input.map(|mut pipe| pipe.write_all(text.as_bytes())));
        let output = scope.spawn(move || all_of(output));
        let errors = scope.spawn(move || all_of(errors));
        let ended = loop {
            match running.0.try_wait() {
                Ok(Some(_)) => break Ok(()),
                Err(error) => break Err(failed(error)),
                Ok(None) if interrupt.load(Ordering::Relaxed) => break Err(Silence::Interrupted),
                Ok(None) if start.elapsed() >= limit => break Err(Silence::TimeOut),
                Ok(None) => thread::sleep(LOOK),
            }
        };
        // its pipes close with it, so that the threads end
        drop(running);
        let output = output.join().unwrap_or_default();
        let errors = errors.join().unwrap_or_default();
        ended?;
        match output.trim().is_empty() {
            true => Err(Silence::Failed(errors.trim().to_owned())),
            false => Ok(output),
        }
    })
}

fn all_of(pipe: Option<impl Read>) -> String {
    let mut bytes = Vec::new();
    if let Some(mut pipe) = pipe {
        let _ = pipe.read_to_end(&mut bytes);
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

fn said(program: &Path, arguments: &[&str]) -> Option<String> {
    let mut command = Command::new(program);
    command.args(arguments);
    answer(&mut command, "", VERSION_TIME, &AtomicBool::new(false)).ok()
}

/// The first thing in `text` that looks like a version.
fn number_in(text: &str) -> String {
    let words = text.split(|c: char| c.is_whitespace() || c == ']' || c == '-');
    let is_version = |word: &&str| word.contains('.') && word.starts_with(|c: char| c.is_ascii_digit());
    words
        .into_iter()
        .find(is_version)
        .unwrap_or("of unknown version")
        .to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn deaf() -> Solver {
        Solver {
            name: "sleep",
            version: String::new(),
            program: "sleep".into(),
            arguments: vec!["1000".into()],
            work: None,
        }
    }

    #[test]
    fn a_solver_that_never_answers_is_ended_after_its_time() {
        let start = Instant::now();
        let answer = deaf().ask("", Duration::from_millis(50), &AtomicBool::new(false));
        assert_eq!(answer, Err(Silence::TimeOut));
        // a busy machine may take a while to end a process, but not as long as the process sleeps
        assert!(start.elapsed() < Duration::from_secs(100));
    }

    #[test]
    fn an_interrupt_ends_it_at_once() {
        let answer = deaf().ask("", Duration::from_secs(1000), &AtomicBool::new(true));
        assert_eq!(answer, Err(Silence::Interrupted));
    }

    #[test]
    fn a_program_that_is_not_there_is_no_answer() {
        let nowhere = Solver {
            program: "no-such-solver".into(),
            ..deaf()
        };
        let answer = nowhere.ask("", Duration::from_secs(1), &AtomicBool::new(false));
        assert!(matches!(answer, Err(Silence::Failed(_))));
    }

    #[test]
    fn versions_are_found_in_what_solvers_say() {
        assert_eq!(number_in("Z3 version 4.8.12 - 64 bit"), "4.8.12");
        assert_eq!(number_in("This is cvc5 version 1.0.3\ncompiled"), "1.0.3");
        assert_eq!(number_in("0.9.1\n"), "0.9.1");
    }
}
