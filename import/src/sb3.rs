//! The archive that stable-baselines3 saves: `data` is JSON about the training, `policy.pth` holds the tensors.
//!
//! What is a Python object in `data` stands there as text, and as a pickle in base64. Texts are taken where they are exact,
//! the pickle where numbers are wanted to the bit.

mod space;

use policy::{Activation, NamedTensor};
use serde_json::Value;
use toml_input::Message;

use crate::Options;
use crate::activations;
use crate::actor::{Actor, Duty};
use crate::network::Layer;
use crate::numpy;
use crate::pickle::{Item, Pickle};
use crate::recognise::names::only_dense;
use crate::recognise::refused_continuous;
use crate::torch;
use crate::zip::Archive;

/// What an archive says beside its tensors.
#[derive(Debug)]
pub(crate) struct Model {
    pub tensors: Vec<NamedTensor>,
    pub actions: usize,
    pub activation: Activation,
    /// Lower and upper bound of each observation, infinite where it has none.
    pub bounds: Vec<(f64, f64)>,
    pub about: Vec<String>,
    /// The layers by the names of the library alone, and how many quantiles are averaged behind them.
    pub original: Option<(Vec<Layer>, usize)>,
    /// The command is a number.
    pub actor: Option<Actor>,
    /// Each command, where the outputs are gains.
    pub commands: Vec<Actor>,
    /// What each of several duties is.
    pub several: Vec<Duty>,
}

/// A policy class that is read: where its layers lie, and its activation unless `policy_kwargs` has another.
struct Class {
    name: &'static str,
    algorithm: &'static str,
    trunk: &'static str,
    head: Option<&'static str>,
    activation: Activation,
    /// Its command is a number by a tanh; of the others the action space says whether it is one.
    is_tanh: bool,
}

const CLASSES: [Class; 5] = [
    Class {
        name: "stable_baselines3.dqn.policies.DQNPolicy",
        algorithm: "DQN",
        trunk: "q_net.q_net.",
        head: None,
        activation: Activation::Relu,
        is_tanh: false,
    },
    Class {
        name: "sb3_contrib.qrdqn.policies.QRDQNPolicy",
        algorithm: "QR-DQN",
        trunk: "quantile_net.quantile_net.",
        head: None,
        activation: Activation::Relu,
        is_tanh: false,
    },
    Class {
        name: "stable_baselines3.common.policies.ActorCriticPolicy",
        algorithm: "PPO or A2C",
        trunk: "mlp_extractor.policy_net.",
        head: Some("action_net"),
        activation: Activation::Tanh,
        is_tanh: false,
    },
    Class {
        name: "stable_baselines3.sac.policies.SACPolicy",
        algorithm: "SAC",
        trunk: "actor.latent_pi.",
        head: Some("actor.mu"),
        activation: Activation::Relu,
        is_tanh: true,
    },
    Class {
        name: "stable_baselines3.td3.policies.TD3Policy",
        algorithm: "TD3 or DDPG",
        trunk: "actor.mu.",
        head: None,
        activation: Activation::Relu,
        is_tanh: true,
    },
];

/// Continuous classes of sb3-contrib whose layers are called otherwise.
const CONTINUOUS: [&str; 2] = ["tqc", "crossq"];

/// Whether an archive is one of stable-baselines3.
pub(crate) fn is_model(archive: &Archive<'_>) -> bool {
    archive.get("data").is_some() && archive.get("policy.pth").is_some()
}

/// Reads a model.
pub(crate) fn read(archive: &Archive<'_>, options: &Options) -> Result<Model, Message> {
    let data = archive.get("data").unwrap_or_default();
    let data: Value = serde_json::from_slice(data).map_err(|error| {
        Message::new("`data` in the archive is not JSON")
            .found(error.to_string())
            .expected("what model.save(...) writes")
    })?;
    let class = class(&data)?;
    let space = space::read(&data, class.is_tanh, options)?;
    let kwargs = data.get("policy_kwargs").unwrap_or(&Value::Null);
    if let Some(extractor) =
        text(kwargs, "features_extractor_class").filter(|class| !class.contains("FlattenExtractor"))
    {
        return Err(other(
            "a features extractor of its own is not compiled",
            extractor,
            "the FlattenExtractor, which is the default",
        ));
    }
    let activation = activation(kwargs, class)?;
    let bounds = bounds(&data)?;
    let policy = Archive::open(archive.get("policy.pth").unwrap_or_default())?;
    let mut tensors = torch::read(&policy, None)?.tensors;
    if let Some(part) = &space.part {
        let last = last_layer(&tensors, class);
        part.cut(&mut tensors, &last)?;
    }
    let version = archive
        .get("_stable_baselines3_version")
        .and_then(|bytes| std::str::from_utf8(bytes).ok());
    let discount = data.get("gamma").and_then(Value::as_f64);
    let mut about = vec![format!(
        "{} of stable-baselines3 {}{}",
        class.algorithm,
        printable(version.unwrap_or("(version unknown)")),
        discount.map_or_else(String::new, |discount| format!(", discount {discount}"))
    )];
    let net = kwargs.get("net_arch").filter(|net| !net.is_null());
    about.push(match net {
        Some(net) => format!("net_arch {}", printable(&net.to_string())),
        None => "net_arch: the library's default".to_owned(),
    });
    about.extend(space.part.map(|part| part.said));
    let original = original(&tensors, class, space.actions);
    Ok(Model {
        tensors,
        actions: space.actions,
        activation,
        bounds,
        about,
        original,
        actor: space.commands.first().copied(),
        commands: space.commands,
        several: space.several,
    })
}

