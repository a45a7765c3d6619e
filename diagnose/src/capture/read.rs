//! From samples to a capture: which period they repeat in, what switches when, and all periods folded.

use plant::Parameters;
use toml_input::Message;

use super::edges::{At, Brackets, Edges, levels, of_node, repeated};
use super::fold::{Bins, Fold};
use super::{Capture, Level, Node, Origin, Pulse, accuracy, period};
use crate::record::{CHANNEL_NAMES, CHANNELS};

/// Fewest samples in a period of a capture: a triangle and a parabola need some on each of their sides.
pub(crate) const SAMPLES: f64 = 8.0;
/// Fewest periods of a record of fast rows that is thinned to a row each period, as long records always were: as many as a record
/// must have rows.
const PERIODS: f64 = 20.0;
/// More samples a period than this are an oscilloscope's, however many periods there are.
const SCOPE: f64 = 500.0;
/// Switching periods of bench and model may differ by this share, as for any record.
const CLOCKS: f64 = 0.02;
/// Periods of a steady state have one mean: in standard deviations of the noise, ...
const MOVED: f64 = 5.0;
/// ... and as a share of the channel's ripple and mean, which a steady state may lose.
const MOVED_SHARE: f64 = 0.02;
const MOVED_RIPPLE: f64 = 0.2;
/// A mean below this share of what duty and load ask for is none: the channel is coupled through a capacitor.
const COUPLED: f64 = 0.1;
/// Levels are read off the middle of an interval: edges ring at its start.
const MIDDLE: (f64, f64) = (0.25, 0.75);
/// Late in the off-interval a node above this share of its high level carries no current any more.
const RESTS: f64 = 0.2;

/// Whether rows are those of a capture, `samples` a period over `periods`.
pub(crate) fn is_capture(samples: f64, periods: f64) -> bool {
    // of so many rows less than a period are more likely times in another unit
    samples > SCOPE && periods >= 1.0 - CLOCKS || (SAMPLES..=SCOPE).contains(&samples) && periods < PERIODS
}

/// Samples of a capture in SI units.
pub(crate) struct Samples {
    pub time: Vec<f64>,
    /// Usual time between them.
    pub step: f64,
    pub channels: [Option<Vec<f64>>; CHANNELS],
    pub pin: Option<Vec<f64>>,
    pub node: Option<Vec<f64>>,
    pub i_in: Option<Vec<f64>>,
    /// Duty that a column or a map states.
    pub duty: Option<f64>,
    /// Mean current that the load draws at an output voltage.
    pub drawn: f64,
}

/// A capture, its duty, whether that is the switch's own, and what is to be said.
pub(crate) struct Read {
    pub capture: Capture,
    pub duty: f64,
    pub applied: bool,
    pub notes: Vec<String>,
}

