//! From files to a policy that holds: section by section, then what must fit between them.
//!
//! ```text
//! head  signals  features  network  actions  mapping  fallback  limits     sections: each reads all of its keys
//!         │         │         └─ weights ◄─ sizes of features and actions
//!         └─ Inputs ┴─► bounded features ─► bounded layers, golden vectors  what must fit between them
//!                 └───► bounded mapping
//! ```
//!
//! A section that is faulty gives `None` or less, and leaves a fault; what needs it is then left out instead of being
//! reported as well. So nothing ends early, and a user sees every fault that stands on its own.

use toml_input::{Document, Sink, Table};

use crate::bounds::{self, Inputs, Overflow};
use crate::catalogue;
use crate::contract::{
    actions, features, head, mapping, network, observers, outputs, protection, residual, schedule, signals,
};
use crate::digests;
use crate::faults::Faults;
use crate::limits::MAX_FEATURES;
use crate::model::{
    Digests, Fallback, Feature, Golden, Head, Interval, Layer, Limits, Mapping, Output, Policy, Signal,
};
use crate::notes::{left_out, on_converters, on_duties, unused};
use crate::raw::RawPolicy;
use crate::weights::{self, Weights};

/// Checks everything that can be checked before code is generated.
///
/// # Errors
/// All faults of all files together: of form, of single values, and of parts that do not fit each other.
pub fn check(raw: RawPolicy) -> Result<Policy, Faults> {
    let mut faults = Sink::new();
    let policy = whole(&raw, &mut faults);
    faults.append(raw.faults.clone());
    // only if a part is missing that left no fault, which would be a mistake of ours
    let incomplete = || raw.contract.source().name.fault(catalogue::incomplete());
    faults
        .conclude(policy, incomplete)
        .map_err(|faults| raw.rejected(faults))
}

/// What the sections of a contract say, each on its own.
struct Sections<'a> {
    head: head::Head,
    signals: signals::Signals,
    observers: observers::Observers<'a>,
    features: features::Features<'a>,
    network: Option<network::Network<'a>>,
    decided: Decided,
}

/// From the network's outputs to the hardware.
struct Decided {
    /// What the outputs mean, and how many the contract lists.
    head: Head,
    outputs: usize,
    mapping: Option<Option<Mapping>>,
    fallback: Option<Fallback>,
    limits: Option<Limits>,
    /// Whether its sections were asked for.
    is_read: bool,
}

impl Default for Decided {
    fn default() -> Self {
        Self {
            head: Head::Choice(Vec::new()),
            outputs: 0,
            mapping: None,
            fallback: None,
            limits: None,
            is_read: false,
        }
    }
}

/// The outputs of a contract with several; none of one with one.
fn several(head: &Head) -> &[Output] {
    match head {
        Head::Several(outputs) => outputs,
        Head::Choice(_) | Head::Residual(_) | Head::Continuous(_) | Head::Schedule(_) => &[],
    }
}

fn sections<'a>(raw: &'a RawPolicy, faults: &mut Sink) -> Sections<'a> {
    let mut root = raw.contract.root();
    let mut taken = Vec::new();
    let head = head::read(&mut root, &mut taken, faults);
    let signals = signals::read(&mut root, &mut taken, faults);
    // before the observers, which name the output that drives them
    let several = outputs::names(&mut root, &mut taken, raw.several, faults);
    let names = several.as_ref().map(outputs::Outputs::names);
    let around = observers::Surroundings {
        names: &signals.names,
        signals: &signals.list,
        duties: match &names {
            Some(names) => observers::Duties::Named(names),
            None if outputs::are_given(&raw.contract) => observers::Duties::Unknown,
            None => observers::Duties::One,
        },
    };
    let observers = observers::read(&mut root, &around, &mut taken, faults);
    let mut estimates = observers.estimates.clone();
    if let Some(several) = &several {
        estimates.extend(several.remembered.iter().cloned());
    }
    let around = features::Surroundings {
        signals: &signals.names,
        estimates: &estimates,
        parameters: &head.parameters,
        period: head.sample_period,
        has_outputs: several.is_some(),
    };
    let features = features::read(&mut root, &around, faults);
    let network = network::read(&mut root, faults);
    let decided = match several {
        Some(several) => decided_several(raw, &mut root, several, &around, faults),
        // a faulty list of outputs has left its fault
        None if outputs::are_given(&raw.contract) => Decided::default(),
        None => decided_one(raw, &mut root, &around, &features.names(), faults),
    };
    // all sections have been asked for by now: a key that is left is one that nobody knows
    if several_is_sound(raw, &decided) {
        root.finish(faults);
    }
    Sections {
        head,
        signals,
        observers,
        features,
        network,
        decided,
    }
}

/// A faulty list of outputs leaves sections unread: they are no unknown keys.
fn several_is_sound(raw: &RawPolicy, decided: &Decided) -> bool {
    decided.is_read || !outputs::are_given(&raw.contract)
}

