//! Pictures of records: measured, simulated, and the difference over time and operating point.

use std::ops::Range;

use report::{Axis, Chart, Panel, ReportError, Section, Series, Svg};

use super::colours::{EXTENDED, MEASURED, MODEL};
use super::spectrum;
use crate::diagnosis::Diagnosis;
use crate::findings::Verdict;
use crate::fit::State;
use crate::noise::channel;
use crate::problem::{LOST, Problem};
use crate::record::{CHANNEL_NAMES, CHANNEL_UNITS, CHANNELS};

/// Groups of equal size in a picture by operating point.
const GROUPS: usize = 12;

/// Measured minus simulated in the channel's unit; NaN where nothing counts, infinite where the simulation has no number.
fn errors(problem: &Problem, state: &State, record: usize, n: usize) -> Vec<f64> {
    let values = channel(problem, &state.residual, record, n).into_iter();
    let error = |v: f64| match v {
        0.0 => f64::NAN,
        LOST => f64::INFINITY,
        _ => v * problem.sigma[n],
    };
    values.map(error).collect()
}

/// Voltage and current of a record with both simulations, and their errors.
fn panels(
    problem: &Problem,
    before: &State,
    after: &State,
    record: usize,
    second: Option<&str>,
    also: &[usize],
    rows: Range<usize>,
) -> Result<Svg, ReportError> {
    let one = &problem.records[record];
    let time = &one.time[rows.clone()];
    let axis = if one.settled && !one.repeated {
        Axis::new("point")
    } else {
        Axis::new("time").unit("s")
    };
    let mut chart = Chart::new(one.name.clone(), axis);
    let first = ("model", before, MODEL);
    let states: Vec<_> = std::iter::once(first)
        .chain(second.map(|name| (name, after, EXTENDED)))
        .collect();
    for n in channels(also) {
        if !one.measured[n].iter().any(|v| v.is_finite()) {
            continue;
        }
        let measured = &one.measured[n][rows.clone()];
        let points = Series::points("measured", time, measured).colour(MEASURED);
        let mut panel = Panel::new(Axis::new(CHANNEL_NAMES[n]).unit(CHANNEL_UNITS[n]))
            .height(150.0)
            .series(points);
        let axis = Axis::new(format!("measured minus simulated {}", CHANNEL_NAMES[n])).unit(CHANNEL_UNITS[n]);
        let mut left = Panel::new(axis).height(100.0);
        let mut is_compared = false;
        for (name, state, colour) in states.iter().copied() {
            let error = &errors(problem, state, record, n)[rows.clone()];
            // a channel of a held-out record that no training record has is not compared, for nobody knows its noise; and a
            // simulation that left every number has no line
            if !error.iter().any(|error| error.is_finite()) {
                continue;
            }
            is_compared = true;
            let simulated: Vec<f64> = measured.iter().zip(error).map(|(shown, error)| shown - error).collect();
            panel = panel.series(Series::line(name, time, simulated).colour(colour));
            left = left.series(Series::line(name, time, error).colour(colour));
        }
        chart = chart.panel(panel);
        if is_compared {
            chart = chart.panel(left);
        }
    }
    chart.svg()
}

/// Channels of a picture: voltage and current of the inductor always, another where `also` names it.
fn channels(also: &[usize]) -> impl Iterator<Item = usize> {
    (0..CHANNELS).filter(move |n| *n < 2 || also.contains(n))
}

/// Mean square over that of the noise from which on a picture of a channel shows more than noise: the errors are 1.6 times as large, as in
/// [`crate::shape`].
const MORE_THAN_NOISE: f64 = 2.5;

/// Channels of a record in which one of both models leaves more than noise.
pub(super) fn unsettled(problem: &Problem, states: [&State; 2], record: usize) -> Vec<usize> {
    let is_more = |n: &usize| {
        let square = |state: &&State| {
            let errors = channel(problem, &state.residual, record, *n);
            let counted: Vec<f64> = errors.into_iter().filter(|error| *error != 0.0).collect();
            counted.iter().map(|error| error * error).sum::<f64>() / counted.len().max(1) as f64
        };
        states.iter().any(|state| square(state) > MORE_THAN_NOISE)
    };
    (0..CHANNELS).filter(is_more).collect()
}

