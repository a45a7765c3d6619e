//! Heads: which of the networks of a file is the policy.

use policy::limits::MIN_ACTIONS;
use toml_input::Message;

use super::names::{Parsed, parts};
use super::{Known, Refusal, refused};
use crate::network::{Layer, Network};

/// Parts of names of networks that give a value and choose nothing.
const VALUES: [&str; 16] = [
    "baseline",
    "fc_v",
    "fc_value",
    "v",
    "v_head",
    "val",
    "value",
    "value_branch",
    "value_fn",
    "value_head",
    "value_net",
    "value_network",
    "value_stream",
    "values",
    "vf",
    "vf_head",
];

/// Whether a layer is one of a network that gives a value and chooses nothing.
pub(crate) fn is_value(name: &str) -> bool {
    parts(name).any(|part| {
        let part = part.to_ascii_lowercase();
        let part = part.trim_start_matches('_');
        VALUES.contains(&part) || ["value_", "critic", "qf"].iter().any(|begin| part.starts_with(begin))
    })
}

fn is_advantage(name: &str) -> bool {
    parts(name).any(|part| {
        let part = part.to_ascii_lowercase();
        part.starts_with("adv") || ["a", "fc_a", "fc_adv", "a_head", "af"].contains(&part.as_str())
    })
}

/// Tianshou calls the streams of a dueling network `Q` and `V`.
fn is_q_stream(name: &str) -> bool {
    parts(name).any(|part| part == "Q")
}

/// Leaves out what gives a value. A dueling network keeps its advantage: `argmax(V + A - mean A) = argmax A`.
pub(crate) fn leave_out_values(parsed: &mut Parsed) -> Result<(), Refusal> {
    let (values, rest): (Vec<Layer>, Vec<Layer>) = std::mem::take(&mut parsed.layers)
        .into_iter()
        .partition(|layer| is_value(&layer.name));
    if values.is_empty() || rest.is_empty() {
        parsed.layers = if rest.is_empty() { values } else { rest };
        return Ok(());
    }
    let names: Vec<&str> = values.iter().map(|layer| layer.name.as_str()).collect();
    let is_dueling = rest
        .iter()
        .any(|layer| is_advantage(&layer.name) || is_q_stream(&layer.name));
    if is_dueling {
        // its last layer has the fewest outputs: one, unless the network is distributional
        if let Some(last) = values
            .iter()
            .min_by_key(|layer| layer.outputs)
            .filter(|last| last.outputs != 1)
        {
            return Err(Refusal::of(&last.name, refused::too_many_actions(last.outputs)));
        }
        parsed.choice_only = true;
        parsed.said.push(format!(
            "dueling: the advantage alone is read, and `{}` is left out. The choice is the same; Q values differ by a constant of each step",
            names.join("`, `")
        ));
    } else {
        parsed
            .said
            .push(format!("left out as a value network: {}", names.join(", ")));
    }
    // whether the contract's own rules find the same chain in the file as it is
    let all = policy::chains(&parsed.all);
    let of = |chain: &Vec<usize>| {
        chain
            .iter()
            .all(|&index| parsed.all.get(index).is_some_and(|(name, ..)| !is_value(name)))
    };
    parsed.plain &= !is_dueling && all.len() == 1 && all.iter().all(|chain| of(chain) && chain.len() == rest.len());
    parsed.layers = rest;
    Ok(())
}

/// The mean over quantiles goes into the last layer of a QR-DQN.
pub(crate) fn quantiles(network: &mut Network, known: &Known) -> Result<(), Refusal> {
    let Some(last) = network.layers.last_mut() else {
        return Ok(());
    };
    if !parts(&last.name).any(|part| part == "quantile_net") {
        return Ok(());
    }
    let Some(actions) = known.actions else {
        return Err(
            Message::new("how many of the outputs of a QR-DQN are one action's the tensors do not say")
                .found(format!("{} outputs", last.outputs))
                .expected("the number of actions")
                .hint("say --actions N, or give the .zip that stable-baselines3 saved")
                .into(),
        );
    };
    if actions < MIN_ACTIONS || last.outputs % actions != 0 {
        return Err(
            Message::new("the outputs of a QR-DQN are the same number for each action")
                .found(format!("{} outputs, {actions} actions", last.outputs))
                .expected("a divisor")
                .into(),
        );
    }
    let count = last.outputs / actions;
    // sb3-contrib: view(-1, n_quantiles, n_actions)
    let mean = |values: &dyn Fn(usize) -> f64| (0..count).map(values).sum::<f64>() / count as f64;
    let mut weights = Vec::with_capacity(actions * last.inputs);
    let mut bias = Vec::with_capacity(actions);
    for action in 0..actions {
        let at = |quantile: usize| quantile * actions + action;
        for input in 0..last.inputs {
            weights.push(mean(&|q| last.row(at(q)).get(input).copied().unwrap_or_default()));
        }
        bias.push(mean(&|q| last.bias.get(at(q)).copied().unwrap_or_default()));
    }
    (last.weights, last.bias, last.outputs) = (weights, bias, actions);
    network.plain = false;
    network.said.push(format!(
        "QR-DQN: the mean over {count} quantiles is folded into `{}`, in f64, rounded once",
        last.name
    ));
    Ok(())
}
