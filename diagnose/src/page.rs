//! The report: one page.

mod control;

use report::{Axis, BarChart, BarPanel, Chart, Page, Panel, ReportError, Section, Series, Svg, Table, quantity};

use crate::diagnosis::{Diagnosis, Named, Verdict};
use crate::fit::State;
use crate::noise::channel;
use crate::problem::Problem;
use crate::record::{CHANNEL_NAMES, CHANNEL_UNITS};

/// The page as HTML.
///
/// # Errors
/// None in practice: a picture whose data do not fit together.
pub fn page(diagnosis: &Diagnosis) -> Result<String, ReportError> {
    let findings = &diagnosis.findings;
    let mark = match findings.verdict {
        Verdict::Consistent | Verdict::Explained => report::Verdict::Pass,
        Verdict::Ambiguous => report::Verdict::Warn,
        Verdict::Unexplained => report::Verdict::Fail,
    };
    let word = match findings.verdict {
        Verdict::Consistent => "consistent",
        Verdict::Explained => "explained",
        Verdict::Ambiguous => "ambiguous",
        Verdict::Unexplained => "unexplained",
    };
    let mut page = Page::new(format!("Diagnosis: {word}")).verdict(mark, findings.sentence.clone());
    page = page.section(causes(diagnosis));
    page = page.section(training(diagnosis)?);
    if !diagnosis.profiles.is_empty() {
        page = page.section(profiles(diagnosis)?);
    }
    page = page.section(ties(diagnosis));
    if let Some(section) = held_out(diagnosis)? {
        page = page.section(section);
    }
    if let Some(control) = &diagnosis.control {
        page = page.section(control::section(control)?);
    }
    page.section(noise(diagnosis)).section(detectable(diagnosis)).html()
}

fn unit(text: &str) -> &str {
    if text == "1" { "" } else { text }
}

fn causes(diagnosis: &Diagnosis) -> Section {
    let findings = &diagnosis.findings;
    let table = |caption: &str, list: &[Named]| {
        let mut table = Table::new(caption)
            .text("cause")
            .text("parameter")
            .text("model")
            .text("found")
            .text("95 %");
        table = table.number("evidence", 0).text("rivals");
        for cause in list {
            let rivals: Vec<String> = cause.rivals.iter().map(|ids| ids.join(" + ")).collect();
            for (name, v) in &cause.parameters {
                let evidence = cause.evidence.delta_chi2;
                let evidence = if evidence < 1e300 {
                    evidence.into()
                } else {
                    report::Cell::from("exact")
                };
                table = table.row([
                    format!("{} ({})", cause.id, cause.words).into(),
                    (*name).into(),
                    quantity(v.model, unit(v.unit), 4).into(),
                    quantity(v.value, unit(v.unit), 4).into(),
                    format!(
                        "{} to {}",
                        quantity(v.low, unit(v.unit), 4),
                        quantity(v.high, unit(v.unit), 4)
                    )
                    .into(),
                    evidence,
                    rivals.join(", ").into(),
                ]);
            }
        }
        table
    };
    let mut section = Section::new("What changes in the model");
    if !findings.causes.is_empty() {
        section = section.table(table(
            "Evidence is the chi-square lost without the cause, over the scatter of the noise.",
            &findings.causes,
        ));
    } else if findings.verdict == Verdict::Consistent {
        section = section.text("Nothing.");
    }
    if !findings.partial.is_empty() {
        section = section.text("The best of the known causes leave structure and are not named as causes:");
        section = section.table(table("Partial explanation", &findings.partial));
    }
    for one in &findings.structure {
        section = section.text(format!("{} of {}: {}", one.channel, one.record, one.shape));
    }
    section
}

/// Simulated values from measured ones and a residual.
fn simulated(problem: &Problem, state: &State, record: usize, n: usize) -> Vec<f64> {
    let values = channel(problem, &state.residual, record, n);
    let measured = &problem.records[record].measured[n];
    let one = |(left, shown): (&f64, &f64)| {
        if *left == 0.0 {
            f64::NAN
        } else {
            shown - left * problem.sigma[n]
        }
    };
    values.iter().zip(measured).map(one).collect()
}

