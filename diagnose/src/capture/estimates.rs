//! What can be read off a capture without any fit of a model, with intervals of 95 %, and what a missing channel keeps back.

use plant::Parameters;

use super::fold::INDEPENDENT;
use super::{Capture, GAIN, Level, Origin};
use crate::search::gained;
use crate::words::{si, unit};

/// A number that a capture shows.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Estimate {
    /// Its name, as a parameter of the plant file where it is one.
    pub name: &'static str,
    /// Best value, SI.
    pub value: f64,
    /// Lower end of the 95 % interval.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// SI unit.
    pub unit: &'static str,
    /// What the plant file has, where it has one.
    pub model: Option<f64>,
    /// What it was read off.
    pub from: String,
}

/// All of one capture.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Estimates {
    /// The record.
    pub record: String,
    /// Whole periods.
    pub periods: f64,
    /// Samples a period.
    pub samples: f64,
    /// `ccm`, `dcm`, or nothing where neither shows.
    pub mode: Option<&'static str>,
    /// The numbers.
    pub values: Vec<Estimate>,
    /// What would need another channel, in words.
    pub missing: Vec<String>,
}

impl Estimates {
    /// What was read off for parts of the plant, and delays, in a line.
    #[must_use]
    pub fn words(&self) -> String {
        const PARTS: [&str; 6] = [
            "inductance",
            "esr",
            "capacitance",
            "turn_on_delay",
            "turn_off_delay",
            "efficiency",
        ];
        let own = self.values.iter().filter(|one| PARTS.contains(&one.name));
        let said = own.map(|one| {
            let [value, low, high] = [one.value, one.low, one.high].map(|v| si(v, unit(one.unit)));
            format!("{} {value} [{low}, {high}]", one.name)
        });
        let said: Vec<String> = said.collect();
        match said.is_empty() {
            true => format!(
                "capture {}: {:.0} periods, no part can be read off alone",
                self.record, self.periods
            ),
            false => format!("capture {} by itself: {}", self.record, said.join(", ")),
        }
    }
}

/// Part of an interval between edges over which a slope is fitted.
const STRAIGHT: (f64, f64) = (0.12, 0.9);
/// What the straight line of a current may be off in its slope: the bend by winding and saturation.
const BENT: f64 = 0.005;

/// Two standard deviations to either side.
fn around(name: &'static str, (value, sd): (f64, f64), unit: &'static str, model: Option<f64>, from: &str) -> Estimate {
    Estimate {
        name,
        value,
        low: value - 1.96 * sd,
        high: value + 1.96 * sd,
        unit,
        model,
        from: from.to_owned(),
    }
}

/// What is driven in the capture.
pub struct Driven {
    /// Record.
    pub name: String,
    /// Duty.
    pub duty: f64,
    /// The duty is that of the switch node.
    pub applied: bool,
    /// Mean current of the load, A.
    pub drawn: f64,
    /// Conductance of the load, S.
    pub conductance: f64,
}

/// Reads off what a capture shows, beside the model `p`.
#[must_use]
pub fn of(capture: &Capture, driven: &Driven, p: &Parameters) -> Estimates {
    let mut out = Estimates {
        record: driven.name.clone(),
        periods: capture.bins.periods,
        samples: (capture.period / capture.step).round(),
        mode: mode(capture),
        values: Vec::new(),
        missing: Vec::new(),
    };
    edges(capture, driven, p, &mut out);
    ripples(capture, p, &mut out);
    let slopes = slopes(capture, driven);
    inductance(capture, slopes, p, &mut out);
    winding(capture, driven, p, &mut out);
    capacitor(capture, driven, p, &mut out);
    efficiency(capture, driven, &mut out);
    out
}

fn mode(capture: &Capture) -> Option<&'static str> {
    Some(if capture.discontinuous? { "dcm" } else { "ccm" })
}

