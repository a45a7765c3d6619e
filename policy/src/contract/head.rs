//! Top level of `policy.toml`: name, sample period, numeric format, parameters.

use std::collections::BTreeMap;

use toml_input::{Sink, Table, Value};

use super::{Taken, name, taken_once};
use crate::catalogue;
use crate::limits;
use crate::model::NumericFormat;
use crate::names::{self, Kind};

/// What stands at the top level.
pub(crate) struct Head {
    pub name: Option<String>,
    pub sample_period: Option<f64>,
    pub numeric_format: NumericFormat,
    pub parameters: BTreeMap<String, f64>,
}

pub(crate) fn read(root: &mut Table<'_>, taken: &mut Taken, faults: &mut Sink) -> Head {
    let hint = "name the controller: `name = \"buck\"`; files and symbols begin with it";
    let name = root
        .required("name", hint, faults)
        // a space of its own: nothing in an expression is called by the policy's name
        .and_then(|v| name(&v, Kind::Policy, &mut Vec::new(), faults));
    let hint = "give the control period in seconds: `sample_period = 1e-4`";
    let sample_period = root
        .required("sample_period", hint, faults)
        .and_then(|v| period(&v, faults));
    let numeric_format = match root.optional("numeric_format") {
        Some(value) => format(&value, faults),
        None => NumericFormat::F32,
    };
    let parameters = root
        .optional("parameters")
        .map(|v| parameters(&v, taken, faults))
        .unwrap_or_default();
    Head {
        name,
        sample_period,
        numeric_format,
        parameters,
    }
}

fn period(value: &Value<'_>, faults: &mut Sink) -> Option<f64> {
    let period = value.number(faults)?;
    if (limits::MIN_SAMPLE_PERIOD..=limits::MAX_SAMPLE_PERIOD).contains(&period) {
        return Some(period);
    }
    let mut message = catalogue::out_of_range("sample_period", &format!("{period} s"), "1e-9 s to 10 s");
    if period > limits::MAX_SAMPLE_PERIOD {
        message = message.hint(format!(
            "write the period in seconds: {} for {period} us, {} for {period} Hz",
            catalogue::tidy(period * 1e-6),
            catalogue::tidy(1.0 / period)
        ));
    }
    faults.push(value.fault(message));
    None
}

fn format(value: &Value<'_>, faults: &mut Sink) -> NumericFormat {
    let Some(text) = value.text(faults) else {
        // any format will do: the fault refuses the policy, and the rest is to be read all the same
        return NumericFormat::F32;
    };
    NumericFormat::find(text).unwrap_or_else(|| {
        let known = NumericFormat::ALL.map(NumericFormat::name);
        faults.push(value.fault(catalogue::not_supported_yet("numeric_format", text, &known)));
        NumericFormat::F32
    })
}

/// Lists of the contract, which TOML takes for parameters if they are written below `[parameters]`.
const LISTS: [&str; 3] = ["signal", "feature", "observer"];

fn parameters(value: &Value<'_>, taken: &mut Taken, faults: &mut Sink) -> BTreeMap<String, f64> {
    let mut parameters = BTreeMap::new();
    for (key, value) in value.pairs(faults).unwrap_or_default() {
        if value.as_list().is_some() && LISTS.contains(&key.value.as_str()) {
            faults.push(
                value
                    .source()
                    .fault(&key.span, catalogue::list_in_parameters(&key.value)),
            );
            continue;
        }
        let kind = Kind::Parameter;
        let objection =
            names::objection(&key.value, kind).map(|hint| catalogue::bad_name(kind.word(), &key.value, &hint));
        let named = match objection {
            Some(message) => Err(message),
            None => taken_once(&key.value, kind, taken),
        };
        faults.extend(named.err().map(|message| value.source().fault(&key.span, message)));
        // a faulty parameter keeps its name, lest every expression that uses it be reported too
        let number = value.number(faults).unwrap_or(1.0);
        parameters.insert(key.value.clone(), number);
    }
    if parameters.len() > limits::MAX_PARAMETERS {
        faults.push(value.fault(catalogue::count(
            "parameters",
            parameters.len(),
            0,
            limits::MAX_PARAMETERS,
        )));
    }
    parameters
}
