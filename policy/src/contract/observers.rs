//! `[[observer]]`: models of the converter whose estimates stand beside the signals (contract section 2b).

use toml_input::{Sink, Table, Value};

use super::{Taken, name, number_f32, range_f32};
use crate::bounds::{self, Inputs, Overflow};
use crate::catalogue;
use crate::limits::MAX_OBSERVERS;
use crate::model::{Circuit, Estimate, Gains, Hold, Input, InputVoltage, Interval, Observer, OnTime, Signal};
use crate::names::Kind;

/// The observers and what expressions may call; a faulty one leaves its names, lest every expression that uses them be
/// reported too.
#[derive(Default)]
pub(crate) struct Observers<'a> {
    /// Names of estimates, and what they stand for.
    pub estimates: Vec<(String, Input)>,
    /// Index into the contract's list, so that positions hold even if one before is faulty.
    pub list: Vec<(Value<'a>, Option<Observer>)>,
}

/// What the entries refer to.
pub(crate) struct Surroundings<'a> {
    pub names: &'a [String],
    pub signals: &'a [Option<Signal>],
    pub duties: Duties<'a>,
}

/// The duties that can drive an observer.
#[derive(Clone, Copy)]
pub(crate) enum Duties<'a> {
    /// There is one, and no name for it.
    One,
    /// Names of several outputs.
    Named(&'a [String]),
    /// The list of outputs is faulty, and has left its fault.
    Unknown,
}

impl Observers<'_> {
    /// All of them, if none is faulty.
    pub fn whole(&self) -> Option<Vec<Observer>> {
        self.list.iter().map(|(_, observer)| observer.clone()).collect()
    }
}

pub(crate) fn read<'a>(
    root: &mut Table<'a>,
    around: &Surroundings<'_>,
    taken: &mut Taken,
    faults: &mut Sink,
) -> Observers<'a> {
    let mut observers = Observers::default();
    let Some(value) = root.optional("observer") else {
        return observers;
    };
    let Some(items) = value.list("[[observer]] tables", faults) else {
        return observers;
    };
    if items.len() > MAX_OBSERVERS {
        faults.push(value.fault(catalogue::count("observers", items.len(), 0, MAX_OBSERVERS)));
        return observers;
    }
    for (index, item) in items.into_iter().enumerate() {
        let written = item.peek("name").and_then(|value| value.as_text().map(str::to_owned));
        for (name, estimate) in written
            .iter()
            .flat_map(|name| estimates_of(&item).map(move |estimate| (name, estimate)))
        {
            let input = Input::Estimate(index, estimate);
            observers.estimates.push((format!("{name}_{}", estimate.word()), input));
        }
        let observer = one(&item, around, taken, faults);
        observers.list.push((item, observer));
    }
    observers
}

/// Whatever else may be wrong with an entry: the surplus is there with a voltage to hold.
fn estimates_of(item: &Value<'_>) -> impl Iterator<Item = Estimate> {
    let has_surplus = item.peek("hold").is_some();
    let surplus = has_surplus.then_some(Estimate::Surplus);
    Estimate::STATE.into_iter().chain(surplus)
}

