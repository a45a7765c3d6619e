//! `continuous` in `[actions]`: one output of the network as a duty.

use toml_input::{Sink, Table, Value};

use super::{number_f32, range_f32};
use crate::activation::Activation;
use crate::catalogue;
use crate::model::{Continuous, Squash};

/// What to write, for those who have an action space in mind.
const HINT: &str = "duty = scale * squash(y) + offset: a tanh actor for duties from lo to hi has { squash = \"tanh\", scale = (hi - lo) / 2, \
                    offset = (hi + lo) / 2 }, a clipped mean of duties { clip = [lo, hi] }";

pub(super) fn read(value: &Value<'_>, faults: &mut Sink) -> Option<Continuous> {
    let mut section = value.table("continuous", faults)?;
    let before = faults.count();
    let (curve, clip) = (section.optional("squash"), section.optional("clip"));
    let scale = section.optional("scale").map(|v| scale(&v, faults));
    let offset = section.optional("offset").map(|v| number_f32(&v, faults));
    let squash = squash(&section, curve, clip, faults);
    section.finish(faults);
    if faults.count() > before {
        return None;
    }
    let head = Continuous {
        squash: squash?,
        scale: scale.unwrap_or(Some(1.0))?,
        offset: offset.unwrap_or(Some(0.0))?,
    };
    // in both arithmetics: features and bounds take a duty for at most 1, and the limits come behind
    let ends = [head.ends_64(), head.ends_32()].concat();
    match ends.into_iter().find(|end| !(0.0..=1.0).contains(end)) {
        None => Some(head),
        Some(end) => {
            faults.push(value.fault(catalogue::duty_range("scale * squash + offset at one end", end).hint(HINT)));
            None
        }
    }
}

fn squash(section: &Table<'_>, curve: Option<Value<'_>>, clip: Option<Value<'_>>, faults: &mut Sink) -> Option<Squash> {
    match (curve, clip) {
        (Some(curve), None) => self::curve(&curve, faults).map(Squash::Curve),
        (None, Some(clip)) => range_f32(&clip, faults).map(Squash::Clip),
        (both, _) => {
            // the arms above took exactly one: it is both or none
            let count = if both.is_some() { 2 } else { 0 };
            let message = catalogue::exactly_one_of("continuous", "`squash`, `clip`", count);
            faults.push(section.fault(message.hint(HINT)));
            None
        }
    }
}

pub(super) fn curve(value: &Value<'_>, faults: &mut Sink) -> Option<Activation> {
    let text = value.text(faults)?;
    let curves = || Activation::plain().filter(|each| each.range().is_some());
    if let Some(curve) = curves().find(|curve| curve.word() == text) {
        return Some(curve);
    }
    let known: Vec<&str> = curves().map(Activation::word).collect();
    faults.push(value.fault(catalogue::not_one_of("squash", text, &known).hint(HINT)));
    None
}

/// A factor that keeps its sign and size in binary32, and is not 0: such a head would command one duty.
pub(super) fn scale(value: &Value<'_>, faults: &mut Sink) -> Option<f64> {
    let number = number_f32(value, faults)?;
    if number != 0.0 {
        return Some(number);
    }
    let message = catalogue::out_of_range("scale", "0", "another number: with 0 every output is one duty");
    faults.push(value.fault(message));
    None
}
