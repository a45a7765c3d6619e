//! The section on the closed loop.

use closed_loop::controller::Period;
use closed_loop::scenario::{Metrics, settled_band};
use report::{Axis, Chart, Panel, ReportError, Section, Series, Svg, Table};

use super::colours::{EXTENDED, MEASURED, MODEL};
use crate::control::{ClosedLoop, Control, Course};

/// Shown before and after the step, in control periods.
const BEFORE: usize = 20;
const AFTER: usize = 120;

const RUNS: [&str; 3] = ["in its simulation", "own mapping", "refitted mapping"];

pub(super) fn section(control: &Control) -> Section {
    let found = &control.findings;
    let mut section = Section::new("Under control")
        .text(format!(
            "Policy {} on the extended model. {}",
            found.policy,
            sentence(found)
        ))
        .chart_or_reason(
            picture(control),
            "The load step with the largest error, at its first instant; true voltage at the sampling instants.",
        )
        .details(Section::new("Figures of every load step").table(table(found)));
    for remark in &found.beyond_repair {
        section = section.text(format!("No mapping repairs: {remark}."));
    }
    section
}

/// In its place where the loop could not be closed.
pub(super) fn missing(reason: &str) -> Section {
    Section::new("Under control").text(format!("No mapping and no closed loop on the extended model: {reason}"))
}

/// What the refit is worth, in words.
pub(super) fn sentence(found: &ClosedLoop) -> String {
    if !found.refitted {
        return "The extended model needs the same duties as the policy's own mapping gives: it is kept.".to_owned();
    }
    let worst = |of: fn(&Course) -> &Metrics| found.steps.iter().map(|step| of(step).tail_mean).fold(0.0, f64::max);
    format!(
        "Mean error in steady state, the worst load step: {:.3} V with the mapping it has, {:.3} V with the one refitted to \
         the extended model (drm.toml); {:.3} V in the simulation it was trained in.",
        worst(|step| &step.before),
        worst(|step| &step.after),
        worst(|step| &step.simulation)
    )
}

fn picture(control: &Control) -> Result<Svg, ReportError> {
    let mut voltage = Panel::new(Axis::new("output voltage").unit("V")).height(220.0);
    let mut duty = Panel::new(Axis::new("duty")).height(110.0);
    for ((name, run), colour) in RUNS.into_iter().zip(&control.shown).zip([MEASURED, MODEL, EXTENDED]) {
        // without a refit the third run is the second again
        if !control.findings.refitted && name == RUNS[2] {
            continue;
        }
        let step = run.iter().position(|period| period.record.time > 0.0).unwrap_or(0);
        let inside = &run[step.saturating_sub(BEFORE)..(step + AFTER).min(run.len())];
        let of = |figure: fn(&Period) -> f64| inside.iter().map(figure).collect::<Vec<f64>>();
        let time = of(|period| period.record.time);
        let volts = of(|period| period.record.sample.v_out);
        voltage = voltage.series(Series::line(name, time.clone(), volts).colour(colour));
        duty = duty.series(Series::step(name, time, of(|period| period.record.duty)).colour(colour));
    }
    let v_ref = control.findings.v_ref;
    let band = settled_band(v_ref);
    let voltage = voltage.y_zone(v_ref - band, v_ref + band, "settled");
    Chart::new(
        control.shown_step.clone(),
        Axis::new("time from the load step").unit("s"),
    )
    .panel(voltage)
    .panel(duty)
    .svg()
}

fn table(found: &ClosedLoop) -> Table {
    let caption = "Each figure the worst of all instants: mean and largest error in steady state, largest error after the \
                   step, time to the last sample outside half a percent of the reference";
    let mut table = Table::new(caption).text("load step").text("");
    for heading in ["mean V", "largest V", "after the step V"] {
        table = table.number(heading, 3);
    }
    table = table.text("settled within ms");
    for step in &found.steps {
        let runs = RUNS.into_iter().zip([&step.simulation, &step.before, &step.after]);
        for (name, m) in runs.take(if found.refitted { 3 } else { 2 }) {
            let settled = match !m.is_settled() {
                true => "not".to_owned(),
                false => format!("{:.1}", 1e3 * m.settling),
            };
            table = table.row([
                step.load_step.clone().into(),
                name.into(),
                m.tail_mean.into(),
                m.tail_max.into(),
                m.deviation.into(),
                settled.into(),
            ]);
        }
    }
    table
}
