//! Continuous actors by the names of their tensors: whose definition they follow, and what that fixes.
//!
//! A state dict holds numbers and not what is made of them. Where the names are those of a library's own network, its
//! definition tells the rest; the contract says so, and the user confirms. Where two definitions share the names, nothing
//! is taken for granted: the user is asked by a `TODO`, or by `--actions`.

use policy::NamedTensor;
use toml_input::Message;

use super::heads::is_value;
use super::names::parts;
use super::{Known, Refusal};
use crate::actor::{self, Actor, Squash, TANH};
use crate::network::no_output;

/// What the definition of an actor adds to its tensors.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Definition {
    pub actor: Actor,
    /// Scale and offset of each of several commands, where the tensors say them.
    pub each: Vec<(f64, f64)>,
    /// What follows from whose definition, for the user to confirm.
    pub said: Vec<String>,
    /// The activation behind the hidden layers as TOML, with a comment.
    pub activation: Option<String>,
    /// The last layer gives a mean and a deviation: its first output counts.
    pub is_mean_of_two: bool,
    /// The training normalised observations, with statistics that this file does not hold.
    pub is_normalised: bool,
}

/// What stands beside the mean and has no part in it.
const BESIDE: [&str; 13] = [
    "action_bias",
    "action_high",
    "action_low",
    "action_scale",
    "actor_logstd",
    "fc_logstd",
    "log_std",
    "log_std_layer",
    "log_std_linear",
    "logstd",
    "sigma",
    "sigma_param",
    "std_layer",
];

/// Whether a tensor is one of an actor's that its mean does not need, or of a critic that only stands beside actors.
pub(crate) fn is_beside(name: &str) -> bool {
    parts(name).any(|part| BESIDE.contains(&part) || ["q1", "q2"].contains(&part))
}

/// Whether a tensor is one of the layer that gives an actor's mean.
pub(crate) fn is_mean(name: &str) -> bool {
    parts(name).any(|part| ["fc_mu", "fc_mean", "actor_mean", "mu"].contains(&part))
}

/// The tensors of one file, without those of critics.
struct Names<'a>(Vec<&'a NamedTensor>);

impl<'a> Names<'a> {
    fn has(&self, wanted: &str) -> bool {
        self.0
            .iter()
            .any(|tensor| parts(&tensor.name).any(|part| part == wanted))
    }

    /// The tensor at the end of whose name this stands.
    fn leaf(&self, wanted: &str) -> Option<&'a NamedTensor> {
        self.0
            .iter()
            .find(|tensor| parts(&tensor.name).last() == Some(wanted))
            .copied()
    }

    /// Whether one of these parts is followed by a number: a member of a sequence.
    fn has_sequence(&self, wanted: &str) -> bool {
        self.0.iter().any(|tensor| {
            let parts: Vec<&str> = parts(&tensor.name).collect();
            let is = |pair: &[&str]| matches!(pair, [name, number] if *name == wanted && number.parse::<u32>().is_ok());
            parts.windows(2).any(is)
        })
    }

    /// Outputs of the last of the layers below a folder, such as `pi.net.mlp`.
    fn outputs(&self, folder: &str) -> Option<usize> {
        let number = |tensor: &&&NamedTensor| {
            let (before, rest) = tensor.name.split_once(folder)?;
            let is_whole = before.is_empty() || before.ends_with(['.', '/']);
            let number = rest.strip_prefix('.')?.strip_suffix(".weight")?;
            (is_whole && tensor.shape.len() == 2)
                .then(|| number.rsplit('.').next()?.parse::<u32>().ok())
                .flatten()
        };
        let last = self
            .0
            .iter()
            .filter(|tensor| number(tensor).is_some())
            .max_by_key(number)?;
        last.shape.first().copied()
    }
}

/// The definition that the names follow; `None` of a table of actions.
pub(crate) fn find(tensors: &[&NamedTensor], known: &Known) -> Result<Option<Definition>, Refusal> {
    let own = tensors.iter().filter(|tensor| !is_value(&tensor.name)).copied();
    let names = Names(own.collect());
    if let Some(definition) = cleanrl(&names, known)? {
        return Ok(Some(definition));
    }
    if let Some(definition) = stable_baselines(&names)? {
        return Ok(Some(definition));
    }
    let of_a_library = [tianshou(&names, known), rllib(&names, known)?, torchrl(&names, known)?];
    let found = of_a_library.into_iter().flatten().next();
    // somebody said that there is one command, or what the several are
    let said = match known {
        Known { gains: true, .. } => Some("by --gains"),
        Known { output: Some(_), .. } => Some("by --output"),
        Known { are_commands: true, .. } => Some("by --outputs"),
        Known { actions: Some(1), .. } => Some("by --actions 1"),
        Known { .. } => None,
    };
    Ok(found.or_else(|| said.map(|said| defined(Squash::Unknown, None, said))))
}

fn defined(squash: Squash, affine: Option<(f64, f64)>, said: &str) -> Definition {
    Definition {
        actor: Actor { squash, affine },
        each: Vec::new(),
        said: vec![said.to_owned()],
        activation: None,
        is_mean_of_two: false,
        is_normalised: false,
    }
}

