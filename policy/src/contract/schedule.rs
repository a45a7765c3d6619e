//! `gains` in `[actions]`: the outputs of the network as the gains of one affine law (contract section 7c).

use toml_input::{Sink, Table, Value};

use super::actions::Actions;
use super::features::{self, Surroundings};
use super::{continuous, number_f32, range_f32, residual};
use crate::bounds::{self, Box32, Inputs, Overflow};
use crate::catalogue;
use crate::limits::MAX_GAINS;
use crate::model::{Expr, Factor, Feature, Gain, Head, Interval, Schedule, Source, Squash};

/// What a gain looks like.
const HINT: &str = "a gain is { source = \"v_ref - v_out\", squash = \"tanh\", scale = 0.01, offset = 0.012 }: gain = scale * squash(y) + offset, \
                    times the source, or times a feature that is named by `feature`";

pub(super) fn read(
    gains: &Value<'_>,
    (base, dead_zone): (Option<&Value<'_>>, Option<&Value<'_>>),
    around: &Surroundings<'_>,
    features: &[String],
    faults: &mut Sink,
) -> Option<Actions> {
    let law = match base {
        Some(value) => residual::source(value, around, faults),
        None => Some(Source {
            tree: Expr::Constant(0.0),
            text: "0".to_owned(),
        }),
    };
    if let (Some(value), None) = (dead_zone, base) {
        let hint = "where nothing is added the base alone is commanded, and without one that is a duty of 0: `base = \"v_ref / 200\"`";
        faults.push(value.fault(catalogue::needs_other("dead_zone", "base").hint(hint)));
    }
    let zone = dead_zone.map_or(Some(Vec::new()), |value| residual::still(value, around, faults));
    let items = gains.list("an array of gains, one for each output", faults)?;
    if !(1..=MAX_GAINS).contains(&items.len()) {
        faults.push(gains.fault(catalogue::count("gains", items.len(), 1, MAX_GAINS)));
        return None;
    }
    // all of them, so that each reports its own faults
    let list: Vec<Option<Gain>> = items.iter().map(|item| gain(item, around, features, faults)).collect();
    let gains: Option<Vec<Gain>> = list.into_iter().collect();
    Some(Actions {
        head: Head::Schedule(Schedule {
            base: law?,
            base_bound: Interval { low: 0.0, high: 0.0 },
            gains: gains?,
            dead_zone: zone?,
            // both are filled in later: by `bounded`, and by `residual::limited` when the limits have been read
            limits: Interval { low: 0.0, high: 1.0 },
        }),
        outputs: items.len(),
    })
}

fn gain(item: &Value<'_>, around: &Surroundings<'_>, features: &[String], faults: &mut Sink) -> Option<Gain> {
    let mut section = item.table("gains", faults)?;
    let before = faults.count();
    let (source, feature) = (section.optional("source"), section.optional("feature"));
    let (curve, clip) = (section.optional("squash"), section.optional("clip"));
    let scale = section.optional("scale").map(|v| continuous::scale(&v, faults));
    let offset = section.optional("offset").map(|v| number_f32(&v, faults));
    let given = section.optional("limits");
    let limits = given.as_ref().map(|v| range_f32(v, faults));
    let factor = factor(&section, source, feature, (around, features), faults);
    let squash = match (&curve, &clip) {
        (Some(curve), None) => continuous::curve(curve, faults).map(|curve| Some(Squash::Curve(curve))),
        (None, Some(clip)) => range_f32(clip, faults).map(|clip| Some(Squash::Clip(clip))),
        (None, None) => Some(None),
        (Some(_), Some(_)) => {
            faults.push(section.fault(catalogue::exactly_one_of("a gain", "`squash`, `clip`", 2).hint(HINT)));
            None
        }
    };
    section.finish(faults);
    if faults.count() > before {
        return None;
    }
    let gain = Gain {
        factor: factor?,
        squash: squash?,
        scale: scale.unwrap_or(Some(1.0))?,
        offset: offset.unwrap_or(Some(0.0))?,
        limits: limits.map_or(Some(None), |limits| limits.map(Some))?,
        // filled in by `bounded`, when all signals are known
        factor_bound: Interval { low: 1.0, high: 1.0 },
    };
    if gain.squash.is_none() && gain.limits.is_none() {
        faults.push(item.fault(catalogue::unbounded_gain().hint(HINT)));
        return None;
    }
    // limits beside what scale and offset reach would leave one gain, whatever the network says
    if gain.ends().low == gain.ends().high {
        let at = given.as_ref().unwrap_or(item);
        faults.push(at.fault(catalogue::one_gain(gain.ends().low)));
        return None;
    }
    Some(gain)
}