fn decided_one(
    raw: &RawPolicy,
    root: &mut Table<'_>,
    around: &features::Surroundings<'_>,
    features: &[String],
    faults: &mut Sink,
) -> Decided {
    let actions = actions::read(root, around, features, faults);
    let mapping = outputs::mapped(root, raw.mapping.as_ref(), around.signals, faults);
    let fallback = protection::fallback(root, faults);
    let limits = protection::limits(root, fallback, faults);
    Decided {
        head: residual::limited(actions.head, limits.map(|limits| limits.duty)),
        outputs: actions.outputs,
        mapping,
        fallback,
        limits,
        is_read: true,
    }
}

fn decided_several(
    raw: &RawPolicy,
    root: &mut Table<'_>,
    several: outputs::Outputs<'_>,
    around: &features::Surroundings<'_>,
    faults: &mut Sink,
) -> Decided {
    let (read, fallback) = outputs::read(root, several, around, &raw.mappings, faults);
    let outputs = read.outputs.unwrap_or_default();
    Decided {
        limits: outputs.first().map(|first| first.limits),
        head: Head::Several(outputs),
        outputs: read.columns,
        mapping: Some(None),
        fallback,
        is_read: true,
    }
}

fn whole(raw: &RawPolicy, faults: &mut Sink) -> Option<Policy> {
    let read = sections(raw, faults);
    let (head, signals, observers, features) = (read.head, read.signals, read.observers, read.features);
    let (network, mapping) = (read.network, read.decided.mapping);
    let (mut decided, output_count) = (read.decided.head, read.decided.outputs);
    let (fallback, limits) = (read.decided.fallback, read.decided.limits);
    let feature_count = features.count;
    let duties = decided.duties();
    // a count of 0 is a faulty list: the widths of the weights cannot be judged by it
    let sizes = (feature_count > 0 && output_count > 0).then_some((feature_count, output_count));
    let mut weights = network
        .as_ref()
        .zip(raw.weights.as_ref())
        .and_then(|(n, file)| weights::read(file, n, sizes, faults));
    let signals: Option<Vec<Signal>> = signals.list.into_iter().collect();
    let whole = observers.whole();
    let inputs = match (&signals, &whole, &limits, &fallback) {
        (Some(read), Some(whole), Some(limits), Some(fallback)) => {
            Some(Inputs::new(read, whole, &duties, several(&decided), limits, fallback))
        }
        _ => None,
    };
    let bounded = match (&inputs, head.sample_period) {
        (Some(inputs), Some(period)) => {
            bound_law(raw, &decided, inputs, faults);
            match observers::bounded(&observers, inputs, period, faults) {
                true => features::bounded(features.list, inputs, period, faults),
                false => Vec::new(),
            }
        }
        _ => Vec::new(),
    };
    // a layer has to know every input: bounds of the others would be another network's
    let complete = feature_count > 0 && bounded.len() == feature_count;
    let known: &[Feature] = if complete { &bounded } else { &[] };
    bound_gains(raw, &mut decided, known, (inputs.as_ref(), head.sample_period), faults);
    if let (true, Some(weights)) = (complete, weights.as_mut()) {
        bound_layers(raw, known, &mut weights.layers, faults);
        bound_outputs(raw, &decided, &weights.layers, faults);
    }
    if let Some(inputs) = &inputs {
        bound_mappings(raw, mapping.as_ref(), &decided, (inputs, &duties), faults);
    }
    // with sizes that the network does not have, every vector would be a fault of its own
    let Weights { layers, mut notes } = weights?;
    let golden = golden(raw, network.as_ref(), sizes, &decided, known, faults);
    notes.extend(golden.as_ref().and_then(Option::as_ref).and_then(left_out));
    let mapped = mapping.as_ref().and_then(Option::as_ref);
    notes.extend(on_converters(signals.as_deref().unwrap_or_default()));
    notes.extend(unused(
        &head.parameters,
        signals.as_deref().unwrap_or_default(),
        whole.as_deref().unwrap_or_default(),
        &decided,
        known,
        mapped,
    ));
    // from here on whatever is missing has left its fault
    let limits = limits?;
    notes.extend(on_outputs(&decided, &limits, &duties, mapped, known));
    let mut policy = Policy {
        name: head.name?,
        sample_period: head.sample_period?,
        numeric_format: head.numeric_format,
        parameters: head.parameters,
        signals: signals?,
        observers: whole?,
        features: complete.then_some(bounded)?,
        layers,
        head: decided,
        mapping: mapping?,
        limits,
        fallback: fallback?,
        golden: golden?,
        digests: Digests {
            weights: String::new(),
            contract: String::new(),
            mapping: None,
        },
        notes,
        files: raw.files.clone(),
    };
    // last, because they are taken of all the rest
    policy.digests = digests::of(&policy);
    Some(policy)
}