/// An activation that a definition has, to be confirmed.
fn fixed(word: &str, whose: &str) -> Option<String> {
    Some(format!("\"{word}\"   # as in {whose}: check"))
}

/// An activation that is only a library's default.
fn default(word: &str, whose: &str) -> Option<String> {
    Some(format!("\"TODO\"   # {word} unless you gave {whose} another one"))
}

fn cleanrl(names: &Names<'_>, known: &Known) -> Result<Option<Definition>, Refusal> {
    let scale = names.leaf("action_scale").zip(names.leaf("action_bias"));
    for (mean, file) in [
        ("fc_mu", "td3_continuous_action.py or ddpg_continuous_action.py"),
        ("fc_mean", "sac_continuous_action.py"),
    ] {
        let Some((scale, bias)) = scale.filter(|_| names.has(mean)) else {
            continue;
        };
        let said = format!(
            "CleanRL's {file} by the names of its tensors: the action is tanh({mean}) * action_scale + action_bias, with ReLU between. Is that \
             your definition?"
        );
        return Ok(Some(Definition {
            activation: fixed("relu", "CleanRL's definition"),
            each: pairs(scale, bias).collect(),
            ..defined(TANH, own(scale, known)?.zip(own(bias, known)?), &said)
        }));
    }
    if !(names.has("actor_mean") && names.leaf("actor_logstd").is_some()) {
        return Ok(None);
    }
    let said = "CleanRL's ppo_continuous_action.py by the names of its tensors: the action is actor_mean, clipped to the action space, with tanh \
                between. Is that your definition?";
    let mut definition = Definition {
        activation: fixed("tanh", "CleanRL's definition"),
        is_normalised: true,
        ..defined(Squash::ClipToSpace, None, said)
    };
    definition.said.push(
        "its environment is wrapped in NormalizeObservation and clipped to +-10, and this file does not hold the statistics: scale = \
         1/sqrt(obs_rms.var + 1e-8), offset = -obs_rms.mean/sqrt(obs_rms.var + 1e-8); without that wrapper 1.0 and 0.0"
            .to_owned(),
    );
    Ok(Some(definition))
}

/// The number of the one command, or of the one that is picked; `None` of several, of which [`pairs`] has each.
fn own(tensor: &NamedTensor, known: &Known) -> Result<Option<f64>, Refusal> {
    let values = tensor.values.as_deref().unwrap_or_default();
    match (values, known.output) {
        ([one], _) => Ok(Some(actor::short(*one))),
        (several, Some(output)) if output < several.len() => Ok(several.get(output).copied().map(actor::short)),
        (several, Some(output)) => Err(Refusal::of(&tensor.name, no_output(output, several.len()))),
        (_, None) => Ok(None),
    }
}

/// The numbers of each command in two tensors.
fn pairs(first: &NamedTensor, second: &NamedTensor) -> impl Iterator<Item = (f64, f64)> {
    let values = |tensor: &NamedTensor| tensor.values.clone().unwrap_or_default();
    let both = values(first).into_iter().zip(values(second));
    both.map(|(first, second)| (actor::short(first), actor::short(second)))
}

fn stable_baselines(names: &Names<'_>) -> Result<Option<Definition>, Refusal> {
    let whose = "stable-baselines3";
    // a parameter of its own with two axes weighs the noise by the state
    let noise = names.leaf("log_std").filter(|tensor| tensor.shape.len() == 2);
    let is_gaussian = names.has("latent_pi") && names.has("mu");
    let is_clipped = names.has("mlp_extractor") && names.has("action_net") && names.leaf("log_std").is_some();
    if let Some(noise) = noise.filter(|_| is_gaussian || is_clipped) {
        let message = Message::new("noise that depends on the state (use_sde) is not read")
            .found(format!("shape {:?}", noise.shape))
            .expected("one deviation for each action, or a layer of them")
            .hint("save the mean's layers as safetensors, and write continuous = {...} in [actions]");
        return Err(Refusal::of(&noise.name, message));
    }
    let zip = "the .zip that model.save(...) wrote holds the ends of the action space, the activation and bounds, too";
    let definition = |squash, activation, who: &str, does: &str| Definition {
        activation: default(activation, whose),
        ..defined(
            squash,
            None,
            &format!("{who} of {whose} by the names of its tensors: {does}; {zip}"),
        )
    };
    Ok(if is_gaussian {
        let does = "the action is tanh(mu), from -1 to 1, scaled to the action space";
        Some(definition(TANH, "relu", "SAC", does))
    } else if is_clipped {
        let does = "the action is action_net's output, clipped to the action space";
        Some(definition(Squash::ClipToSpace, "tanh", "PPO or A2C", does))
    } else if names.has_sequence("mu") && !names.0.iter().any(|tensor| is_beside(&tensor.name)) {
        let does = "the action is a tanh of mu, from -1 to 1, scaled to the action space";
        Some(definition(TANH, "relu", "TD3 or DDPG", does))
    } else {
        None
    })
}