fn edges(capture: &Capture, driven: &Driven, p: &Parameters, out: &mut Estimates) {
    let t = capture.period;
    let f_sw = Some(p.converter.f_sw);
    // the trigger's clock is better than 50 ppm; a period fitted to bins of one is as good as a sample over all of them
    let sd = (capture.step / 12f64.sqrt() / (capture.bins.periods * t)).max(5e-5) / t;
    out.values.push(around(
        "f_sw",
        (1.0 / t, sd),
        "Hz",
        f_sw,
        "the period in which the samples repeat",
    ));
    if let Some(pin) = capture.pin {
        out.values.push(around(
            "duty_command",
            (pin.width.time / t, pin.width.sd / t),
            "1",
            None,
            "edges of v_pwm",
        ));
    }
    let Some(node) = &capture.node else {
        out.missing
            .push("v_sw: on-time and levels of the switch, delays".to_owned());
        return;
    };
    let width = node.pulse.width;
    out.values.push(around(
        "duty_switch",
        (width.time / t, width.sd / t),
        "1",
        None,
        "edges of v_sw",
    ));
    match capture.pin {
        Some(pin) => {
            let late = |time: f64| (time + 0.5 * t).rem_euclid(t) - 0.5 * t;
            let on = late(node.pulse.on.time - pin.on.time);
            let sd = node.pulse.on.sd.hypot(pin.on.sd);
            let off = late(on + width.time - pin.width.time);
            let s = &p.switch;
            let hold = if p.converter.rectifier == plant::Rectifier::Synchronous {
                s.dead_time
            } else {
                0.0
            };
            let [from_on, from_off] = ["v_pwm rises to v_sw rises", "v_pwm falls to v_sw falls"];
            let model = Some(s.turn_on_delay + hold);
            out.values.push(around("turn_on_delay", (on, sd), "s", model, from_on));
            let sd = width.sd.hypot(pin.width.sd) / 2f64.sqrt();
            out.values.push(around(
                "turn_off_delay",
                (off, sd),
                "s",
                Some(s.turn_off_delay),
                from_off,
            ));
        }
        None => {
            let known = if driven.applied {
                "the duty that was commanded and "
            } else {
                ""
            };
            out.missing.push(format!("v_pwm: {known}turn-on and turn-off delay"));
        }
    }
    let [on, off] = [
        "middle of the on-interval of v_sw",
        "middle of the off-interval of v_sw",
    ];
    out.values
        .push(around("v_sw_on", (node.on.value, node.on.sd), "V", None, on));
    if let Some(level) = node.off {
        out.values
            .push(around("v_sw_off", (level.value, level.sd), "V", None, off));
    }
}

fn ripples(capture: &Capture, _: &Parameters, out: &mut Estimates) {
    for (n, name, unit) in [(1, "i_l_ripple", "A"), (0, "v_out_ripple", "V")] {
        if let Some(fold) = &capture.folds[n] {
            let bin = fold.noise / capture.bins.periods.max(1.0).sqrt();
            let sd = (GAIN * fold.ripple()).hypot(2.0 * bin).hypot(fold.step / 12f64.sqrt());
            out.values.push(around(
                name,
                (fold.ripple(), sd),
                unit,
                None,
                "highest less lowest of the mean period",
            ));
        }
    }
}

/// On-time and slopes of the current in both intervals, A/s with their standard deviations.
struct Slopes {
    up: (f64, f64),
    down: (f64, f64),
}

fn slopes(capture: &Capture, _: &Driven) -> Option<Slopes> {
    let fold = capture.folds[1].as_ref()?;
    let place = |best: fn(f64, f64) -> bool| {
        let mut place = 0;
        for n in 0..fold.value.len() {
            if best(fold.value[n], fold.value[place]) {
                place = n;
            }
        }
        capture.bins.at[place]
    };
    let (start, on) = match (capture.origin, &capture.node) {
        (Origin::Node, Some(node)) => (0.0, node.pulse.width.time / capture.period),
        // without a switch node the corners of the current say it
        _ => {
            let (valley, peak) = (place(|a, b| a < b), place(|a, b| a > b));
            (valley, (peak - valley).rem_euclid(1.0))
        }
    };
    let slope = |start: f64, width: f64| {
        let (from, to) = (STRAIGHT.0 * width, STRAIGHT.1 * width);
        let inside = capture
            .bins
            .at
            .iter()
            .zip(&fold.value)
            .zip(&fold.sd)
            .filter_map(|((at, v), sd)| {
                let since = (at - start).rem_euclid(1.0);
                ((from..to).contains(&since) && v.is_finite()).then_some((since * capture.period, *v, *sd))
            });
        let rows: Vec<(f64, f64, f64)> = inside.collect();
        let n = rows.len() as f64;
        let (t, v) = (
            rows.iter().map(|r| r.0).sum::<f64>() / n,
            rows.iter().map(|r| r.1).sum::<f64>() / n,
        );
        let (up, down) = rows.iter().fold((0.0, 0.0), |(up, down), r| {
            (up + (r.0 - t) * (r.1 - v), down + (r.0 - t).powi(2))
        });
        let slope = up / down;
        let left = rows.iter().map(|r| (r.1 - v - slope * (r.0 - t)).powi(2)).sum::<f64>() / (n - 2.0).max(1.0);
        // what is left of a line is smooth: fewer values than bins are independent
        let many = (n * capture.bins.periods / INDEPENDENT).max(1.0);
        (rows.len() >= 4).then(|| (slope, (left * many.min(n) / down).sqrt()))
    };
    Some(Slopes {
        up: slope(start, on)?,
        down: slope(start + on, 1.0 - on)?,
    })
}

