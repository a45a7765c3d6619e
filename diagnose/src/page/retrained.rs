//! The section on the policy that was trained anew.

use closed_loop::controller::Period;
use closed_loop::scenario::settled_band;
use closed_loop::{AT_REST, COLUMNS};
use report::{Axis, Chart, Colour, Panel, ReportError, Section, Series, Svg, Table};

use super::colours::{EXTENDED, MEASURED, MODEL};
use crate::retrain::judged::{Judged, NEW, OLD, Place};

/// Shown before and after the step, in control periods.
const BEFORE: usize = 20;
const AFTER: usize = 120;

pub(super) fn section(judged: &Judged) -> Section {
    let found = &judged.findings;
    let mut section = Section::new("Trained anew")
        .text(format!("{} The new policy lies in {}.", found.sentence, found.policy))
        .chart_or_reason(
            picture(judged),
            "The load step that the policy before holds worst, on the extended model at its first instant; true voltage at the sampling instants.",
        );
    for place in found.places.iter().take(1) {
        section = section.table(table(place, "On the extended model"));
    }
    for correction in &found.corrections {
        section = section.text(format!(
            "Corrected in the contract of the new policy: {}.",
            correction.words()
        ));
    }
    for note in &found.notes {
        section = section.text(note.clone());
    }
    if found.places.len() > 1 {
        let mut inner = Section::new("On the other explanations of the tie");
        for place in &found.places[1..] {
            inner = inner.table(table(place, &format!("If {} is the true cause", place.plant)));
        }
        section = section.details(inner);
    }
    section
}

/// In its place where there is nothing to train on, or a training was not ended.
pub(super) fn missing(reason: &str) -> Section {
    Section::new("Trained anew").text(reason)
}

fn colour(name: &str) -> Colour {
    match name {
        OLD => MODEL,
        NEW => EXTENDED,
        _ => MEASURED,
    }
}

fn picture(judged: &Judged) -> Result<Svg, ReportError> {
    let mut voltage = Panel::new(Axis::new("output voltage").unit("V")).height(220.0);
    let mut duty = Panel::new(Axis::new("duty")).height(110.0);
    for (name, run) in &judged.shown {
        let step = run.iter().position(|period| period.record.time > 0.0).unwrap_or(0);
        let inside = &run[step.saturating_sub(BEFORE)..(step + AFTER).min(run.len())];
        let of = |figure: fn(&Period) -> f64| inside.iter().map(figure).collect::<Vec<f64>>();
        let time = of(|period| period.record.time);
        let volts = of(|period| period.record.sample.v_out);
        voltage = voltage.series(Series::line(*name, time.clone(), volts).colour(colour(name)));
        duty = duty.series(Series::step(*name, time, of(|period| period.record.duty)).colour(colour(name)));
    }
    let v_ref = judged.findings.v_ref;
    let band = settled_band(v_ref);
    let voltage = voltage.y_zone(v_ref - band, v_ref + band, "settled");
    let axis = Axis::new("time from the load step").unit("s");
    Chart::new(judged.shown_step.clone(), axis)
        .panel(voltage)
        .panel(duty)
        .svg()
}

/// The figures of `simulate`, the worst of all instants.
fn table(place: &Place, caption: &str) -> Table {
    let [deviation, settling, most, mean, _, _] = COLUMNS;
    let [changes, swing, _] = AT_REST;
    let mut table = Table::new(format!("{caption}: the worst of all instants"))
        .text("load step")
        .text("controller")
        .number(deviation, 3)
        .text(settling);
    for (heading, digits) in [(most, 3), (mean, 3), (changes, 4), (swing, 2)] {
        table = table.number(heading, digits);
    }
    let count = place.controllers.first().map_or(0, |line| line.steps.len());
    for step in 0..count {
        for line in &place.controllers {
            let Some(figures) = line.steps.get(step) else { continue };
            let m = &figures.worst;
            let unsettled = if m.is_settled() { "" } else { ">" };
            table = table.row([
                figures.load_step.clone().into(),
                line.controller.into(),
                m.deviation.into(),
                format!("{unsettled}{:.1}", 1e3 * m.settling).into(),
                m.tail_max.into(),
                m.tail_mean.into(),
                m.chatter.duty_activity.into(),
                m.chatter.current_swing.into(),
            ]);
        }
    }
    table
}
