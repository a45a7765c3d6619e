//! Signals whose size or sign says that they are not what their column is called, or not in its unit.

use plant::{Load, Parameters, Rectifier, Topology};
use toml_input::Message;

use super::channels::{CHANNEL_UNITS, CHANNELS, QUANTITIES};
use super::exchanged;
use super::load_unit;
use super::source::Source;
use super::steady::{self, Beside};
use super::still;
use super::{Record, V_IN};
use crate::ideal::{self, Ideal};
use crate::median::median;

/// A signal this many times larger or smaller than the model's is in another unit: units are a thousand apart, percent a hundred,
/// and operating points of one converter less than ten. About the geometric mean of ten and a hundred.
pub(super) const OTHER_UNIT: f64 = 30.0;
/// Two signals are exchanged if each is this far from its own size and (conventions: no bench is 60 % off its model in two signals at
/// once, and one that is 30 % off is no longer near) ...
const FAR: f64 = 1.6;
/// ... this near to the other's.
const NEAR: f64 = 1.3;
/// Duties and currents below this are too small to judge by: a ratio of two of them would be one of offsets. A
/// convention.
const LEAST: f64 = 0.02;

/// A signal has the turned sign if it lies on the other side of 0 by this share of its size. A convention: offsets of sensors are
/// smaller, and a negative mean current needs a load that feeds back.
const TURNED: f64 = 0.5;
/// Ratios of probes and shunts that are set wrong, and how near to one a signal has to be: 0.3 diode drops at 12 V make 8 %, and
/// no cause of the list makes a signal 1.8 times as large.
const PROBES: [f64; 4] = [2.0, 10.0, 0.5, 0.1];
const AS_PROBE: f64 = 1.1;
/// A load current that is off by more than this does not confirm what the load is: losses and two meters are less.
const AGREES: f64 = 1.2;
/// Share of the current that losses may take: of the voltage, that is, at the load. A diode of half a volt at 4 V makes a tenth.
const CURRENT_LOST: f64 = 0.15;
/// Share of its mean by which an inductor current has to lie outside of its ripple, at whichever instant it is sampled: losses of a
/// tenth are half of it, and a shunt of half the ratio makes more while the ripple is below 0.6 of the mean to either side.
const APART: f64 = 0.2;
/// The duty is taken for that of the other switch if the voltage is this near to what 1 - d makes, in units of the source, ...
const AS_OTHER: f64 = 0.05;
/// ... and this far from what d makes. Losses, a tenth of the source at most, lie between.
const NOT_AS_OWN: f64 = 0.2;
/// Where the duty moves and the voltage falls with it, levels have only to agree with 1 - d within this: losses of a tenth of the source.
const NEARLY_AS_OTHER: f64 = 0.12;
/// Slope of the voltages over those of an ideal converter: losses that grow with the load, which may step with the duty, change it by some
/// ten percent, and the wrong reading has the other sign.
const STEEP: std::ops::Range<f64> = 0.6..1.5;
/// Of two readings of one number the nearer is taken if it is this many times as near: a buck-boost's voltages at a duty of 0.4 are those
/// of a buck at 0.6 but for a tenth.
const CLEARLY: f64 = 3.0;
/// A voltage is that of another kind of converter within this share: losses of a tenth.
const AS_KIND: f64 = 0.1;

/// What is wrong with a record, as far as signs and sizes tell; signs first, since a turned signal has no size to speak of.
pub fn of(record: &Record, parameters: &Parameters, sources: &[Source; CHANNELS], duty: &Source) -> Vec<Message> {
    let turned = turned(record, parameters, sources);
    if !turned.is_empty() {
        return turned;
    }
    let labels: [&str; CHANNELS] = std::array::from_fn(|n| sources[n].label.as_str());
    if let Some(message) = load_unit::suspected(record, parameters) {
        return vec![message];
    }
    let mut odd = sized(record, parameters, &labels);
    if odd.is_empty() {
        odd = exchanged_voltages(record, parameters, sources);
    }
    if odd.is_empty() && !duty.stated {
        odd = other_duty(record, parameters, &duty.header);
    }
    if odd.is_empty() {
        odd = other_kind(record, parameters);
    }
    if odd.is_empty() {
        odd = other_load(record, parameters, sources);
    }
    if odd.is_empty() {
        odd = probes(record, parameters, sources);
    }
    odd
}

