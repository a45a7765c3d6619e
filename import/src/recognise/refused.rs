//! What no chain of dense layers with a largest output computes: refused by name, with the way out.

use policy::NamedTensor;
use policy::limits::{MAX_ACTIONS, MIN_ACTIONS};
use toml_input::Message;

use super::Refusal;
use super::names::parts;
use crate::network::Layer;

/// The way out of tensors that are more than the mean.
pub(crate) const MEAN: &str = "say --actions 1 if trunk and mean are a chain of dense layers: squash, scale and offset are then left to you in \
     the contract";

/// Refuses what is not compiled; of an actor whose definition is known, what stands behind its mean is no reason.
pub(crate) fn check(tensors: &[&NamedTensor], is_actor: bool) -> Result<(), Refusal> {
    for tensor in tensors {
        if let Some(message) = refusal(tensor, tensors, is_actor) {
            return Err(Refusal::of(&tensor.name, message));
        }
    }
    Ok(())
}

fn refusal(tensor: &NamedTensor, all: &[&NamedTensor], is_actor: bool) -> Option<Message> {
    let parts: Vec<String> = parts(&tensor.name).map(str::to_ascii_lowercase).collect();
    let (leaf, folders) = parts.split_last()?;
    let is = |names: &[&str]| parts.iter().any(|part| names.contains(&part.as_str()));
    let begins = |names: &[&str]| names.iter().any(|name| leaf.starts_with(name));
    let recurrent = [
        "weight_ih",
        "weight_hh",
        "bias_ih",
        "bias_hh",
        "recurrent_kernel",
        "recurrentweights",
    ];
    if begins(&recurrent)
        || folders
            .iter()
            .any(|part| part.contains("lstm") || part == "gru" || part.starts_with("gru_"))
    {
        return Some(recurrence());
    }
    if tensor.shape.len() > 2 && ["weight", "kernel", "w"].contains(&leaf.as_str()) {
        return Some(convolution(&tensor.shape));
    }
    if is(&["atoms", "support", "supports", "z_atoms"]) {
        return Some(categorical());
    }
    // action_scale: what CleanRL's actors multiply their tanh with
    let deviation = [
        "log_std",
        "logstd",
        "actor_logstd",
        "fc_logstd",
        "log_std_layer",
        "action_scale",
        "action_bias",
        "sigma_param",
    ];
    let mean = [
        "latent_pi",
        "mu",
        "mu_layer",
        "mu_net",
        "fc_mu",
        "fc_mean",
        "actor_mean",
        "action_mean",
    ];
    if !is_actor && (is(&deviation) || is(&mean)) {
        return Some(continuous(
            "a continuous actor (SAC, TD3, DDPG or PPO with a Box action space)",
        ));
    }
    if is(&["cosine_net", "cos_embedding", "phi"]) && is(&["weight", "kernel"]) {
        return Some(
            Message::new("an implicit quantile network is not compiled")
                .expected("a chain of dense layers")
                .hint("its quantiles are drawn anew at each step; train DQN or QR-DQN"),
        );
    }
    let stem = tensor.name.get(..tensor.name.len() - leaf.len()).unwrap_or_default();
    if leaf == "running_mean" && all.iter().any(|other| other.name == format!("{stem}steps")) {
        return Some(
            Message::new("a BatchRenorm (CrossQ) is not read")
                .found("running statistics that count their steps")
                .expected("BatchNorm1d, or no norm")
                .hint("its epsilon is not that of a batch norm, and the file does not hold it: train with TQC, SAC or without a norm"),
        );
    }
    is_layer_norm(tensor, leaf, all).then(layer_norm)
}

/// A scale for each value, and no statistics of a batch beside it.
fn is_layer_norm(tensor: &NamedTensor, leaf: &str, all: &[&NamedTensor]) -> bool {
    let scale = tensor.shape.len() == 1 && ["weight", "gamma", "scale"].contains(&leaf);
    let stem = tensor.name.get(..tensor.name.len() - leaf.len()).unwrap_or_default();
    let beside = |name: &str| all.iter().any(|other| other.name == format!("{stem}{name}"));
    scale
        && !["running_mean", "moving_mean", "mean", "TrainedMean"]
            .iter()
            .any(|name| beside(name))
}

fn recurrence() -> Message {
    Message::new("this is a recurrent network (LSTM or GRU), which is not compiled")
        .found("weights of a recurrence")
        .expected("a chain of dense layers")
        .hint("give the network its past as features instead: delays, differences and low-passes are filters of the contract")
}

fn convolution(shape: &[usize]) -> Message {
    Message::new("this is a convolution, which is not compiled")
        .found(format!("shape {shape:?}"))
        .expected("a chain of dense layers: weights with two axes")
        .hint("over a window of samples a convolution is a dense layer on delayed features: export it so")
}

fn categorical() -> Message {
    Message::new("a categorical network (C51, Rainbow) is not compiled")
        .found("a support of atoms")
        .expected("one Q value for each action")
        .hint(
            "its Q values are a softmax over atoms, times the support: an exponential that no target has to the bit. QR-DQN is read: its mean \
             is linear",
        )
}

/// A head whose command is a number, in a file that does not say what is made of it.
pub(crate) fn continuous(found: &str) -> Message {
    Message::new("this policy commands a number, and its tensors do not say how: what squashes and scales it is code of the trainer")
        .found(found)
        .expected("the .zip of stable-baselines3, an ONNX graph, or names as CleanRL, Tianshou or RLlib give them")
        .hint(MEAN)
}

pub(crate) fn layer_norm() -> Message {
    Message::new("a LayerNorm is not compiled")
        .found("a scale for each value, without running statistics")
        .expected("dense layers, or batch norms, whose statistics are constants")
        .hint("it divides by the deviation of the values of each step, which no dense layer can hold; train without it, or with BatchNorm1d")
}

/// A tensor of floats that no rule knows.
pub(crate) fn stranger(name: &str) -> Refusal {
    let message =
        Message::new("this tensor belongs to no dense layer: left out, the network would compute something else")
            .expected("weights and biases of dense layers, and batch norms")
            .hint("fold it into the layers before saving; if it is not part of the network, save the network alone");
    Refusal::of(name, message)
}

pub(crate) fn too_many_actions(found: usize) -> Message {
    let hint = if found > MAX_ACTIONS {
        "a distributional network has several outputs for each action: with the mean over quantiles (QR-DQN) say --actions N; C51 is not compiled"
    } else {
        "a single output is a value, or a command: say --actions 1 if it is a command"
    };
    Message::new("the outputs are no table of actions")
        .found(format!("{found} outputs"))
        .expected(format!("{MIN_ACTIONS} to {MAX_ACTIONS} actions"))
        .hint(hint)
}

pub(crate) fn more_than_a_chain(layers: &[Layer]) -> Message {
    let list: Vec<String> = layers
        .iter()
        .map(|layer| format!("{} ({} -> {})", layer.name, layer.inputs, layer.outputs))
        .collect();
    Message::new("the layers are more than one chain, and their names do not say which is the policy")
        .found(list.join(", "))
        .expected("one chain, or names as those of the libraries that are known")
        .hint("save the policy network alone: its module's state_dict(), without critics and other heads")
}
