//! Limits of activations that no layer reaches.

use policy::{Activation, Policy};

use super::{Edited, arguments, bits};

/// The largest magnitude that a limited activation may see, whatever the observation; nothing where the first layer is unbounded.
fn reach(policy: &Policy, of: impl Fn(Activation) -> Option<f64>) -> Option<f64> {
    let layers = &policy.layers;
    let first = layers
        .first()
        .filter(|layer| layer.activation == Activation::Softsign)?;
    let mut bounds = vec![1.0; first.outputs];
    let mut reach: f64 = 0.0;
    for layer in &layers[1..] {
        let rows = layer.weights.chunks(layer.inputs).zip(&layer.bias);
        let sums = rows.map(|(row, bias)| {
            let products = row.iter().zip(&bounds).map(|(w, bound)| f64::from(w.abs()) * bound);
            f64::from(bias.abs()) + products.sum::<f64>()
        });
        let sums: Vec<f64> = sums.collect();
        let greatest = sums.iter().fold(0.0, |greatest: f64, x| greatest.max(*x));
        // of the sum the share that the function is given
        reach = reach.max(of(layer.activation).map_or(0.0, |share| share * greatest));
        bounds = match layer.activation {
            Activation::Softsign | Activation::Tanh => vec![1.0; layer.outputs],
            // below in magnitude, or -1 where the sum is far below 0
            Activation::Elu => sums.iter().map(|x| x.max(1.0)).collect(),
            Activation::Relu | Activation::LeakyRelu { .. } | Activation::Silu | Activation::Identity => sums,
            _ => return None,
        };
    }
    Some(reach)
}

/// The largest magnitude that the tanh sees: of a sum, or of half of it.
fn reach_of_tanh(policy: &Policy) -> Option<f64> {
    reach(policy, |activation| match activation {
        Activation::Tanh => Some(1.0),
        Activation::Elu | Activation::Silu => Some(0.5),
        _ => None,
    })
}

pub fn limit_unreached(edited: &Edited) -> bool {
    let ["x", limit] = arguments(edited.line(), "_limit")[..] else {
        return false;
    };
    let of_silu = |activation| (activation == Activation::Silu).then_some(1.0);
    let reach = match (edited.within("tanh"), edited.within("silu")) {
        (true, _) => reach_of_tanh(edited.policy),
        (_, true) => reach(edited.policy, of_silu),
        _ => None,
    };
    let limits = [limit, &edited.edit.new].map(|limit| bits(limit).map(f32::from_bits));
    let is_beyond =
        |limit: Option<f32>| limit.is_some_and(|limit| reach.is_some_and(|reach| 1.01 * reach < limit.into()));
    limit == edited.edit.old && limits.into_iter().all(is_beyond)
}

/// Of every float up to 7.94 the quotient was computed: the greatest has the bits 0x3F7FFFFF, the one below 1.
const TRIED: f64 = 7.94;

pub fn quotient_unreached(edited: &Edited) -> bool {
    let is_small = reach_of_tanh(edited.policy).is_some_and(|reach| 1.001 * reach < TRIED);
    let end = edited.within("tanh") && edited.line().contains("_limit((p0 * t) / q0, 0x3F800000u)");
    let is_end = end && bits(&edited.edit.new).is_some_and(|new| (0x3F7F_FFFF..0x4000_0000).contains(&new));
    // the sign of the limit itself: what is within it has the other bits as well
    let sign = edited.within("limit") && edited.edit.old == "0x80000000u" && edited.edit.new == "2147483649u";
    is_small && (is_end || sign)
}