fn panels(problem: &Problem, before: &State, after: &State, record: usize, same: bool) -> Result<Svg, ReportError> {
    let one = &problem.records[record];
    let axis = if one.settled {
        Axis::new("point")
    } else {
        Axis::new("time").unit("s")
    };
    let mut chart = Chart::new(one.name.clone(), axis);
    for n in 0..2 {
        if !one.measured[n].iter().any(|v| v.is_finite()) {
            continue;
        }
        let mut panel = Panel::new(Axis::new(CHANNEL_NAMES[n]).unit(CHANNEL_UNITS[n])).height(150.0);
        panel = panel
            .series(Series::points("measured", one.time.clone(), one.measured[n].clone()))
            .series(Series::line(
                "model",
                one.time.clone(),
                simulated(problem, before, record, n),
            ));
        let mut left =
            Panel::new(Axis::new(format!("error of {}", CHANNEL_NAMES[n])).unit(CHANNEL_UNITS[n])).height(110.0);
        let errors = |state: &State| -> Vec<f64> {
            channel(problem, &state.residual, record, n)
                .iter()
                .map(|v| if *v == 0.0 { f64::NAN } else { v * problem.sigma[n] })
                .collect()
        };
        left = left.series(Series::line("model", one.time.clone(), errors(before)));
        if !same {
            panel = panel.series(Series::line(
                "extended",
                one.time.clone(),
                simulated(problem, after, record, n),
            ));
            left = left.series(Series::line("extended", one.time.clone(), errors(after)));
        }
        chart = chart.panel(panel).panel(left);
    }
    chart.svg()
}

fn training(diagnosis: &Diagnosis) -> Result<Section, ReportError> {
    let mut section = Section::new("Measured, simulated, extended");
    let (problem, before, after) = (
        &diagnosis.problem,
        &diagnosis.attribution.null,
        diagnosis.attribution.state(),
    );
    let same = diagnosis.attribution.best.is_none();
    for record in 0..problem.records.len() {
        let svg = panels(problem, before, after, record, same)?;
        section = section.chart(
            svg,
            "Training record; initial states estimated for both models. Errors are measured minus simulated.",
        );
    }
    let mut chart = Chart::new("Error of v_o by operating point", Axis::new("duty"));
    for (name, state) in [("model", before), ("extended", after)] {
        let (mut x, mut y) = (Vec::new(), Vec::new());
        for (index, record) in problem.records.iter().enumerate() {
            let values = channel(problem, &state.residual, index, 0);
            for (duty, value) in record.duty.iter().zip(values).filter(|(_, v)| *v != 0.0) {
                x.push(*duty);
                y.push(value * problem.sigma[0]);
            }
        }
        if !(x.is_empty() || same && name == "extended") {
            chart = chart.panel(
                Panel::new(Axis::new(name).unit("V"))
                    .height(120.0)
                    .series(Series::points(name, x, y)),
            );
        }
    }
    match problem.sigma[0].is_finite() {
        true => Ok(section.chart(chart.svg()?, "")),
        false => Ok(section),
    }
}

fn profiles(diagnosis: &Diagnosis) -> Result<Section, ReportError> {
    let mut section = Section::new("How well the data hold the parameters");
    for profile in diagnosis.profiles.iter().filter(|profile| profile.curve.len() > 1) {
        let (x, y): (Vec<f64>, Vec<f64>) = profile.curve.iter().copied().unzip();
        let cause = diagnosis
            .attribution
            .best
            .as_ref()
            .map_or(0, |fit| fit.causes[profile.member]);
        let id = diagnosis.attribution.id(cause);
        let panel = Panel::new(Axis::new("cost in chi-square")).height(120.0);
        let panel = panel
            .series(Series::line("profile", x.clone(), y.clone()))
            .series(Series::points("fitted", x, y));
        let chart = Chart::new(
            format!("{id}: {}", profile.name),
            Axis::new(profile.name).unit(unit(profile.unit)),
        );
        let svg = chart.panel(panel.y_line(3.84, "95 %")).svg()?;
        section = section.chart(svg, "All other parameters and initial states follow.");
    }
    Ok(section)
}

