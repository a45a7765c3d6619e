//! Golden answers from the tensors as they were saved: an oracle that knows neither the chain that was recognised nor the
//! interpreter.

use std::collections::BTreeMap;

use policy::Activation;
use random::{Random, SplitMix};
use toml_input::Message;

use crate::activations;
use crate::network::{Layer, rounded, written};

const SEED: u64 = 1;
const COUNT: usize = 64;
// below it the choice could be another one after rounding to binary32: some sixteen layers of 64 sums of half a unit
const SMALLEST_GAP: f64 = 1e-4;
// bounds so narrow, or a network so flat, that nothing is decided: better no golden answers than a search without end
const MOST_DRAWS: usize = 100 * COUNT;

/// What observations are drawn from, and the layers to put them through; the outputs are averaged in groups of `quantiles`.
pub(crate) struct Oracle<'a> {
    pub bounds: &'a [(f64, f64)],
    pub layers: &'a [Layer],
    pub quantiles: usize,
    pub activation: Activation,
    /// The one output is a command, not a choice.
    pub is_actor: bool,
    /// Columns of each of several outputs; none where there is one.
    pub several: &'a [usize],
}

/// What says in a file's metadata that it was made here.
const MAKER: &str = "by policyc new";
/// The metadata stand at the beginning, in a header of a few hundred bytes.
const HEADER: usize = 4096;

/// Whether a golden file was computed by [`answers`].
pub(crate) fn is_computed(bytes: &[u8]) -> bool {
    let header = bytes.get(..HEADER).unwrap_or(bytes);
    header.windows(MAKER.len()).any(|part| part == MAKER.as_bytes())
}

/// A golden file, if the network decides often enough within the bounds.
pub(crate) fn answers(oracle: &Oracle<'_>) -> Result<Option<Vec<u8>>, Message> {
    let Some(exact) = activations::exact(oracle.activation) else {
        return Ok(None);
    };
    let mut draws = SplitMix::new(SEED);
    let (mut obs, mut q, mut action) = (Vec::new(), Vec::new(), Vec::new());
    let mut actions = 0;
    for _ in 0..MOST_DRAWS {
        if action.len() == COUNT {
            break;
        }
        // a number is never a choice between two that are near
        // as binary32, which is what the file holds
        let draw = |(low, high): &(f64, f64)| f64::from(draws.uniform(*low, *high) as f32);
        let observation: Vec<f64> = oracle.bounds.iter().map(draw).collect();
        let values = oracle.outputs(&observation, &exact);
        let best = match oracle.several {
            _ if oracle.is_actor => Some(0),
            [] => decided(&values),
            widths => all_decided(&values, widths).then_some(0),
        };
        let Some(best) = best else { continue };
        actions = values.len();
        obs.extend(observation);
        q.extend(values);
        action.push(best);
    }
    if action.len() < COUNT {
        return Ok(None);
    }
    let chosen = action.iter().flat_map(|index: &i32| index.to_le_bytes()).collect();
    if !oracle.several.is_empty() {
        let said = format!(
            "plain products in f64 of the tensors as saved, {MAKER}; {COUNT} observations drawn uniformly, seed {SEED}, those left out \
             where the two largest values of a choice are closer than {SMALLEST_GAP:e} of the largest; output is the last layer's, before \
             argmax, tanh or clip"
        );
        return layer(oracle, &obs, (&q, actions), said).map(Some);
    }
    if oracle.is_actor {
        let said = format!(
            "plain products in f64 of the tensors as saved, {MAKER}; {COUNT} observations drawn uniformly, seed {SEED}; output is the \
             last layer's, before tanh or clip"
        );
        return layer(oracle, &obs, (&q, actions), said).map(Some);
    }
    let said = format!(
        "plain products in f64 of the tensors as saved, {MAKER}; {COUNT} observations drawn uniformly, seed {SEED}, those left out \
         whose two largest values are closer than {SMALLEST_GAP:e} of the largest"
    );
    // one key alone: the crate writes several in the order of a hash map
    let metadata = BTreeMap::from([("oracle".to_owned(), said)]);
    let tensors = [
        ("obs".to_owned(), vec![COUNT, oracle.bounds.len()], rounded(&obs)?),
        ("q".to_owned(), vec![COUNT, actions], rounded(&q)?),
        ("action".to_owned(), vec![COUNT], chosen),
    ];
    written(&tensors, &metadata).map(Some)
}

/// Observations with the last layer alone.
fn layer(
    oracle: &Oracle<'_>,
    obs: &[f64],
    (output, columns): (&[f64], usize),
    said: String,
) -> Result<Vec<u8>, Message> {
    let metadata = BTreeMap::from([("oracle".to_owned(), said)]);
    let tensors = [
        ("obs".to_owned(), vec![COUNT, oracle.bounds.len()], rounded(obs)?),
        ("output".to_owned(), vec![COUNT, columns], rounded(output)?),
    ];
    written(&tensors, &metadata)
}

/// Whether every choice among several outputs is clear.
fn all_decided(values: &[f64], widths: &[usize]) -> bool {
    let mut rest = values;
    widths.iter().all(|width| {
        let (own, behind) = rest.split_at((*width).min(rest.len()));
        rest = behind;
        *width == 1 || decided(own).is_some()
    })
}

impl Oracle<'_> {
    fn outputs(&self, observation: &[f64], exact: &dyn Fn(f64) -> f64) -> Vec<f64> {
        let mut values = observation.to_vec();
        for (index, layer) in self.layers.iter().enumerate() {
            values = layer.apply(&values);
            if index + 1 < self.layers.len() {
                values.iter_mut().for_each(|value| *value = exact(*value));
            }
        }
        let actions = values.len() / self.quantiles.max(1);
        let mean =
            |action: usize| values.iter().skip(action).step_by(actions.max(1)).sum::<f64>() / self.quantiles as f64;
        (0..actions).map(mean).collect()
    }
}

/// The largest value's index, if it is clearly the largest.
fn decided(values: &[f64]) -> Option<i32> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    let at = |index: &usize| values.get(*index).copied().unwrap_or_default();
    order.sort_by(|a, b| at(b).total_cmp(&at(a)));
    let [best, next, ..] = order.as_slice() else {
        return None;
    };
    let largest = values.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
    (at(best) - at(next) > SMALLEST_GAP * largest).then(|| i32::try_from(*best).ok())?
}
