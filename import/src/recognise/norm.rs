//! Batch norms into the dense layer beside them, in binary64.
//!
//! ```text
//!   net.0 dense   net.1 norm   net.2 (relu)   net.3 dense      norm after dense:   s W,  s (b - mean) + beta
//!   net.0 dense   net.1 (relu) net.2 norm     net.3 dense      norm before dense:  W s,  b + W (beta - s mean)
//! ```
//!
//! Numbers leave room for what has no tensors. Where they do not tell on which side the activation stands, nothing is
//! folded: both ways are exact, and only one is the trainer's.

use toml_input::Message;

use super::Refusal;
use super::names::{Norm, Parsed};
use crate::network::Layer;

/// Folds every norm.
pub(crate) fn fold(parsed: &mut Parsed) -> Result<(), Refusal> {
    for norm in std::mem::take(&mut parsed.norms) {
        let beside = |offset: i64| {
            let wanted = neighbour(&norm.stem, offset)?;
            parsed.layers.iter().position(|layer| layer.name == wanted)
        };
        let fits = |index: Option<usize>, width: fn(&Layer) -> usize| {
            index.filter(|&index| parsed.layers.get(index).map(width) == Some(norm.mean.len()))
        };
        let before = fits(beside(-1), |layer| layer.outputs);
        let behind = fits(beside(1), |layer| layer.inputs);
        let (index, is_before) = match (before, behind) {
            (Some(index), None) => (index, true),
            (None, Some(index)) => (index, false),
            _ => return Err(Refusal::of(&norm.stem, no_place())),
        };
        if let Some(layer) = parsed.layers.get_mut(index) {
            if is_before {
                into_outputs(layer, &norm);
            } else {
                into_inputs(layer, &norm);
            }
            let name = &layer.name;
            parsed.said.push(format!(
                "batch norm `{}` is folded into `{name}`, in f64, rounded once",
                norm.stem
            ));
        }
    }
    Ok(())
}

/// `net.1` and -1 give `net.0`.
fn neighbour(stem: &str, offset: i64) -> Option<String> {
    let start = stem.rfind(|c: char| !c.is_ascii_digit()).map_or(0, |at| at + 1);
    let (folder, number) = stem.split_at_checked(start)?;
    // only members of a sequence count their activations, too: `fc1` and `bn1` do not
    let number: i64 = folder.ends_with('.').then(|| number.parse().ok())??;
    Some(format!("{folder}{}", number.checked_add(offset)?))
}

fn scale(norm: &Norm, index: usize) -> (f64, f64) {
    let at = |values: &[f64]| values.get(index).copied().unwrap_or_default();
    let scale = at(&norm.gamma) / (at(&norm.var) + norm.epsilon).sqrt();
    (scale, at(&norm.beta) - at(&norm.mean) * scale)
}

fn into_outputs(layer: &mut Layer, norm: &Norm) {
    let inputs = layer.inputs.max(1);
    for (output, row) in layer.weights.chunks_exact_mut(inputs).enumerate() {
        let (scale, shift) = scale(norm, output);
        row.iter_mut().for_each(|weight| *weight *= scale);
        if let Some(bias) = layer.bias.get_mut(output) {
            *bias = *bias * scale + shift;
        }
    }
}

fn into_inputs(layer: &mut Layer, norm: &Norm) {
    let inputs = layer.inputs.max(1);
    for (output, row) in layer.weights.chunks_exact_mut(inputs).enumerate() {
        let mut moved = 0.0;
        for (input, weight) in row.iter_mut().enumerate() {
            let (scale, shift) = scale(norm, input);
            moved += *weight * shift;
            *weight *= scale;
        }
        if let Some(bias) = layer.bias.get_mut(output) {
            *bias += moved;
        }
    }
}

fn no_place() -> Message {
    Message::new("the names do not say on which side of the activation this batch norm stands")
        .found("a batch norm without a numbered dense layer on exactly one side")
        .expected("members of a torch.nn.Sequential, whose numbers count the activations, too")
        .hint("save an nn.Sequential, or fold it in Python: torch.nn.utils.fusion.fuse_linear_bn_eval(linear, norm)")
}