/// The two voltages in each other's columns.
fn exchanged_voltages(record: &Record, parameters: &Parameters, sources: &[Source; CHANNELS]) -> Vec<Message> {
    let [output, source] = [&sources[0], &sources[V_IN]];
    let is_stated = output.stated || source.stated;
    if is_stated || !exchanged::voltages(record, &Ideal::of(record, parameters)) {
        return Vec::new();
    }
    let [v_out, v_in] = [QUANTITIES[0], QUANTITIES[V_IN]];
    let map = measured::argument(&format!("{v_out}={},{v_in}={}", source.header, output.header));
    let [output_label, source_label] = [&output.label, &source.label];
    vec![
        Message::new(format!("the columns {output_label} and {source_label} look exchanged"))
            .found(format!(
                "{output_label} stands still at the source's voltage, and {source_label} goes with the duty"
            ))
            .hint(format!(
                "name them the right way in the header, or by a map: {map}; if they are right: {}",
                mapped(0, output, 1.0)
            )),
    ]
}

/// Signals on the wrong side of 0.
fn turned(record: &Record, parameters: &Parameters, sources: &[Source; CHANNELS]) -> Vec<Message> {
    let sizes = sizes(record, parameters);
    let is_drawn = drawn(record, parameters).is_some_and(|drawn| drawn > 0.0);
    let message = |n: usize| {
        let (size, found, source) = (sizes[n]?, median(record.measured[n].iter().copied()), &sources[n]);
        let is_current = n == 1 || n == 2;
        // in its valley the current of a synchronous leg at light load is negative by right
        let swings = n == 1 && !record.settled && !is_continuous(record, parameters);
        let is_turned = found < -TURNED * size && !source.stated && (is_drawn || !is_current) && !swings;
        let unit = CHANNEL_UNITS[n];
        is_turned.then(|| {
            Message::new(format!("{} has the turned sign", source.label))
                .found(format!("around {} {unit}", shown(found)))
                .expected(format!("about {} {unit} by the model", shown(size)))
                .hint(format!(
                    "was the sensor or the probe put in the other way round? turn it by a map: {}",
                    mapped(n, source, -1.0)
                ))
        })
    };
    (0..CHANNELS).filter_map(message).collect()
}

/// The argument that multiplies a channel by `factor`.
fn mapped(n: usize, source: &Source, factor: f64) -> String {
    measured::argument(&format!(
        "{}={}*{}",
        QUANTITIES[n],
        source.header,
        factor * source.scale
    ))
}

/// The median of the drawn current, with its sign, at the voltage that the duty makes.
fn drawn(record: &Record, parameters: &Parameters) -> Option<f64> {
    let ideal = Ideal::of(record, parameters);
    let each = record.load.iter().zip(&record.duty);
    Some(median(each.map(|(load, duty)| ideal::drawn(load, ideal.volts(*duty))))).filter(|drawn| drawn.is_finite())
}

/// Whether the inductor current surely never rests: a voltage then follows from the duty alone.
fn is_continuous(record: &Record, parameters: &Parameters) -> bool {
    let d = median(record.duty.iter().copied());
    drawn(record, parameters).is_some_and(|drawn| Ideal::of(record, parameters).never_rests(drawn, d))
}

/// Share of the rows in which the inductor current may rest from which on most samples of it may be 0: a record whose duty and load move may
/// be continuous at their medians and rest in half of its rows.
const MAY_REST: f64 = 0.1;

/// Whether the inductor current may rest in more than a few rows.
fn may_rest(record: &Record, parameters: &Parameters) -> bool {
    let ideal = Ideal::of(record, parameters);
    let may = |(load, duty): &(&Load, &f64)| !ideal.never_rests(ideal::drawn(load, ideal.volts(**duty)), **duty);
    let count = record.load.iter().zip(&record.duty).filter(may).count();
    count as f64 > MAY_REST * record.rows() as f64
}

