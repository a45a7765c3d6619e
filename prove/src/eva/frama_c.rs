//! One run of Frama-C: its command line, and what it says.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

use super::driver::Entry;
use super::text::{self, Labels};
use crate::program::{self, Stop};

/// The program and how to get it.
pub(super) const PROGRAM: &str = "frama-c";
pub(super) const INSTALL: &str = "apt-get install frama-c-base";

/// How long one run may take: ten times what the largest example took on a busy machine.
const PATIENCE: Duration = Duration::from_secs(900);

/// What a processor's C is like: the name of a model that Frama-C brings along.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Machine(pub &'static str);

/// Which numbers a run is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Numbers {
    /// All bit patterns, NaN and infinities among them, and any may arise.
    Any,
    /// Inputs are finite, and it is an alarm if a NaN or an infinity arises.
    Finite,
}

impl Numbers {
    pub fn name(self) -> &'static str {
        match self {
            Numbers::Any => "all bit patterns",
            Numbers::Finite => "finite numbers",
        }
    }
}

/// What one run found.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Found {
    /// What may go wrong, a line each.
    pub alarms: Vec<String>,
    /// Labels of checks that are not shown, and whether one is shown to fail.
    pub open: Vec<(String, bool)>,
    /// Labels of checks that hold.
    pub valid: Vec<String>,
    /// Whether the end of the entry was analysed.
    pub reached: bool,
    /// Why there is no answer; empty if there is.
    pub failure: String,
    /// Wall-clock time.
    pub seconds: f64,
}

/// Version of the program; `None` if it is not there.
pub(super) fn version(stop: &Stop) -> Option<String> {
    let output = program::run(Command::new(PROGRAM).arg("-version"), Duration::from_secs(60), stop).ok()?;
    let text = String::from_utf8_lossy(&output.stdout);
    Some(format!("Frama-C {}", text.trim()))
}

/// One entry of `driver.c` in a folder.
#[derive(Debug, Clone, Copy)]
pub(super) struct Analysis<'a> {
    pub folder: &'a Path,
    /// Name of the policy.
    pub policy: &'a str,
    pub labels: &'a Labels,
    pub entry: &'a Entry,
    pub machine: Machine,
    pub numbers: Numbers,
    pub part: usize,
}

/// Analyses the entry, ever more precisely until everything is shown. What is shown with little precision is shown.
///
/// # Errors
/// If the user has had enough.
pub(super) fn analyse(analysis: Analysis<'_>, stop: &Stop) -> Result<Found, program::Stopped> {
    let mut found = Found::default();
    for precision in analysis.entry.precisions {
        let seconds = found.seconds;
        found = once(analysis, *precision, stop)?;
        found.seconds += seconds;
        if found.failure.is_empty() && found.reached && found.alarms.is_empty() && found.open.is_empty() {
            break;
        }
    }
    Ok(found)
}

/// Frama-C with what is needed of it, in a folder.
fn frama_c(folder: &Path) -> Command {
    let mut command = Command::new(PROGRAM);
    // its own temporary files go with the folder, also when it is killed
    command.current_dir(folder).env("TMPDIR", folder);
    // it takes the folder from there
    command.env("PWD", folder);
    // all plugins together take longer to load than a small driver to analyse; without `inout` Eva does not know what a call reads, and
    // analyses the same call again
    command.args(["-no-autoload-plugins", "-load-module", "inout,eva,report"]);
    command
}

/// Where the syntax tree of the driver is kept.
fn tree(folder: &Path, machine: Machine, numbers: Numbers) -> PathBuf {
    folder.join(format!("{}-{numbers:?}.sav", machine.0))
}

/// What reads the driver and the generated C.
fn source(command: &mut Command, policy: &str, machine: Machine, numbers: Numbers) {
    command.args([FILE, "-machdep", machine.0]);
    let finite = match numbers {
        Numbers::Any => "",
        Numbers::Finite => " -DFINITE",
    };
    // without __GNUC__ the portable text is taken; the two flags keep the preprocessor from announcing excess precision
    command.arg(format!(
        "-cpp-extra-args=-U__GNUC__ -D{}_PORTABLE -msse2 -mfpmath=sse{finite} -I.",
        policy.to_uppercase()
    ));
}

/// Reads the driver once for all runs on a machine with such numbers, for reading takes as long as analysing a small entry. If this
/// fails, each run reads for itself and says why it cannot.
///
/// # Errors
/// If the user has had enough.
pub(super) fn read_once(
    folder: &Path,
    policy: &str,
    (machine, numbers): (Machine, Numbers),
    stop: &Stop,
) -> Result<(), program::Stopped> {
    let tree = tree(folder, machine, numbers);
    let mut command = frama_c(folder);
    source(&mut command, policy, machine, numbers);
    command.arg("-save").arg(&tree);
    match program::run(&mut command, PATIENCE, stop) {
        Ok(output) if output.status.success() => Ok(()),
        Err(program::Failed::Stopped) => Err(program::Stopped),
        Ok(_) | Err(program::Failed::Io(_)) => {
            // half a tree is none; what is not there need not be removed
            let _ = std::fs::remove_file(&tree);
            Ok(())
        }
    }
}

