//! The page with all tables and pictures.

use report::{Cell, Page, Section, Svg, Table, Verdict};

use super::findings::{Findings, Setting, Step};
use super::{outputs, words};
use crate::faults::{Error, told};
use crate::scenario::Metrics;
use crate::tables::{AT_REST, COLUMNS, cells, digits, limit_cells, rest_cells, time_digits};

/// One HTML file; `drawn` are the pictures of the load steps in their order, `of_spread` those of the spread.
pub(super) fn page(found: &Findings, drawn: Vec<Svg>, of_spread: Vec<(String, Svg)>) -> Result<String, Error> {
    let setting = &found.setting;
    let (verdict, sentence) = verdict(found);
    let setup = [
        ("policy", setting.policy.name.clone()),
        ("run by", found.controller.clone()),
        ("plant", words::plant_text(setting)),
    ];
    let driven = outputs::drives(&setting.policy, setting.output).map(|text| ("output", text));
    let setup = setup.into_iter().chain(driven);
    let mut about = Section::new("").pairs(setup).text(words::explanation(setting));
    for note in &setting.notes {
        about = about.text(format!("Note: {note}."));
    }
    let mut page = Page::new(format!("{} in closed loop", setting.policy.name))
        .verdict(verdict, sentence)
        .section(about);
    let steps = found.steps.iter().zip(drawn).map(|(step, picture)| {
        let section = Section::new(step.step.to_string()).chart(picture, CAPTION);
        let section = section.table(table(step)).table(at_rest(step));
        match setting.policy.output_names().is_empty() {
            true => section,
            false => section
                .table(beside(setting, step))
                .text(format!("Status of all outputs: {}.", outputs::status_words(step))),
        }
    });
    page = page.section(Section::new("Load steps").pick("load step", steps.collect()));
    if let Some(spread) = &found.spread {
        page = page.section(spread.section(of_spread));
    }
    page.html().map_err(told)
}

const CAPTION: &str = "The first sampling instant. Voltages and currents are samples, one per control period. The dashed lines \
    are the smallest deviation that any sequence of duties of the range reaches from rest; a policy that dithers meets the step \
    with another current and can stay within it at one instant. The table is of all instants.";

fn verdict(found: &Findings) -> (Verdict, String) {
    let compared = found.check.as_ref().map(words::check_text);
    let different = found.check.as_ref().is_some_and(|check| !check.differences.is_empty());
    let sentences = |first: String| {
        let said: Vec<String> = [Some(first), compared].into_iter().flatten().collect();
        sentence(&said.join("; "))
    };
    match words::unsettled(found) {
        Some(text) if different => (Verdict::Fail, sentences(text)),
        Some(text) => (Verdict::Warn, sentences(text)),
        None if different => (Verdict::Fail, sentences(worst(found))),
        None if found.check.is_some() => (Verdict::Pass, sentences(worst(found))),
        None => (Verdict::Note, sentence(&worst(found))),
    }
}

/// With a capital and a full stop, which a note among others does without.
fn sentence(text: &str) -> String {
    let mut letters = text.chars();
    match letters.next() {
        Some(first) => format!("{}{}.", first.to_uppercase(), letters.as_str()),
        None => String::new(),
    }
}

/// The policy's largest deviation.
fn worst(found: &Findings) -> String {
    let of_policy = found
        .steps
        .iter()
        .filter_map(|step| Some((step, &step.courses.first()?.1)));
    let largest = of_policy.max_by(|(_, a), (_, b)| {
        let [a, b] = [a, b].map(|course| course.finding.worst.deviation);
        a.total_cmp(&b)
    });
    largest.map_or(String::new(), |(step, course)| {
        let Metrics {
            deviation,
            settling,
            band,
            ..
        } = course.finding.worst;
        let (volts, times) = (digits(band), time_digits(settling));
        format!(
            "the policy's largest deviation is {deviation:.volts$} V, at {}, settled after {:.times$} ms",
            step.step,
            1e3 * settling
        )
    })
}

fn table(step: &Step) -> Table {
    let mut table = Table::new("").text("");
    for heading in COLUMNS {
        table = table.text(heading);
    }
    for (name, course) in &step.courses {
        let cells = cells(&course.finding).into_iter().map(Cell::from);
        table = table.row([Cell::from(name.as_str())].into_iter().chain(cells));
    }
    for (name, limit) in &step.limits {
        let [deviation, settling] = limit_cells(limit).map(Cell::from);
        let blank = std::iter::repeat_n(Cell::from("-"), COLUMNS.len() - 2);
        let cells = [Cell::from(name.as_str()), deviation, settling];
        table = table.row(cells.into_iter().chain(blank));
    }
    table
}

/// What each of several outputs did.
fn beside(setting: &Setting, step: &Step) -> Table {
    let mut table = Table::new("").text("outputs, first sampling instant");
    for heading in outputs::OUTPUTS {
        table = table.text(heading);
    }
    for output in outputs::outputs(setting, step) {
        let cells = output.cells().into_iter().map(Cell::from);
        table = table.row([Cell::from(output.called())].into_iter().chain(cells));
    }
    table
}

/// What each controller does once the load step is over.
fn at_rest(step: &Step) -> Table {
    let mut table = Table::new("").text("at rest after it");
    for heading in AT_REST {
        table = table.text(heading);
    }
    for (name, course) in &step.courses {
        let cells = rest_cells(&course.finding).into_iter().map(Cell::from);
        table = table.row([Cell::from(name.as_str())].into_iter().chain(cells));
    }
    table
}