/// `L = v / (di/dt)` by the leap of both at the edges, in which output voltage and winding have no part.
fn inductance(capture: &Capture, slopes: Option<Slopes>, p: &Parameters, out: &mut Estimates) {
    let Some(slopes) = slopes else {
        out.missing
            .push("i_l: inductance, and the output capacitor without the model's inductance".to_owned());
        return;
    };
    let resting = out.mode == Some("dcm");
    let bend = slopes.up.0 - slopes.down.0;
    let (swing, what) = match &capture.node {
        Some(node) => match node.off {
            Some(off) => (
                Level {
                    value: node.on.value - off.value,
                    // one channel: its offset is in both levels
                    sd: GAIN * (node.on.value - off.value),
                },
                "slopes of i_l over the swing of v_sw",
            ),
            None => (
                level(node.on.value + p.switch.v_f),
                "slopes of i_l over the high level of v_sw",
            ),
        },
        None => (
            capture.mean(3).unwrap_or(level(p.converter.v_in)),
            "slopes of i_l over the source voltage",
        ),
    };
    let (value, sd) = match resting {
        // the rest has no slope: the on-interval alone, with the output voltage
        true => {
            let v_out = capture.mean(0).map_or(f64::NAN, |v| v.value);
            let high = capture.node.as_ref().map_or(p.converter.v_in, |node| node.on.value);
            ((high - v_out) / slopes.up.0, slopes.up.1 / slopes.up.0)
        }
        false => (swing.value / bend, slopes.up.1.hypot(slopes.down.1) / bend),
    };
    let share = sd.hypot(swing.sd / swing.value).hypot(GAIN).hypot(BENT);
    if value.is_finite() && value > 0.0 {
        let model = Some(p.converter.inductance);
        out.values
            .push(around("inductance", (value, (value * share).abs()), "H", model, what));
    }
}

fn level(value: f64) -> Level {
    Level {
        value,
        sd: GAIN * value,
    }
}

/// The winding holds what the means of switch node and output differ by.
fn winding(capture: &Capture, driven: &Driven, p: &Parameters, out: &mut Estimates) {
    let (Some(node), Some(v_out)) = (&capture.node, capture.mean(0)) else {
        return;
    };
    let i = capture.mean(1).map_or(driven.drawn, |i| i.value);
    if i > 0.0 {
        let value = (node.mean.value - v_out.value) / i;
        let sd = node.mean.sd.hypot(v_out.sd) / i;
        out.values.push(around(
            "dcr",
            (value, sd),
            "ohm",
            Some(p.inductor.dcr),
            "mean of v_sw less mean of v_out, over the current",
        ));
    }
}

/// `v = esr i + q / c` over the period: the ripple of the current is measured, or that of the model.
fn capacitor(capture: &Capture, driven: &Driven, p: &Parameters, out: &mut Estimates) {
    let Some(v) = &capture.folds[0] else {
        out.missing.push("v_out: the output capacitor, losses".to_owned());
        return;
    };
    let (at, t) = (&capture.bins.at, capture.period);
    let measured = capture.folds[1].as_ref();
    let (current, from) = match measured {
        Some(fold) => (fold.value.clone(), "ripple of v_out over that of i_l"),
        None => {
            let on = capture
                .node
                .as_ref()
                .map_or(driven.duty, |node| node.pulse.width.time / t);
            let ripple = p.converter.v_in * on * (1.0 - on) * t / p.converter.inductance;
            let triangle = |at: f64| match at < on {
                true => at / on - 0.5,
                false => 0.5 - (at - on) / (1.0 - on),
            };
            let shifted = |shift: f64| {
                at.iter()
                    .map(|at| ripple * triangle((at - shift).rem_euclid(1.0)))
                    .collect::<Vec<f64>>()
            };
            // nothing tells the instants of the switch: where the ripple itself fits best
            let shifts = if capture.origin == Origin::Node { 1 } else { SHIFTS };
            let tried = (0..shifts).map(|n| shifted(n as f64 / shifts as f64));
            let left = |current: &Vec<f64>| Parallel::new(capture, v, current, driven.conductance).solved().left;
            let best = tried.min_by(|a, b| left(a).total_cmp(&left(b)));
            (
                best.unwrap_or_default(),
                "ripple of v_out over that of the model's inductance",
            )
        }
    };
    let solved = Parallel::new(capture, v, &current, driven.conductance).solved();
    let probe = 2f64.sqrt() * GAIN;
    let (esr, elastance) = (solved.esr, solved.elastance);
    // a resistance below nothing fits where the ripple is below what the capture resolves
    if esr.0 + 1.96 * esr.1 > 0.0 {
        let sd = esr.1.hypot(probe * esr.0);
        out.values
            .push(around("esr", (esr.0, sd), "ohm", Some(p.capacitor.esr), from));
    }
    let relative = (elastance.1 / elastance.0).abs();
    if elastance.0 > 0.0 && relative < 0.5 {
        let value = 1.0 / elastance.0;
        let model = Some(p.converter.capacitance);
        out.values.push(around(
            "capacitance",
            (value, value * relative.hypot(probe)),
            "F",
            model,
            from,
        ));
    } else {
        out.missing
            .push("a finer range of v_out: its part of the ripple says the capacitance".to_owned());
    }
}

