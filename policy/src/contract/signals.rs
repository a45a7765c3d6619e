//! `[[signal]]`: what is measured.

use toml_input::{Message, Sink, Table, Value};

use super::{Taken, name, number_f32, range_f32};
use crate::catalogue;
use crate::limits::{MAX_ADC_CODE, MAX_SIGNALS, MAX_UNIT_CHARS};
use crate::model::{Adc, Interval, Signal};
use crate::names::Kind;

/// The signals in order; a faulty one leaves its name, lest every expression that uses it be reported too.
pub(crate) struct Signals {
    pub names: Vec<String>,
    /// Index into the contract's list, so that positions hold even if one before is faulty.
    pub list: Vec<Option<Signal>>,
    pub adc: Vec<bool>,
}

pub(crate) fn read(root: &mut Table<'_>, taken: &mut Taken, faults: &mut Sink) -> Signals {
    let mut signals = Signals {
        names: Vec::new(),
        list: Vec::new(),
        adc: Vec::new(),
    };
    let hint = "give one [[signal]] with name, unit and range per measured quantity";
    let Some(value) = root.required("signal", hint, faults) else {
        return signals;
    };
    let Some(items) = value.list("[[signal]] tables", faults) else {
        return signals;
    };
    if !(1..=MAX_SIGNALS).contains(&items.len()) {
        faults.push(value.fault(catalogue::count("signals", items.len(), 1, MAX_SIGNALS)));
        return signals;
    }
    for item in items {
        let Some(mut section) = item.table("[[signal]]", faults) else {
            // without a table there is no name to keep
            continue;
        };
        let hint = "a signal needs a name: `name = \"v_out\"`";
        let name_value = section.required("name", hint, faults);
        let name = name_value.as_ref().and_then(|v| name(v, Kind::Signal, taken, faults));
        let unit = section
            .optional("unit")
            .map_or(Some(String::new()), |v| unit(&v, faults));
        let hint = "the plausible range in physical units, outside of which a sample is held: `range = [0.0, 250.0]`";
        let range = section.required("range", hint, faults);
        let adc_value = section.optional("adc");
        signals.adc.push(adc_value.is_some());
        let interval = range.as_ref().and_then(|v| range_f32(v, faults));
        let adc = adc_value.map(|v| adc(&v, interval, name.as_deref().unwrap_or("signal"), faults));
        section.finish(faults);
        // the name as it stands there, fit or not
        let written = name_value.as_ref().and_then(Value::as_text);
        signals.names.push(written.unwrap_or_default().to_owned());
        let usable = name.zip(unit).zip(interval).filter(|_| adc != Some(None));
        signals.list.push(usable.map(|((name, unit), range)| Signal {
            name,
            unit,
            range,
            adc: adc.flatten(),
        }));
    }
    signals
}

/// A unit as it may stand in a comment.
fn unit(value: &Value<'_>, faults: &mut Sink) -> Option<String> {
    let text = value.text(faults)?;
    let printable = |c: char| !c.is_control() && !matches!(c, '"' | '\'' | '\\' | '`') && is_visible(c);
    let fit = text.chars().count() <= MAX_UNIT_CHARS && text.chars().all(printable);
    if fit
        // ends and beginnings of comments in C and XML, the end of CDATA, and trigraphs, which C90 still reads
        && !["*/", "/*", "//", "]]>", "--", "??"]
            .iter()
            .any(|mark| text.contains(mark))
    {
        return Some(text.to_owned());
    }
    faults.push(value.fault(catalogue::bad_unit(text)));
    None
}

/// Not a line separator, a direction mark or another invisible character.
fn is_visible(c: char) -> bool {
    // such a character can make a comment show another text than the compiler reads
    !matches!(c, '\u{2028}' | '\u{2029}' | '\u{200b}'..='\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2060}'..='\u{206f}' | '\u{feff}')
}

/// Largest converter.
// codes are exact in f32 up to here
const MAX_ADC_BITS: u64 = 24;

fn adc(value: &Value<'_>, range: Option<Interval>, name: &str, faults: &mut Sink) -> Option<Adc> {
    let mut section = value.table("adc", faults)?;
    let gain = section.required(
        "gain",
        "physical unit per code: `adc = { gain = 0.0625, offset = 0.0 }`",
        faults,
    );
    let offset = section.required("offset", "physical value at code 0", faults);
    let bits_value = section.optional("bits");
    let bits = bits_value.as_ref().map(|v| v.integer(1..=MAX_ADC_BITS, faults));
    let factor = gain.as_ref().and_then(|v| number_f32(v, faults));
    let offset = offset.and_then(|v| number_f32(&v, faults));
    section.finish(faults);
    let (gain, factor, offset) = (gain?, factor?, offset?);
    if factor == 0.0 {
        let message = catalogue::out_of_range("gain", "0", "a number other than 0");
        faults.push(gain.fault(message.hint("every code would mean the same value")));
        return None;
    }
    let range = range?;
    // a negative gain turns the ends round, so that neither is the larger
    let (a, b) = ((range.low - offset) / factor, (range.high - offset) / factor);
    if a.abs().max(b.abs()) > MAX_ADC_CODE {
        faults.push(value.fault(catalogue::adc_codes(name, a.min(b), a.max(b))));
        return None;
    }
    let bits = match bits {
        Some(bits) => Some(u32::try_from(bits?).ok()?),
        None => None,
    };
    if let Some((bits, value)) = bits.zip(bits_value) {
        let last = ((1_u64 << bits) - 1) as f64;
        if let Some(message) = saturation(range, [offset, factor * last + offset], factor, name) {
            faults.push(value.fault(message));
            return None;
        }
    }
    Some(Adc {
        gain: factor,
        offset,
        bits,
    })
}

/// What is wrong with the range of a converter that shows `ends` at its first and its last code.
fn saturation(range: Interval, ends: [f64; 2], gain: f64, name: &str) -> Option<Message> {
    let [first, last] = ends;
    let shown = Interval {
        low: first.min(last),
        high: first.max(last),
    };
    if range.high.min(shown.high) - range.low.max(shown.low) < gain.abs() {
        return Some(catalogue::adc_shows_nothing(name, shown));
    }
    let within = |x: f64| range.low <= x && x <= range.high;
    // 0 at the first code is a measurement: of a voltage of 0, say
    [last, first]
        .into_iter()
        .find(|end| within(*end) && *end != 0.0)
        .map(|end| catalogue::adc_saturates(name, end, gain.abs(), range))
}