/// Channels of a training record in which structure is left, or one of both models leaves more than noise.
fn structured(diagnosis: &Diagnosis, record: usize) -> Vec<usize> {
    let name = &diagnosis.problem.records[record].name;
    let own = diagnosis.findings.structure.iter().filter(|one| one.record == *name);
    let mut list: Vec<usize> = own
        .filter_map(|one| CHANNEL_NAMES.iter().position(|name| *name == one.channel))
        .collect();
    let states = [&diagnosis.given, diagnosis.attribution.state()];
    list.extend(unsettled(&diagnosis.problem, states, record));
    list
}

/// Adds the pictures of a record, and says which simulation has no line in them.
pub(super) fn pictures(
    section: Section,
    problem: &Problem,
    [before, after]: [&State; 2],
    record: usize,
    second: Option<&str>,
    also: &[usize],
    caption: &str,
) -> Section {
    let rows = 0..problem.records[record].rows();
    let mut section = section.chart_or_reason(panels(problem, before, after, record, second, also, rows), caption);
    let states = std::iter::once(("model", before)).chain(second.map(|name| (name, after)));
    for (name, state) in states {
        // channels without any line, and those whose line has gaps
        let (mut none, mut gaps) = (Vec::new(), Vec::new());
        for (n, channel) in CHANNEL_NAMES.iter().enumerate().take(2) {
            let errors = errors(problem, state, record, n);
            if errors.iter().any(|error| error.is_infinite()) {
                let is_drawn = errors.iter().any(|error| error.is_finite());
                (if is_drawn { &mut gaps } else { &mut none }).push(*channel);
            }
        }
        if !none.is_empty() {
            section = section.text(format!(
                "No line of {name} for {}: its simulation diverges, beyond what can be drawn.",
                none.join(" and ")
            ));
        }
        if !gaps.is_empty() {
            section = section.text(format!(
                "The line of {name} for {} has gaps: there its simulation diverges, beyond what can be drawn.",
                gaps.join(" and ")
            ));
        }
    }
    section
}

/// What the second simulation is where nothing explains the records.
pub(super) const PARTLY: &str = "best of the known causes";

/// What the second simulation is, if there is one.
pub(super) fn second(diagnosis: &Diagnosis) -> Option<&'static str> {
    diagnosis.attribution.best.as_ref()?;
    Some(match diagnosis.findings.verdict {
        Verdict::Unexplained => PARTLY,
        _ => "extended",
    })
}

/// Rows of a picture from near: each has ten pixels, so that what a sensor or a delay does from row to row is seen.
const NEAR: usize = 60;

/// The rows around the largest error of a record over time that is long enough to have a picture from near.
fn stretch(problem: &Problem, state: &State, record: usize) -> Option<Range<usize>> {
    let one = &problem.records[record];
    if one.rows() < 3 * NEAR || one.settled {
        return None;
    }
    let size = |row: usize| {
        let own = (0..CHANNELS).map(|n| state.residual[problem.offsets[record] + row * CHANNELS + n]);
        // what the simulation left has no size that says where it began to
        own.map(|v| if v.is_finite() && v.abs() < LOST { v.abs() } else { 0.0 })
            .fold(0.0, f64::max)
    };
    let most = (0..one.rows()).max_by(|a, b| size(*a).total_cmp(&size(*b)))?;
    // what led to it stands before
    let first = most.saturating_sub(NEAR / 3).min(one.rows() - NEAR);
    Some(first..first + NEAR)
}

