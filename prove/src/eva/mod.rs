//! Abstract interpretation of the generated C with Frama-C Eva.

mod calls;
mod command;
mod curves;
mod driver;
mod frama_c;
mod head;
mod inputs;
mod invariant;
mod number;
mod slices;
mod stated;
mod text;

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use codegen::Output;
use policy::NumericFormat;

use crate::claim::{Claim, Verdict};
use crate::program::Stopped;
use crate::{Next, Prover, Task, Watch};
use driver::{Driver, Entry};
use frama_c::{Analysis, Found, INSTALL, Machine, Numbers};
use text::Labels;

/// Frama-C Eva on the generated C: no run-time error, limits, invariant.
#[derive(Debug, Clone, Copy)]
pub struct Eva;

/// Name of the prover in its claims.
const NAME: &str = "eva";

/// One run.
#[derive(Debug, Clone, Copy)]
struct Job<'a> {
    entry: &'a Entry,
    machine: Machine,
    numbers: Numbers,
    /// Which of the entry's parts.
    part: usize,
}

impl Prover for Eva {
    fn prove(&self, task: Task<'_>, watch: &Watch<'_>) -> Result<Vec<Claim>, Stopped> {
        if let Some(why) = beyond(task) {
            return Ok(vec![not_run(task, why)]);
        }
        (watch.say)(Next::first("looking for Frama-C"));
        let Some(tool) = frama_c::version(watch.stop) else {
            let why = format!("{} is not on PATH; install it: {INSTALL}", frama_c::PROGRAM);
            return Ok(vec![not_run(task, &why)]);
        };
        let files = match codegen::sources(task.policy, task.target, &[Output::C], None) {
            Ok(files) => files.files,
            Err(error) => return Ok(vec![not_run(task, &error.to_string())]),
        };
        analyse(task, &files, None, &tool, watch)
    }
}

/// Proves with other sources in the place of the generated ones: for tests that plant defects. The files are by name; `only` is one
/// driver, such as `prove_step`, whose claims then rest on what nobody has shown.
///
/// # Errors
/// If the run was stopped.
pub fn prove_sources(
    task: Task<'_>,
    files: &BTreeMap<String, String>,
    only: Option<&str>,
    watch: &Watch<'_>,
) -> Result<Vec<Claim>, Stopped> {
    let Some(tool) = frama_c::version(watch.stop) else {
        return Ok(vec![not_run(task, INSTALL)]);
    };
    analyse(task, files, only, &tool, watch)
}

/// Whether Frama-C runs here.
#[must_use]
pub fn is_here() -> bool {
    frama_c::version(&crate::Stop::new(false)).is_some()
}

