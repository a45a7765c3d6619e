//! Voltage, current and duty of a load step, controllers laid over each other.

use report::{Axis, Chart, Colour, Panel, Series, Svg};
use toml_input::Message;

use super::findings::{LAW, POLICY, Setting, Step};
use crate::baselines::Kind;
use crate::faults::{Error, told};
use crate::scenario::{Record, settled_band};

/// A classical controller that deviates more than so many times the policy would only flatten the picture.
const DRAWN: f64 = 5.0;
/// Shown before the step, s, and at least after it, in control periods.
const BEFORE: f64 = 10.0;
const AFTER: f64 = 40.0;

/// The load step at its first sampling instant as SVG; a voltage between the samples is not drawn.
pub(super) fn picture(setting: &Setting, step: &Step) -> Result<Svg, Error> {
    let mut title = format!("{}: {}", setting.policy.name, step.step);
    let Some((_, policy)) = step.courses.first() else {
        return Err(Message::new("internal fault: a picture of no controller").into());
    };
    // of a policy that hardly moves everything would be far off
    let most = DRAWN * policy.shown.metrics.deviation.max(2.0 * settled_band(setting.v_ref));
    let (drawn, left_out): (Vec<_>, Vec<_>) = step
        .courses
        .iter()
        .partition(|(name, course)| course.shown.metrics.deviation <= most || name == POLICY);
    if !left_out.is_empty() {
        let names: Vec<&str> = left_out.iter().map(|(name, _)| name.as_str()).collect();
        title.push_str(&format!(" (far off and not drawn: {})", names.join(", ")));
    }
    let t = setting.policy.sample_period;
    let longest = drawn
        .iter()
        .map(|(_, course)| course.shown.metrics.settling)
        .fold(0.0, f64::max);
    let recorded = setting.scenario.task.after as f64 * t;
    let window = [-BEFORE * t, (1.5 * longest).max(AFTER * t).min(recorded)];
    let mut voltage = Panel::new(Axis::new("output voltage").unit("V")).height(280.0);
    let mut current = Panel::new(Axis::new("inductor current").unit("A"));
    let mut duty = Panel::new(Axis::new("duty"));
    // the policy last: on top of the others
    for (name, course) in drawn.iter().rev() {
        let periods = course.shown.periods.iter().map(|period| &period.record);
        let inside: Vec<_> = periods.filter(|r| r.time >= window[0] && r.time <= window[1]).collect();
        let of = |figure: fn(&Record) -> f64| -> Vec<f64> { inside.iter().map(|record| figure(record)).collect() };
        let time = of(|record| record.time);
        let colour = colour(name);
        let line = |y| Series::line(name.as_str(), time.clone(), y).colour(colour);
        voltage = voltage.series(line(of(|record| record.sample.v_out)));
        current = current.series(line(of(|record| record.sample.i_l)));
        duty = duty.series(Series::step(name.as_str(), time.clone(), of(|record| record.duty)).colour(colour));
    }
    let [_, v_ref] = step.step.held(setting.v_ref);
    let band = settled_band(v_ref);
    voltage = voltage.y_zone(v_ref - band, v_ref + band, "settled");
    let [from, to] = step
        .step
        .loads()
        .map(|load| load.conductance * setting.v_ref + load.current + load.power / setting.v_ref);
    let side = if to >= from { -1.0 } else { 1.0 };
    for (name, limit) in &step.limits {
        voltage = voltage.y_line(setting.v_ref + side * limit.at_sample.deviation, name.as_str());
    }
    let x = Axis::new("time from the step").unit("s").range(window[0], window[1]);
    let chart = Chart::new(title, x).panel(voltage).panel(current).panel(duty);
    chart.svg().map_err(told)
}

/// The same controller in the same colour in every picture, whichever are left out.
fn colour(name: &str) -> Colour {
    if name == LAW {
        return Colour::SKY;
    }
    let classical = Kind::ALL.iter().position(|kind| kind.name() == name);
    let colours = [Colour::ORANGE, Colour::GREEN, Colour::PURPLE, Colour::VERMILION];
    classical
        .and_then(|index| colours.get(index))
        .copied()
        .unwrap_or(Colour::BLUE)
}
