//! The steps of `cargo xtask test`, and the loop that runs them all and reports every failure.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::mpsc;
use std::time::{Duration, Instant};

use crate::book;
use crate::process::{self, Output};
use crate::programs;
use crate::release;
use crate::rules::{self, Findings};
use crate::studio;
use crate::tools;
use crate::wheel;
use crate::workspace::Workspace;

/// Golden files are rewritten instead of compared when this is set.
pub const BLESS: &str = "POLICYC_BLESS";

/// Tests that have a short and a long form take the long one when this is set (`tests::full`).
const FULL: &str = "POLICYC_FULL";

/// The long forms take hours where floats are a library.
const FULL_LIMIT: Duration = Duration::from_secs(6 * 3600);

const HEARTBEAT: Duration = Duration::from_secs(60);

/// Switches of `cargo xtask test`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Options {
    pub quick: bool,
    pub full: bool,
    pub skip_install: bool,
}

/// How a step that did not fail ended.
enum Done {
    /// Lines worth showing: warnings, counts.
    Passed(Vec<String>),
    /// There is nothing to do yet.
    Skipped(String),
}

type Outcome = Result<Done, String>;

/// The shortest form of a run that a step belongs to.
#[derive(Clone, Copy, PartialEq, PartialOrd)]
enum Form {
    Quick,
    Usual,
    Full,
}

impl Form {
    fn of(options: Options) -> Self {
        match options {
            Options { quick: true, .. } => Self::Quick,
            Options { full: true, .. } => Self::Full,
            Options { .. } => Self::Usual,
        }
    }
}

/// One thing that is tested.
pub struct Step {
    name: &'static str,
    form: Form,
    run: fn(&Context) -> Outcome,
}

const fn step(name: &'static str, form: Form, run: fn(&Context) -> Outcome) -> Step {
    Step { name, form, run }
}

const PAGES: Step = step("pages", Form::Quick, |c| judged(rules::pages(c.workspace)));
const BOOK: Step = step("book", Form::Quick, book);

/// A crate of its own, with its own lock file.
const MUTANTS: &str = "tools/mutants";

const STUDIO: Step = step("studio", Form::Usual, build_studio);

/// The page of `policyc studio`.
pub const OF_THE_STUDIO: &[Step] = &[STUDIO];

/// What an author of pages wants to know.
pub const OF_THE_BOOK: &[Step] = &[PAGES, BOOK];

const WHEEL: Step = step("wheel", Form::Usual, wheel);

/// The Python package.
pub const OF_THE_WHEEL: &[Step] = &[WHEEL];

const MANIFESTS: Step = step("manifests", Form::Quick, |c| {
    judged(Ok(Findings {
        faults: release::faults(&c.workspace.crates),
        warnings: Vec::new(),
    }))
});

const PACKAGES: Step = step("packages", Form::Full, |c| {
    release::pack(c.workspace, &c.log, c.limit()).map(Done::Passed)
});

const OLDEST: Step = step("oldest", Form::Full, |c| {
    release::oldest(c.workspace, &c.log, c.limit()).map(Done::Passed)
});

/// What a release asks for beside the tests.
pub const OF_A_RELEASE: &[Step] = &[MANIFESTS, PACKAGES, OLDEST];

/// What CI asks for.
pub const ALL: &[Step] = &[
    step("tools", Form::Quick, install),
    MANIFESTS,
    step("layers", Form::Quick, |c| judged(rules::layers(c.workspace))),
    step("lengths", Form::Quick, |c| judged(rules::lengths(c.workspace))),
    step("portable", Form::Quick, |c| judged(rules::portable(c.workspace))),
    PAGES,
    BOOK,
    step("fmt", Form::Quick, fmt),
    step("clippy", Form::Quick, clippy),
    // before the tests, which open its page
    STUDIO,
    step("test", Form::Quick, test),
    WHEEL,
    step("mutants", Form::Usual, mutants),
    step("rustdoc", Form::Usual, rustdoc),
    step("firmware", Form::Usual, firmware),
    step("demo", Form::Usual, demo),
    PACKAGES,
    OLDEST,
];

