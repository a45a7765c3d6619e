//! `policyc train`

use std::collections::BTreeSet;
use std::path::Path;
use std::time::{Duration, Instant};

use serde::Serialize;
use toml_input::{FileName, Message};
use train::summary::Summary;
use train::verdict::missed;
use train::{
    Contract, Converter, Course, Ended, Outcome as Trained, SeedRun, Settings, page, seeds, tables, train_converter,
};

use super::foreign::opener;
use crate::arguments::Train;
use crate::failure::Failure;
use crate::interruption;
use crate::made;
use crate::outcome::Outcome;
use crate::output;
use crate::talk;
use report::grouped;

mod kept;
mod progress;
mod tensorboard;

use kept::Kept;
use progress::Watcher;
use tensorboard::Events;

/// Time between two checkpoints on the way. A kill or a power cut may cost five seconds of work; the rest is for a look at
/// the selection scenarios and for writing.
const CHECKPOINT_EVERY: Duration = Duration::from_secs(3);
/// Limits that are said in the terminal: those that are exceeded most. A screen.
const SHOWN: usize = 8;
const SEEDS: &str = "seeds";
const PAGE: &str = "report.html";

/// What `--json` prints.
#[derive(Serialize)]
struct Answer<'a> {
    out: &'a Path,
    /// The one figure that is another in each run.
    seconds: f64,
    /// After an interruption: the command that goes on.
    #[serde(skip_serializing_if = "Option::is_none")]
    resume: Option<String>,
    #[serde(flatten)]
    summary: Summary,
}

/// Trains all seeds and writes the folders.
pub fn run(options: &Train) -> Result<Outcome, Failure> {
    let mut settings = Settings::load(&options.settings)?;
    if !options.seeds.is_empty() {
        settings.seeds = distinct(&options.seeds)?;
    }
    let contract = Contract::load(&settings.contract, &settings.hidden)?;
    let converter = converter(options, &settings)?;
    closed_loop::holds_power(converter.parameters(), settings.reward.v_ref, &settings.plant)?;
    settings
        .remarks(converter.parameters())
        .iter()
        .for_each(|doubt| talk::note(doubt));
    let kept = Kept::new(&options.out);
    let course = Course {
        threads: threads(options, &converter),
        checkpoints: kept.prepare(&settings.seeds, options.resume)?,
        checkpoint_every: Some(CHECKPOINT_EVERY),
    };
    let events = options.tensorboard.as_deref();
    let events = events
        .map(|folder| Events::new(folder, &settings.seeds, options.resume))
        .transpose()?;
    let stop = interruption::stop_on_signal();
    let start = Instant::now();
    let watcher = Watcher::new(&settings, &kept, events.as_ref(), &stop);
    let result = train_converter(&settings, &contract, &converter, &course, &stop, &watcher);
    watcher.finish()?;
    let runs = result?;
    if runs.iter().any(|run| run.ended == Ended::Interrupted) {
        return interrupted(options, &settings, &kept, &runs, start.elapsed());
    }
    let Some(best) = seeds::best(&runs) else {
        return Err(Message::new("no seed was trained").into());
    };
    write(options, &settings, &runs, best, &converter)?;
    kept.remove();
    let outcome = report(options, &settings, &runs, best, start.elapsed())?;
    // behind the answer: the policy is there all the same
    events.map_or(Ok(()), |events| events.failure())?;
    Ok(outcome)
}

/// Whether a training of these seeds may go to `out`.
///
/// # Errors
/// If it holds a policy, or an interrupted training that is not to be resumed; or nothing to resume.
pub fn ready(out: &Path, seeds: &[u64], resume: bool) -> Result<(), Failure> {
    Kept::new(out).prepare(seeds, resume).map(|_| ())
}

/// Reads every file that is named, and trains nothing.
///
/// # Errors
/// Their faults.
pub fn check(options: &Train) -> Result<(), Failure> {
    let settings = Settings::load(&options.settings)?;
    Contract::load(&settings.contract, &settings.hidden)?;
    converter(options, &settings)?;
    Ok(())
}

/// What is trained on.
fn converter(options: &Train, settings: &Settings) -> Result<Converter, Failure> {
    let file = FileName::named_by_a_file(&settings.plant);
    Ok(Converter::open(file, &settings.set, &opener(options.foreign))?)
}

/// Cores that a training may use. Of an FMU that is there once in a process one: two seeds would take it from each other at every
/// step, and each repeat its run.
fn threads(options: &Train, converter: &Converter) -> usize {
    let Some(outside) = converter.outside() else {
        return options.threads;
    };
    outside.notes().iter().for_each(|note| talk::note(note));
    if !outside.is_only_one() || options.threads == 1 {
        return options.threads;
    }
    talk::note(&format!(
        "{} runs once in a process: the seeds are trained one after the other",
        outside.name()
    ));
    1
}