/// What one in twenty values of a signal exceeds in size.
fn peak(values: &[f64]) -> f64 {
    let mut sizes: Vec<f64> = values.iter().filter(|v| v.is_finite()).map(|v| v.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    sizes.get(sizes.len() * 19 / 20).copied().unwrap_or(0.0)
}

/// A duty that is that of the lower switch.
fn other_duty(record: &Record, parameters: &Parameters, header: &str) -> Vec<Message> {
    let ideal = Ideal::of(record, parameters);
    let off = |volts: &dyn Fn(f64) -> f64| {
        let each = record.measured[0].iter().zip(&record.duty);
        // as a share of the source, where a boost's voltages lie further apart than a buck's
        median(each.map(|(v, d)| (v - volts(*d)).abs() / ideal.v_in))
    };
    let (own, other) = (off(&|d| ideal.volts(d)), off(&|d| ideal.volts(1.0 - d)));
    let kinds = [Topology::Buck, Topology::Boost, Topology::BuckBoost];
    let of_kind = |of: &Topology| off(&|d| of.voltage(ideal.v_in, d));
    let another = kinds.iter().filter(|of| **of != ideal.topology).map(of_kind);
    let is_turned = match still::slopes(record, &ideal) {
        // a voltage that falls where the duty rises is seen at any duty, at one half too
        Some(slopes) => {
            let falls = STEEP.contains(&slopes.other) && !STEEP.contains(&slopes.own);
            falls && other < NEARLY_AS_OTHER && other < own + AS_OTHER
        }
        // one duty is one number, which another kind of converter makes as well
        None => {
            let least = another.fold(f64::INFINITY, f64::min);
            own > NOT_AS_OWN && other < AS_OTHER && CLEARLY * other < least
        }
    };
    // the ripple is that of both
    if !(is_turned && is_continuous(record, parameters)) {
        return Vec::new();
    }
    let d = median(record.duty.iter().copied());
    let message = Message::new("the duty looks like that of the lower switch, 1 - d")
        .found(format!(
            "duties around {}, and voltages as with {}",
            shown(d),
            shown(1.0 - d)
        ))
        .hint(format!(
            "turn it by a map file: duty = {{ name = {header:?}, scale = -1.0, offset = 1.0 }} under [columns]; if it is right: \
             --map duty={header}*1"
        ));
    vec![message]
}

/// Voltages that another topology gives.
fn other_kind(record: &Record, parameters: &Parameters) -> Vec<Message> {
    let ideal = Ideal::of(record, parameters);
    let off = |of: Topology, beside: &dyn Fn(f64, f64) -> f64| {
        let each = record.measured[0].iter().zip(&record.duty);
        median(
            each.map(|(v, d)| (v - of.voltage(ideal.v_in, *d)).abs() / beside(of.voltage(ideal.v_in, *d), ideal.v_in)),
        )
    };
    // one duty is one number, which a wrong probe makes as well
    let duties = record
        .duty
        .iter()
        .fold((1.0f64, 0.0f64), |(low, high), d| (low.min(*d), high.max(*d)));
    if duties.1 - duties.0 < AS_OTHER {
        return Vec::new();
    }
    // a current that rests lifts the voltage over what its duty says; that of a buck up to its source
    let is_beyond = ideal.topology == Topology::Buck && median(record.measured[0].iter().copied()) > ideal.v_in;
    if parameters.converter.rectifier == Rectifier::Diode && may_rest(record, parameters) && !is_beyond {
        return Vec::new();
    }
    let is_other = |of: &Topology| *of != ideal.topology && off(*of, &|volts, _| volts) < AS_KIND;
    let fits = [Topology::Boost, Topology::BuckBoost, Topology::Buck]
        .into_iter()
        .find(is_other);
    let Some(other) = fits.filter(|_| off(ideal.topology, &|_, v_in| v_in) > NOT_AS_OWN) else {
        return Vec::new();
    };
    let (name, own) = (other.word(), ideal.topology.word());
    vec![
        Message::new(format!("the voltages are those of a {name}, and the model is a {own}"))
            .found(format!(
                "{} at a duty of {}",
                shown_in(median(record.measured[0].iter().copied()), "V"),
                shown(median(record.duty.iter().copied()))
            ))
            .expected(format!(
                "about {}",
                shown_in(ideal.volts(median(record.duty.iter().copied())), "V")
            ))
            .hint(format!(
                "is the record of another converter? If it is a {name}, `topology = {name:?}` under [converter] of the plant file"
            )),
    ]
}

/// A load that draws other currents than its setting, with all meters of one mind.
fn other_load(record: &Record, parameters: &Parameters, sources: &[Source; CHANNELS]) -> Vec<Message> {
    let sizes = sizes(record, parameters);
    let over = |n: usize| sizes[n].and_then(|_| Some(steady::beside(record, parameters, n)?.times));
    let (Some(v), Some(i_l), Some(i_out)) = (over(0), over(1), over(2)) else {
        return Vec::new();
    };
    let agreed = ratio(v, 1.0) < AS_PROBE && ratio(i_l, i_out) < AS_PROBE && ratio(i_out, 1.0) > FAR;
    if !agreed || sources.iter().any(|source| source.stated) || !is_continuous(record, parameters) {
        return Vec::new();
    }
    let found = typical(&record.measured[2]).unwrap_or(f64::NAN);
    let message = Message::new("the load that was set is not the load that was drawn")
        .found(format!("both meters show about {}", shown_in(found, "A")))
        .expected(format!("about {} at the set load", shown_in(sizes[2].unwrap_or(f64::NAN), "A")))
        .hint(format!(
            "correct r_load, i_load or p_load, by a map: --map r_load=COLUMN*{:.3}; or leave them out and let i_out be the load",
            1.0 / i_out
        ));
    vec![message]
}

/// One signal that is twice or ten times what it should be, while no other is.
fn probes(record: &Record, parameters: &Parameters, sources: &[Source; CHANNELS]) -> Vec<Message> {
    let sizes = sizes(record, parameters);
    let known = |n: usize| sizes[n].and_then(|_| steady::beside(record, parameters, n));
    let known: Vec<(usize, Beside)> = (0..CHANNELS).filter_map(|n| Some((n, known(n)?))).collect();
    // at another instant of its ripple a current would be another
    let is_off = |(n, own): &&(usize, Beside)| match n {
        1 => own.apart > APART,
        _ => ratio(own.times, 1.0) > FAR,
    };
    let off: Vec<(usize, Beside)> = known.iter().filter(is_off).copied().collect();
    let [(n, own)] = off[..] else { return Vec::new() };
    let (lost, ripple) = match n {
        1 => (CURRENT_LOST, own.ripple),
        _ => (AS_PROBE - 1.0, 0.0),
    };
    // what losses take off the mean is a larger share of a valley; and the instant may be another than the plant file says
    let is_probe = |probe: &f64| {
        ratio(own.times, *probe) < 1.0 + lost * (1.0 + ripple) || ratio(own.times_mean, *probe) < 1.0 + lost
    };
    let probe = PROBES.into_iter().find(is_probe);
    // a current alone may be off because the load is, and a voltage alone because the source is, but no source is ten times another
    let is_alone = known.len() == 1 && !(n == 0 && probe.is_some_and(|probe| ratio(probe, 1.0) > 5.0));
    let confirmed = n == 3 || is_continuous(record, parameters) && !is_alone;
    let is_current = n == 1 || n == 2;
    // the other current has to be as it should: where both are off, the load is another
    let agrees = |(other, own): &(usize, Beside)| match other {
        1 => own.apart <= APART,
        _ => ratio(own.times, 1.0) < AGREES,
    };
    let sure = confirmed && (!is_current || known.iter().any(|one| one.0 + n == 3 && agrees(one)));
    let (Some(probe), true, false) = (probe, sure, sources[n].stated) else {
        return Vec::new();
    };
    let (source, unit) = (&sources[n], CHANNEL_UNITS[n]);
    let message = Message::new(format!("{} is {probe} times what the model has", source.label))
        .found(format!("around {} {unit}", shown(own.times * own.expected)))
        .expected(format!(
            "about {} {unit}, as the other signals have it",
            shown(own.expected)
        ))
        .hint(format!(
            "a probe or shunt of another ratio? {}; if it is right as it is: {}",
            mapped(n, source, 1.0 / probe),
            mapped(n, source, 1.0)
        ));
    vec![message]
}

/// Signals in another unit, and two that are exchanged.
fn sized(record: &Record, parameters: &Parameters, labels: &[&str; CHANNELS]) -> Vec<Message> {
    let sizes = sizes(record, parameters);
    let known: Vec<(usize, f64, f64)> = (0..CHANNELS)
        .filter_map(|n| Some((n, sizes[n]?, typical(&record.measured[n])?)))
        .collect();
    for (n, (a, size_a, found_a)) in known.iter().enumerate() {
        for (b, size_b, found_b) in &known[n + 1..] {
            let apart = ratio(*found_a, *size_a) > FAR && ratio(*found_b, *size_b) > FAR;
            if apart && ratio(*found_a, *size_b) < NEAR && ratio(*found_b, *size_a) < NEAR {
                let (a, b) = (labels[*a], labels[*b]);
                let message = Message::new(format!("the columns {a} and {b} look exchanged"));
                let found = format!("{a} around {}, {b} around {}", shown(*found_a), shown(*found_b));
                let expected = format!("about {} and {}", shown(*size_a), shown(*size_b));
                return vec![
                    message
                        .found(found)
                        .expected(expected)
                        .hint("name them the right way in the header, or by a map: --map v_out=COLUMN,..."),
                ];
            }
        }
    }
    // of a converter that steps up the inductor carries many times what is drawn: then the kind is wrong, and no unit
    let steps_up = |found: f64| {
        let (drawn, duty) = (typical(&record.measured[2]), typical(&record.duty));
        let inductor = drawn.zip(duty).map(|(drawn, duty)| drawn / (1.0 - duty));
        inductor.is_some_and(|inductor| ratio(found, inductor) < FAR)
    };
    // where the current may rest it is sampled as 0 or nearly, in most rows perhaps: too small is no size there
    let rests = !record.settled && may_rest(record, parameters);
    let is_off = |(n, size, found): &&(usize, f64, f64)| {
        match *n == 1 && found < size {
            // where it does not rest its valleys may be small: the unit is that of its peaks
            true => !rests && peak(&record.measured[1]) * OTHER_UNIT < *size,
            false => ratio(*found, *size) > OTHER_UNIT && !(*n == 1 && steps_up(*found)),
        }
    };
    let off = known.iter().filter(is_off);
    let as_drawn =
        |(n, _, found): &(usize, f64, f64)| *n == 1 && sizes[2].is_some_and(|drawn| ratio(*found, drawn) < NEAR);
    let exchanged = known.iter().any(as_drawn);
    let message = |(n, size, found): &(usize, f64, f64)| {
        // small in most rows and as large as the load in some: an inductor current that is sampled where it rests
        let swings = peak(&record.measured[2]) * FAR > *size;
        if *n == 2 && exchanged && found < size && swings {
            let (inductor, load) = (labels[1], labels[2]);
            return Message::new(format!("the columns {inductor} and {load} look exchanged"))
                .found(format!(
                    "{load} around {}, and {inductor} as steady as a load",
                    shown(*found)
                ))
                .expected(format!("around {} A of load by the model", shown(*size)))
                .hint("name them the right way in the header, or by a map: --map i_l=COLUMN,i_out=COLUMN");
        }
        let (name, unit) = (labels[*n], CHANNEL_UNITS[*n]);
        Message::new(format!("{name} is not in {unit}, or not of this converter"))
            .found(format!("around {}", shown(*found)))
            .expected(format!("around {} {unit} by the model", shown(*size)))
            .hint(format!(
                "a unit may follow the name: `{name} [m{unit}]`; or give scale = ... in the map file"
            ))
    };
    off.map(message).collect()
}

/// What the model has on average: nothing where that is too small or unknown.
pub(super) fn sizes(record: &Record, parameters: &Parameters) -> [Option<f64>; CHANNELS] {
    let ideal = Ideal::of(record, parameters);
    let duty = typical(&record.duty).filter(|duty| *duty > LEAST);
    let v_o = duty.map(|duty| ideal.volts(duty)).filter(|volts| volts.is_finite());
    let drawn = v_o.and_then(|v| {
        let each: Vec<f64> = record
            .load
            .iter()
            .map(|l| l.current + l.conductance * v + l.power / v)
            .collect();
        typical(&each).filter(|i| *i > LEAST)
    });
    let inductor = drawn.zip(duty).map(|(drawn, duty)| ideal.inductor(drawn, duty));
    [v_o, inductor, drawn, Some(ideal.v_in)]
}

/// The middle size of a signal; nothing if it is empty or 0.
pub fn typical(values: &[f64]) -> Option<f64> {
    let sizes: Vec<f64> = values.iter().filter(|v| v.is_finite()).map(|v| v.abs()).collect();
    let middle = if sizes.is_empty() { 0.0 } else { median(sizes) };
    (middle > 0.0).then_some(middle)
}

pub(super) fn ratio(a: f64, b: f64) -> f64 {
    (a / b).max(b / a)
}

fn shown_in(value: f64, unit: &str) -> String {
    report::quantity(value, unit, 3)
}

pub(super) fn shown(value: f64) -> String {
    report::quantity(value, "", 3)
}
