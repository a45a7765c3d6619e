//! Channels of a capture whose probe has another ratio than the oscilloscope was told: what one channel shows by itself.
//!
//! Signs, units and what several channels say together are checked as in any record.

use plant::Parameters;
use toml_input::Message;

use super::{Capture, Fold};
use crate::record::{CHANNEL_UNITS, CHANNELS, Record, Source};

/// Ratios that a probe may be forgotten at.
const PROBES: [f64; 2] = [0.1, 10.0];
/// How near to such a ratio a voltage is: losses, and what a current that rests adds.
const NEAR: f64 = 1.3;
/// The same of a ripple: an inductor that saturates, a source that is off.
const NEAR_RIPPLE: f64 = 1.6;
/// The same of the level of the switch node: the switch drops a little.
const NEAR_LEVEL: f64 = 1.15;
/// A buck gives no more than its source has, but for what its meters are off.
const BEYOND: f64 = 1.1;

/// A channel beside its expectation.
struct Odd<'a> {
    source: &'a Source,
    name: &'static str,
    probe: f64,
    found: f64,
    expected: f64,
    unit: &'static str,
}

/// What is wrong with sizes; `record` has the means of the capture as measured.
pub(crate) fn of(
    record: &Record,
    capture: &Capture,
    parameters: &Parameters,
    sources: &[Source; CHANNELS],
    node: &Source,
) -> Vec<Message> {
    let found = [
        voltage(record, capture, parameters, &sources[0]),
        current(record, capture, parameters, &sources[1]),
        level(record, capture, parameters, node),
    ];
    // a factor in the map is the user's word
    let unsaid = found.into_iter().flatten().filter(|odd| !odd.source.stated);
    unsaid.map(|odd| odd.message()).collect()
}

fn near(times: f64, within: f64) -> Option<f64> {
    let is_near = |probe: &f64| (times / probe).max(probe / times) < within;
    PROBES.into_iter().find(is_near)
}

/// Duty, source voltage and the voltage that they make.
fn made(record: &Record, parameters: &Parameters) -> (f64, f64, f64) {
    let duty = record.duty.first().copied().unwrap_or(0.0);
    let v_in = parameters.converter.v_in * record.v_in_ratio;
    (duty, v_in, duty * v_in)
}

fn voltage<'a>(record: &Record, capture: &Capture, parameters: &Parameters, source: &'a Source) -> Option<Odd<'a>> {
    let (_, v_in, expected) = made(record, parameters);
    let found = capture.mean(0)?.value;
    let probe = near(found / expected, NEAR)?;
    // a current that rests raises the voltage, to that of the source at most
    (probe < 1.0 || found > BEYOND * v_in).then_some(Odd {
        source,
        name: "v_out",
        probe,
        found,
        expected,
        unit: CHANNEL_UNITS[0],
    })
}

/// A current by its ripple, and by its mean if it has one: the mean alone may be that of another load.
fn current<'a>(record: &Record, capture: &Capture, parameters: &Parameters, source: &'a Source) -> Option<Odd<'a>> {
    let (duty, _, v_out) = made(record, parameters);
    let fold = capture.folds[1].as_ref();
    let fold = fold.filter(|fold| !fold.has_holes() && capture.discontinuous != Some(true))?;
    let (p, found) = (&parameters.converter, Fold::ripple(fold));
    let expected = v_out * (1.0 - duty) / (p.inductance * p.f_sw);
    let probe = near(found / expected, NEAR_RIPPLE)?;
    let load = record.load.first()?;
    let drawn = v_out * load.conductance + load.current + if v_out > 0.0 { load.power / v_out } else { 0.0 };
    let contradicts = |mean: f64| drawn > 0.0 && near(mean / drawn, NEAR_RIPPLE) != Some(probe);
    let mean = capture.mean(1).map(|level| level.value);
    (!mean.is_some_and(contradicts)).then_some(Odd {
        source,
        name: "i_l",
        probe,
        found,
        expected,
        unit: CHANNEL_UNITS[1],
    })
}

fn level<'a>(record: &Record, capture: &Capture, parameters: &Parameters, source: &'a Source) -> Option<Odd<'a>> {
    let (_, v_in, _) = made(record, parameters);
    let expected = capture.mean(3).map_or(v_in, |level| level.value);
    let found = capture.node.as_ref()?.on.value;
    Some(Odd {
        source,
        name: "v_sw",
        probe: near(found / expected, NEAR_LEVEL)?,
        found,
        expected,
        unit: "V",
    })
}

impl Odd<'_> {
    fn message(&self) -> Message {
        let (source, unit) = (self.source, self.unit);
        let map = |factor: f64| {
            let factor = factor * source.scale;
            measured::argument(&format!("{}={}*{factor}", self.name, source.header))
        };
        let said = |value: f64| report::quantity(value, unit, 3);
        let what = if self.name == "i_l" { "a ripple of " } else { "" };
        Message::new(format!("{} is {} times what the model has", source.label, self.probe))
            .found(format!("{what}{}", said(self.found)))
            .expected(format!("{what}about {}", said(self.expected)))
            .hint(format!(
                "is the probe set to another ratio in the oscilloscope? {}; if it is right as it is: {}",
                map(1.0 / self.probe),
                map(1.0)
            ))
    }
}