struct Context<'a> {
    workspace: &'a Workspace,
    options: Options,
    log: PathBuf,
}

impl Context<'_> {
    fn cargo(&self, arguments: &[&str], environment: &[(&str, &str)]) -> Result<(), String> {
        self.cargo_in(&self.workspace.root, arguments, environment)
    }

    fn cargo_in(&self, folder: &Path, arguments: &[&str], environment: &[(&str, &str)]) -> Result<(), String> {
        let mut command = self.command(arguments, environment);
        command.current_dir(folder);
        process::run_within(&mut command, &Output::Log(self.log.clone()), self.limit())
    }

    fn command(&self, arguments: &[&str], environment: &[(&str, &str)]) -> Command {
        let mut command = self.workspace.cargo(arguments);
        command.env_remove(BLESS).env("CARGO_TERM_COLOR", "never");
        command.envs(environment.iter().copied());
        command
    }

    fn limit(&self) -> Duration {
        if self.options.full { FULL_LIMIT } else { process::LIMIT }
    }
}

/// Runs every step, also after a failing one; true when none failed.
pub fn run_all(workspace: &Workspace, steps: &[Step], options: Options) -> bool {
    let form = Form::of(options);
    let steps: Vec<&Step> = steps.iter().filter(|step| step.form <= form).collect();
    let mut passed = 0;
    let mut failures = Vec::new();
    let started = Instant::now();
    for (index, step) in steps.iter().enumerate() {
        let label = format!("[{}/{}] {}", index + 1, steps.len(), step.name);
        match run_one(step, &label, workspace, options) {
            Ok(Done::Passed(_)) => passed += 1,
            Ok(Done::Skipped(_)) => {}
            Err(message) => failures.push((step.name, message)),
        }
    }
    for (name, message) in &failures {
        println!("\n---- {name} failed ----\n{message}");
    }
    println!("\n{:.0} s in all", started.elapsed().as_secs_f64());
    println!("{passed} passed, {} failed", failures.len());
    failures.is_empty()
}

fn run_one(step: &Step, label: &str, workspace: &Workspace, options: Options) -> Outcome {
    print!("{label} ... ");
    flush();
    let started = Instant::now();
    let (outcome, beats) = match fresh_log(workspace, step.name) {
        Ok(log) => {
            let context = Context {
                workspace,
                options,
                log,
            };
            with_heartbeat(&context.log, || (step.run)(&context))
        }
        Err(message) => (Err(message), 0),
    };
    if beats > 0 {
        print!("\n{label} ... ");
    }
    let seconds = started.elapsed().as_secs_f64();
    match &outcome {
        Ok(Done::Passed(notes)) => {
            println!("ok {seconds:.1} s");
            notes.iter().for_each(|note| println!("    {note}"));
        }
        Ok(Done::Skipped(reason)) => println!("skipped: {reason}"),
        Err(_) => println!("FAILED {seconds:.1} s"),
    }
    outcome
}

fn fresh_log(workspace: &Workspace, name: &str) -> Result<PathBuf, String> {
    let folder = workspace.target_dir.join("xtask");
    let log = folder.join(format!("{name}.log"));
    std::fs::create_dir_all(&folder)
        .and_then(|()| std::fs::write(&log, ""))
        .map_err(|e| format!("cannot write the log {}: {e}", log.display()))?;
    Ok(log)
}

/// Does the work and says every minute that it goes on; also returns how often it said so.
fn with_heartbeat<T>(log: &Path, work: impl FnOnce() -> T) -> (T, usize) {
    let (done, waiting) = mpsc::channel::<()>();
    std::thread::scope(|scope| {
        let beats = scope.spawn(move || {
            let started = Instant::now();
            let mut beats = 0;
            while waiting.recv_timeout(HEARTBEAT) == Err(mpsc::RecvTimeoutError::Timeout) {
                let line = process::last_line(log).unwrap_or_default();
                print!("\n    {} s: {line}", started.elapsed().as_secs());
                flush();
                beats += 1;
            }
            beats
        });
        let result = work();
        drop(done);
        (result, beats.join().unwrap_or(0))
    })
}