fn class(data: &Value) -> Result<&'static Class, Message> {
    let pickle = pickled(data, "policy_class")?;
    let Item::Global(name) = pickle.item(pickle.root) else {
        return Err(other(
            "the policy's class is not named",
            "no name",
            "a class of stable-baselines3",
        ));
    };
    if let Some(class) = CLASSES.iter().find(|class| class.name == name) {
        return Ok(class);
    }
    if name.split('.').any(|part| CONTINUOUS.contains(&part)) {
        return Err(refused_continuous(&format!("`{}`", printable(name))));
    }
    if name.to_ascii_lowercase().contains("recurrent") {
        return Err(other("a recurrent policy (LSTM) is not compiled", name, "an MlpPolicy")
            .hint("give the network its past as features instead: delays, differences and low-passes are filters of the contract"));
    }
    let expected: Vec<&str> = CLASSES.iter().map(|class| class.name).collect();
    Err(other("this policy class is not read", name, &expected.join(", ")).hint(
        "if it computes a chain of dense layers, save that alone: torch.save(model.policy.q_net.state_dict(), \"weights.pt\")",
    ))
}

fn activation(kwargs: &Value, class: &Class) -> Result<Activation, Message> {
    let Some(given) = text(kwargs, "activation_fn") else {
        return Ok(class.activation);
    };
    let name = given.trim_end_matches("'>").rsplit('.').next().unwrap_or(given);
    let plain = activations::Parameters::default();
    activations::of_torch(name, plain).ok_or_else(|| {
        activations::not_compiled(&printable(name), plain)
            .hint("train with one of these: policy_kwargs = dict(activation_fn=...)")
    })
}

fn bounds(data: &Value) -> Result<Vec<(f64, f64)>, Message> {
    let space = data.get("observation_space").unwrap_or(&Value::Null);
    let kind = text(space, ":type:").unwrap_or("none");
    let expected = "gymnasium.spaces.Box of floats";
    if !kind.ends_with(".Box'>") {
        return Err(other("the observation space is no box", kind, expected));
    }
    box_ends(data, "observation_space")
        .map_err(|_| other("the bounds of the observation space cannot be read", kind, expected))
}

/// Lower and upper end of each number of a box.
pub(super) fn box_ends(data: &Value, key: &str) -> Result<Vec<(f64, f64)>, Message> {
    let pickle = pickled(data, key)?;
    let of = |key: &str| numpy::array(&pickle, pickle.get(pickle.attributes(pickle.root), key)?);
    match (of("low"), of("high")) {
        (Some(low), Some(high)) if low.len() == high.len() => Ok(low.into_iter().zip(high).collect()),
        _ => Err(other(
            "the bounds of a space cannot be read",
            key,
            "gymnasium.spaces.Box of floats",
        )),
    }
}

/// The layers by the library's own names, and nothing inferred: what golden answers are computed from.
fn original(tensors: &[NamedTensor], class: &Class, actions: usize) -> Option<(Vec<Layer>, usize)> {
    let mut numbered: Vec<(usize, Layer)> = Vec::new();
    let mut head = None;
    for layer in only_dense(tensors) {
        if let Some(number) = layer.name.strip_prefix(class.trunk).and_then(|rest| rest.parse().ok()) {
            numbered.push((number, layer));
        } else if Some(layer.name.as_str()) == class.head {
            head = Some(layer);
        }
    }
    numbered.sort_by_key(|(number, _)| *number);
    let mut layers: Vec<Layer> = numbered.into_iter().map(|(_, layer)| layer).collect();
    layers.extend(head);
    let outputs = layers.last()?.outputs;
    (actions > 0 && outputs % actions == 0).then(|| (layers, outputs / actions))
}

/// Name of the layer whose rows are the outputs.
fn last_layer(tensors: &[NamedTensor], class: &Class) -> String {
    if let Some(head) = class.head {
        return head.to_owned();
    }
    let number = |layer: &Layer| layer.name.strip_prefix(class.trunk)?.parse::<usize>().ok();
    let last = only_dense(tensors).iter().filter_map(number).max();
    format!("{}{}", class.trunk, last.unwrap_or_default())
}

/// A pickle that stands in `data` in base64.
pub(super) fn pickled(data: &Value, key: &str) -> Result<Pickle, Message> {
    let value = data.get(key).unwrap_or(&Value::Null);
    let bytes = text(value, ":serialized:").and_then(base64);
    Pickle::read(&bytes.ok_or_else(|| {
        other(
            "`data` in the archive is incomplete",
            &format!("no `{key}`"),
            "what model.save(...) writes",
        )
    })?)
}

pub(super) fn text<'a>(value: &'a Value, key: &str) -> Option<&'a str> {
    value.get(key).and_then(Value::as_str)
}

fn base64(text: &str) -> Option<Vec<u8>> {
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3);
    let (mut bits, mut count) = (0_u32, 0);
    for digit in text.trim_end_matches('=').bytes() {
        let value = match digit {
            b'A'..=b'Z' => digit - b'A',
            b'a'..=b'z' => digit - b'a' + 26,
            b'0'..=b'9' => digit - b'0' + 52,
            b'+' => 62,
            b'/' => 63,
            _ => return None,
        };
        bits = (bits << 6) | u32::from(value);
        count += 6;
        if count >= 8 {
            count -= 8;
            bytes.push((bits >> count) as u8);
            bits &= (1 << count) - 1;
        }
    }
    Some(bytes)
}

/// Text of a file for a comment in a contract: one line.
pub(super) fn printable(text: &str) -> String {
    let short: String = text.trim().chars().take(80).collect();
    short.escape_debug().to_string().replace("\\\"", "\"")
}

pub(super) fn other(what: &str, found: &str, expected: &str) -> Message {
    Message::new(what).found(printable(found)).expected(expected)
}
