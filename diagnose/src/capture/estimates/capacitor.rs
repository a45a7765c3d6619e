//! Series resistance and capacitance of the output, by the shape of the ripple.

use plant::Parameters;

use super::{Driven, Estimates, around};
use crate::capture::fold::INDEPENDENT;
use crate::capture::{Capture, Fold, GAIN, Origin};
use crate::exact::Exact;
use crate::search::gained;

/// `v = esr i + q / c` over the period: the ripple of the current is measured, or that of the model.
pub(super) fn capacitor(capture: &Capture, driven: &Driven, p: &Parameters, out: &mut Estimates) {
    let Some(v) = &capture.folds[0] else {
        out.missing.push("v_out: the output capacitor, losses".to_owned());
        return;
    };
    let (at, t) = (&capture.bins.at, capture.period);
    let measured = capture.folds[1].as_ref().filter(|fold| !fold.has_holes());
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
        let sd = esr.1.hypotenuse(probe * esr.0);
        out.values
            .push(around("esr", (esr.0, sd), "ohm", Some(p.capacitor.esr), from));
    }
    let relative = (elastance.1 / elastance.0).abs();
    if elastance.0 > 0.0 && relative < 0.5 {
        let value = 1.0 / elastance.0;
        let model = Some(p.converter.capacitance);
        out.values.push(around(
            "capacitance",
            (value, value * relative.hypotenuse(probe)),
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
    fn new(capture: &Capture, v: &Fold, current: &[f64], conductance: f64) -> Self {
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
        let normal = crate::normal::Normal::new(&self.columns, &self.right);
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
            crate::normal::solve(normal.matrix(), &unit)[n].max(0.0).sqrt() * scale
        };
        Solved {
            esr: (values[0], sd(0)),
            elastance: (values[1], sd(1)),
            left,
        }
    }
}