fn flush() {
    // a closed terminal is no reason to stop the tests
    let _ = std::io::stdout().flush();
}

fn judged(findings: Result<Findings, String>) -> Outcome {
    let findings = findings?;
    match findings.faults.is_empty() {
        true => Ok(Done::Passed(findings.warnings)),
        false => Err([findings.faults, findings.warnings].concat().join("\n")),
    }
}

fn passed() -> Outcome {
    Ok(Done::Passed(Vec::new()))
}

fn install(context: &Context) -> Outcome {
    let target_dir = &context.workspace.target_dir;
    let notes = if context.options.skip_install {
        tools::require(target_dir)?
    } else {
        let output = Output::Log(context.log.clone());
        book::provide(target_dir, &output);
        tools::provide(target_dir, &output)?
    };
    Ok(Done::Passed(notes))
}

fn book(context: &Context) -> Outcome {
    match book::build(context.workspace, &context.log)? {
        book::Built::Pages(folder) => Ok(Done::Passed(vec![folder.join("index.html").display().to_string()])),
        book::Built::NoTool(what_to_type) => Ok(Done::Skipped(what_to_type)),
    }
}

fn fmt(context: &Context) -> Outcome {
    context.cargo(&["fmt", "--all", "--check", "--", "--color", "never"], &[])?;
    let mutants = context.workspace.root.join(MUTANTS);
    for folder in context.workspace.firmware()?.into_iter().chain([mutants]) {
        context.cargo_in(&folder, &["fmt", "--check", "--", "--color", "never"], &[])?;
    }
    passed()
}

/// The tool behind `cargo xtask mutants`, which is outside of the workspace.
fn mutants(context: &Context) -> Outcome {
    let target_dir = context.workspace.target_dir.join("mutants/tool");
    let target_dir = target_dir.to_string_lossy();
    let environment = [("CARGO_TARGET_DIR", target_dir.as_ref())];
    let folder = context.workspace.root.join(MUTANTS);
    context.cargo_in(
        &folder,
        &["clippy", "--all-targets", "--", "-D", "warnings"],
        &environment,
    )?;
    context.cargo_in(&folder, &["test"], &environment)?;
    passed()
}

fn clippy(context: &Context) -> Outcome {
    let arguments = ["clippy", "--workspace", "--all-targets"];
    context.cargo(&[&arguments[..], &["--", "-D", "warnings"]].concat(), &[])?;
    passed()
}

fn test(context: &Context) -> Outcome {
    let absent = tools::absent(&context.workspace.target_dir);
    let mut environment: Vec<_> = absent.iter().map(|(name, value)| (*name, value.as_str())).collect();
    if context.options.full {
        environment.push((FULL, "1"));
    }
    // the dev profile (opt-level 1) keeps overflow checks, which the integer formats are to pass
    let arguments = ["test", "--workspace"];
    if context.options.quick {
        let without = ["--no-fail-fast", "--exclude", "tests", "--exclude", "blind"];
        context.cargo(&[&arguments[..], &without].concat(), &environment)?;
        let log = process::read_lossy(&context.log);
        return Ok(Done::Passed(vec![programs::test_count(std::iter::once(log.as_str()))]));
    }
    context.cargo(&[&arguments[..], &["--no-run"]].concat(), &environment)?;
    let tests = context.workspace.crates.iter().flat_map(|one| &one.tests);
    let command = |selection: &[String]| {
        let mut command = context.command(&arguments, &environment);
        command.arg("--no-fail-fast").args(selection);
        command
    };
    let programs = programs::all(tests.map(String::as_str));
    programs::run(programs, command, &context.log, context.limit()).map(Done::Passed)
}