fn one(item: &Value<'_>, around: &Surroundings<'_>, taken: &mut Taken, faults: &mut Sink) -> Option<Observer> {
    let mut section = item.table("[[observer]]", faults)?;
    let hint = "an observer needs a name: with `name = \"model\"` its estimates are model_current, model_voltage and model_bias";
    let name = section
        .required("name", hint, faults)
        .and_then(|value| estimates(item, &value, taken, faults));
    let topology = word(&mut section, "topology", &Circuit::EACH, Circuit::Buck, faults);
    let carrier = word(&mut section, "carrier", &OnTime::EACH, OnTime::Trailing, faults);
    let inductance = part(
        &mut section,
        "inductance",
        "L of the converter in henry: `inductance = 2e-3`",
        faults,
    );
    let capacitance = part(
        &mut section,
        "capacitance",
        "C of the converter in farad: `capacitance = 150e-6`",
        faults,
    );
    let hint = "V of the converter, a number or the name of a signal: `input_voltage = 200.0`";
    let input_voltage = section
        .required("input_voltage", hint, faults)
        .and_then(|value| input_voltage(&value, around, faults));
    let hint = "the signal of the output voltage: `output_voltage = \"v_out\"`";
    let output_voltage = signal(&mut section, "output_voltage", hint, around, faults);
    let hint = "the signal of the load current: `load_current = \"i_out\"`";
    let load_current = signal(&mut section, "load_current", hint, around, faults);
    let hint = "periods from a measurement to the duty that is computed of it: `compute_delay = 1` where it waits for the next period, \
                0 where it acts in the same";
    let compute_delay = section
        .required("compute_delay", hint, faults)
        .and_then(|value| value.integer(0..=1, faults));
    let output = driven(item, &mut section, around.duties, faults);
    let gains = gains(&mut section, faults);
    let hint = "what the estimated current is clamped to, in A: `current = [0.0, 20.0]` with a diode, from a negative current with a synchronous leg";
    let current = section
        .required("current", hint, faults)
        .and_then(|value| range_f32(&value, faults));
    let hint = "what the bias is clamped to, in V at the switch node: `bias = [-5.0, 5.0]`";
    let bias = section
        .required("bias", hint, faults)
        .and_then(|value| around_zero(&value, faults));
    let hold = section.optional("hold");
    section.finish(faults);
    let (output_voltage, load_current) = (output_voltage?, load_current?);
    let (topology, input_voltage, current) = (topology?, input_voltage?, current?);
    let loads = around.signals.get(load_current)?.as_ref()?.range;
    let hold = match hold {
        None => None,
        Some(value) => Some(held(&value, topology, input_voltage, [current, loads], faults)?),
    };
    Some(Observer {
        name: name?,
        topology,
        carrier: carrier?,
        hold,
        inductance: inductance?,
        capacitance: capacitance?,
        input_voltage,
        output_voltage,
        load_current,
        compute_delay: compute_delay?,
        output: output?,
        gains: gains?,
        current,
        voltage: around.signals.get(output_voltage)?.as_ref()?.range,
        bias: bias?,
    })
}

/// The output whose duty drives it; the only one without being named.
fn driven(item: &Value<'_>, section: &mut Table<'_>, duties: Duties<'_>, faults: &mut Sink) -> Option<usize> {
    let written = section.optional("duty");
    let text = match &written {
        Some(value) => Some(value.text(faults)?),
        None => None,
    };
    match (duties, written, text) {
        (Duties::One, None, _) => Some(0),
        (Duties::One, Some(value), _) => {
            faults.push(value.fault(catalogue::one_duty()));
            None
        }
        (Duties::Unknown, ..) => None,
        (Duties::Named(names), Some(value), Some(text)) => {
            let found = names.iter().position(|name| name == text);
            // the name that is meant may be the faulty one, which has left its fault
            let is_whole = names.iter().all(|name| !name.is_empty());
            if found.is_none() && is_whole {
                let names: Vec<&str> = names.iter().map(String::as_str).collect();
                faults.push(value.fault(catalogue::unknown_name("output", text, &names)));
            }
            found
        }
        (Duties::Named(names), ..) => {
            faults.push(item.fault(catalogue::whose_duty(names)));
            None
        }
    }
}

/// The observer's name, if none of those of its estimates is taken.
fn estimates(item: &Value<'_>, value: &Value<'_>, taken: &mut Taken, faults: &mut Sink) -> Option<String> {
    let own = name(value, Kind::Observer, taken, faults)?;
    for estimate in estimates_of(item) {
        let called = format!("{own}_{}", estimate.word());
        if let Err(message) = super::taken_once(&called, Kind::Estimate, taken) {
            faults.push(value.fault(message));
            return None;
        }
    }
    Some(own)
}