/// Why no model of a machine fits.
fn beyond(task: Task<'_>) -> Option<&'static str> {
    if task.target.widths.char_bits != 8 {
        return Some("Frama-C has no machine whose char has other than 8 bits");
    }
    if task.policy.numeric_format == NumericFormat::F32Fma {
        return Some("f32-fma puts the bits of a fused sum together, which intervals do not follow");
    }
    None
}

fn not_run(task: Task<'_>, why: &str) -> Claim {
    Claim {
        prover: NAME,
        name: "eva".to_owned(),
        text: "No run-time error, no duty outside of its limits, and a state that stays sound, for every input."
            .to_owned(),
        subject: "the whole interface".to_owned(),
        format: task.policy.numeric_format,
        settings: Vec::new(),
        verdict: Verdict::NotRun,
        reason: why.to_owned(),
        seconds: 0.0,
        tool: String::new(),
        details: Vec::new(),
    }
}

fn analyse(
    task: Task<'_>,
    files: &BTreeMap<String, String>,
    only: Option<&str>,
    tool: &str,
    watch: &Watch<'_>,
) -> Result<Vec<Claim>, Stopped> {
    let mut driver = driver::driver(task.policy);
    driver
        .entries
        .retain(|entry| only.is_none_or(|only| entry.function == only));
    let folder = match put(files, &driver.text) {
        Ok(folder) => folder,
        Err(error) => return Ok(vec![not_run(task, &format!("no folder for temporary files: {error}"))]),
    };
    let jobs = jobs(&driver);
    let found = run_all(folder.path(), task, &driver.labels, &jobs, watch)?;
    let mut parts: Vec<(&Entry, Vec<Claim>)> = Vec::new();
    for entry in &driver.entries {
        let runs: Vec<(Job<'_>, &Found)> = jobs
            .iter()
            .zip(&found)
            .filter(|(job, _)| job.entry == entry)
            .map(|(job, found)| (*job, found))
            .collect();
        parts.push((entry, claims_of(task, entry, &runs, tool)));
    }
    rest_on_others(&mut parts);
    let mut claims: Vec<Claim> = parts.into_iter().flat_map(|(_, claims)| claims).collect();
    let left = driver.not_stated.iter().enumerate();
    claims.extend(left.map(|(index, (place, why))| Claim {
        name: format!("left-{index}"),
        text: format!("`{place}` stays within its ends."),
        reason: (*why).to_owned(),
        ..not_run(task, "")
    }));
    Ok(claims)
}

fn put(files: &BTreeMap<String, String>, driver: &str) -> std::io::Result<tempfile::TempDir> {
    let folder = tempfile::Builder::new().prefix("policyc-prove-").tempdir()?;
    for (name, text) in files {
        std::fs::write(folder.path().join(name), text)?;
    }
    std::fs::write(folder.path().join(frama_c::FILE), driver)?;
    Ok(folder)
}

fn jobs(driver: &Driver) -> Vec<Job<'_>> {
    let mut jobs = Vec::new();
    for entry in &driver.entries {
        for &(machine, numbers) in entry.runs {
            let job = |part| Job {
                entry,
                machine,
                numbers,
                part,
            };
            jobs.extend((0..entry.parts).map(job));
        }
    }
    jobs
}

/// All runs, behind one that reads the driver for each machine and kind of numbers.
fn run_all(
    folder: &Path,
    task: Task<'_>,
    labels: &Labels,
    jobs: &[Job<'_>],
    watch: &Watch<'_>,
) -> Result<Vec<Found>, Stopped> {
    let policy = task.policy;
    let mut readings: Vec<(Machine, Numbers)> = Vec::new();
    for reading in jobs.iter().map(|job| (job.machine, job.numbers)) {
        if !readings.contains(&reading) {
            readings.push(reading);
        }
    }
    (watch.say)(Next::first("reading the driver"));
    side_by_side(&readings, |_, reading| {
        frama_c::read_once(folder, &policy.name, *reading, watch.stop)
    })?;
    side_by_side(jobs, |index, job| {
        let what = format!(
            "{} in {}: {} on {}, {} ({} of {})",
            policy.name,
            policy.numeric_format.name(),
            job.entry.function,
            job.machine.0,
            job.numbers.name(),
            index + 1,
            jobs.len()
        );
        (watch.say)(Next {
            what: &what,
            done: index,
            all: jobs.len(),
        });
        let analysis = Analysis {
            folder,
            policy: &policy.name,
            labels,
            entry: job.entry,
            machine: job.machine,
            numbers: job.numbers,
            part: job.part,
        };
        frama_c::analyse(analysis, watch.stop)
    })
}

/// Does it for each, as many at a time as there are cores; the answers in the order of the items.
fn side_by_side<T: Sync, R: Send + Clone>(
    items: &[T],
    run: impl Fn(usize, &T) -> Result<R, Stopped> + Sync,
) -> Result<Vec<R>, Stopped> {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let next = AtomicUsize::new(0);
    let results = Mutex::new(vec![None; items.len()]);
    std::thread::scope(|scope| {
        for _ in 0..cores.min(items.len()) {
            scope.spawn(|| {
                while let Some((index, item)) = {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    items.get(index).map(|item| (index, item))
                } {
                    let result = run(index, item);
                    let mut results = results.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
                    results[index] = Some(result);
                }
            });
        }
    });
    let results = results.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    // every index below the count was taken by a thread
    results
        .into_iter()
        .map(|result| result.unwrap_or(Err(Stopped)))
        .collect()
}

/// A claim that was shown with a contract in the place of a function holds if that contract was shown.
///
/// That no NaN arises rests on the same claim there; all else on what was shown for all bit patterns, finite numbers among them.
fn rest_on_others(parts: &mut [(&Entry, Vec<Claim>)]) {
    let finite = |claim: &Claim| claim.name.ends_with(FINITE);
    // a choice rests on the network, and a step on the choice: one turn for each
    for _ in 0..2 {
        let open: Vec<(&str, bool)> = parts
            .iter()
            .flat_map(|(entry, claims)| claims.iter().map(|claim| (entry.function, claim)))
            .filter(|(_, claim)| claim.verdict != Verdict::Proved)
            .map(|(function, claim)| (function, finite(claim)))
            .collect();
        for (entry, claims) in parts.iter_mut() {
            for base in &entry.assumed {
                let function = format!("prove_{base}");
                let shaky = |claim: &Claim| open.iter().any(|(own, of)| *own == function && *of == finite(claim));
                let shown = claims.iter_mut().filter(|claim| claim.verdict == Verdict::Proved);
                for claim in shown.filter(|claim| shaky(claim)) {
                    claim.verdict = Verdict::Unproven;
                    claim.reason = format!("it rests on what is claimed of `{base}`, and that is not shown");
                }
            }
        }
    }
}

/// What the runs of an entry say together.
fn claims_of(task: Task<'_>, entry: &Entry, runs: &[(Job<'_>, &Found)], tool: &str) -> Vec<Claim> {
    let short = entry.function.trim_start_matches("prove_").replace('_', "-");
    let seconds = runs.iter().map(|(_, found)| found.seconds).sum();
    let mut settings: Vec<String> = runs.iter().map(|(job, _)| setting(job)).collect();
    // of a run in parts
    settings.dedup();
    let claim = |name: &str, text: &str, judged: Vec<(Verdict, Vec<String>)>| {
        let verdict = judged
            .iter()
            .map(|(verdict, _)| *verdict)
            .max()
            .unwrap_or(Verdict::NotRun);
        Claim {
            prover: NAME,
            name: format!("{short}-{name}"),
            text: text.to_owned(),
            subject: entry.about.to_owned(),
            format: task.policy.numeric_format,
            settings: settings.clone(),
            verdict,
            reason: String::new(),
            seconds,
            tool: tool.to_owned(),
            details: judged.into_iter().flat_map(|(_, details)| details).collect(),
        }
    };
    let no_error = |numbers| {
        let own = runs.iter().filter(move |(job, _)| job.numbers == numbers);
        own.map(|(job, found)| alarms(job, found)).collect::<Vec<_>>()
    };
    let finite = no_error(Numbers::Finite);
    let any = no_error(Numbers::Any);
    // where all inputs are integers, finite numbers are all that there are
    let any = if any.is_empty() { finite.clone() } else { any };
    let mut claims = vec![claim("runs", NO_ERROR, any)];
    claims.extend((!finite.is_empty()).then(|| claim(FINITE, NO_NAN, finite)));
    for stated in &entry.stated {
        let judged = runs
            .iter()
            .filter(|(job, _)| !stated.is_finite_only || job.numbers == Numbers::Finite)
            .map(|(job, found)| checks(job, found, &stated.label))
            .collect();
        claims.push(claim(&stated.name, &stated.text, judged));
    }
    claims
}

