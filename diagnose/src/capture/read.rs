//! From samples to a capture: which period they repeat in, what switches when, and all periods folded.

use plant::{Load, Parameters};
use toml_input::Message;

use super::edges::{At, Brackets, Edges, levels, of_node, repeated};
use super::fold::{Bins, Fold};
use super::{Capture, Level, Origin, Pulse, accuracy, alike, clean, node, period};
use crate::exact::Exact;
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
/// A mean below this share of what duty and load ask for may be none: the channel may be coupled through a capacitor.
const COUPLED: f64 = 0.1;
/// It is, if the mean is also below this share of the channel's own ripple and what offset its range may have: a probe of a wrong ratio
/// takes the ripple along.
const COUPLED_RIPPLE: f64 = 0.25;
const COUPLED_OFFSET: f64 = 4.0;
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
    pub load: Load,
    /// Source voltage, V.
    pub v_in: f64,
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
pub(crate) fn read(mut samples: Samples, parameters: &Parameters) -> Result<Read, Message> {
    let t_sw = parameters.t_sw();
    let span =
        samples.time.last().copied().unwrap_or(0.0) - samples.time.first().copied().unwrap_or(0.0) + samples.step;
    if span < (1.0 - CLOCKS) * t_sw {
        let found = format!("{} of {}", said(span), said(t_sw));
        let message = Message::new("the capture is shorter than one switching period").found(found);
        return Err(message
            .expected("one whole period or more")
            .hint("a longer time base, or `converter.f_sw` is not right"));
    }
    let mut notes = Vec::new();
    let largest = 0.25 * samples.v_in * t_sw / parameters.converter.inductance;
    let cut = clean::clean(&mut samples, largest, &mut notes);
    let samples = &samples;
    let time = &samples.time;
    let pin = samples.pin.as_ref();
    let pin = pin.and_then(|v| told("v_pwm", two_levels(time, v), &mut notes));
    let node = samples.node.as_ref();
    let node = node.and_then(|v| told("v_sw", of_node(time, v), &mut notes));
    let clock = timing(samples, [pin.as_ref(), node.as_ref()], t_sw, &mut notes)?;
    let (period, [pin_on, pin_off, node_on, node_off]) = (clock.period, clock.at);
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
            alike::check(n, values, fold, time, &bins)?;
        }
    }
    let ac = without_mean(&folds, cut, duty, samples, &mut notes);
    let v_out = mean_of(&folds, &ac, 0)
        .filter(|v| *v > 0.0)
        .unwrap_or(duty * samples.v_in);
    let current = folds[1].as_ref().filter(|_| !ac[1]);
    let node = node.and_then(|pulse| node::shown(pulse, samples.node.as_deref()?, &bins, v_out, current));
    let resting = node
        .as_ref()
        .map(|(_, resting)| *resting)
        .or(current.map(|fold| fold.rests(bins.periods)));
    let folds = folds.map(|fold| fold.map(|fold| if resting == Some(true) { fold.ringing() } else { fold }));
    let i_in = samples.i_in.as_deref().map(|v| bins.fold(v)).map(|fold| Level {
        value: fold.mean,
        sd: fold.mean_sd.hypotenuse(accuracy(fold.mean, fold.span, fold.step)),
    });
    let capture = Capture {
        period,
        timed: clock.is_own,
        step: samples.step,
        origin,
        folds,
        ac,
        pin,
        node: node.map(|(node, _)| node),
        i_in: i_in.filter(|level| level.value.is_finite()),
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

/// The mean of a channel that shows one.
fn mean_of(folds: &[Option<Fold>; CHANNELS], ac: &[bool; CHANNELS], channel: usize) -> Option<f64> {
    let fold = folds[channel].as_ref().filter(|_| !ac[channel])?;
    Some(fold.mean).filter(|mean| mean.is_finite())
}

/// A pulse between two edges of a period.
fn pulse(on: Option<At>, off: Option<At>, period: f64) -> Option<Pulse> {
    let (on, off) = (on?, off?);
    let width = At {
        time: (off.time - on.time).rem_euclid(period),
        sd: on.sd.hypotenuse(off.sd),
    };
    Some(Pulse { on, width })
}

/// Channels that show no mean: cut off, or coupled through a capacitor although duty and load ask for a mean.
fn without_mean(
    folds: &[Option<Fold>; CHANNELS],
    cut: [bool; CHANNELS],
    duty: f64,
    samples: &Samples,
    notes: &mut Vec<String>,
) -> [bool; CHANNELS] {
    let mut without = cut;
    let made = duty * samples.v_in;
    // the voltage first: what the load draws depends on it
    for n in 0..CHANNELS {
        let v_out = mean_of(folds, &without, 0).filter(|v| *v > 0.0).unwrap_or(made);
        let load = &samples.load;
        let power = if v_out > 0.0 { load.power / v_out } else { 0.0 };
        let drawn = v_out * load.conductance + load.current + power;
        let expected = [made, drawn, drawn, samples.v_in][n];
        let is_coupled = |fold: &Fold| {
            let own = COUPLED_RIPPLE * fold.ripple() + COUPLED_OFFSET * accuracy(0.0, fold.span, fold.step);
            expected > 0.0 && fold.mean.abs() < (COUPLED * expected).min(own)
        };
        if !without[n] && folds[n].as_ref().is_some_and(is_coupled) {
            let name = CHANNEL_NAMES[n];
            notes.push(format!(
                "{name} has no mean: taken as coupled through a capacitor, and only its ripple is used"
            ));
            without[n] = true;
        }
    }
    without
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

/// When things repeat.
struct Clock {
    period: f64,
    /// One instant of each kind of edge: pin up and down, node up and down.
    at: [Option<At>; 4],
    /// The period is that of the capture, not the model's.
    is_own: bool,
}

/// The period, and the edges.
fn timing(samples: &Samples, edges: [Option<&Edges>; 2], t_sw: f64, notes: &mut Vec<String>) -> Result<Clock, Message> {
    let clock = |period: f64, at: [Option<At>; 4], is_own: bool| Clock { period, at, is_own };
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
        return Ok(clock(period, [at[0], at[1], at[2], at[3]], true));
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
            return Ok(clock(t_sw, [at[0], at[1], at[2], at[3]], false));
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
        false if span < 3.0 * t_sw => Ok(clock(t_sw, [None; 4], false)),
        false => Ok(clock(period, [None; 4], true)),
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
        // of one that is commanded to be on while the node is low
        if let Some(node) = node {
            let on = node.width.time / period;
            if (1.0 - on - shown).abs() < 0.02 && (on - shown).abs() > 0.1 {
                let message = Message::new("v_pwm looks like the command of the lower switch");
                let found = format!("high for {shown:.4} of the period, and v_sw for {on:.4}");
                return Err(message
                    .found(found)
                    .hint("is it inverted, or at the other pin? Leave it out, or give its duty"));
            }
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
