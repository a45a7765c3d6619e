//! What a simulation leaves behind, as text.

use std::collections::BTreeMap;

use closed_loop::limit::Bound;
use closed_loop::scenario::{Metrics, SETTLED};
use closed_loop::{LoadStep, MetricsCsv, comparison, trajectory_csv};
use serde::Serialize;

use super::{Check, Findings, Setting, Step, page, pictures};
use crate::Failure;
use report::grouped;

/// The page with everything on it.
pub const PAGE: &str = "report.html";

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
    notes: &'a [String],
}

#[derive(Serialize)]
struct JsonStep<'a> {
    from: f64,
    to: f64,
    unit: &'a str,
    controllers: BTreeMap<&'a str, JsonPair<&'a Metrics>>,
    limits: BTreeMap<&'a str, JsonPair<&'a Bound>>,
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

/// Name and text of every file.
pub fn all(found: &Findings) -> Result<BTreeMap<String, String>, Failure> {
    let mut files = BTreeMap::new();
    let mut metrics = MetricsCsv::default();
    let mut drawn = Vec::new();
    for step in &found.steps {
        let stem = stem(step.step);
        for course in &step.courses {
            metrics.controller(&course.name, &course.finding);
            let name = format!("{stem}-{}.csv", course.name);
            files.insert(name, trajectory_csv(&course.shown, step.step.kind));
        }
        for (name, limit) in &step.limits {
            metrics.limit(name, step.step, limit);
        }
        let picture = pictures::picture(&found.setting, step)?;
        files.insert(format!("{stem}.svg"), picture.as_str().to_owned());
        drawn.push(picture);
    }
    files.insert("metrics.csv".to_owned(), metrics.finish());
    files.insert("metrics.json".to_owned(), json(found)?);
    files.insert("summary.txt".to_owned(), summary(found));
    files.insert(PAGE.to_owned(), page::page(found, drawn)?);
    Ok(files)
}

/// Start of the names of a load step's files: `200-500W`.
fn stem(step: LoadStep) -> String {
    let [from, to] = step.values;
    format!("{from}-{to}{}", step.kind.unit())
}

fn json(found: &Findings) -> Result<String, Failure> {
    let Findings {
        setting,
        controller,
        steps,
        check,
    } = found;
    let json = Json {
        policy: &setting.policy.name,
        controller,
        v_ref: setting.v_ref,
        sample_period: setting.policy.sample_period,
        load_steps: steps.iter().map(json_step).collect(),
        check: check.as_ref().map(|check| JsonCheck {
            equal: check.differences.is_empty(),
            controllers: &check.names,
            periods: check.periods,
            differences: &check.differences,
        }),
        notes: &setting.notes,
    };
    let text = serde_json::to_string_pretty(&json)?;
    Ok(format!("{text}\n"))
}

fn json_step(step: &Step) -> JsonStep<'_> {
    let [from, to] = step.step.values;
    let controllers = step.courses.iter().map(|course| {
        let (sample, worst) = (&course.finding.at_sample, &course.finding.worst);
        (course.name.as_str(), JsonPair { sample, worst })
    });
    let limits = step.limits.iter().map(|(name, limit)| {
        let (sample, worst) = (&limit.at_sample, &limit.worst);
        (name.as_str(), JsonPair { sample, worst })
    });
    JsonStep {
        from,
        to,
        unit: step.step.kind.unit(),
        controllers: controllers.collect(),
        limits: limits.collect(),
    }
}

/// The plant's file and the numbers that were replaced.
pub fn plant_text(setting: &Setting) -> String {
    let set = setting.scenario.set.iter();
    set.fold(setting.plant.display().to_string(), |text, (key, value)| {
        format!("{text}, {key} = {value}")
    })
}

/// What the figures are of.
pub fn explanation(setting: &Setting) -> String {
    let task = &setting.scenario.task;
    format!(
        "True voltages at the sampling instants, errors from {} V, settled within {SETTLED} V. Each pair: worst of {} \
         sampling instants / worst of {} instants and phases.",
        setting.v_ref,
        task.sampling_instants,
        task.all_instants().len(),
    )
}

/// The load steps before or after which the policy does not stay within the settling band, in words.
pub fn unsettled(found: &Findings) -> Option<String> {
    let lost = |step: &&Step| {
        let policy = step.courses.first();
        policy.is_some_and(|policy| policy.finding.worst.tail_max.max(policy.finding.worst.pre_error) > SETTLED)
    };
    let steps: Vec<String> = found
        .steps
        .iter()
        .filter(lost)
        .map(|step| step.step.to_string())
        .collect();
    (!steps.is_empty()).then(|| {
        format!(
            "the policy does not settle within {SETTLED} V of {} V before or after {}",
            found.setting.v_ref,
            steps.join(", ")
        )
    })
}

/// The summary, also printed.
pub fn summary(found: &Findings) -> String {
    let setting = &found.setting;
    let mut out = format!(
        "policy  {} ({})\nplant   {}\n\n{}\n",
        setting.policy.name,
        found.controller,
        plant_text(setting),
        explanation(setting).replace(". ", ".\n")
    );
    for step in &found.steps {
        let controllers = step
            .courses
            .iter()
            .map(|course| (course.name.as_str(), &course.finding));
        let limits = step.limits.iter().map(|(name, limit)| (name.as_str(), limit));
        out.push('\n');
        out.push_str(&comparison(step.step, controllers, limits));
    }
    if let Some(check) = &found.check {
        out.push_str(&format!("\n{}\n", check_text(check)));
    }
    for note in unsettled(found).iter().chain(&setting.notes) {
        out.push_str(&format!("\nnote: {note}\n"));
    }
    out
}

/// How the comparison of the controllers came out.
pub fn check_text(check: &Check) -> String {
    let names = check.names.join(", ");
    let periods = grouped(check.periods as u64);
    if check.differences.is_empty() {
        return format!("equal to the bit over {periods} control periods: {names}");
    }
    let first = check.names.first().map(String::as_str).unwrap_or_default();
    format!(
        "DIFFERENT from {first} within {periods} control periods:\n  {}",
        check.differences.join("\n  ")
    )
}
