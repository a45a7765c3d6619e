//! `policyc campaign`

use std::sync::Mutex;
use std::sync::atomic::Ordering;

use campaign::{Call, Plan, slurm, snakemake};
use report::grouped;
use serde::Serialize;
use serde_json::{Value, json};
use toml_input::Message;

use super::progress_line::{Pace, ProgressLine};
use crate::arguments::{Campaign, Engine, Script};
use crate::campaign::{Finished, Local, Progress, Session, check};
use crate::failure::Failure;
use crate::interruption;
use crate::outcome::Outcome;
use crate::output;
use crate::talk;

/// Runs what has not been run, and merges.
pub fn run(options: &Campaign) -> Result<Outcome, Failure> {
    let stop = interruption::stop_on_signal();
    let session = Session::open(Plan::open(&options.plan)?, &options.out, options.replacing)?;
    if let Some(script) = &options.write {
        return write(options, &session, script);
    }
    if options.list {
        return list(options, &session);
    }
    if options.engine == Engine::Ray {
        let message = Message::new("--engine ray comes with the Python package, and this is the program alone");
        return Err(message
            .hint("pip install 'policyc[ray]', and call its `policyc` or policyc.campaign; --write slurm=FILE needs neither")
            .into());
    }
    if options.address.is_some() {
        return Err(Message::new("--address is of a cluster of Ray")
            .hint("add --engine ray")
            .into());
    }
    let pending = match &options.task {
        Some(task) => {
            let index = session.find(task)?;
            let is_settled = session
                .plan
                .tasks
                .get(index)
                .is_some_and(|task| session.is_settled(task));
            if is_settled { Vec::new() } else { vec![index] }
        }
        None => session.pending(),
    };
    check(&session.plan, &pending)?;
    session.begin()?;
    let follower = Follower::new(session.plan.tasks.len(), pending.len());
    let engine = Local {
        jobs: options.jobs,
        stop: &stop,
        tell: &|progress| follower.hear(progress),
    };
    let ran = pending.len();
    let result = engine.run(&session, pending);
    follower.clear();
    result?;
    if stop.load(Ordering::Relaxed) {
        let left = session.pending().len();
        talk::interrupted(&format!("{left} tasks are left; to go on, type the same again"));
        return Ok(Outcome::Interrupted);
    }
    if let Some(task) = &options.task {
        return alone(&session, session.find(task)?);
    }
    answer(
        options.json,
        &options.out.display().to_string(),
        &session.finish()?,
        Some(ran),
    )
}

/// What became of one task.
fn alone(session: &Session, index: usize) -> Result<Outcome, Failure> {
    let Some(task) = session.plan.tasks.get(index) else {
        return Err(Message::new("the plan has no such task").into());
    };
    if session.is_done(task) {
        output::say(&format!("done: {}", task.title()))?;
        return Ok(Outcome::Done);
    }
    let reason = session.reason(task);
    let message = Message::new(format!("{} has no result", task.title()));
    Err(match reason {
        Some(reason) => message.found(reason),
        None => message.hint("another process works on it"),
    }
    .into())
}

/// What `--json` prints.
#[derive(Serialize)]
struct Answer<'a> {
    out: &'a str,
    files: &'a [String],
    /// Tasks that ran now.
    #[serde(skip_serializing_if = "Option::is_none")]
    ran: Option<usize>,
    /// The keys of `results.json`.
    #[serde(flatten)]
    results: Value,
}

/// Says what a campaign came to.
pub fn answer(json: bool, out: &str, finished: &Finished, ran: Option<usize>) -> Result<Outcome, Failure> {
    let results = &finished.results;
    if json {
        output::say_json(&Answer {
            out,
            files: &finished.files,
            ran,
            results: serde_json::from_str(&results.json())?,
        })?;
    } else {
        output::say(&summary(out, finished, ran))?;
    }
    Ok(match results.hold() {
        true => Outcome::Done,
        false => Outcome::Different,
    })
}

/// Lines of a summary that name tasks, before it says how many more there are.
const NAMED: usize = 10;

