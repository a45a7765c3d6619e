//! `[network]`: which tensors, which activations.

use toml_input::{At, Fault, Message, Sink, Table, Value};

use crate::activation::Activation;
use crate::catalogue;
use crate::known_answers;
use crate::limits::MAX_LAYERS;
use crate::weights::golden::Limits;

/// The activations behind the hidden layers, as given.
pub(crate) enum Hidden<'a> {
    /// Not given.
    Missing,
    /// Given, but faulty.
    Faulty,
    /// The same behind each hidden layer.
    Same(Activation),
    /// One per hidden layer.
    Each(Vec<Activation>, Value<'a>),
}

/// What `[network]` says beside the file names.
pub(crate) struct Network<'a> {
    section: Value<'a>,
    pub hidden: Hidden<'a>,
    pub prefix: Option<At<String>>,
    pub layers: Option<Vec<At<String>>>,
    pub transpose: Option<bool>,
    pub bias: bool,
    pub golden: Limits,
}

pub(crate) fn read<'a>(root: &mut Table<'a>, faults: &mut Sink) -> Option<Network<'a>> {
    let hint = "give [network] with `weights` and `hidden_activation`";
    let at = root.required("network", hint, faults)?;
    let mut section = at.table("[network]", faults)?;
    let hint = "the network's tensors: `weights = \"weights.safetensors\"`";
    if let Some(value) = section.required("weights", hint, faults) {
        value.text(faults);
    }
    if let Some(value) = section.optional("golden") {
        value.text(faults);
    }
    let hidden = section
        .optional("hidden_activation")
        .map_or(Hidden::Missing, |v| hidden(&v, faults));
    let prefix = section.optional("prefix").and_then(|v| owned(&v, faults));
    let layers = section.optional("layers").and_then(|v| layers(&v, faults));
    let transpose = section.optional("transpose").and_then(|v| v.boolean(faults));
    let bias = section
        .optional("bias")
        .is_none_or(|v| v.boolean(faults) != Some(false));
    let tolerance = section
        .optional("golden_tolerance")
        .and_then(|v| tolerance(&v, faults))
        .unwrap_or(known_answers::TOLERANCE);
    let decisions = section.optional("golden_decisions").and_then(|v| {
        share(
            &v,
            "golden_decisions",
            "golden actions that the numeric format may change",
            faults,
        )
    });
    let duty_error = section.optional("golden_duty").and_then(|v| {
        share(
            &v,
            "golden_duty",
            "the duty's range that the numeric format may cost",
            faults,
        )
    });
    let outside = section
        .optional("golden_outside")
        .and_then(|v| share(&v, "golden_outside", "golden observations that may be left out", faults));
    section.finish(faults);
    Some(Network {
        section: at,
        hidden,
        prefix,
        layers,
        transpose,
        bias,
        golden: Limits {
            tolerance,
            decisions,
            duty_error,
            outside: outside.unwrap_or(0.0),
        },
    })
}

impl Network<'_> {
    /// A fault at a place in the contract.
    pub fn fault<T>(&self, at: &At<T>, message: Message) -> Fault {
        self.section.source().fault(&at.span, message)
    }

    /// One activation per layer; the last is the identity.
    pub fn activations(&self, layers: usize, faults: &mut Sink) -> Option<Vec<Activation>> {
        let hidden = layers.saturating_sub(1);
        let mut list = match &self.hidden {
            Hidden::Faulty => return None,
            // a single layer has nothing to choose; otherwise nothing is assumed, since a wrong curve gives plausible
            // numbers
            Hidden::Missing if hidden == 0 => Vec::new(),
            Hidden::Missing => {
                let message = catalogue::missing_key("hidden_activation", "[network]", &hint());
                faults.push(self.section.fault(message));
                return None;
            }
            Hidden::Same(activation) => vec![*activation; hidden],
            Hidden::Each(list, at) if list.len() != hidden => {
                let expected = format!("{hidden}, one per hidden layer");
                faults.push(at.fault(catalogue::wrong_length("hidden_activation", list.len(), &expected)));
                return None;
            }
            Hidden::Each(list, _) => list.clone(),
        };
        // section 6: the last layer gives its Q values as they are
        list.push(Activation::Identity);
        Some(list)
    }
}