/// One of some words, or the usual one.
fn word<T: Copy>(
    section: &mut Table<'_>,
    key: &'static str,
    each: &[(&'static str, T)],
    usual: T,
    faults: &mut Sink,
) -> Option<T> {
    let Some(value) = section.optional(key) else {
        return Some(usual);
    };
    let text = value.text(faults)?;
    let found = each.iter().find(|(word, _)| *word == text);
    if found.is_none() {
        let words: Vec<&str> = each.iter().map(|(word, _)| *word).collect();
        faults.push(value.fault(catalogue::unknown_name(key, text, &words)));
    }
    found.map(|(_, of)| *of)
}

/// The voltage to hold, with what the surplus is clamped to.
fn held(
    value: &Value<'_>,
    topology: Circuit,
    source: InputVoltage,
    [current, loads]: [Interval; 2],
    faults: &mut Sink,
) -> Option<Hold> {
    let voltage = value.positive(faults)?;
    let whole = match (topology, source) {
        (Circuit::Buck, _) => {
            faults.push(value.fault(catalogue::no_surplus(
                "a buck converter",
                "its output receives the whole current: a source `model_current - i_out` says it",
            )));
            return None;
        }
        (Circuit::Boost, _) => voltage,
        (Circuit::BuckBoost, InputVoltage::Constant(volts)) => volts + voltage,
        (Circuit::BuckBoost, InputVoltage::Signal(_)) => {
            faults.push(value.fault(catalogue::no_surplus(
                "a buck-boost converter whose input voltage is a signal",
                "the output's share of the current would need a division: give the input voltage as a number, or leave `hold` out",
            )));
            return None;
        }
    };
    let share = 1.0 / whole;
    let start = match source {
        InputVoltage::Constant(volts) => whole / volts,
        InputVoltage::Signal(_) => 1.0,
    };
    if !super::fits_f32(share) || !super::fits_f32(start) {
        faults.push(value.fault(catalogue::not_in_f32("hold", voltage)));
        return None;
    }
    Some(Hold {
        voltage,
        share,
        start,
        // a share of 0 to 1 of the current, less the load
        range: Interval {
            low: current.low.min(0.0) - loads.high,
            high: current.high.max(0.0) - loads.low,
        },
    })
}

/// A coil or a capacitor.
fn part(section: &mut Table<'_>, key: &'static str, hint: &str, faults: &mut Sink) -> Option<f64> {
    section
        .required(key, hint, faults)
        .and_then(|value| value.positive(faults))
}

fn signal(
    section: &mut Table<'_>,
    key: &'static str,
    hint: &str,
    around: &Surroundings<'_>,
    faults: &mut Sink,
) -> Option<usize> {
    let value = section.required(key, hint, faults)?;
    named(&value, around, faults)
}

fn named(value: &Value<'_>, around: &Surroundings<'_>, faults: &mut Sink) -> Option<usize> {
    let text = value.text(faults)?;
    let index = around.names.iter().position(|name| name == text);
    if index.is_none() {
        let names = around.names.iter().map(String::as_str).filter(|name| !name.is_empty());
        faults.push(value.fault(catalogue::unknown_name("signal", text, &names.collect::<Vec<_>>())));
    }
    index
}

fn input_voltage(value: &Value<'_>, around: &Surroundings<'_>, faults: &mut Sink) -> Option<InputVoltage> {
    if value.as_text().is_some() {
        return named(value, around, faults).map(InputVoltage::Signal);
    }
    let volts = value.positive(faults)?;
    if super::fits_f32(volts) {
        return Some(InputVoltage::Constant(volts));
    }
    faults.push(value.fault(catalogue::not_in_f32("input_voltage", volts)));
    None
}

fn gains(section: &mut Table<'_>, faults: &mut Sink) -> Option<Gains> {
    let hint = "what one volt of error corrects: `gains = { current = 0.07, voltage = 0.1, bias = 0.002 }`";
    let mut table = section.required("gains", hint, faults)?.table("gains", faults)?;
    let [current, voltage, bias] = Estimate::STATE.map(|estimate| {
        let value = table.required(estimate.word(), hint, faults)?;
        number_f32(&value, faults)
    });
    table.finish(faults);
    Some(Gains {
        current: current?,
        voltage: voltage?,
        bias: bias?,
    })
}

/// A range with 0 in it: the bias starts there.
fn around_zero(value: &Value<'_>, faults: &mut Sink) -> Option<Interval> {
    let range = range_f32(value, faults)?;
    if (range.low..=range.high).contains(&0.0) {
        return Some(range);
    }
    let found = format!("{} to {}", range.low, range.high);
    faults.push(value.fault(catalogue::out_of_range(
        "bias",
        &found,
        "a range with 0 in it, where the bias starts",
    )));
    None
}

/// A fault for each observer that could leave the format; whether there is none.
pub(crate) fn bounded(observers: &Observers<'_>, inputs: &Inputs, period: f64, faults: &mut Sink) -> bool {
    let mut fits = true;
    for (at, observer) in &observers.list {
        let Some(observer) = observer else { continue };
        if let Err(Overflow(magnitude)) = bounds::observer(observer, inputs, period) {
            let what = format!("the prediction of observer `{}`", observer.name);
            faults.push(at.fault(catalogue::may_overflow(&what, magnitude)));
            fits = false;
        }
    }
    fits
}
