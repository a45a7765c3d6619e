//! The inductance, by the slopes of the current.

use plant::Parameters;

use super::{Estimates, around};
use crate::capture::fold::INDEPENDENT;
use crate::capture::{Capture, GAIN, Level, Origin};
use crate::exact::Exact;

/// Part of an interval between edges over which a slope is fitted.
const STRAIGHT: (f64, f64) = (0.12, 0.9);
/// What the straight line of a current may be off in its slope: the bend by winding and saturation.
const BENT: f64 = 0.005;

/// On-time and slopes of the current in both intervals, A/s with their standard deviations.
struct Slopes {
    up: (f64, f64),
    down: (f64, f64),
}

fn slopes(capture: &Capture, resting: bool) -> Option<Slopes> {
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
    let (start, on) = match (capture.origin, &capture.node, &capture.pin) {
        (Origin::Node, Some(node), _) => (0.0, node.pulse.width.time / capture.period),
        // bins then count from the rise of the pin
        (Origin::Free, _, Some(pin)) if resting => (0.0, pin.width.time / capture.period),
        // the lowest sample of a current that rests is any of the rest
        _ if resting => return None,
        // without a switch node the corners of the current say it
        _ => {
            let (valley, peak) = (place(|a, b| a < b), place(|a, b| a > b));
            (valley, (peak - valley).rem_euclid(1.0))
        }
    };
    let slope = |start: f64, width: f64| {
        let (from, to) = (STRAIGHT.0 * width, STRAIGHT.1 * width);
        let bins = capture.bins.at.iter().zip(&fold.value).zip(&fold.sd);
        let measured = bins.filter(|(_, sd)| sd.is_finite()).map(|(bin, _)| bin);
        let since = measured.map(|(at, v)| ((at - start).rem_euclid(1.0), *v));
        let inside = since.filter(|(since, v)| (from..to).contains(since) && v.is_finite());
        let rows: Vec<(f64, f64)> = inside.map(|(since, v)| (since * capture.period, v)).collect();
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
pub(super) fn inductance(capture: &Capture, p: &Parameters, out: &mut Estimates) {
    let resting = out.mode == Some("dcm");
    let Some(slopes) = slopes(capture, resting) else {
        let missing = match capture.folds[1].is_some() && resting {
            true => "v_sw or v_pwm: inductance, since nothing else says where a current that rests begins to rise",
            false => "i_l: inductance, and the output capacitor without the model's inductance",
        };
        out.missing.push(missing.to_owned());
        return;
    };
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
        false => (swing.value / bend, slopes.up.1.hypotenuse(slopes.down.1) / bend),
    };
    let share = sd.hypotenuse(swing.sd / swing.value).hypotenuse(GAIN).hypotenuse(BENT);
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