/// `None` if faulty, `Some(None)` without golden vectors.
fn golden(
    raw: &RawPolicy,
    network: Option<&network::Network<'_>>,
    sizes: Option<(usize, usize)>,
    head: &Head,
    features: &[Feature],
    faults: &mut Sink,
) -> Option<Option<Golden>> {
    let Some(file) = &raw.golden else { return Some(None) };
    let (count, outputs) = sizes?;
    let several: Vec<_> = several(head).iter().map(weights::golden::OutputShape::of).collect();
    let shape = weights::golden::Shape {
        features: count,
        outputs,
        head,
        several: &several,
    };
    weights::golden::read(file, shape, features, network?.golden, faults).map(Some)
}

fn bound_layers(raw: &RawPolicy, features: &[Feature], layers: &mut [Layer], faults: &mut Sink) {
    let mut inputs: Vec<Interval> = Vec::with_capacity(MAX_FEATURES);
    inputs.extend(features.iter().map(|feature| feature.bound));
    for layer in layers {
        match bounds::layer(&inputs, &layer.weights, &layer.bias, layer.activation) {
            Ok(bounds) => layer.bounds = bounds,
            Err((output, Overflow(magnitude))) => {
                let what = format!("output {output} of layer `{}`", layer.name);
                let file = raw
                    .weights
                    .as_ref()
                    .map_or(&raw.contract.source().name, |file| &file.name);
                faults.push(file.tensor_fault(&layer.name, catalogue::may_overflow(&what, magnitude)));
                // the layers behind would be bounded from numbers that do not hold
                return;
            }
        }
        inputs.clone_from(&layer.bounds);
    }
}

/// Where the contract schedules gains.
fn gains(raw: &RawPolicy) -> Option<toml_input::Value<'_>> {
    raw.contract.peek(&["actions", "gains"])
}

fn bound_gains(
    raw: &RawPolicy,
    head: &mut Head,
    features: &[Feature],
    around: (Option<&Inputs>, Option<f64>),
    faults: &mut Sink,
) {
    if let ((Some(inputs), Some(period)), Some(at)) = (around, gains(raw)) {
        schedule::bounded(head, features, inputs, period, &at, faults);
    }
}

fn bound_outputs(raw: &RawPolicy, head: &Head, layers: &[Layer], faults: &mut Sink) {
    if let (Some(last), Some(at)) = (layers.last(), gains(raw)) {
        schedule::outputs_bounded(head, &last.bounds, &at, faults);
    }
}

fn bound_law(raw: &RawPolicy, head: &Head, inputs: &Inputs, faults: &mut Sink) {
    if let Some(base) = raw.contract.peek(&["actions", "base"]) {
        residual::bounded(head, inputs, &base, faults);
    }
}

/// The notes on one of several outputs, each with its name.
/// What is odd about the duties of the only output, or of each.
fn on_outputs(
    head: &Head,
    limits: &Limits,
    duties: &[f64],
    mapping: Option<&Mapping>,
    known: &[Feature],
) -> Vec<String> {
    match several(head) {
        [] => on_duties(limits, duties, mapping, known),
        outputs => outputs.iter().flat_map(|output| of_output(output, known)).collect(),
    }
}

fn of_output(output: &Output, features: &[Feature]) -> Vec<String> {
    let notes = on_duties(&output.limits, &output.head.duties(), output.mapping.as_ref(), features);
    let named = notes
        .into_iter()
        .map(|note| format!("output `{}`: {note}", output.name));
    named.collect()
}

fn bound_mappings(
    raw: &RawPolicy,
    mapping: Option<&Option<Mapping>>,
    head: &Head,
    (inputs, duties): (&Inputs, &[f64]),
    faults: &mut Sink,
) {
    if let Some(Some(mapping)) = mapping {
        bound_mapping(raw, (mapping, raw.mapping.as_ref()), inputs, duties, faults);
    }
    for (output, document) in several(head).iter().zip(&raw.mappings) {
        if let Some(mapping) = &output.mapping {
            bound_mapping(raw, (mapping, document.as_ref()), inputs, &output.head.duties(), faults);
        }
    }
}

fn bound_mapping(
    raw: &RawPolicy,
    (mapping, document): (&Mapping, Option<&Document>),
    inputs: &Inputs,
    duties: &[f64],
    faults: &mut Sink,
) {
    let Some(current) = inputs.signal(mapping.load_current) else {
        return;
    };
    let duties = Interval {
        // no duty is negative: a box from 0 holds them all
        low: 0.0,
        high: duties.iter().fold(0.0, |high, duty| duty.max(high)),
    };
    if let Err(magnitude) = mapping::magnitude_fits(mapping, current, duties) {
        let file = document.map_or(&raw.contract.source().name, |document| &document.source().name);
        faults.push(file.fault(catalogue::may_overflow("the mapped duty", magnitude)));
    }
}
