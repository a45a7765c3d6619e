//! The report: one page.

mod captures;
mod colours;
pub mod comparison;
mod control;
mod empirical;
mod records;
mod retrained;
mod spectrum;

use report::{Axis, BarChart, BarPanel, Chart, Page, Panel, ReportError, Section, Series, Table, quantity};

use self::colours::{EXTENDED, MODEL};
use crate::diagnosis::Diagnosis;
use crate::findings::{Findings, Named, Verdict};
use crate::gain::{Pair, Regime, Shift};
use crate::next;
use crate::noise::channel;
use crate::record::{CHANNEL_NAMES, CHANNEL_UNITS, CHANNELS};
use crate::timing;
use crate::words::{needs, si, told, unit};

/// The page as HTML.
///
/// # Errors
/// None in practice: a table whose rows do not fit its columns. A picture that cannot be drawn says so in its place.
pub fn page(diagnosis: &Diagnosis) -> Result<String, ReportError> {
    let findings = &diagnosis.findings;
    let list = comparison::compared(diagnosis);
    let mut page = Page::new(title(findings.verdict));
    // what leaves out a channel is no answer to rely on, whatever it says
    let mark = match (mark(findings.verdict), findings.compared.leaves_out()) {
        (report::Verdict::Pass | report::Verdict::Note, true) => report::Verdict::Warn,
        (mark, _) => mark,
    };
    page = page.verdict_as(mark, word(findings.verdict), headline(diagnosis, &list));
    if !list.is_empty() {
        page = page.section(comparison::section(&list, &findings.residuals));
    }
    if let Some(section) = held_out(diagnosis) {
        page = page.section(section);
    }
    page = page.section(causes(diagnosis));
    if let Some(term) = &diagnosis.empirical {
        page = page.section(empirical::section(term));
    }
    if let Some(reason) = &diagnosis.findings.gain.closed_loop_missing {
        page = page.section(control::missing(reason));
    }
    if let Some(control) = &diagnosis.control {
        page = page.section(control::section(control));
    }
    if let Some(reason) = &findings.gain.retrained_missing {
        page = page.section(retrained::missing(reason));
    }
    if let Some(judged) = &diagnosis.retrained {
        page = page.section(retrained::section(judged));
    }
    if let Some(section) = captures::section(diagnosis, records::second(diagnosis)) {
        page = page.section(section);
    }
    if let Some(section) = records::training(diagnosis) {
        page = page.section(section);
    }
    if !diagnosis.profiles.is_empty() && findings.verdict != Verdict::Unexplained {
        page = page.section(profiles(diagnosis));
    }
    if findings.verdict != Verdict::Unexplained {
        // where nothing is an explanation there is nothing to separate it from
        page = page.section(ties(diagnosis));
    }
    page.section(noise(diagnosis)).section(detectable(diagnosis)).html()
}

/// A colour says how sure the answer is; green alone is a model that is right.
fn mark(verdict: Verdict) -> report::Verdict {
    match verdict {
        Verdict::Consistent => report::Verdict::Pass,
        Verdict::Explained => report::Verdict::Note,
        Verdict::Ambiguous | Verdict::MostlyExplained => report::Verdict::Warn,
        Verdict::Unexplained => report::Verdict::Fail,
    }
}

fn word(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Consistent => "model holds",
        Verdict::Explained => "explained",
        Verdict::Ambiguous => "ambiguous",
        Verdict::MostlyExplained => "mostly explained",
        Verdict::Unexplained => "unexplained",
    }
}

fn title(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Consistent => "Diagnosis: the model agrees with the records",
        Verdict::Explained => "Diagnosis: the model is off, and why is known",
        Verdict::Ambiguous => "Diagnosis: the model is off, and more than one reason fits",
        Verdict::MostlyExplained => "Diagnosis: the model is off, and most of it is explained",
        Verdict::Unexplained => "Diagnosis: the model is off, and no known cause explains it",
    }
}

/// The volts before and after, then the causes.
fn headline(diagnosis: &Diagnosis, list: &[comparison::Compared]) -> String {
    let sentence = &diagnosis.findings.sentence;
    match comparison::volts(list) {
        Some(volts) => format!("{volts} {sentence}"),
        None => sentence.clone(),
    }
}