/// Reads a capture for a converter of `parameters`.
///
/// # Errors
/// Less than a whole period, another switching frequency, nothing that switches, no steady state, no duty.
pub(crate) fn read(samples: &Samples, parameters: &Parameters) -> Result<Read, Message> {
    let (time, t_sw) = (&samples.time, parameters.t_sw());
    let span = time.last().copied().unwrap_or(0.0) - time.first().copied().unwrap_or(0.0) + samples.step;
    if span < (1.0 - CLOCKS) * t_sw {
        let found = format!("{} of {}", said(span), said(t_sw));
        let message = Message::new("the capture is shorter than one switching period").found(found);
        return Err(message
            .expected("one whole period or more")
            .hint("a longer time base, or `converter.f_sw` is not right"));
    }
    let mut notes = Vec::new();
    let pin = samples.pin.as_ref();
    let pin = pin.and_then(|v| told("v_pwm", two_levels(time, v), &mut notes));
    let node = samples.node.as_ref();
    let node = node.and_then(|v| told("v_sw", of_node(time, v), &mut notes));
    let (period, at) = timing(samples, [pin.as_ref(), node.as_ref()], t_sw, &mut notes)?;
    let [pin_on, pin_off, node_on, node_off] = at;
    let (pin, node) = (pulse(pin_on, pin_off, period), pulse(node_on, node_off, period));
    let (origin, from) = match node {
        Some(node) => (Origin::Node, node.on.time),
        None => (
            Origin::Free,
            pin.map_or(time.first().copied().unwrap_or(0.0), |pin| pin.on.time),
        ),
    };
    let bins = Bins::new(time, samples.step, period, from);
    if bins.periods < 1.0 {
        return Err(Message::new("the capture is shorter than one switching period").found(said(span)));
    }
    let (duty, applied) = duty(samples, pin, node, period, &mut notes)?;
    let folds: [Option<Fold>; CHANNELS] = std::array::from_fn(|n| samples.channels[n].as_deref().map(|v| bins.fold(v)));
    for (n, (values, fold)) in samples.channels.iter().zip(&folds).enumerate() {
        if let (Some(values), Some(fold)) = (values, fold) {
            steady(n, values, fold, time, period, bins.periods)?;
        }
    }
    let ac = coupled(
        &folds,
        duty * parameters.converter.v_in,
        samples.drawn,
        parameters,
        &mut notes,
    );
    let node = node.and_then(|pulse| shown_node(pulse, samples.node.as_deref()?, &bins));
    let by_current = || {
        folds[1]
            .as_ref()
            .filter(|_| !ac[1])
            .map(|fold| fold.rests(bins.periods))
    };
    let resting = node.as_ref().map(|(_, resting)| *resting).or_else(by_current);
    let folds = folds.map(|fold| fold.map(|fold| if resting == Some(true) { fold.ringing() } else { fold }));
    let i_in = samples.i_in.as_deref().map(|v| bins.fold(v)).map(|fold| Level {
        value: fold.mean,
        sd: fold.mean_sd.hypot(accuracy(fold.mean, fold.span, fold.step)),
    });
    let capture = Capture {
        period,
        step: samples.step,
        origin,
        folds,
        ac,
        pin,
        node: node.map(|(node, _)| node),
        i_in,
        discontinuous: resting,
        bins,
    };
    Ok(Read {
        capture,
        duty,
        applied,
        notes,
    })
}

/// A pulse between two edges of a period.
fn pulse(on: Option<At>, off: Option<At>, period: f64) -> Option<Pulse> {
    let (on, off) = (on?, off?);
    let width = At {
        time: (off.time - on.time).rem_euclid(period),
        sd: on.sd.hypot(off.sd),
    };
    Some(Pulse { on, width })
}

/// Channels that show no mean although duty and load ask for one.
fn coupled(
    folds: &[Option<Fold>; CHANNELS],
    v_out: f64,
    drawn: f64,
    parameters: &Parameters,
    notes: &mut Vec<String>,
) -> [bool; CHANNELS] {
    let expected = [v_out, drawn, drawn, parameters.converter.v_in];
    std::array::from_fn(|n| {
        let has_none = |fold: &Fold| fold.mean.abs() < COUPLED * expected[n] && expected[n] > 0.0;
        let is_coupled = folds[n].as_ref().is_some_and(has_none);
        if is_coupled {
            let name = CHANNEL_NAMES[n];
            notes.push(format!(
                "{name} has no mean: taken as coupled through a capacitor, and only its ripple is used"
            ));
        }
        is_coupled
    })
}

fn said(seconds: f64) -> String {
    report::quantity(seconds, "s", 4)
}

fn two_levels(time: &[f64], values: &[f64]) -> Option<Edges> {
    levels(values).map(|levels| Edges::of(time, values, levels))
}

fn told(name: &str, found: Option<Edges>, notes: &mut Vec<String>) -> Option<Edges> {
    if found.is_none() {
        notes.push(format!("{name} does not switch between two levels: not used for edges"));
    }
    found
}

