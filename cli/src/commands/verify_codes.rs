//! `policyc verify --codes`

use std::path::Path;

use policy::Policy;
use serde::Serialize;
use targets::TargetSpec;
use toml_input::{Fault, Faults};
use verify::codes::{Axis, Grid, Row};
use verify::{Files, Options, shards, text};

use super::progress_line::{Pace, ProgressLine};
use super::verify::told;
use crate::arguments::Verify;
use crate::failure::Failure;
use crate::outcome::Outcome;
use crate::output;
use report::grouped;

/// The file that all shards are merged into.
const MERGED: &str = "codes.csv";

/// What `--json` prints.
#[derive(Serialize)]
struct Answer<'a> {
    /// Whether nothing that was compared is different.
    equal: bool,
    /// Whether every combination was compared.
    complete: bool,
    combinations: u64,
    compared: u64,
    signals: &'a [Axis],
    different: Vec<&'a Row>,
}

/// Compares the parts of a shard, merges what is in the folder, and reports on all of it.
pub fn run(
    options: &Verify,
    out: &Path,
    policy: &Policy,
    target: &'static TargetSpec,
    generated: Option<&Files>,
) -> Result<Outcome, Failure> {
    let contract = super::contract_path(&options.policy);
    let grid = Grid::of(policy).map_err(|message| Fault::in_file(&contract, message))?;
    let mut progress = ProgressLine::new();
    let parts = grid.parts();
    let own: Vec<_> = (0..parts).filter(|part| options.every.shard.takes(*part)).collect();
    let (pace, all, mut done) = (Pace::new(), own.len() as u64, 0);
    let compare = |part| -> Result<Row, Faults> {
        let left = pace.left(done, all);
        let mut tell = |news| progress.show(|| format!("part {} of {parts}: {}{left}", part + 1, told(news)));
        let report = verify::run(
            policy,
            Options {
                codes: Some((&grid, grid.part(part))),
                target,
                generated,
                assembly: true,
                progress: Some(&mut tell),
                ..Options::default()
            },
        )?;
        if !report.compared() {
            return Err(text::nothing_compared(&report).into());
        }
        done += 1;
        Ok(Row::new(part, &report))
    };
    shards::run(
        out,
        options.every.shard,
        &grid.head(policy, target),
        own.into_iter(),
        compare,
        |_| {},
    )?;
    progress.clear();
    let rows: Vec<Row> = shards::merge(out, MERGED)?;
    let compared = rows.iter().map(|row| row.combinations).sum();
    let answer = Answer {
        equal: rows.iter().all(Row::is_equal),
        complete: compared == grid.combinations(),
        combinations: grid.combinations(),
        compared,
        signals: grid.axes(),
        different: rows.iter().filter(|row| !row.is_equal()).collect(),
    };
    if options.json {
        output::say_json(&answer)?;
    } else {
        output::say(&summary(&answer, &rows))?;
    }
    Ok(if answer.equal {
        Outcome::Done
    } else {
        Outcome::Different
    })
}

fn summary(answer: &Answer<'_>, rows: &[Row]) -> String {
    let axes = answer.signals.iter();
    let mut lines: Vec<String> = axes
        .map(|axis| format!("{}: codes {} to {}", axis.signal, axis.first, axis.last))
        .collect();
    let builds = rows.iter().map(|row| row.builds);
    let builds = match (builds.clone().min(), builds.max()) {
        (Some(least), Some(most)) if least != most => format!("{least} to {most}"),
        (_, most) => most.unwrap_or_default().to_string(),
    };
    let compared = grouped(answer.compared);
    lines.push(match answer.complete {
        true => format!("all {compared} combinations compared, in {builds} builds"),
        false => format!(
            "{compared} of {} combinations compared, in {builds} builds; the others are of shards that are not in the folder",
            grouped(answer.combinations)
        ),
    });
    for row in &answer.different {
        lines.push(format!("part {}: {}", row.part, row.outcome));
    }
    lines.push(match answer.equal {
        true if answer.complete => "equal: every first step against the interpreter".to_owned(),
        true => "equal: every first step that was compared".to_owned(),
        false => format!("different in {} of {} parts", answer.different.len(), rows.len()),
    });
    lines.join("\n")
}