fn factor(
    section: &Table<'_>,
    source: Option<Value<'_>>,
    feature: Option<Value<'_>>,
    (around, features): (&Surroundings<'_>, &[String]),
    faults: &mut Sink,
) -> Option<Factor> {
    match (source, feature) {
        (Some(source), None) => residual::source(&source, around, faults).map(Factor::Source),
        (None, None) => Some(Factor::One),
        (None, Some(feature)) => {
            let name = feature.text(faults)?;
            // a feature that is faulty has its fault already
            let known: Vec<&str> = features.iter().map(String::as_str).collect();
            let index = known.iter().position(|own| *own == name);
            if index.is_none() && !known.is_empty() {
                faults.push(feature.fault(catalogue::unknown_name("feature", name, &known)));
            }
            index.map(Factor::Feature)
        }
        (Some(_), Some(_)) => {
            faults.push(section.fault(catalogue::exactly_one_of("a gain", "`source`, `feature`", 2).hint(HINT)));
            None
        }
    }
}

/// Fills in the bounds of base and factors; a fault if a product or a partial sum could leave the format.
pub(crate) fn bounded(
    head: &mut Head,
    features: &[Feature],
    inputs: &Inputs,
    period: f64,
    at: &Value<'_>,
    faults: &mut Sink,
) {
    let Head::Schedule(head) = head else { return };
    if let Err((what, Overflow(magnitude))) = sums(head, features, inputs, period) {
        faults.push(at.fault(catalogue::may_overflow(&what, magnitude)));
    }
}

fn sums(head: &mut Schedule, features: &[Feature], inputs: &Inputs, period: f64) -> Result<(), (String, Overflow)> {
    let base = bounds::expression(&head.base.tree, inputs);
    let mut sum = base.map_err(|overflow| (format!("`{}` in [actions]", head.base.text), overflow))?;
    head.base_bound = sum.interval();
    for (index, gain) in head.gains.iter_mut().enumerate() {
        let within = |overflow| (format!("the sum of the law up to gain {index}"), overflow);
        let factor = match &gain.factor {
            Factor::Source(source) => bounds::expression(&source.tree, inputs),
            // faulty features leave faults of their own
            Factor::Feature(own) => match features.get(*own) {
                Some(feature) => features::filtered(feature, inputs, period),
                None => return Ok(()),
            },
            Factor::One => Ok(Box32::point(1.0)),
        };
        let factor = factor.map_err(within)?;
        gain.factor_bound = factor.interval();
        let product = Box32::nearest(gain.ends()).times(factor).map_err(within)?;
        sum = sum.add(product).map_err(within)?;
    }
    Ok(())
}

/// A fault if an output that nothing squashes could leave the format on its way to a gain.
pub(crate) fn outputs_bounded(head: &Head, outputs: &[Interval], at: &Value<'_>, faults: &mut Sink) {
    let Head::Schedule(head) = head else { return };
    for (index, (gain, output)) in head.gains.iter().zip(outputs).enumerate() {
        if gain.squash.is_some() {
            continue;
        }
        let scaled = Box32::nearest(*output).scale(gain.scale);
        let shifted = scaled.and_then(|scaled| scaled.add(Box32::point(gain.offset as f32)));
        if let Err(Overflow(magnitude)) = shifted {
            faults.push(at.fault(catalogue::may_overflow(
                &format!("gain {index} before its limits"),
                magnitude,
            )));
        }
    }
}