/// What Eva looks for everywhere.
const NO_ERROR: &str = "No access outside of an object, no uninitialised read, no overflow of a signed integer, no wrong shift, no \
                        division by zero, no conversion of a float that does not fit.";

/// Name of the claim about finite numbers.
const FINITE: &str = "finite";
const NO_NAN: &str = "Where numbers are finite, no NaN and no infinity arises, and nothing else goes wrong.";

fn setting(job: &Job<'_>) -> String {
    format!("{}, {}", job.machine.0, job.numbers.name())
}

fn alarms(job: &Job<'_>, found: &Found) -> (Verdict, Vec<String>) {
    let place = |text: &String| format!("{}: {text}", setting(job));
    if !found.failure.is_empty() {
        return (Verdict::Unproven, vec![place(&found.failure)]);
    }
    if !found.reached {
        let text = "the end of the driver is not reached".to_owned();
        return (
            Verdict::Unproven,
            vec![place(&text)]
                .into_iter()
                .chain(found.alarms.iter().map(place))
                .collect(),
        );
    }
    let verdict = if found.alarms.is_empty() {
        Verdict::Proved
    } else {
        Verdict::Unproven
    };
    (verdict, found.alarms.iter().map(place).collect())
}

fn checks(job: &Job<'_>, found: &Found, label: &str) -> (Verdict, Vec<String>) {
    let own = |name: &str| name == label || name.strip_prefix(label).is_some_and(|rest| rest.starts_with('_'));
    let open: Vec<&(String, bool)> = found.open.iter().filter(|(name, _)| own(name)).collect();
    let details = open
        .iter()
        .map(|(name, _)| format!("{}: {name}", setting(job)))
        .collect();
    let tried = found.valid.iter().any(|name| own(name));
    let verdict = match () {
        () if open.iter().any(|(_, fails)| *fails) => Verdict::Refuted,
        () if !open.is_empty() || !found.reached || !tried => Verdict::Unproven,
        () => Verdict::Proved,
    };
    (verdict, details)
}

/// The driver of a policy in its numeric format, for who wants to read it or run Frama-C by hand.
#[must_use]
pub fn driver_text(policy: &policy::Policy) -> String {
    driver::driver(policy).text
}