/// The period, and one instant of each kind of edge: pin up and down, node up and down.
fn timing(
    samples: &Samples,
    edges: [Option<&Edges>; 2],
    t_sw: f64,
    notes: &mut Vec<String>,
) -> Result<(f64, [Option<At>; 4]), Message> {
    let expected = format!("{} within {:.0} %", said(t_sw), 100.0 * CLOCKS);
    let hint = "is `converter.f_sw` of the plant file right, and is the time in s?";
    let other = |found: f64, what: &str| {
        let message = Message::new("the capture has another switching period than the model");
        let found = format!("{what} repeats every {}, {:.4} kHz", said(found), 1e-3 / found);
        message.found(found).expected(expected.clone()).hint(hint)
    };
    let none = Brackets::new();
    let empty = Edges::default();
    let [pin, node] = edges.map(|edges| edges.unwrap_or(&empty));
    let named = [(pin, "v_pwm"), (node, "v_sw")];
    let rough = named
        .iter()
        .find_map(|(edges, name)| Some((edges.rough_period()?, *name)));
    if let Some((rough, name)) = rough {
        // two edges a sample apart may be off by a sample each
        let unsure = 2.0 * samples.step / rough / (pin.rising.len().max(node.rising.len()) as f64 - 1.0).max(1.0);
        if (rough / t_sw - 1.0).abs() > CLOCKS + unsure {
            return Err(other(rough, name));
        }
        // a node that rings beyond its middle has more edges than periods
        let rings = |edges: &Edges| {
            edges
                .rough_period()
                .is_some_and(|period| (period / rough - 1.0).abs() > CLOCKS + unsure)
        };
        if rings(node) {
            notes.push(
                "v_sw has more edges than the command has periods: it rings, and is not used for edges".to_owned(),
            );
        }
        let lists: [&Brackets; 4] = match rings(node) {
            true => [&pin.rising, &pin.falling, &none, &none],
            false => [&pin.rising, &pin.falling, &node.rising, &node.falling],
        };
        let (period, at) = repeated(&lists, rough);
        if (period / t_sw - 1.0).abs() > CLOCKS {
            return Err(other(period, name));
        }
        return Ok((period, [at[0], at[1], at[2], at[3]]));
    }
    // the channel whose period stands out: the current before the voltage
    let span = samples.time.last().unwrap_or(&0.0) - samples.time.first().unwrap_or(&0.0);
    let ripples = [(1, "i_l"), (0, "v_out")];
    let found = ripples.iter().find_map(|(n, name)| {
        let values = samples.channels[*n].as_ref()?;
        Some((period::of(&samples.time, values, 1.0 / t_sw)?, *name))
    });
    let Some((frequency, name)) = found else {
        // less than two periods with one edge of each kind: the model's period stands
        let has = |edges: &Edges| !edges.rising.is_empty() && !edges.falling.is_empty();
        if has(pin) || has(node) {
            let (_, at) = repeated(&[&pin.rising, &pin.falling, &node.rising, &node.falling], t_sw);
            return Ok((t_sw, [at[0], at[1], at[2], at[3]]));
        }
        let message = Message::new("nothing in the capture switches").found("no edge, and no ripple above its noise");
        return Err(message
            .expected("an edge of v_sw or v_pwm, or the ripple of i_l or v_out")
            .hint("does the converter run, is the range small enough? A settled point without ripple is a row of a table without `t`"));
    };
    let period = 1.0 / frequency;
    // a few periods tell a frequency to a part of 1 / span
    let tells = CLOCKS + 0.1 * t_sw / span.max(t_sw);
    match (period / t_sw - 1.0).abs() > tells {
        true => Err(other(period, name)),
        false if span < 3.0 * t_sw => Ok((t_sw, [None; 4])),
        false => Ok((period, [None; 4])),
    }
}

