//! What can be read off a capture without any fit of a model, with intervals of 95 %, and what a missing channel keeps back.

mod capacitor;
mod inductor;

use plant::Parameters;

use super::{Capture, GAIN, Level};
use crate::exact::Exact;
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
    /// From the command to the switch node's rise and fall, by the model, s.
    pub delays: Option<[f64; 2]>,
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
    frequency(capture, p, &mut out);
    edges(capture, driven, &mut out);
    ripples(capture, &mut out);
    inductor::inductance(capture, p, &mut out);
    winding(capture, driven, p, &mut out);
    capacitor::capacitor(capture, driven, p, &mut out);
    efficiency(capture, driven, &mut out);
    out
}

fn mode(capture: &Capture) -> Option<&'static str> {
    Some(if capture.discontinuous? { "dcm" } else { "ccm" })
}

fn frequency(capture: &Capture, p: &Parameters, out: &mut Estimates) {
    let t = capture.period;
    if !capture.timed {
        out.missing.push("more periods: switching frequency".to_owned());
        return;
    }
    // the trigger's clock is better than 50 ppm; a period fitted to bins of one is as good as a sample over all of them
    let sd = (capture.step / 12f64.sqrt() / (capture.bins.periods * t)).max(5e-5) / t;
    out.values.push(around(
        "f_sw",
        (1.0 / t, sd),
        "Hz",
        Some(p.converter.f_sw),
        "the period in which the samples repeat",
    ));
}

fn edges(capture: &Capture, driven: &Driven, out: &mut Estimates) {
    let t = capture.period;
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
            let sd = node.pulse.on.sd.hypotenuse(pin.on.sd);
            let off = late(on + width.time - pin.width.time);
            let [model_on, model_off] = driven.delays.map_or([None; 2], |delays| delays.map(Some));
            let [from_on, from_off] = ["v_pwm rises to v_sw rises", "v_pwm falls to v_sw falls"];
            out.values
                .push(around("turn_on_delay", (on, sd), "s", model_on, from_on));
            let sd = width.sd.hypotenuse(pin.width.sd) / 2f64.sqrt();
            out.values
                .push(around("turn_off_delay", (off, sd), "s", model_off, from_off));
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

fn ripples(capture: &Capture, out: &mut Estimates) {
    for (n, name, unit) in [(1, "i_l_ripple", "A"), (0, "v_out_ripple", "V")] {
        // what was cut off was larger
        if let Some(fold) = capture.folds[n].as_ref().filter(|fold| !fold.has_holes()) {
            let bin = fold.noise / capture.bins.periods.max(1.0).sqrt();
            let sd = (GAIN * fold.ripple())
                .hypotenuse(2.0 * bin)
                .hypotenuse(fold.step / 12f64.sqrt());
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

/// The winding holds what the means of switch node and output differ by.
fn winding(capture: &Capture, driven: &Driven, p: &Parameters, out: &mut Estimates) {
    let (Some(node), Some(v_out)) = (&capture.node, capture.mean(0)) else {
        return;
    };
    let i = capture.mean(1).map_or(driven.drawn, |i| i.value);
    if i > 0.0 {
        let value = (node.mean.value - v_out.value) / i;
        let sd = node.mean.sd.hypotenuse(v_out.sd) / i;
        out.values.push(around(
            "dcr",
            (value, sd),
            "ohm",
            Some(p.inductor.dcr),
            "mean of v_sw less mean of v_out, over the current",
        ));
    }
}

/// Two meters of current and two of voltage, each off by what an oscilloscope may be, make no more of a converter without losses.
const MOST_EFFICIENT: f64 = 1.15;

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
    if !(0.0..MOST_EFFICIENT).contains(&value) {
        let what = "i_in in its own direction and with its own ratio: efficiency, which would be";
        out.missing.push(format!("{what} {value:.2}"));
        return;
    }
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
