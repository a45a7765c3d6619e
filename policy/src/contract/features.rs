//! `[[feature]]`: what the network sees.

use std::collections::BTreeMap;

use toml_input::{Sink, Table, Value};

use super::{Taken, filters, name, number_f32, range_f32};
use crate::bounds::{self, Box32, Inputs, Overflow};
use crate::catalogue;
use crate::expression::{self, Scope};
use crate::limits::MAX_FEATURES;
use crate::model::{Expr, Feature, Input, Interval};
use crate::names::Kind;

/// A feature whose bound is not known yet, with its place.
pub(crate) struct Unbounded<'a> {
    at: Value<'a>,
    feature: Feature,
}

/// The features and how many the contract lists, faulty ones included.
pub(crate) struct Features<'a> {
    pub list: Vec<Unbounded<'a>>,
    pub count: usize,
}

impl Features<'_> {
    /// The names of all, in their order; nothing if one is faulty, for the place of the others is not known then.
    pub fn names(&self) -> Vec<String> {
        let whole = self.list.len() == self.count;
        let names = self.list.iter().filter(|_| whole);
        names.map(|own| own.feature.name.clone()).collect()
    }
}

/// What the entries refer to.
pub(crate) struct Surroundings<'a> {
    pub signals: &'a [String],
    pub estimates: &'a [(String, Input)],
    pub parameters: &'a BTreeMap<String, f64>,
    pub period: Option<f64>,
    /// Whether there are several outputs; the names of their duties stand among the estimates.
    pub has_outputs: bool,
}

pub(crate) fn read<'a>(root: &mut Table<'a>, around: &Surroundings<'_>, faults: &mut Sink) -> Features<'a> {
    let mut features = Features {
        list: Vec::new(),
        count: 0,
    };
    let hint = "give one [[feature]] with name and source per network input, in the order of the inputs";
    let Some(value) = root.required("feature", hint, faults) else {
        return features;
    };
    let Some(items) = value.list("[[feature]] tables", faults) else {
        return features;
    };
    if !(1..=MAX_FEATURES).contains(&items.len()) {
        faults.push(value.fault(catalogue::count("features", items.len(), 1, MAX_FEATURES)));
        // not read one by one: hundreds of entries could be hundreds of faults
        return features;
    }
    features.count = items.len();
    let mut taken = Taken::new();
    for item in items {
        if let Some(feature) = one(&item, around, &mut taken, faults) {
            features.list.push(Unbounded { at: item, feature });
        }
    }
    features
}

fn one(item: &Value<'_>, around: &Surroundings<'_>, taken: &mut Taken, faults: &mut Sink) -> Option<Feature> {
    let mut section = item.table("[[feature]]", faults)?;
    let hint = "a feature needs a name: `name = \"e\"`";
    let name = section
        .required("name", hint, faults)
        .and_then(|v| name(&v, Kind::Feature, taken, faults));
    let hint = "an affine expression over signals and parameters: `source = \"v_ref - v_out\"`";
    let source = section
        .required("source", hint, faults)
        .and_then(|v| source(&v, around, faults));
    let chain = section
        .optional("filters")
        .map_or(Some(Vec::new()), |v| filters::read(&v, around.period, faults));
    let factor = section.optional("scale");
    let scale = factor.as_ref().map_or(Some(1.0), |v| number_f32(v, faults));
    if let (Some(value), Some(0.0)) = (&factor, scale) {
        let message = catalogue::out_of_range("scale", "0", "a number other than 0");
        faults.push(value.fault(message.hint("the feature would be constant")));
    }
    let offset = section.optional("offset").map_or(Some(0.0), |v| number_f32(&v, faults));
    let clip = section
        .optional("clip")
        .map_or(Some(None), |v| range_f32(&v, faults).map(Some));
    section.finish(faults);
    let (source, source_text) = source?;
    // filled in by `bounded`, when all signals are known
    let bound = Interval { low: 0.0, high: 0.0 };
    Some(Feature {
        name: name?,
        source,
        source_text,
        filters: chain?,
        scale: scale?,
        offset: offset?,
        clip: clip?,
        bound,
    })
}

/// An expression over signals, estimates and parameters, and its text.
pub(super) fn source(value: &Value<'_>, around: &Surroundings<'_>, faults: &mut Sink) -> Option<(Expr, String)> {
    let text = value.text(faults)?;
    let scope = Scope {
        signals: around.signals,
        estimates: around.estimates,
        parameters: around.parameters,
        has_outputs: around.has_outputs,
    };
    match expression::parse(text, &scope) {
        // blanks collapse: the text ends in comments and in the digest, and a line break must not
        Ok(expr) => Some((expr, text.split_ascii_whitespace().collect::<Vec<_>>().join(" "))),
        Err((range, message)) => {
            faults.push(value.fault_within(&range, message));
            None
        }
    }
}

/// Features with their bounds; a fault for each that could leave the format.
pub(crate) fn bounded(list: Vec<Unbounded<'_>>, inputs: &Inputs, period: f64, faults: &mut Sink) -> Vec<Feature> {
    let mut features = Vec::with_capacity(list.len());
    for Unbounded { at, mut feature } in list {
        match bound(&feature, inputs, period) {
            Ok(bound) => {
                feature.bound = bound.interval();
                features.push(feature);
            }
            Err(Overflow(magnitude)) => {
                let what = format!("feature `{}`", feature.name);
                faults.push(at.fault(catalogue::may_overflow(&what, magnitude)));
            }
        }
    }
    features
}

fn bound(feature: &Feature, inputs: &Inputs, period: f64) -> Result<Box32, Overflow> {
    let x = filtered(feature, inputs, period)?;
    bounds::observation(x, feature.scale, feature.offset, feature.clip)
}

/// Bound of a feature behind the last of its filters.
pub(super) fn filtered(feature: &Feature, inputs: &Inputs, period: f64) -> Result<Box32, Overflow> {
    let mut x = bounds::expression(&feature.source, inputs)?;
    for filter in &feature.filters {
        x = bounds::filter(filter, x, period)?;
    }
    Ok(x)
}
