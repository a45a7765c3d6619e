//! One process for each target, and what came of all of them.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use crate::arguments::{Arguments, USAGE};
use crate::driver::{Plan, Summary, run};
use crate::finding::Finding;
use crate::guard::{Fault, probe};
use crate::journal::Journal;
use crate::targets::{self, Target};

/// Stack of a reader: that of a thread of a program or a test, the smallest that a user's call gets.
const STACK: usize = 2 << 20;
/// Times its limit of seconds after which a reader is taken to hang.
// far beyond what another load of the machine makes of a second
const HANG: f64 = 20.0;
/// How often a hang is looked for.
const LOOK: Duration = Duration::from_millis(200);
/// Begins the line in which a target's process says its figures.
const DONE: &str = "done ";

/// The program.
#[must_use]
pub fn main() -> ExitCode {
    match Arguments::read(std::env::args().skip(1)).and_then(|arguments| command(&arguments)) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(message) => {
            eprint!("error: {message}\n\n{USAGE}");
            ExitCode::from(2)
        }
    }
}

/// `Ok(false)` if something was found.
fn command(arguments: &Arguments) -> Result<bool, String> {
    if arguments.help {
        print!("{USAGE}");
        return Ok(true);
    }
    if arguments.list {
        targets::all().for_each(|target| println!("{:22} {}", target.name, target.about));
        return Ok(true);
    }
    let chosen = chosen(&arguments.targets)?;
    match (&arguments.replay, &arguments.journal, &chosen[..]) {
        (Some(file), _, [target]) => replay(target, file),
        (_, Some(journal), [target]) => alone(target, arguments, journal),
        _ => campaign(&chosen, arguments),
    }
}

fn chosen(names: &[String]) -> Result<Vec<&'static Target>, String> {
    if names.is_empty() {
        return Ok(targets::all().collect());
    }
    let find = |name: &String| targets::find(name).ok_or_else(|| format!("no target `{name}`: --list shows them"));
    names.iter().map(find).collect()
}

fn findings(arguments: &Arguments) -> PathBuf {
    let usual = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../target/fuzz/findings");
    arguments.out.clone().unwrap_or_else(usual)
}

fn replay(target: &'static Target, file: &Path) -> Result<bool, String> {
    let input = std::fs::read(file).map_err(|error| format!("{}: {error}", file.display()))?;
    let reader = (target.reader)()?;
    let started = Instant::now();
    let outcome = probe(&*reader, &input, &target.limits);
    let took = started.elapsed().as_secs_f64();
    match &outcome {
        Ok(answer) => println!("{} in {took:.4} s: {}", word(answer.accepted), answer.message),
        Err(fault) => println!("FINDING {}: {fault}", target.name),
    }
    Ok(outcome.is_ok())
}

fn word(accepted: bool) -> &'static str {
    if accepted { "accepted" } else { "refused" }
}

/// The run of one target in this process.
fn alone(target: &'static Target, arguments: &Arguments, path: &Path) -> Result<bool, String> {
    let journal = Journal::create(path).map_err(|error| format!("{}: {error}", path.display()))?;
    let journal = Arc::new(journal);
    let plan = Plan {
        seed: arguments.seed.unwrap_or(1),
        until: arguments.until(),
        findings: findings(arguments),
    };
    let (folder, seed) = (plan.findings.clone(), plan.seed);
    let work = {
        let journal = Arc::clone(&journal);
        move || run(target, &plan, Some(&journal), &|line| println!("{line}"))
    };
    let worker = std::thread::Builder::new().stack_size(STACK).spawn(work);
    let worker = worker.map_err(|error| format!("cannot start a thread: {error}"))?;
    let patience = Duration::from_secs_f64(HANG * target.limits.seconds);
    let (mut beat, mut since) = (0, Instant::now());
    while !worker.is_finished() {
        std::thread::sleep(LOOK);
        if journal.beat() != beat || beat == 0 {
            (beat, since) = (journal.beat(), Instant::now());
        } else if since.elapsed() > patience {
            // a thread cannot be stopped: the process ends with it
            let fault = Fault::Hang(since.elapsed().as_secs());
            lost(target.name, &fault, path, seed, &folder)?;
            return Ok(false);
        }
    }
    let summary = worker
        .join()
        .map_err(|_| format!("{}: the driver panicked", target.name))??;
    let Summary {
        executions,
        accepted,
        seconds,
        kinds,
        ..
    } = summary;
    println!("{DONE}{executions} {accepted} {seconds} {kinds}");
    Ok(summary.findings.is_empty())
}