fn hidden<'a>(value: &Value<'a>, faults: &mut Sink) -> Hidden<'a> {
    let Some(items) = value.as_list() else {
        return activation(value, faults).map_or(Hidden::Faulty, Hidden::Same);
    };
    let list: Vec<_> = items.iter().map(|item| activation(item, faults)).collect();
    match list.into_iter().collect() {
        Some(list) => Hidden::Each(list, value.clone()),
        None => Hidden::Faulty,
    }
}

fn activation(value: &Value<'_>, faults: &mut Sink) -> Option<Activation> {
    if value.is_table() {
        let mut section = value.table("hidden_activation", faults)?;
        let slope = section.required(
            "leaky_relu",
            "the slope for negative values: { leaky_relu = 0.01 }",
            faults,
        );
        section.finish(faults);
        let slope = slope?;
        let number = slope.number(faults)?;
        // the slope must stay inside (0, 1) when rounded, or the activation would be another one
        if (f32::MIN_POSITIVE..1.0).contains(&(number as f32)) {
            return Some(Activation::LeakyRelu { slope: number });
        }
        faults.push(slope.fault(catalogue::out_of_range(
            "leaky_relu",
            &number.to_string(),
            "more than 0, less than 1",
        )));
        return None;
    }
    let text = value.text(faults)?;
    if let Some(activation) = Activation::find(text) {
        return Some(activation);
    }
    let known: Vec<&str> = Activation::plain().map(Activation::word).collect();
    let with_parameter = Activation::EACH.iter().find(|each| each.word() == text);
    faults.push(
        value.fault(match with_parameter.and_then(|each| Some((each, each.parameter()?))) {
            Some((each, (parameter, _))) => {
                catalogue::missing_key(parameter, text, &format!("write {}", each.written()))
            }
            // a word for another function is no slip of the pen
            None if FOREIGN.contains(&text.to_ascii_lowercase().as_str()) => {
                catalogue::foreign_activation(text, &known.join(", "))
            }
            None => catalogue::not_one_of("hidden_activation", text, &known),
        }),
    );
    None
}

/// Activations of other frameworks that no output computes.
const FOREIGN: [&str; 14] = [
    "celu",
    "elu",
    "exponential",
    "gelu",
    "hard_sigmoid",
    "hardswish",
    "log_sigmoid",
    "mish",
    "selu",
    "sigmoid",
    "silu",
    "softmax",
    "softplus",
    "swish",
];

/// All activations as they are written.
fn written() -> String {
    let written: Vec<String> = Activation::EACH.iter().map(|each| each.written()).collect();
    written.join(", ")
}

/// What to write where nothing is written.
fn hint() -> String {
    format!(
        "weights do not say it: hidden_activation = {}, or an array with one per hidden layer",
        written()
    )
}

fn owned(value: &Value<'_>, faults: &mut Sink) -> Option<At<String>> {
    value.text(faults).map(|text| At {
        value: text.to_owned(),
        span: value.span().clone(),
    })
}

fn layers(value: &Value<'_>, faults: &mut Sink) -> Option<Vec<At<String>>> {
    let items = value.list("an array of layer names: [\"fc1\", \"fc2\", \"out\"]", faults)?;
    if !(1..=MAX_LAYERS).contains(&items.len()) {
        faults.push(value.fault(catalogue::count("layers", items.len(), 1, MAX_LAYERS)));
        return None;
    }
    items.iter().map(|item| owned(item, faults)).collect()
}

/// A share of the golden vectors, 0..1.
fn share(value: &Value<'_>, key: &str, of: &str, faults: &mut Sink) -> Option<f64> {
    let number = value.number(faults)?;
    if (0.0..=1.0).contains(&number) {
        return Some(number);
    }
    let expected = format!("0 to 1: the share of {of}");
    faults.push(value.fault(catalogue::out_of_range(key, &number.to_string(), &expected)));
    None
}

fn tolerance(value: &Value<'_>, faults: &mut Sink) -> Option<f64> {
    let number = value.number(faults)?;
    if number > 0.0 && number < 1.0 {
        return Some(number);
    }
    let expected = "more than 0, less than 1: |Q - golden| relative to the largest |Q|";
    faults.push(value.fault(catalogue::out_of_range(
        "golden_tolerance",
        &number.to_string(),
        expected,
    )));
    None
}
