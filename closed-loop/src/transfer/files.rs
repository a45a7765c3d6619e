//! What a transfer leaves behind.

use std::collections::BTreeMap;

use report::{Cell, Page, Section, Table, Verdict};

use super::findings::{Findings, MAPPED, Real, Run};
use super::pictures;
use crate::faults::{Error, told};
use crate::scenario::Metrics;
use crate::simulation::band_text;
use crate::tables::{COLUMNS, MetricsCsv, cells, comparison, digits, time_digits};

/// Name of the page with everything on it, among the files.
pub const PAGE: &str = "report.html";

impl Findings {
    /// Name and text of every file: points, mapping and pictures of each real converter, metrics, the summary with the figures
    /// of every load step, and the [`PAGE`].
    ///
    /// # Errors
    /// If a picture cannot be drawn.
    pub fn files(&self) -> Result<BTreeMap<String, String>, Error> {
        let mut files = BTreeMap::new();
        let mut metrics = MetricsCsv::default();
        add(&mut metrics, self.simulation.name, &self.simulation);
        let mut page = Page::new(format!("Transfer of {}", self.setting.policy.name))
            .verdict(Verdict::Note, sentence(self))
            .section(Section::new("").text(explanation(self)).table(overview(self)));
        let simulation = drm::simulation_toml(&self.setting.trained_on);
        for real in &self.real {
            let name = &real.name;
            files.insert(format!("{name}-points.csv"), real.points.clone());
            let mapping = real.report.fit.map.to_toml("") + &simulation;
            files.insert(format!("{name}-drm.toml"), mapping);
            for run in &real.runs {
                add(&mut metrics, &format!("{name}: {}", run.name), run);
            }
            page = page.section(section(self, real, &mut files)?);
        }
        files.insert("metrics.csv".to_owned(), metrics.finish());
        files.insert("summary.txt".to_owned(), whole_summary(self));
        files.insert(PAGE.to_owned(), page.html().map_err(told)?);
        Ok(files)
    }

    /// The largest figures, the mappings and what none repairs, for people: voltages in V, times in ms.
    #[must_use]
    pub fn summary(&self) -> String {
        let mut out = format!("{}\n\n{}", explanation(self), overview_text(self));
        for real in &self.real {
            let fit = &real.report.fit;
            out.push_str(&format!(
                "\n{}: {} points, leave-one-out {:.4} V rms, {:.4} V at most; {}\n",
                real.name,
                fit.rows.len(),
                fit.left_out.rms_v,
                fit.left_out.max_v,
                formula(real)
            ));
            for note in &real.notes {
                out.push_str(&format!("  note: {note}\n"));
            }
            for remark in &real.remarks {
                out.push_str(&format!("  no mapping repairs: {remark}\n"));
            }
        }
        out
    }
}

/// A real converter on the page; its pictures are files as well.
fn section(found: &Findings, real: &Real, files: &mut BTreeMap<String, String>) -> Result<Section, Error> {
    let mut section = Section::new(real.name.as_str());
    for note in &real.notes {
        section = section.text(format!("Note: {note}."));
    }
    for remark in &real.remarks {
        section = section.text(format!("No mapping repairs: {remark}."));
    }
    let mut steps = Vec::new();
    for (index, course) in found.simulation.courses.iter().enumerate() {
        let picture = pictures::picture(found, real, index)?;
        let stem = course.finding.step().stem();
        files.insert(format!("{}-{stem}.svg", real.name), picture.as_str().to_owned());
        let step = Section::new(course.finding.step().to_string());
        steps.push(step.chart(picture, CAPTION).table(table(found, real, index)));
    }
    section = section.pick(format!("load step on {}", real.name), steps);
    let text = drm::text(&real.report).map_err(told)?;
    Ok(section.details(Section::new("Fit").code(text)))
}

const CAPTION: &str =
    "The first sampling instant; voltages are samples, one per control period. The table is of all instants.";

fn add(metrics: &mut MetricsCsv, name: &str, run: &Run) {
    for course in &run.courses {
        metrics.controller(name, &course.finding);
    }
}

/// The runs at a converter, that in simulation first.
fn rows<'a>(found: &'a Findings, real: &'a Real) -> impl Iterator<Item = &'a Run> {
    std::iter::once(&found.simulation).chain(&real.runs)
}

/// The summary with the figures of every load step.
fn whole_summary(found: &Findings) -> String {
    let mut out = found.summary();
    for real in &found.real {
        out.push_str(&format!("\n{}\n", real.name));
        for (index, course) in found.simulation.courses.iter().enumerate() {
            let findings = rows(found, real).filter_map(|run| Some((run.name, &run.courses.get(index)?.finding)));
            out.push_str(&format!("\n{}", comparison(course.finding.step(), findings, [])));
        }
    }
    out
}