/// Says and writes a finding whose input is in the journal.
fn lost(target: &str, fault: &Fault, journal: &Path, seed: u64, folder: &Path) -> Result<String, String> {
    let (execution, input) = Journal::last(journal).unwrap_or_default();
    let finding = Finding {
        target,
        fault,
        input: &input,
        seed,
        execution,
    };
    let file = finding
        .write(folder)
        .map_err(|error| format!("cannot write a finding: {error}"))?;
    let words = format!("FINDING {target}: {fault}; {}", file.display());
    println!("{words}");
    Ok(words)
}

fn campaign(chosen: &[&'static Target], arguments: &Arguments) -> Result<bool, String> {
    let journals = targets::folder().map_err(|error| format!("cannot make a folder: {error}"))?;
    let next = AtomicUsize::new(0);
    let done: Mutex<Vec<(usize, Result<Summary, String>)>> = Mutex::default();
    std::thread::scope(|scope| {
        for _ in 0..arguments.jobs.unwrap_or(1).max(1) {
            scope.spawn(|| {
                while let Some((index, target)) = take(chosen, &next) {
                    let summary = watched(target, arguments, &journals.path().join(target.name));
                    done.lock()
                        .unwrap_or_else(PoisonError::into_inner)
                        .push((index, summary));
                }
            });
        }
    });
    let mut done = done.into_inner().unwrap_or_else(PoisonError::into_inner);
    done.sort_by_key(|(index, _)| *index);
    println!(
        "\n| target | executions | a second | accepted | kinds of answers | findings |\n|---|---:|---:|---:|---:|---:|"
    );
    let (mut total, mut is_clean) = (0, true);
    for (index, summary) in done {
        let summary = summary?;
        total += summary.executions;
        is_clean &= summary.findings.is_empty();
        println!(
            "| {} | {} | {:.0} | {} | {} | {} |",
            chosen[index].name,
            summary.executions,
            summary.rate(),
            summary.accepted,
            summary.kinds,
            summary.findings.len()
        );
    }
    println!("\n{total} executions, seed {}", arguments.seed.unwrap_or(1));
    Ok(is_clean)
}

fn take(chosen: &[&'static Target], next: &AtomicUsize) -> Option<(usize, &'static Target)> {
    let index = next.fetch_add(1, Ordering::Relaxed);
    chosen.get(index).map(|target| (index, *target))
}

/// Runs a target in a process of its own.
fn watched(target: &Target, arguments: &Arguments, journal: &Path) -> Result<Summary, String> {
    let failed = |error: std::io::Error| format!("{}: {error}", target.name);
    let seed = arguments.seed.unwrap_or(1);
    let mut command = Command::new(std::env::current_exe().map_err(failed)?);
    command.args(["--target", target.name, "--seed", &seed.to_string()]);
    command
        .arg("--out")
        .arg(findings(arguments))
        .arg("--journal")
        .arg(journal);
    // what a reader writes on its way goes with the journals, also if the process is killed
    command.env("TMPDIR", journal.parent().unwrap_or(journal));
    let until = arguments.until();
    if let Some(executions) = until.executions {
        command.args(["--executions", &executions.to_string()]);
    }
    if let Some(seconds) = until.seconds {
        command.args(["--seconds", &seconds.to_string()]);
    }
    let mut child = command.stdout(Stdio::piped()).spawn().map_err(failed)?;
    let mut summary = Summary::default();
    let started = Instant::now();
    for line in child
        .stdout
        .take()
        .map(BufReader::new)
        .into_iter()
        .flat_map(BufRead::lines)
    {
        let line = line.map_err(failed)?;
        match line.strip_prefix(DONE) {
            Some(figures) => summary = figures_of(figures, summary),
            None => println!("{line}"),
        }
        if line.starts_with("FINDING ") {
            summary.findings.push(line);
        }
    }
    let status = child.wait().map_err(failed)?;
    if !matches!(status.code(), Some(0 | 1)) {
        let fault = Fault::Death(status.to_string());
        summary
            .findings
            .push(lost(target.name, &fault, journal, seed, &findings(arguments))?);
    }
    if summary.executions == 0 {
        summary.executions = Journal::last(journal).map_or(0, |(execution, _)| execution);
        summary.seconds = started.elapsed().as_secs_f64();
    }
    Ok(summary)
}

fn figures_of(line: &str, summary: Summary) -> Summary {
    let mut words = line.split(' ');
    let mut number = || words.next().and_then(|word| word.parse::<f64>().ok()).unwrap_or(0.0);
    Summary {
        // counts below 2^53 survive the way through a float
        executions: number() as u64,
        accepted: number() as u64,
        seconds: number(),
        kinds: number() as usize,
        ..summary
    }
}