/// Writes the seeds' folders, the best one's last: a folder with a `policy.toml` is a whole training.
fn write(
    options: &Train,
    settings: &Settings,
    runs: &[SeedRun],
    best: &Trained,
    converter: &Converter,
) -> Result<(), Failure> {
    let out = &options.out;
    for outcome in runs.iter().filter_map(|run| run.outcome.as_ref()) {
        output::write_all(&out.join(SEEDS).join(outcome.seed.to_string()), &outcome.files)?;
    }
    let mut files = best.files.clone();
    files.insert("seeds.txt".to_owned(), seeds::table(settings, runs).into_bytes());
    let read = [
        ("training file", options.settings.display().to_string()),
        ("contract", settings.contract.display().to_string()),
        ("plant", settings.plant.display().to_string()),
    ];
    let page = made::signed_page(
        &page::page(settings, runs, best, converter)?,
        &[("--out", "policy")],
        &read,
    )?;
    files.insert(PAGE.to_owned(), page.into_bytes());
    output::write_all(out, &files)
}

fn report(
    options: &Train,
    settings: &Settings,
    runs: &[SeedRun],
    best: &Trained,
    spent: Duration,
) -> Result<Outcome, Failure> {
    let missed = !settings.specification.is_empty() && !best.evaluated.met;
    let outcome = if missed { Outcome::Different } else { Outcome::Done };
    let seconds = spent.as_secs_f64();
    if options.json {
        output::say_json(&Answer {
            out: &options.out,
            seconds,
            resume: None,
            summary: Summary::new(settings, runs, Some(best)),
        })?;
        return Ok(outcome);
    }
    let steps: u64 = runs.iter().map(|run| run.steps).sum();
    let out = options.out.display();
    let mut text = seeds::table(settings, runs);
    text.push_str(&format!(
        "\nSeed {}, {}, in its evaluation (at sampling instants / worst of all instants):\n\n{}",
        best.seed,
        seeds::chosen(settings, best),
        tables(&best.judged, &best.law)
    ));
    if missed {
        text.push_str(&limits(best));
    }
    text.push_str(&format!(
        "\n{} control periods in {seconds:.1} s; policy in {out}, all seeds in {out}/{SEEDS}; to look at: {out}/{PAGE}\n\
         next: policyc verify {out}",
        grouped(steps)
    ));
    output::say(&text)?;
    Ok(outcome)
}

/// Which limits were missed, and what there is to do.
fn limits(best: &Trained) -> String {
    let missed = missed(best.verdicts());
    let mut text = format!(
        "\nThe specification is missed: {} of {} limits\n",
        missed.len(),
        best.verdicts().count()
    );
    for verdict in missed.iter().take(SHOWN) {
        text.push_str(&format!("  {verdict}\n"));
    }
    if missed.len() > SHOWN {
        text.push_str(&format!("  and {} more, in report.txt\n", missed.len() - SHOWN));
    }
    text.push_str("what to do: docs/how-to/missed-specification.md\n");
    text
}

fn interrupted(
    options: &Train,
    settings: &Settings,
    kept: &Kept,
    runs: &[SeedRun],
    spent: Duration,
) -> Result<Outcome, Failure> {
    for (seed, run) in settings.seeds.iter().zip(runs) {
        kept.write(*seed, &run.checkpoint)?;
    }
    let mut resume = format!(
        "policyc train {} --out {}",
        options.settings.display(),
        options.out.display()
    );
    if !options.seeds.is_empty() {
        let seeds: Vec<String> = options.seeds.iter().map(u64::to_string).collect();
        resume.push_str(&format!(" --seeds {}", seeds.join(",")));
    }
    if let Some(folder) = &options.tensorboard {
        resume.push_str(&format!(" --tensorboard {}", folder.display()));
    }
    resume.push_str(" --resume");
    if options.json {
        output::say_json(&Answer {
            out: &options.out,
            seconds: spent.as_secs_f64(),
            resume: Some(resume),
            summary: Summary::new(settings, runs, seeds::best(runs)),
        })?;
        return Ok(Outcome::Interrupted);
    }
    output::say(&format!(
        "{}\nInterrupted; checkpoints in {}. To go on: {resume}",
        seeds::table(settings, runs),
        kept.folder.display()
    ))?;
    Ok(Outcome::Interrupted)
}

fn distinct(seeds: &[u64]) -> Result<Vec<u64>, Failure> {
    let mut seen = BTreeSet::new();
    match seeds.iter().find(|seed| !seen.insert(**seed)) {
        None => Ok(seeds.to_vec()),
        Some(seed) => {
            let message = Message::new("--seeds names a seed twice").found(seed.to_string());
            Err(message.expected("different numbers").into())
        }
    }
}
