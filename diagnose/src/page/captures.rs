//! Captures: the mean period beside the model's own, and what was read off.

use report::{Axis, Chart, Panel, ReportError, Section, Series, Svg, Table};

use super::colours::{EXTENDED, MEASURED, MODEL};
use crate::capture::estimates::{Estimate, Estimates};
use crate::capture::{Capture, Origin};
use crate::diagnosis::Diagnosis;
use crate::fit::State;
use crate::problem::capture_drive;
use crate::record::{CHANNEL_NAMES, CHANNEL_UNITS, Record};
use crate::words::{si, unit};

/// All captures; nothing if there is none.
pub(super) fn section(diagnosis: &Diagnosis, second: Option<&str>) -> Option<Section> {
    let records = diagnosis.problem.records.iter();
    let captures: Vec<(&Record, &Capture)> = records
        .filter_map(|record| Some((record, record.capture.as_deref()?)))
        .collect();
    if captures.is_empty() {
        return None;
    }
    let mut section = Section::new("Captures").text(
        "The mean of all periods, less its mean value, beside the steady state of the model. The trigger's instant, and gain and \
         offset of each probe within its accuracy, are estimated for each model.",
    );
    for (record, capture) in captures {
        if let Some(svg) = picture(diagnosis, record, capture, second) {
            section = section.chart_or_reason(svg, "");
        }
        let own = diagnosis
            .findings
            .captures
            .iter()
            .filter(|one| one.record == record.name);
        for estimates in own {
            section = section.table(table(estimates));
            for text in &estimates.missing {
                section = section.text(format!("Not shown without {text}."));
            }
        }
    }
    Some(section)
}

fn picture(
    diagnosis: &Diagnosis,
    record: &Record,
    capture: &Capture,
    second: Option<&str>,
) -> Option<Result<Svg, ReportError>> {
    let from = match capture.origin {
        Origin::Node => "time from the switch-on",
        Origin::Free => "time in the period",
    };
    let mut chart = Chart::new(record.name.clone(), Axis::new(from).unit("s"));
    let time: Vec<f64> = capture.bins.at.iter().map(|at| at * capture.period).collect();
    let first = ("model", &diagnosis.given, MODEL);
    let states: Vec<(&str, &State, _)> = std::iter::once(first)
        .chain(second.map(|name| (name, diagnosis.attribution.state(), EXTENDED)))
        .collect();
    let mut is_empty = true;
    for n in crate::capture::terms::SHAPED {
        let Some(fold) = &capture.folds[n] else { continue };
        is_empty = false;
        // a bin without samples has the line between its neighbours
        let bins = time.iter().copied().zip(fold.value.iter().copied()).zip(&fold.sd);
        let (at, shown): (Vec<f64>, Vec<f64>) = bins.filter(|(_, sd)| sd.is_finite()).map(|(bin, _)| bin).unzip();
        let points = Series::points("measured", at, shown).colour(MEASURED);
        let mut panel = Panel::new(Axis::new(format!("ripple of {}", CHANNEL_NAMES[n])).unit(CHANNEL_UNITS[n]))
            .height(150.0)
            .series(points);
        for (name, state, colour) in &states {
            if let Some(line) = capture.drawn(&state.model, &capture_drive(record, state.starts.trim), n) {
                panel = panel.series(Series::line(*name, time.clone(), line).colour(*colour));
            }
        }
        chart = chart.panel(panel);
    }
    (!is_empty).then(|| chart.svg())
}

fn table(estimates: &Estimates) -> Table {
    let caption = format!(
        "Read off {} ({:.0} periods, {:.0} samples each{}), without a fit",
        estimates.record,
        estimates.periods,
        estimates.samples,
        match estimates.mode {
            Some("dcm") => ", discontinuous conduction",
            Some(_) => ", continuous conduction",
            None => "",
        }
    );
    let mut table = Table::new(caption)
        .text("what")
        .text("model")
        .text("read off")
        .text("95 %")
        .text("from");
    let said = |value: f64, one: &Estimate| si(value, unit(one.unit));
    for one in &estimates.values {
        table = table.row([
            one.name.into(),
            one.model.map_or(String::new(), |model| said(model, one)).into(),
            said(one.value, one).into(),
            format!("{} to {}", said(one.low, one), said(one.high, one)).into(),
            one.from.clone().into(),
        ]);
    }
    table
}
