//! What a simulation leaves behind, as text.

use std::collections::BTreeMap;

use serde::Serialize;

use super::findings::{Findings, POLICY, Setting, Step};
use super::outputs::{self, OutputUse};
use super::spread::{Json as SpreadJson, Spreads};
use super::{page, pictures, words};
use crate::faults::{Error, told};
use crate::limit::Bound;
use crate::scenario::Metrics;
use crate::tables::{MetricsCsv, at_rest, comparison, trajectory_csv};

/// Name of the page with everything on it, among the files.
pub const PAGE: &str = "report.html";

/// `metrics.json`. Figures that are not finite are null.
#[derive(Serialize)]
struct Json<'a> {
    policy: &'a str,
    controller: &'a str,
    /// Of several outputs the one that drives the plant.
    #[serde(skip_serializing_if = "Option::is_none")]
    output: Option<&'a str>,
    v_ref: f64,
    sample_period: f64,
    load_steps: Vec<JsonStep<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    check: Option<JsonCheck<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    spread: Option<SpreadJson<'a>>,
    notes: &'a [String],
}

#[derive(Serialize)]
struct JsonLoad<'a> {
    value: f64,
    unit: &'a str,
}

#[derive(Serialize)]
struct JsonStep<'a> {
    from: f64,
    to: f64,
    unit: &'a str,
    /// The load that stays while the source steps.
    #[serde(skip_serializing_if = "Option::is_none")]
    load: Option<JsonLoad<'a>>,
    controllers: BTreeMap<&'a str, JsonPair<&'a Metrics>>,
    limits: BTreeMap<&'a str, JsonPair<&'a Bound>>,
    /// At the first sampling instant.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    outputs: Vec<OutputUse>,
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

impl Findings {
    /// Name and text of every file: metrics, trajectories, a picture for each load step, the summary, and the [`PAGE`].
    ///
    /// # Errors
    /// If a picture cannot be drawn.
    pub fn files(&self) -> Result<BTreeMap<String, String>, Error> {
        let mut files = BTreeMap::new();
        let mut metrics = MetricsCsv::default();
        let mut drawn = Vec::new();
        for step in &self.steps {
            let stem = step.step.stem();
            for (name, course) in &step.courses {
                metrics.controller(name, &course.finding);
                let file = format!("{stem}-{}.csv", name.replace(' ', "-"));
                let beside = match name == POLICY {
                    true => outputs::names_beside(&self.setting),
                    false => Vec::new(),
                };
                files.insert(file, trajectory_csv(&course.shown, step.step.kind, &beside));
            }
            for (name, limit) in &step.limits {
                metrics.limit(name, step.step, limit);
            }
            let picture = pictures::picture(&self.setting, step)?;
            files.insert(format!("{stem}.svg"), picture.as_str().to_owned());
            drawn.push(picture);
        }
        files.insert("metrics.csv".to_owned(), metrics.finish());
        files.insert("metrics.json".to_owned(), json(self)?);
        files.insert("summary.txt".to_owned(), self.summary());
        let mut of_spread = Vec::new();
        if let Some(spread) = &self.spread {
            files.insert("spread.csv".to_owned(), spread.csv());
            of_spread = spread.pictures()?;
            for (name, svg) in &of_spread {
                files.insert(
                    format!("spread-{}.svg", name.replace(' ', "-")),
                    svg.as_str().to_owned(),
                );
            }
        }
        files.insert(PAGE.to_owned(), page::page(self, drawn, of_spread)?);
        Ok(files)
    }

    /// What was simulated and a table of each load step, for people: voltages in V, times in ms.
    #[must_use]
    pub fn summary(&self) -> String {
        let setting = &self.setting;
        let mut out = format!(
            "policy  {} in {} ({})\n{}plant   {}\n\n{}\n",
            setting.policy.name,
            setting.policy.numeric_format.name(),
            self.controller,
            outputs::drives(&setting.policy, setting.output)
                .map_or_else(String::new, |text| format!("output  {text}\n")),
            words::plant_text(setting),
            words::explanation(setting).replace(". ", ".\n")
        );
        for step in &self.steps {
            let courses = step.courses.iter();
            let controllers = courses.map(|(name, course)| (name.as_str(), &course.finding));
            let resting = controllers.clone();
            let limits = step.limits.iter().map(|(name, limit)| (name.as_str(), limit));
            out.push('\n');
            out.push_str(&comparison(step.step, controllers, limits));
            out.push_str(&at_rest(resting));
            out.push_str(&outputs::table(setting, step));
        }
        if let Some(spread) = &self.spread {
            out.push_str(&format!("\n{}", spread.text()));
        }
        if let Some(check) = &self.check {
            out.push_str(&format!("\n{}\n", words::check_text(check)));
        }
        for note in self.notes() {
            out.push_str(&format!("\nnote: {note}\n"));
        }
        out
    }

    /// What the user should know of the results, one sentence each.
    #[must_use]
    pub fn notes(&self) -> Vec<String> {
        let unsettled = words::unsettled(self).into_iter();
        unsettled.chain(self.setting.notes.iter().cloned()).collect()
    }

    /// What `metrics.json` holds. Figures that are not finite are null in JSON.
    #[must_use]
    pub fn metrics(&self) -> impl Serialize + '_ {
        let Findings {
            setting,
            controller,
            steps,
            check,
            spread,
        } = self;
        Json {
            policy: &setting.policy.name,
            controller,
            output: setting.policy.output_names().get(setting.output).copied(),
            v_ref: setting.v_ref,
            sample_period: setting.policy.sample_period,
            load_steps: steps.iter().map(|step| json_step(setting, step)).collect(),
            check: check.as_ref().map(|check| JsonCheck {
                equal: check.differences.is_empty(),
                controllers: &check.names,
                periods: check.periods,
                differences: &check.differences,
            }),
            spread: spread.as_ref().map(Spreads::json),
            notes: &setting.notes,
        }
    }
}

fn json(found: &Findings) -> Result<String, Error> {
    let text = serde_json::to_string_pretty(&found.metrics()).map_err(told)?;
    Ok(format!("{text}\n"))
}

fn json_step<'a>(setting: &Setting, step: &'a Step) -> JsonStep<'a> {
    let ([from, to], unit) = step.step.stepped();
    let controllers = step.courses.iter().map(|(name, course)| {
        let (sample, worst) = (&course.finding.at_sample, &course.finding.worst);
        (name.as_str(), JsonPair { sample, worst })
    });
    let limits = step.limits.iter().map(|(name, limit)| {
        let (sample, worst) = (&limit.at_sample, &limit.worst);
        (name.as_str(), JsonPair { sample, worst })
    });
    JsonStep {
        from,
        to,
        unit,
        load: step.step.keeps_load().then(|| JsonLoad {
            value: step.step.values[0],
            unit: step.step.kind.unit(),
        }),
        controllers: controllers.collect(),
        limits: limits.collect(),
        outputs: outputs::outputs(setting, step),
    }
}