fn formula(real: &Real) -> String {
    let k = real.report.fit.map.coefficients;
    let product = k.r.map_or(String::new(), |r| format!(" {r:+.6} i_out d_sim"));
    format!("d_real = {:.6} d_sim {:+.6} i_out {:+.6}{product}", k.a, k.b, k.c)
}

fn explanation(found: &Findings) -> String {
    let setting = &found.setting;
    let task = &setting.scenario.task;
    let output = setting.policy.path(setting.output).name;
    format!(
        "Policy {}{} ({}) at real converters simulated by {}. True voltages at the sampling instants, errors from {} V, \
         settled within {}; worst of {} sampling instants / of {} instants and phases. Steady state: the last {} \
         of {} control periods after the step.",
        setting.policy.name,
        output.map_or_else(String::new, |name| format!(", its output {name}")),
        found.controller,
        found.simulator,
        setting.v_ref,
        band_text(setting.v_ref),
        task.sampling_instants,
        task.all_instants().len(),
        task.tail,
        task.after,
    )
}

/// Figure by figure the largest of all load steps.
fn largest(run: &Run) -> Metrics {
    let all = run.courses.iter().map(|course| course.finding.worst);
    all.fold(Metrics::default(), Metrics::worst)
}

const HEADINGS: [&str; 6] = [
    "converter",
    "run",
    "steady mean V",
    "steady max V",
    "deviation V",
    "settling ms",
];

/// One line for each run: the largest figures over all load steps.
fn lines(found: &Findings) -> Vec<[String; 6]> {
    let line = |converter: &str, run: &Run| {
        let m = largest(run);
        let unsettled = if m.is_settled() { "" } else { ">" };
        let digits = digits(m.band);
        [
            converter.to_owned(),
            run.name.to_owned(),
            format!("{:.*}", digits + 1, m.tail_mean),
            format!("{:.*}", digits + 1, m.tail_max),
            format!("{:.digits$}", m.deviation),
            format!("{unsettled}{:.*}", time_digits(m.settling), 1e3 * m.settling),
        ]
    };
    let real = found
        .real
        .iter()
        .flat_map(|real| real.runs.iter().map(move |run| line(&real.name, run)));
    std::iter::once(line("that of the training", &found.simulation))
        .chain(real)
        .collect()
}

fn overview(found: &Findings) -> Table {
    let table = HEADINGS
        .into_iter()
        .fold(Table::new("Largest of all load steps"), Table::text);
    lines(found)
        .into_iter()
        .fold(table, |table, line| table.row(line.map(Cell::from)))
}

fn overview_text(found: &Findings) -> String {
    let line = |cells: &[&str]| {
        let (first, rest) = cells.split_at(1);
        let start = format!("{:<21}", first.join(""));
        let row = rest.iter().fold(start, |row, cell| format!("{row} {cell:<14}"));
        format!("{}\n", row.trim_end())
    };
    let body = lines(found)
        .iter()
        .map(|cells| line(&cells.each_ref().map(String::as_str)))
        .collect::<String>();
    format!("Largest of all load steps\n{}{body}", line(&HEADINGS))
}

/// The answer in one sentence: the converter on which the mapping gains most.
fn sentence(found: &Findings) -> String {
    let gained = |real: &&Real| {
        let before = real.runs.first().map(largest)?;
        let after = real.runs.iter().find(|run| run.name == MAPPED).map(largest)?;
        Some((real.name.clone(), before.tail_mean, after.tail_mean))
    };
    let all = found.real.iter().filter_map(|real| gained(&real));
    let most = all.max_by(|(_, a, b), (_, c, d)| (a - b).total_cmp(&(c - d)));
    let simulated = largest(&found.simulation);
    let volts = digits(simulated.band) + 1;
    most.map_or(String::new(), |(name, before, after)| {
        format!(
            "Steady-state mean error on {name}, the worst load step: {before:.volts$} V without a mapping, {after:.volts$} V with \
             it; in simulation {:.volts$} V.",
            simulated.tail_mean
        )
    })
}

fn table(found: &Findings, real: &Real, index: usize) -> Table {
    let mut table = Table::new("").text("");
    for heading in COLUMNS {
        table = table.text(heading);
    }
    for run in rows(found, real) {
        let Some(course) = run.courses.get(index) else { continue };
        let cells = cells(&course.finding).into_iter().map(Cell::from);
        table = table.row([Cell::from(run.name)].into_iter().chain(cells));
    }
    table
}