/// The training records that are no captures; nothing if there is none.
pub(super) fn training(diagnosis: &Diagnosis) -> Option<Section> {
    let (problem, before, after) = (&diagnosis.problem, &diagnosis.given, diagnosis.attribution.state());
    let second = second(diagnosis);
    // in units of the noise, so that volts and amperes count alike
    let square = |record: usize| {
        let own = (0..crate::record::CHANNELS).flat_map(|n| channel(problem, &before.residual, record, n));
        own.map(|v| v * v).sum::<f64>() / problem.records[record].rows().max(1) as f64
    };
    let all = || (0..problem.records.len()).filter(|n| problem.records[*n].capture.is_none());
    let worst = all().max_by(|a, b| square(*a).total_cmp(&square(*b)))?;
    let caption =
        "The training record that the model as given misses most. Initial states are estimated for each model.";
    let also = |record: usize| structured(diagnosis, record);
    let title = match second {
        Some("extended") => "Measured, simulated, extended",
        _ => "Training records, measured and simulated",
    };
    let states = [before, after];
    let mut section = pictures(
        Section::new(title),
        problem,
        states,
        worst,
        second,
        &also(worst),
        caption,
    );
    if let Some(rows) = stretch(problem, before, worst) {
        section = section.chart_or_reason(
            panels(problem, before, states[1], worst, second, &also(worst), rows),
            "The same from near: the rows around the largest error of the model as given.",
        );
    }
    let models = spectrum::models(before, after, second);
    let measured = |n: &usize| problem.records[worst].measured[*n].iter().any(|v| v.is_finite());
    let shown: Vec<usize> = channels(&also(worst)).filter(measured).collect();
    if let Some(svg) = spectrum::picture(problem, &models, worst, &shown) {
        section = section.chart_or_reason(
            svg,
            "Amplitude of the sine that would leave this error. Noise is flat; a peak is a line, and what rises to the left is slow.",
        );
    }
    if all().count() > 1 {
        let mut inner = Section::new("The other training records");
        for record in all().filter(|record| *record != worst) {
            inner = pictures(inner, problem, states, record, second, &also(record), "");
        }
        section = section.details(inner);
    }
    match problem.sigma[0].is_finite() {
        true => Some(section.chart_or_reason(
            by_operating_point(diagnosis),
            "All rows of the training records, ordered by load current and cut into twelve groups of equal size: each dot is the mean of a group.",
        )),
        false => Some(section),
    }
}

/// Mean error of the output voltage over duty and set load.
fn by_operating_point(diagnosis: &Diagnosis) -> Result<Svg, ReportError> {
    let problem = &diagnosis.problem;
    let mut panel = Panel::new(Axis::new("mean error of v_o").unit("V")).height(130.0);
    let first = ("model", &diagnosis.given, MODEL);
    let after = second(diagnosis).map(|name| (name, diagnosis.attribution.state(), EXTENDED));
    for (name, state, colour) in std::iter::once(first).chain(after) {
        let mut points: Vec<(f64, f64)> = Vec::new();
        for (index, record) in problem.records.iter().enumerate() {
            let errors = errors(problem, state, index, 0);
            let drawn = record.measured[0].iter().zip(&record.load);
            // a voltage of 0 would send the point beyond any picture
            let drawn = drawn.map(|(v, load)| load.current + load.conductance * v + load.power / v.max(1e-3));
            points.extend(drawn.zip(errors).filter(|(i, e)| i.is_finite() && e.is_finite()));
        }
        // a model whose simulation left every number has no point, and the other one is still worth a picture
        if points.is_empty() {
            continue;
        }
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        let group = points.len().div_ceil(GROUPS).max(1);
        let mean = |of: fn(&(f64, f64)) -> f64| {
            points
                .chunks(group)
                .map(|part| part.iter().map(of).sum::<f64>() / part.len() as f64)
                .collect::<Vec<f64>>()
        };
        let (x, y) = (mean(|p| p.0), mean(|p| p.1));
        panel = panel
            .series(Series::line(name, x.clone(), y.clone()).colour(colour))
            .series(Series::points("", x, y).colour(colour));
    }
    Chart::new("Error by operating point", Axis::new("load current").unit("A"))
        .panel(panel)
        .svg()
}