fn tianshou(names: &Names<'_>, known: &Known) -> Option<Definition> {
    if !names.has("preprocess") {
        return None;
    }
    let activation = default("relu", "Tianshou's Net");
    if names.has("mu") && (names.has("sigma_param") || names.has("sigma")) {
        let said = "Tianshou's ContinuousActorProbabilistic by the names of its tensors: of SAC, and without `unbounded`, the action is tanh(mu); \
                    of PPO and A2C it is mu, clipped to -1 and 1 (action_bound_method). Then it is scaled to the action space";
        return Some(Definition {
            activation,
            ..defined(Squash::Unknown, None, said)
        });
    }
    let outputs = names.outputs("last.model");
    let is_said = outputs.is_some() && (known.is_said());
    let is_one = is_said || outputs == Some(1) && known.actions.is_none_or(|actions| actions == 1);
    let said = "Tianshou's ContinuousActorDeterministic (TD3, DDPG) by the names of its tensors: the action is max_action * tanh(last), which is \
                scaled to the action space";
    is_one.then(|| Definition {
        activation,
        ..defined(TANH, None, said)
    })
}

fn rllib(names: &Names<'_>, known: &Known) -> Result<Option<Definition>, Refusal> {
    let Some(outputs) = names.outputs("pi.net.mlp") else {
        return Ok(None);
    };
    let is_free = names.leaf("log_std").is_some();
    let is_command = is_free || known.actions == Some(1);
    let is_said = known.is_said();
    if outputs == 2 && !is_free && known.actions.is_none() && !is_said {
        return Err(two_or_one("pi.net.mlp"));
    }
    if !is_command {
        return Ok(None);
    }
    let (squash, said) = if names.has("pi_encoder") {
        // its to_deterministic() leaves out the squash of its sample()
        let said = "RLlib's SAC by the names of its tensors: training squashes the mean by tanh, but its own inference with explore=False \
                    commands the mean itself, clipped. Say which your converter shall do";
        (Squash::Unknown, said)
    } else {
        let said = "RLlib's PPO by the names of its tensors: the action is the mean, clipped to -1 and 1 and scaled to the action space \
                    (normalize_actions, which is the default)";
        (Squash::Clip(-1.0, 1.0), said)
    };
    Ok(Some(Definition {
        activation: default("tanh", "RLlib's fcnet_activation"),
        is_mean_of_two: !is_free && outputs == 2,
        ..defined(squash, None, said)
    }))
}

/// What to say of a table of actions whose names could be those of several commands with their deviations.
pub(crate) fn doubt(tensors: &[&NamedTensor], known: &Known) -> Option<String> {
    let names = Names(tensors.to_vec());
    let of = |folder: &str| names.outputs(folder).filter(|outputs| outputs.is_multiple_of(2));
    let outputs = of("pi.net.mlp").or_else(|| of("module.0.module"))?;
    known.actions.is_none().then(|| {
        format!(
            "{outputs} outputs are taken for {outputs} actions: the names of {} commands with their deviations would be the same, and these are not \
             compiled",
            outputs / 2
        )
    })
}

fn torchrl(names: &Names<'_>, known: &Known) -> Result<Option<Definition>, Refusal> {
    let activation = default("tanh", "TorchRL's MLP");
    if let Some((low, high)) = names.leaf("action_low").zip(names.leaf("action_high")) {
        let actor = match own(low, known)?.zip(own(high, known)?) {
            Some((low, high)) => Actor::of_space(low, high),
            None => Actor {
                squash: TANH,
                affine: None,
            },
        };
        let said = "TorchRL's TanhModule by the names of its tensors: the action is a tanh from action_low to action_high. Is that your definition?";
        return Ok(Some(Definition {
            activation,
            each: pairs(low, high)
                .filter_map(|(low, high)| Actor::of_space(low, high).affine)
                .collect(),
            ..defined(actor.squash, actor.affine, said)
        }));
    }
    if names.outputs("module.0.module") != Some(2) {
        return Ok(None);
    }
    match known.actions {
        None if known.is_said() => Ok(None),
        None => Err(two_or_one("module.0.module")),
        Some(1) => {
            let said = "TorchRL's NormalParamExtractor by --actions 1: the first of two outputs is the mean, which a TanhNormal squashes by tanh and a \
                        Normal leaves as it is";
            Ok(Some(Definition {
                activation,
                is_mean_of_two: true,
                ..defined(Squash::Unknown, None, said)
            }))
        }
        Some(_) => Ok(None),
    }
}

/// The names of a mean with its deviation are those of a table of two actions.
fn two_or_one(layers: &str) -> Refusal {
    Message::new("two outputs may be two actions, or the mean and the deviation of one command: the names are the same")
        .found(format!("2 outputs of `{layers}`"))
        .expected("--actions 2, or --actions 1")
        .hint("say --actions 2 if the action space is Discrete(2), --actions 1 if it is a Box of one number")
        .into()
}