/// The duty of the capture, and whether it is what the switch itself did.
fn duty(
    samples: &Samples,
    pin: Option<Pulse>,
    node: Option<Pulse>,
    period: f64,
    notes: &mut Vec<String>,
) -> Result<(f64, bool), Message> {
    if let Some(pin) = pin {
        let shown = pin.width.time / period;
        let apart = samples.duty.map(|stated| (stated - shown).abs());
        // a pin at the gate of the lower switch, or a count of another clock
        if apart.is_some_and(|apart| apart > 0.02) {
            let stated = samples.duty.unwrap_or(f64::NAN);
            let message =
                Message::new("v_pwm and the duty contradict each other").found(format!("{shown:.4} and {stated:.4}"));
            return Err(
                message.hint("is v_pwm the command of the upper switch, and not inverted? Leave one of them out")
            );
        }
        notes.push(format!("duty by the edges of v_pwm: {shown:.4}"));
        return Ok((shown, false));
    }
    if let Some(stated) = samples.duty {
        return Ok((stated, false));
    }
    if let Some(node) = node {
        let shown = node.width.time / period;
        notes.push(format!(
            "no duty was given: taken from v_sw, {shown:.4}. What is lost between command and switch does not show"
        ));
        return Ok((shown, true));
    }
    let message = Message::new("nothing says what the duty is").expected("a column duty, v_pwm or v_sw");
    Err(message.hint("--map duty=0.5 says it for the whole capture"))
}

/// A capture is of a steady state.
fn steady(channel: usize, values: &[f64], fold: &Fold, time: &[f64], period: f64, periods: f64) -> Result<(), Message> {
    let first = time.first().copied().unwrap_or(0.0);
    let mean = |n: f64| {
        let within = |t: &f64| (n * period..(n + 1.0) * period).contains(&(t - first));
        let all = time.iter().zip(values).filter(|(t, v)| within(t) && v.is_finite());
        let (sum, count) = all.fold((0.0, 0.0), |(sum, count), (_, v)| (sum + v, count + 1.0));
        (sum / count, count)
    };
    if periods < 2.0 {
        return Ok(());
    }
    let ((a, count), (b, _)) = (mean(0.0), mean(periods - 1.0));
    let sd = (2.0f64 / count).sqrt() * fold.noise;
    // periods that are no whole number of samples differ by one sample's share of the ripple
    let allowed = (MOVED * sd)
        .max(MOVED_SHARE * fold.mean.abs())
        .max(MOVED_RIPPLE * fold.ripple())
        .max(fold.step);
    if (b - a).abs() <= allowed {
        return Ok(());
    }
    let (name, unit) = (CHANNEL_NAMES[channel], crate::record::CHANNEL_UNITS[channel]);
    let [from, to] = [a, b].map(|v| report::quantity(v, unit, 4));
    let message = Message::new("the converter is not at rest in the capture").found(format!(
        "the mean of {name} goes from {from} in the first period to {to} in the last"
    ));
    Err(message
        .expected("a steady state: each period like the others")
        .hint("a transient is a record with a row each period, 20 or more of them"))
}

/// Levels of the switch node, and whether the current rests.
fn shown_node(pulse: Pulse, values: &[f64], bins: &Bins) -> Option<(Node, bool)> {
    let fold = bins.fold(values);
    let on = pulse.width.time / bins.period;
    let level = |from: f64, to: f64| {
        let within = bins
            .at
            .iter()
            .zip(&fold.value)
            .filter(|(at, v)| (from..to).contains(*at) && v.is_finite());
        let all: Vec<f64> = within.map(|(_, v)| v + fold.mean).collect();
        let value = all.iter().sum::<f64>() / all.len() as f64;
        let noise = fold.noise / (all.len() as f64 * bins.periods).sqrt();
        (!all.is_empty()).then(|| Level {
            value,
            sd: noise.hypot(accuracy(value, fold.span, fold.step)),
        })
    };
    let inside = |start: f64, width: f64| level(start + MIDDLE.0 * width, start + MIDDLE.1 * width);
    let high = inside(0.0, on)?;
    let late = level(on + 0.85 * (1.0 - on), on + 0.95 * (1.0 - on))?;
    let rests = late.value > RESTS * high.value;
    Some((
        Node {
            pulse,
            on: high,
            off: inside(on, 1.0 - on).filter(|_| !rests),
            mean: Level {
                value: fold.mean,
                sd: fold.mean_sd.hypot(accuracy(fold.mean, fold.span, fold.step)),
            },
        },
        rests,
    ))
}