/// Shifts of the current that are tried where nothing tells them.
const SHIFTS: usize = 200;

/// `v = esr i + q / c + constant` over the bins, each row over its noise.
struct Parallel {
    columns: [Vec<f64>; 3],
    right: Vec<f64>,
    count: f64,
}

/// What it comes to: values with their standard deviations, and what is left.
struct Solved {
    esr: (f64, f64),
    elastance: (f64, f64),
    left: f64,
}

impl Parallel {
    fn new(capture: &Capture, v: &super::Fold, current: &[f64], conductance: f64) -> Self {
        let (at, t) = (&capture.bins.at, capture.period);
        let current: Vec<f64> = current.iter().zip(&v.value).map(|(i, v)| i - conductance * v).collect();
        let mut charge = Vec::with_capacity(at.len());
        let mut sum = 0.0;
        for n in 0..at.len() {
            charge.push(sum);
            let (next, width) = match n + 1 < at.len() {
                true => (n + 1, at[n + 1] - at[n]),
                false => (0, at[0] + 1.0 - at[n]),
            };
            sum += 0.5 * (current[n] + current[next]) * width * t;
        }
        // currents of a period add up to nothing; what noise leaves is spread evenly
        for (phase, q) in at.iter().zip(&mut charge) {
            *q -= sum * (phase - at[0]);
        }
        let weight = |n: usize| if capture.is_quiet(at[n]) { 1.0 / v.sd[n] } else { 0.0 };
        let weighted = |list: &[f64]| {
            list.iter()
                .enumerate()
                .map(|(n, v)| v * weight(n))
                .collect::<Vec<f64>>()
        };
        Parallel {
            columns: [weighted(&current), weighted(&charge), weighted(&vec![1.0; at.len()])],
            right: weighted(&v.value),
            count: (0..at.len()).filter(|n| weight(*n) > 0.0).count() as f64,
        }
    }

    fn solved(&self) -> Solved {
        let normal = crate::fit::Normal::new(&self.columns, &self.right);
        let values = normal.solved();
        let explained = gained(&self.columns, &self.right);
        let left = (self.right.iter().map(|v| v * v).sum::<f64>() - explained).max(0.0) / (self.count - 3.0).max(1.0);
        // what is left beyond noise is smooth: fewer values are independent
        let many = if left > 1.0 {
            (self.count / INDEPENDENT).max(1.0)
        } else {
            1.0
        };
        let scale = (left.max(1.0) * many).sqrt();
        let sd = |n: usize| {
            let unit: Vec<f64> = (0..3).map(|k| if k == n { 1.0 } else { 0.0 }).collect();
            crate::fit::solve(normal.matrix(), &unit)[n].max(0.0).sqrt() * scale
        };
        Solved {
            esr: (values[0], sd(0)),
            elastance: (values[1], sd(1)),
            left,
        }
    }
}

fn efficiency(capture: &Capture, driven: &Driven, out: &mut Estimates) {
    let (Some(v_in), Some(i_in)) = (capture.mean(3), capture.i_in) else {
        out.missing.push("v_in and i_in: efficiency".to_owned());
        return;
    };
    let Some(v_out) = capture.mean(0) else { return };
    let i_out = capture.mean(2).unwrap_or(Level {
        value: driven.drawn,
        sd: 0.0,
    });
    let value = v_out.value * i_out.value / (v_in.value * i_in.value);
    let parts = [v_out, i_out, v_in, i_in].map(|l| (l.sd / l.value).powi(2));
    let sd = value * parts.iter().sum::<f64>().sqrt();
    out.values.push(around(
        "efficiency",
        (value, sd),
        "1",
        None,
        "v_out i_out over v_in i_in, means of whole periods",
    ));
}