/// Whether neither a cause nor anything that is left is told.
fn has_nothing(findings: &Findings) -> bool {
    findings.partial.is_empty() && findings.set_aside.is_none() && findings.structure.is_empty()
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
            let rivals: Vec<String> = cause.rival_values.iter().map(|values| needs(values)).collect();
            for (name, v) in &cause.parameters {
                let evidence = cause.evidence.delta_chi2;
                // the step of a converter is read off, not fitted: `quantised` writes f64::MAX
                let evidence = if evidence < 1e300 {
                    evidence.into()
                } else {
                    report::Cell::from("exact")
                };
                table = table.row([
                    format!("{} ({})", cause.id, cause.words).into(),
                    (*name).into(),
                    told(cause.id, v.model, v.unit).into(),
                    told(cause.id, v.value, v.unit).into(),
                    match timing::word(cause.id, v.value) {
                        Some(_) => "read off the current".into(),
                        None => format!("{} to {}", si(v.low, unit(v.unit)), si(v.high, unit(v.unit))).into(),
                    },
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
    } else if findings.verdict == Verdict::Consistent || has_nothing(findings) {
        section = section.text("Nothing.");
    }
    if !findings.partial.is_empty() {
        section = section.text("The best of the known causes leave structure and are not named as causes:");
        section = section.table(table("Partial explanation", &findings.partial));
        section =
            section.text("What they would gain stands in the first table, under after. None of it is an explanation.");
    }
    if let Some(aside) = &findings.set_aside {
        section = section.text(format!(
            "{} was set aside. The causes are those of all the rest; what they make of it, root mean square:",
            aside.name()
        ));
        for worth in &aside.errors {
            section = section.text(worth.words());
        }
        section = section.text("What is left there:");
    }
    for one in &findings.structure {
        section = section.text(format!("{} of {}: {}", one.channel, one.record, one.shape));
    }
    section
}

fn profiles(diagnosis: &Diagnosis) -> Section {
    let mut section = Section::new("How well the data hold the parameters").text(
        "Cost of holding a parameter at a value while all others and the initial states follow; below the line are the values \
         that the data allow at 95 %. The interval in the table is wider: it adds what two simulators of one circuit differ by.",
    );
    for profile in diagnosis.profiles.iter().filter(|profile| profile.curve.len() > 1) {
        let (x, y): (Vec<f64>, Vec<f64>) = profile.curve.iter().copied().unzip();
        let cause = diagnosis
            .attribution
            .best
            .as_ref()
            .map_or(0, |fit| fit.causes[profile.member]);
        let id = diagnosis.attribution.id(cause);
        let panel = Panel::new(Axis::new("cost in chi-square")).height(90.0);
        let panel = panel
            .series(Series::line("cost", x.clone(), y.clone()))
            .series(Series::points("", x, y));
        let chart = Chart::new(
            match id == profile.name {
                true => format!("Cost of holding {id}"),
                false => format!("Cost of holding {} of {id}", profile.name),
            },
            Axis::new(profile.name).unit(unit(profile.unit)),
        );
        // the level at which `profile` ends its intervals
        let svg = chart.panel(panel.y_line(3.84, "95 %")).svg();
        section = section.chart_or_reason(svg, "");
    }
    section
}

fn ties(diagnosis: &Diagnosis) -> Section {
    let findings = &diagnosis.findings;
    let section = Section::new("Ties and the next experiment");
    let section = section.text(next::advice(findings).unwrap_or_else(|| "No tie to be broken.".to_owned()));
    if findings.next_experiments.is_empty() {
        return section;
    }
    let heading = "Separation: standard deviations between the two explanations, initial states free. The best experiment of \
                   each tie; all are in diagnosis.json, and the folder experiments has them period by period.";
    let mut table = Table::new(heading);
    table = table
        .text("to separate")
        .text("do")
        .number("separation", 1)
        .text("file");
    let mut shown = Vec::new();
    for next in &findings.next_experiments {
        // the best experiment of a tie comes first
        if shown.contains(&&next.separates) {
            continue;
        }
        shown.push(&next.separates);
        table = table.row([
            next.separates.join(" from ").into(),
            next.experiment.clone().into(),
            next.separation.into(),
            next.file.clone().into(),
        ]);
    }
    section.table(table)
}

fn held_out(diagnosis: &Diagnosis) -> Option<Section> {
    let pair = diagnosis.held.as_ref()?;
    let whole: Vec<_> = diagnosis
        .findings
        .gain
        .heldout
        .iter()
        .filter(|held| held.regime == Regime::All)
        .collect();
    if whole.is_empty() {
        return None;
    }
    let names: Vec<String> = whole
        .iter()
        .map(|held| format!("{} {}", held.record, held.channel))
        .collect();
    let ratio = |f: fn(&crate::gain::Held) -> f64| whole.iter().map(|held| f(held) / held.floor).collect::<Vec<_>>();
    let mut panel = BarPanel::new(Axis::new("error over noise"));
    panel = panel.bars_in(MODEL, "model", ratio(|held| held.rmse_before));
    let second = comparison::second_held(diagnosis);
    let is_extended = second.is_some();
    if let Some(name) = second {
        panel = panel.bars_in(EXTENDED, name, ratio(|held| held.rmse_after));
    }
    let svg = BarChart::new("Held-out error", names).panel(panel).svg();
    let title = if is_extended {
        "Gain on held-out records"
    } else {
        "Held-out records"
    };
    let mut section =
        Section::new(title).chart_or_reason(svg, "1 is the noise as estimated: where a right model ends.");
    for shift in &diagnosis.findings.gain.shifts {
        section = section.text(crate::words::shifted(std::slice::from_ref(shift)).trim().to_owned());
    }
    let mut table = Table::new("Root mean square errors")
        .text("record")
        .text("channel")
        .text("regime");
    table = match is_extended {
        true => table.number("before", 4).number("after", 4).number("noise", 4),
        false => table.number("error", 4).number("noise", 4),
    };
    table = table.text("unit");
    if is_extended {
        table = table.text("reducible part removed");
    }
    for held in &diagnosis.findings.gain.heldout {
        let mut row: Vec<report::Cell> = vec![
            held.record.clone().into(),
            held.channel.into(),
            held.regime.word().into(),
            held.rmse_before.into(),
        ];
        row.extend(is_extended.then(|| held.rmse_after.into()));
        row.extend([held.floor.into(), held.unit.into()]);
        let removed = held.removed.map_or_else(
            || "nothing above the noise".to_owned(),
            |removed| format!("{:.0} %", 100.0 * removed),
        );
        row.extend(is_extended.then(|| removed.into()));
        table = table.row(row);
    }
    section = section.details(Section::new("By record and regime").table(table));
    Some(held_pictures(section, diagnosis, pair))
}

/// The held-out record that the model as given misses most, and the others behind a click.
fn held_pictures(section: Section, diagnosis: &Diagnosis, pair: &Pair) -> Section {
    let second = comparison::second_held(diagnosis);
    let square = |record: usize| {
        let own = (0..CHANNELS).flat_map(|n| channel(&pair.problem, &pair.before.residual, record, n));
        own.map(|v| v * v).sum::<f64>() / pair.problem.records[record].rows().max(1) as f64
    };
    let also = |record: usize| {
        let own = |shift: &&Shift| shift.record == pair.problem.records[record].name;
        let shifts = diagnosis.findings.gain.shifts.iter().filter(own);
        let place = |shift: &Shift| CHANNEL_NAMES.iter().position(|name| *name == shift.channel);
        let mut list: Vec<usize> = shifts.filter_map(place).collect();
        list.extend(records::unsettled(&pair.problem, [&pair.before, &pair.after], record));
        list
    };
    let count = pair.problem.records.len();
    let worst = (0..count).max_by(|a, b| square(*a).total_cmp(&square(*b))).unwrap_or(0);
    let draw = |section: Section, record: usize, caption: &str| {
        let states = [&pair.before, &pair.after];
        records::pictures(section, &pair.problem, states, record, second, &also(record), caption)
    };
    let caption = "The held-out record that the model as given misses most. No fit has seen it; its initial state is estimated for each model.";
    let section = draw(section, worst, caption);
    if count < 2 {
        return section;
    }
    let others = (0..count).filter(|record| *record != worst);
    let inner = Section::new("The other held-out records");
    section.details(others.fold(inner, |inner, record| draw(inner, record, "")))
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
        "scatter of sums of errors over that of white noise".to_owned(),
        format!("{:.2}", noise.inflation),
    ));
    pairs.push((
        "duty that the edges of the gate add".to_owned(),
        quantity(noise.trim, "", 2),
    ));
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
            match one.smallest {
                Some(smallest) => quantity(smallest, unit(one.unit), 3),
                None => format!(
                    "not at any size within its reach, {}",
                    quantity(one.reach, unit(one.unit), 3)
                ),
            }
            .into(),
        ]);
    }
    match diagnosis.findings.not_detectable.is_empty() {
        true => Section::new(""),
        false => Section::new("").details(Section::new("Not detectable").table(table)),
    }
}
