//! What a simulation leaves behind, as text.

use std::collections::BTreeMap;

use closed_loop::limit::Bound;
use closed_loop::scenario::{Finding, Metrics, SETTLED};
use closed_loop::{LoadStep, comparison, metrics_csv, trajectory_csv};
use serde::Serialize;

use super::{Check, Setting, Step};
use crate::Failure;
use crate::commands::grouped;

/// Start of the names of a load step's files: `200-500W`.
pub fn stem(step: LoadStep) -> String {
    let [from, to] = step.values;
    format!("{from}-{to}{}", step.kind.unit())
}

/// `metrics.json`. Figures that are not finite are null.
#[derive(Serialize)]
struct Json<'a> {
    policy: &'a str,
    controller: &'a str,
    v_ref: f64,
    sample_period: f64,
    load_steps: Vec<JsonStep<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    check: Option<JsonCheck<'a>>,
}

#[derive(Serialize)]
struct JsonStep<'a> {
    from: f64,
    to: f64,
    unit: &'a str,
    controllers: BTreeMap<&'a str, JsonPair<&'a Metrics>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    limit: Option<JsonPair<&'a Bound>>,
}

#[derive(Serialize)]
struct JsonPair<T> {
    sample: T,
    worst: T,
}

#[derive(Serialize)]
struct JsonCheck<'a> {
    equal: bool,
    controllers: &'a [String],
    periods: usize,
    differences: &'a [String],
}

/// `metrics.csv`, `metrics.json` and the trajectories.
pub fn tables(
    setting: &Setting,
    controller: &str,
    steps: &[Step],
    check: Option<&Check>,
) -> Result<BTreeMap<String, String>, Failure> {
    let mut files = BTreeMap::new();
    let mut findings: Vec<(&str, Vec<Finding>)> = Vec::new();
    for step in steps {
        for (n, course) in step.courses.iter().enumerate() {
            if findings.len() <= n {
                findings.push((&course.name, Vec::new()));
            }
            findings[n].1.push(course.finding);
            let name = format!("{}-{}.csv", stem(step.step), course.name);
            files.insert(name, trajectory_csv(&course.shown, step.step.kind));
        }
    }
    let rows = findings.iter().map(|(name, findings)| (*name, findings.as_slice()));
    files.insert("metrics.csv".to_owned(), metrics_csv(rows));
    let json = Json {
        policy: &setting.policy.name,
        controller,
        v_ref: setting.v_ref,
        sample_period: setting.policy.sample_period,
        load_steps: steps.iter().map(json_step).collect(),
        check: check.map(|check| JsonCheck {
            equal: check.differences.is_empty(),
            controllers: &check.names,
            periods: check.periods,
            differences: &check.differences,
        }),
    };
    let text = serde_json::to_string_pretty(&json)?;
    files.insert("metrics.json".to_owned(), format!("{text}\n"));
    Ok(files)
}

fn json_step(step: &Step) -> JsonStep<'_> {
    let [from, to] = step.step.values;
    JsonStep {
        from,
        to,
        unit: step.step.kind.unit(),
        controllers: step
            .courses
            .iter()
            .map(|course| {
                let Finding { at_sample, worst, .. } = &course.finding;
                let sample = at_sample;
                (course.name.as_str(), JsonPair { sample, worst })
            })
            .collect(),
        limit: step.limit.as_ref().map(|limit| JsonPair {
            sample: &limit.at_sample,
            worst: &limit.worst,
        }),
    }
}

/// The summary, also printed.
pub fn summary(setting: &Setting, controller: &str, steps: &[Step], check: Option<&Check>) -> String {
    let task = &setting.scenario.task;
    let mut out = format!("policy  {} ({controller})\n", setting.policy.name);
    out.push_str(&format!("plant   {}", setting.plant.display()));
    for (key, value) in &setting.scenario.set {
        out.push_str(&format!(", {key} = {value}"));
    }
    out.push_str(&format!(
        "\n\nTrue voltages at the sampling instants, errors from {} V, settled within {SETTLED} V.\n\
         Worst of {} sampling instants / worst of {} instants and phases.\n",
        setting.v_ref,
        task.sampling_instants,
        task.all_instants().len(),
    ));
    for step in steps {
        let controllers = step
            .courses
            .iter()
            .map(|course| (course.name.as_str(), &course.finding));
        out.push('\n');
        out.push_str(&comparison(step.step, controllers, step.limit.as_ref()));
    }
    if let Some(check) = check {
        out.push_str(&check_text(check));
    }
    for note in &setting.notes {
        out.push_str(&format!("\nnote: {note}\n"));
    }
    out
}

fn check_text(check: &Check) -> String {
    let names = check.names.join("; ");
    let periods = grouped(check.periods as u64);
    if check.differences.is_empty() {
        return format!("\nequal to the bit over {periods} control periods: {names}\n");
    }
    let first = check.names.first().map(String::as_str).unwrap_or_default();
    format!(
        "\nDIFFERENT from {first} within {periods} control periods:\n  {}\n",
        check.differences.join("\n  ")
    )
}