/// One run of Frama-C, which writes its findings to `table`.
fn command(analysis: Analysis<'_>, precision: u8, table: &Path) -> Command {
    let Analysis {
        folder,
        policy,
        machine,
        numbers,
        part,
        ..
    } = analysis;
    let mut command = frama_c(folder);
    let tree = tree(folder, machine, numbers);
    if tree.exists() {
        command.arg("-load").arg(tree);
    } else {
        source(&mut command, policy, machine, numbers);
    }
    command.arg("-eva").arg("-main").arg(analysis.entry.main(part));
    let special = match numbers {
        Numbers::Any => "none",
        Numbers::Finite => "non-finite",
    };
    command.args(["-warn-special-float", special]);
    // loops have up to 1024 turns (the width of a layer), and every one is to be seen apart
    command.args([
        "-eva-precision",
        &precision.to_string(),
        "-eva-auto-loop-unroll",
        "1024",
        "-eva-interprocedural-splits",
    ]);
    // whether a duty is a number is seen with the duty; in the guard of the state it would be 2^n cases
    for function in ["far", "aside", "beyond", "within"] {
        command
            .arg("-eva-split-return-function")
            .arg(format!("{policy}_{function}:full"));
    }
    command
        .arg("-eva-slevel-function")
        .arg(format!("{policy}_guard:0,{policy}_sense:0"));
    for function in &analysis.entry.assumed {
        command.arg("-eva-use-spec").arg(format!("{policy}_{function}"));
    }
    command.args(["-eva-no-show-progress", "-eva-msg-key=-initial-state,-final-states"]);
    command.arg("-then").arg("-report-csv").arg(table);
    command
}

fn once(analysis: Analysis<'_>, precision: u8, stop: &Stop) -> Result<Found, program::Stopped> {
    let begun = Instant::now();
    let Analysis {
        folder,
        policy,
        labels,
        machine,
        numbers,
        part,
        ..
    } = analysis;
    let Entry { function, assumed, .. } = analysis.entry;
    let table = folder.join(format!("{function}-{}-{numbers:?}-{part}.csv", machine.0));
    let mut command = command(analysis, precision, &table);
    let output = program::run(&mut command, PATIENCE, stop);
    let seconds = begun.elapsed().as_secs_f64();
    let output = match output {
        Ok(output) => output,
        Err(program::Failed::Stopped) => return Err(program::Stopped),
        Err(program::Failed::Io(error)) => {
            return Ok(Found {
                failure: error.to_string(),
                seconds,
                ..Found::default()
            });
        }
    };
    // shown where the text of the function is analysed
    let given = |function: &str| assumed.iter().any(|own| function == format!("{policy}_{own}"));
    let mut found = match std::fs::read_to_string(&table) {
        Ok(text) if output.status.success() => read(&text, labels, &given),
        _ => Found {
            failure: last_words(&output),
            ..Found::default()
        },
    };
    found.seconds = seconds;
    Ok(found)
}

/// The first lines that speak of an error, or the last ones.
fn last_words(output: &std::process::Output) -> String {
    let text = [&output.stdout, &output.stderr].map(|stream| String::from_utf8_lossy(stream).into_owned());
    let lines: Vec<&str> = text.iter().flat_map(|text| text.lines()).collect();
    let errors: Vec<&str> = lines
        .iter()
        .copied()
        .filter(|line| line.contains("rror"))
        .take(3)
        .collect();
    let said = if errors.is_empty() {
        lines.iter().rev().take(3).rev().copied().collect()
    } else {
        errors
    };
    said.join("; ")
}

/// The driver's file.
pub(super) const FILE: &str = "driver.c";

/// Reads the table of properties: directory, file, line, function, kind, status, text.
fn read(table: &str, labels: &Labels, given: &dyn Fn(&str) -> bool) -> Found {
    let mut found = Found::default();
    // an own postcondition that is not shown: Eva goes on as if it held, so a check behind it says nothing
    let mut presumed = false;
    for line in table.lines().skip(1) {
        let cells: Vec<&str> = line.split('\t').collect();
        let [_, file, line, function, kind, status, text] = cells[..] else {
            continue;
        };
        if kind == "postcondition" && given(function) {
            continue;
        }
        let proved = status == "Valid" || status.starts_with("Considered valid");
        let unreached = status == "Dead";
        // the table does not name checks
        let own = line.parse().ok().filter(|_| file == FILE);
        if let Some(label) = own.and_then(|line: usize| labels.get(&line)) {
            if label == text::REACHED {
                // "Invalid or unreachable" is what is shown to fail
                found.reached |= !proved && status != "Dead";
            } else if proved {
                found.valid.push(label.to_owned());
            } else if !unreached {
                found.open.push((label.to_owned(), status.contains("nvalid")));
            }
        } else if !proved && !unreached {
            presumed |= kind == "postcondition";
            found
                .alarms
                .push(format!("{file}:{line} in {function}: {kind}: {text}"));
        }
    }
    if presumed {
        let valid = std::mem::take(&mut found.valid);
        found.open.extend(valid.into_iter().map(|label| (label, false)));
    }
    found
}