fn ties(diagnosis: &Diagnosis) -> Section {
    let findings = &diagnosis.findings;
    let section = Section::new("Ties and the next experiment");
    if findings.next_experiments.is_empty() {
        return section.text("No tie to be broken.");
    }
    let mut table = Table::new("Separation: standard deviations between the two explanations, initial states free.");
    table = table.text("to separate").text("do").number("separation", 1);
    for next in &findings.next_experiments {
        table = table.row([
            next.separates.join(" from ").into(),
            next.experiment.clone().into(),
            next.separation.into(),
        ]);
    }
    section.table(table)
}

fn held_out(diagnosis: &Diagnosis) -> Result<Option<Section>, ReportError> {
    let Some(pair) = &diagnosis.held else { return Ok(None) };
    let whole: Vec<_> = diagnosis
        .findings
        .gain
        .heldout
        .iter()
        .filter(|held| held.regime == "all")
        .collect();
    if whole.is_empty() {
        return Ok(None);
    }
    let names: Vec<String> = whole
        .iter()
        .map(|held| format!("{} {}", held.record, held.channel))
        .collect();
    let ratio = |f: fn(&crate::gain::Held) -> f64| whole.iter().map(|held| f(held) / held.floor).collect::<Vec<_>>();
    let panel = BarPanel::new(Axis::new("error over noise"))
        .bars("model", ratio(|held| held.rmse_before))
        .bars("extended", ratio(|held| held.rmse_after));
    let svg = BarChart::new("Held-out error", names).panel(panel).svg()?;
    let mut section = Section::new("Gain on held-out records").chart(svg, "1 is the noise: no model gets below it.");
    let mut table = Table::new("").text("record").text("channel").text("regime");
    table = table
        .number("before", 4)
        .number("after", 4)
        .number("noise", 4)
        .text("unit")
        .text("reducible part removed");
    for held in &diagnosis.findings.gain.heldout {
        table = table.row([
            held.record.clone().into(),
            held.channel.into(),
            held.regime.into(),
            held.rmse_before.into(),
            held.rmse_after.into(),
            held.floor.into(),
            held.unit.into(),
            held.removed
                .map_or_else(
                    || "nothing above the noise".to_owned(),
                    |r| format!("{:.0} %", 100.0 * r),
                )
                .into(),
        ]);
    }
    section = section.table(table);
    let same = diagnosis.attribution.best.is_none();
    let mut inner = Section::new("Held-out records");
    for record in 0..pair.problem.records.len() {
        inner = inner.chart(panels(&pair.problem, &pair.before, &pair.after, record, same)?, "");
    }
    Ok(Some(section.details(inner)))
}

fn noise(diagnosis: &Diagnosis) -> Section {
    let noise = &diagnosis.findings.noise;
    let mut pairs: Vec<(String, String)> = Vec::new();
    for (n, name) in CHANNEL_NAMES.iter().enumerate() {
        if let Some(sigma) = noise.sigma.get(name) {
            pairs.push((format!("noise of {name}"), quantity(*sigma, CHANNEL_UNITS[n], 3)));
        }
    }
    pairs.push((
        "scatter over independent noise".to_owned(),
        format!("{:.2}", noise.inflation),
    ));
    pairs.push(("duty added by the edges".to_owned(), format!("{:.1e}", noise.trim)));
    let mut section = Section::new("Noise and data").pairs(pairs);
    for text in &noise.repairs {
        section = section.text(text.clone());
    }
    if !noise.outliers.is_empty() {
        section = section.text(format!(
            "Outliers left out (record:row:channel): {}",
            noise.outliers.join(", ")
        ));
    }
    section
}

fn detectable(diagnosis: &Diagnosis) -> Section {
    let mut table = Table::new("Causes that would have to be larger than usual to be seen in these records");
    table = table.text("cause").text("parameter").text("smallest change seen");
    for one in &diagnosis.findings.not_detectable {
        table = table.row([
            one.id.into(),
            one.parameter.into(),
            quantity(one.smallest, unit(one.unit), 3).into(),
        ]);
    }
    Section::new("").details(Section::new("Not detectable").table(table))
}