fn build_studio(context: &Context) -> Outcome {
    let output = Output::Log(context.log.clone());
    Ok(match studio::build(context.workspace, &output, context.limit())? {
        Ok(notes) => Done::Passed(notes),
        // a release carries it
        Err(reason) if context.options.full => return Err(format!("{reason}\n  = hint: cargo xtask setup")),
        Err(reason) => Done::Skipped(reason),
    })
}

fn wheel(context: &Context) -> Outcome {
    let Context {
        workspace,
        options,
        log,
    } = context;
    Ok(match wheel::test(workspace, options.full, log, context.limit())? {
        Ok(notes) => Done::Passed(notes),
        // a release is not made of what was not tested
        Err(reason) if options.full => return Err(format!("{reason}\n  = hint: cargo xtask setup")),
        Err(reason) => Done::Skipped(reason),
    })
}

fn rustdoc(context: &Context) -> Outcome {
    let arguments = ["doc", "--workspace", "--no-deps"];
    context.cargo(&arguments, &[("RUSTDOCFLAGS", "-D warnings")])?;
    passed()
}

fn firmware(context: &Context) -> Outcome {
    let folders = context.workspace.firmware()?;
    if folders.is_empty() {
        return Ok(Done::Skipped("no crate in firmware/ yet".into()));
    }
    let mut faults = Vec::new();
    // a firmware for a processor is built by its test, which knows what to do without the Rust target
    let is_for_host = |folder: &&PathBuf| !folder.join(".cargo").exists();
    for folder in folders.iter().filter(is_for_host) {
        let name = folder.file_name().unwrap_or_default();
        let target_dir = context.workspace.target_dir.join("firmware").join(name);
        let target_dir = target_dir.to_string_lossy();
        let environment = [("CARGO_TARGET_DIR", target_dir.as_ref())];
        if let Err(fault) = context.cargo_in(folder, &["build", "--release"], &environment) {
            faults.push(format!("{}: {fault}", folder.display()));
        }
    }
    match faults.is_empty() {
        true => Ok(Done::Passed(vec![format!(
            "{} crates",
            folders.iter().filter(is_for_host).count()
        )])),
        false => Err(faults.join("\n")),
    }
}

/// What the README begins with, its files below the target folder. The program is that of the tests: a build for
/// release takes minutes on two cores and finds nothing that they do not.
fn demo(context: &Context) -> Outcome {
    let out = context.workspace.target_dir.join("xtask/demo");
    let out = out.to_string_lossy();
    let command = ["run", "--bin", "policyc", "--", "demo", "--out", out.as_ref()];
    context.cargo(&command, &[])?;
    passed()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(options: Options) -> Vec<&'static str> {
        let form = Form::of(options);
        ALL.iter()
            .filter(|step| step.form <= form)
            .map(|step| step.name)
            .collect()
    }

    #[test]
    fn a_longer_form_has_the_steps_of_the_shorter_and_the_full_one_those_of_a_release() {
        let quick = Options {
            quick: true,
            ..Options::default()
        };
        let full = Options {
            full: true,
            ..Options::default()
        };
        let (quick, usual, full) = (names(quick), names(Options::default()), names(full));
        assert!(quick.iter().all(|name| usual.contains(name)) && usual.iter().all(|name| full.contains(name)));
        assert!(!quick.contains(&"wheel") && usual.contains(&"wheel") && !usual.contains(&"oldest"));
        assert!(OF_A_RELEASE.iter().all(|step| full.contains(&step.name)));
        assert_eq!(full.len(), ALL.len());
    }

    #[test]
    fn a_fault_fails_a_step_and_a_warning_does_not() {
        let warning = Findings {
            faults: Vec::new(),
            warnings: vec!["long".into()],
        };
        assert!(matches!(judged(Ok(warning)), Ok(Done::Passed(notes)) if notes == ["long"]));
        let fault = Findings {
            faults: vec!["wrong".into()],
            warnings: vec!["long".into()],
        };
        assert_eq!(judged(Ok(fault)).err().as_deref(), Some("wrong\nlong"));
    }
}
