//! A load step in simulation, at the real converter without a mapping, and with it.

use report::{Axis, Chart, Colour, Panel, Series, Svg};

use super::findings::{EXACT, Findings, Real};
use crate::faults::{Error, told};
use crate::scenario::{Record, settled_band};

/// Shown before the step, in control periods, and at most after it.
const BEFORE: f64 = 20.0;
const AFTER: f64 = 120.0;

/// The load step of this index at its first sampling instant.
pub(super) fn picture(found: &Findings, real: &Real, index: usize) -> Result<Svg, Error> {
    let setting = &found.setting;
    let t = setting.policy.sample_period;
    let window = [-BEFORE * t, AFTER.min(setting.scenario.task.after as f64) * t];
    let colours = [Colour::GREY, Colour::VERMILION, Colour::BLUE, Colour::GREEN];
    let mut voltage = Panel::new(Axis::new("output voltage").unit("V")).height(280.0);
    let mut duty = Panel::new(Axis::new("duty"));
    let mut title = String::new();
    let all = std::iter::once(&found.simulation).chain(&real.runs);
    for (run, colour) in all.zip(colours) {
        let Some(course) = run.courses.get(index) else { continue };
        title = format!("{}: {}", real.name, course.finding.step());
        let drawn = |record: &&Record| {
            let inside = record.time >= window[0] && record.time <= window[1];
            inside && record.sample.v_out.is_finite() && record.duty.is_finite()
        };
        let records = course.shown.periods.iter().map(|period| &period.record);
        let inside: Vec<&Record> = records.filter(drawn).collect();
        let of = |figure: fn(&Record) -> f64| -> Vec<f64> { inside.iter().map(|record| figure(record)).collect() };
        let time = of(|record| record.time);
        let line = Series::line(run.name, time.clone(), of(|record| record.sample.v_out)).colour(colour);
        voltage = voltage.series(if run.name == EXACT { line.dashed() } else { line });
        if run.name != EXACT {
            duty = duty.series(Series::step(run.name, time, of(|record| record.duty)).colour(colour));
        }
    }
    let band = settled_band(setting.v_ref);
    voltage = voltage.y_zone(setting.v_ref - band, setting.v_ref + band, "settled");
    let x = Axis::new("time from the load step")
        .unit("s")
        .range(window[0], window[1]);
    Chart::new(title, x).panel(voltage).panel(duty).svg().map_err(told)
}