/// What a campaign came to, for people.
#[must_use]
pub fn summary(out: &str, finished: &Finished, ran: Option<usize>) -> String {
    let results = &finished.results;
    let mut lines = Vec::new();
    for (listed, figures) in results.best() {
        let figure = |name: &str| figures.iter().find(|(own, _)| own == name).map(|(_, value)| value);
        let cost = figure("selection_cost").and_then(Value::as_f64);
        let met = match figure("met").and_then(Value::as_bool) {
            Some(true) => ", meets its specification",
            Some(false) => ", misses its specification",
            None => "",
        };
        let cost = cost.map(|cost| format!(", cost {cost:.3}")).unwrap_or_default();
        lines.push(format!("best {}{cost}{met}", listed.title()));
    }
    let failed = results.failed().map(|(listed, reason)| {
        let first = reason.lines().next().unwrap_or_default().trim_start_matches("error: ");
        format!("failed {}: {first}", listed.title())
    });
    let refused = results.refused();
    let refused = refused.iter().map(|listed| format!("no: {}", listed.title()));
    let mut named: Vec<String> = failed.chain(refused).collect();
    if named.len() > NAMED {
        let more = named.len() - NAMED;
        named.truncate(NAMED);
        named.push(format!("and {more} more"));
    }
    lines.extend(named);
    if !lines.is_empty() {
        lines.push(String::new());
    }
    let now = ran
        .map(|ran| format!(" {} ran now.", grouped(ran as u64)))
        .unwrap_or_default();
    lines.push(format!("{}{now}", results.sentence()));
    lines.push(format!("results in {out}; to look at: {out}/report.html"));
    lines.join("\n")
}

fn list(options: &Campaign, session: &Session) -> Result<Outcome, Failure> {
    let tasks = session.plan.tasks.iter().enumerate();
    if options.json {
        let all: Vec<Value> = tasks
            .map(|(index, task)| {
                json!({ "number": index + 1, "id": task.id, "title": task.title(), "done": session.is_done(task), "arguments": task.arguments })
            })
            .collect();
        output::say_json(&all)?;
        return Ok(Outcome::Done);
    }
    let width = session.plan.tasks.len().to_string().len();
    let lines = tasks.map(|(index, task)| {
        let state = if session.is_done(task) { "done" } else { "to do" };
        format!("{:>width$}  {:<25}  {state:<5}  {}", index + 1, task.id, task.title())
    });
    output::say(&lines.collect::<Vec<_>>().join("\n"))?;
    Ok(Outcome::Done)
}

fn write(options: &Campaign, session: &Session, script: &Script) -> Result<Outcome, Failure> {
    // a slip should not come out on the cluster
    check(&session.plan, &session.pending())?;
    // so that the jobs find a campaign, and do not all begin one
    session.begin()?;
    let call = Call {
        plan: options.plan.display().to_string(),
        out: options.out.display().to_string(),
    };
    let schedule = session.plan.schedule();
    let (file, text, next) = match script {
        Script::Slurm(file) => (file, slurm(&schedule, session.plan.tasks.len(), &call), "sbatch"),
        Script::Snakemake(file) => (file, snakemake(&schedule, &call), "snakemake --cores all --snakefile"),
    };
    output::replace_own_one(file, &text, options.replacing)?;
    output::say(&format!(
        "{} tasks; next: {next} {}",
        session.plan.tasks.len(),
        file.display()
    ))?;
    Ok(Outcome::Done)
}

/// Tells how far a campaign is.
struct Follower {
    line: Mutex<ProgressLine>,
    counts: Mutex<[usize; 2]>,
    all: usize,
    pending: usize,
    pace: Pace,
}

impl Follower {
    fn new(all: usize, pending: usize) -> Self {
        Self {
            line: Mutex::new(ProgressLine::new()),
            counts: Mutex::new([0, 0]),
            all,
            pending,
            pace: Pace::new(),
        }
    }

    fn hear(&self, progress: Progress<'_>) {
        let Ok(mut counts) = self.counts.lock() else { return };
        let failed = progress.reason.is_some();
        counts[usize::from(failed)] += 1;
        let ended = counts[0] + counts[1];
        let left = self.pace.left(ended as u64, self.pending as u64);
        let done = self.all - self.pending + counts[0];
        let failures = if counts[1] == 0 {
            String::new()
        } else {
            format!(", {} failed", counts[1])
        };
        if let Ok(mut line) = self.line.lock() {
            line.show(|| {
                format!(
                    "{done} of {} tasks done{failures}{left}: {}",
                    self.all,
                    progress.task.title()
                )
            });
        }
    }

    fn clear(&self) {
        if let Ok(mut line) = self.line.lock() {
            line.clear();
        }
    }
}
