//! The contract of a policy that is yet to be trained, and the policy folder that comes out.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

use policy::{Activation, Fault, Policy};
use safetensors::Dtype;
use safetensors::tensor::{TensorView, serialize};
use sha2::{Digest, Sha256};
use toml::Spanned;
use toml::de::{DeTable, DeValue};
use toml_input::{FileName, MAX_TOML_BYTES, Message};

use crate::faults::{Error, of_file};
use crate::network::Network;

/// Files by name, as data; only the command line writes them.
pub type Files = BTreeMap<String, Vec<u8>>;

/// A contract with a network that has not learnt anything yet.
#[derive(Debug, Clone)]
pub struct Contract {
    /// The checked policy; its weights are 0.
    pub policy: Policy,
    path: PathBuf,
    /// Text of `policy.toml`, with golden vectors named.
    text: String,
    weights: String,
    golden: String,
    /// Files that are taken over as they are (the mapping).
    beside: Files,
}

/// Known answers, row by row.
#[derive(Debug, Clone, Default)]
pub struct GoldenVectors {
    /// `[count][features]`
    pub observations: Vec<f32>,
    /// `[count][actions]`
    pub q_values: Vec<f32>,
    /// `[count]`
    pub actions: Vec<u32>,
}

/// What the text says about files and sizes.
struct Sketch {
    features: usize,
    actions: usize,
    /// The entry of `[actions]` by which it makes no choice, and the outputs that it takes.
    numbers: Option<(&'static str, usize)>,
    weights: Option<(String, Range<usize>)>,
    golden: Option<String>,
    mapping: Option<String>,
    inline: bool,
    /// Names of several outputs.
    several: Vec<String>,
}

/// The bytes of a file that another one names.
fn read_named(path: &Path) -> Result<Vec<u8>, Error> {
    let name = FileName::named_by_a_file(path);
    Ok(name.read(MAX_TOML_BYTES).map_err(|message| name.fault(message))?)
}

impl Contract {
    /// Reads `path` and checks it with a network of the given hidden widths in the place of its weights.
    ///
    /// # Errors
    /// If the file cannot be read or is not a sound contract, or commands a number: the training here is one that chooses.
    pub fn load(path: &Path, hidden: &[usize]) -> Result<Self, Error> {
        // before its other faults, which a contract for another kind of training need not have; unreadable files are said below
        let text = std::fs::read_to_string(path).unwrap_or_default();
        if let Some((entry, _)) = sketch(&text).numbers {
            let message =
                Message::new("the training is that of a DQN, which chooses, and this contract commands a number")
                    .found(format!("{entry} in [actions]"))
                    .expected("duties or pairs")
                    .hint("train such an actor with a library, and read what it saved: policyc new model.zip");
            return Err(Fault::in_file(path, message).into());
        }
        Self::load_any(path, hidden)
    }

    /// [`Contract::load`], also of a contract that commands a number.
    ///
    /// # Errors
    /// If the file cannot be read or is not a sound contract.
    pub fn load_any(path: &Path, hidden: &[usize]) -> Result<Self, Error> {
        let bytes = read_named(path)?;
        Self::read(path, String::from_utf8_lossy(&bytes).into_owned(), hidden)
    }

    /// [`Contract::load_any`] of a text; `path` names it in faults, and a mapping is read beside it.
    ///
    /// # Errors
    /// As [`Contract::load_any`].
    pub fn read(path: &Path, text: String, hidden: &[usize]) -> Result<Self, Error> {
        let sketch = sketch(&text);
        if !sketch.several.is_empty() {
            return Err(Fault::in_file(path, several(&sketch.several)).into());
        }
        let mut beside = Files::new();
        if let Some(mapping) = &sketch.mapping {
            let folder = path.parent().unwrap_or(Path::new(""));
            beside.insert(plain(mapping)?, read_named(&folder.join(mapping))?);
        }
        let weights = match &sketch.weights {
            Some((name, _)) => plain(name)?,
            None => "weights.safetensors".to_owned(),
        };
        let (golden, text) = match (&sketch.golden, &sketch.weights) {
            (Some(golden), _) => (plain(golden)?, text),
            (None, Some((_, span))) => ("golden.safetensors".to_owned(), name_golden(&text, span, sketch.inline)),
            (None, None) => ("golden.safetensors".to_owned(), text),
        };
        // a contract without features or actions is refused by `policy::load`, which needs a network to get that far
        let mut widths = vec![sketch.features.max(1)];
        widths.extend_from_slice(hidden);
        widths.push(sketch.numbers.map_or(sketch.actions, |(_, outputs)| outputs).max(1));
        // stands in for the trained one: a fault of the contract is said before a training, not after it
        let network = Network::zeros(&widths, &vec![policy::Activation::Identity; widths.len() - 1]);
        let empty = GoldenVectors {
            observations: vec![0.0; network.inputs()],
            q_values: vec![0.0; network.outputs()],
            actions: vec![0],
        };
        let files = files(&text, &weights, &network, &golden, &empty, &beside)?;
        let policy = check(&files, path)?;
        if let Some(foreign) = policy
            .layers
            .iter()
            .map(|layer| layer.activation)
            .find(|each| !is_trained(*each))
        {
            return Err(Fault::in_file(path, untrained(foreign)).into());
        }
        Ok(Self {
            policy,
            path: path.to_owned(),
            text,
            weights,
            golden,
            beside,
        })
    }

    /// A network of the contract's shape with parameters 0.
    #[must_use]
    pub fn network(&self) -> Network {
        let layers = &self.policy.layers;
        let widths: Vec<usize> = layers
            .iter()
            .map(|l| l.inputs)
            .chain(layers.last().map(|l| l.outputs))
            .collect();
        let activations: Vec<_> = layers.iter().map(|layer| layer.activation).collect();
        Network::zeros(&widths, &activations)
    }

    /// The policy with the network's parameters: fit for a controller; its bounds and digests are those of the contract.
    #[must_use]
    pub fn with(&self, network: &Network) -> Policy {
        let mut policy = self.policy.clone();
        network.write_into(&mut policy.layers);
        policy
    }

    /// A network that adds nothing to the law of a residual policy, whatever it sees; `None` without a law that stands alone
    /// ([`Policy::law_alone`]) or an offset of 0.
    #[must_use]
    pub fn adds_nothing(&self) -> Option<Network> {
        self.policy.law_alone()?;
        let nothing = self.policy.actions().iter().position(|action| action.duty == 0.0)?;
        let mut network = self.network();
        let bias = network.layers().last()?.bias.clone();
        // far from a tie in every number format
        *network.parameters[bias].get_mut(nothing)? = 1.0;
        Some(network)
    }

    /// The complete policy folder of a trained network, checked as `policy::load` checks it, golden vectors included.
    ///
    /// # Errors
    /// If the policy does not pass the check.
    pub fn folder(&self, network: &Network, golden: &GoldenVectors) -> Result<(Policy, Files), Error> {
        let files = files(&self.text, &self.weights, network, &self.golden, golden, &self.beside)?;
        Ok((check(&files, &self.path)?, files))
    }

    /// Text of the contract, with golden vectors named, and the files beside it that are taken over as they are.
    #[must_use]
    pub fn sources(&self) -> (&str, &Files) {
        (&self.text, &self.beside)
    }

    /// SHA-256 of the contract and the files beside it.
    #[must_use]
    pub fn digest(&self) -> [u8; 32] {
        let mut digest = Sha256::new();
        digest.update(self.text.as_bytes());
        for (name, bytes) in &self.beside {
            digest.update(name.as_bytes());
            digest.update(bytes);
        }
        digest.finalize().into()
    }
}

/// A name that stays in the folder.
fn plain(name: &str) -> Result<String, Error> {
    if Path::new(name).file_name().is_some_and(|file| file == name) {
        return Ok(name.to_owned());
    }
    let message = Message::new(format!("the contract names the file `{name}`"));
    Err(message.expected("a file in the policy's own folder").into())
}

/// Faults of the contract are left to [`policy::load`]: what cannot be read here counts as absent.
fn sketch(text: &str) -> Sketch {
    let (tree, _) = DeTable::parse_recoverable(text);
    let root = tree.get_ref();
    let list = |value: Option<&Spanned<DeValue<'_>>>| match value.map(Spanned::get_ref) {
        Some(DeValue::Array(items)) => items.len(),
        _ => 0,
    };
    let entry = |table: &'static str, key: &'static str| match root.get(table)?.get_ref() {
        DeValue::Table(entries) => entries.get(key),
        _ => None,
    };
    let string = |value: &Spanned<DeValue<'_>>| match value.get_ref() {
        DeValue::String(text) => Some((text.to_string(), value.span())),
        _ => None,
    };
    let pairs = match entry("actions", "pairs").map(Spanned::get_ref) {
        Some(DeValue::Array(items)) => items
            .iter()
            .map(|item| match item.get_ref() {
                // three factors unless given: the paper's -1, 0 and 1
                DeValue::Table(pair) => pair.get("c").map_or(3, |c| list(Some(c))),
                _ => 0,
            })
            .sum(),
        _ => 0,
    };
    let inline = root
        .get("network")
        .is_some_and(|value| text[value.span()].starts_with('{'));
    Sketch {
        features: list(root.get("feature")),
        actions: list(entry("actions", "duties")) + list(entry("actions", "offsets")) + pairs,
        numbers: match (entry("actions", "continuous"), entry("actions", "gains")) {
            (Some(_), _) => Some(("continuous", 1)),
            (None, Some(gains)) => Some(("gains", list(Some(gains)))),
            (None, None) => None,
        },
        weights: entry("network", "weights").and_then(string),
        golden: entry("network", "golden").and_then(string).map(|(name, _)| name),
        mapping: entry("mapping", "file").and_then(string).map(|(name, _)| name),
        inline,
        several: names_of(root.get("output").map(Spanned::get_ref)),
    }
}

/// Names of `[[output]]`; of an entry without one a question mark.
fn names_of(list: Option<&DeValue<'_>>) -> Vec<String> {
    let Some(DeValue::Array(items)) = list else {
        return Vec::new();
    };
    let name = |item: &Spanned<DeValue<'_>>| match item.get_ref() {
        DeValue::Table(entries) => match entries.get("name")?.get_ref() {
            DeValue::String(text) => Some(text.to_string()),
            _ => None,
        },
        _ => None,
    };
    items
        .iter()
        .map(|item| name(item).unwrap_or_else(|| "?".to_owned()))
        .collect()
}

fn several(names: &[String]) -> Message {
    Message::new("a training here is one of one duty, and this contract has several outputs")
        .found(format!("outputs {}", names.join(", ")))
        .expected("[actions] at the top level")
        .hint(
            "train a policy for each output, in a contract without [[output]]; or train all in one network with a library, and read what \
             it saved: policyc new model.zip",
        )
}

/// The contract with its golden vectors named beside the weights.
fn name_golden(text: &str, weights: &Range<usize>, inline: bool) -> String {
    // an inline table may not be broken into lines
    let (at, golden) = if inline {
        (weights.end, ", golden = \"golden.safetensors\"")
    } else {
        let end = text[weights.end..].find('\n').map_or(text.len(), |at| weights.end + at);
        (end, "\ngolden = \"golden.safetensors\"")
    };
    format!("{}{golden}{}", &text[..at], &text[at..])
}

fn files(
    text: &str,
    weights: &str,
    network: &Network,
    golden: &str,
    vectors: &GoldenVectors,
    beside: &Files,
) -> Result<Files, Error> {
    let mut files = beside.clone();
    files.insert("policy.toml".to_owned(), text.as_bytes().to_vec());
    files.insert(weights.to_owned(), weights_file(network)?);
    files.insert(
        golden.to_owned(),
        golden_file(vectors, network, sketch(text).numbers.is_some())?,
    );
    Ok(files)
}

fn weights_file(network: &Network) -> Result<Vec<u8>, Error> {
    let mut tensors = Vec::new();
    for (index, layer) in network.layers().iter().enumerate() {
        // the numbers of torch's `nn.Sequential`, where an activation between two layers counts as well
        let name = format!("q_net.{}", 2 * index);
        let (outputs, inputs) = (layer.outputs, layer.inputs);
        let bias = &network.parameters[layer.bias.clone()];
        tensors.push((
            format!("{name}.weight"),
            vec![outputs, inputs],
            bytes(&network.weights_by_output(layer)),
        ));
        tensors.push((format!("{name}.bias"), vec![outputs], bytes(bias)));
    }
    let tensors: Vec<_> = tensors
        .into_iter()
        .map(|(name, shape, data)| (name, shape, Dtype::F32, data))
        .collect();
    safetensors_file(&tensors)
}

fn golden_file(vectors: &GoldenVectors, network: &Network, is_number: bool) -> Result<Vec<u8>, Error> {
    let count = vectors.actions.len();
    let actions: Vec<u8> = vectors
        .actions
        .iter()
        .flat_map(|&action| (action as i32).to_le_bytes())
        .collect();
    let observations = (
        "obs".to_owned(),
        vec![count, network.inputs()],
        Dtype::F32,
        bytes(&vectors.observations),
    );
    let outputs = vec![count, network.outputs()];
    if is_number {
        let output = ("output".to_owned(), outputs, Dtype::F32, bytes(&vectors.q_values));
        return safetensors_file(&[observations, output]);
    }
    safetensors_file(&[
        observations,
        ("q".to_owned(), outputs, Dtype::F32, bytes(&vectors.q_values)),
        ("action".to_owned(), vec![count], Dtype::I32, actions),
    ])
}

fn bytes(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|x| x.to_le_bytes()).collect()
}

fn safetensors_file(tensors: &[(String, Vec<usize>, Dtype, Vec<u8>)]) -> Result<Vec<u8>, Error> {
    let error = |error: safetensors::SafeTensorError| -> Error {
        Message::new("cannot make a safetensors file")
            .found(error.to_string())
            .into()
    };
    let mut views = Vec::new();
    for (name, shape, dtype, data) in tensors {
        views.push((
            name.as_str(),
            TensorView::new(*dtype, shape.clone(), data).map_err(error)?,
        ));
    }
    serialize(views, None).map_err(error)
}

/// Whether the trainer has the slope of such a layer: it takes it from the layer's outputs.
fn is_trained(activation: Activation) -> bool {
    activation.curve().is_none_or(|curve| curve.slope_of_value.is_some())
}

fn untrained(activation: Activation) -> Message {
    let trained: Vec<String> = Activation::EACH
        .iter()
        .filter(|each| is_trained(**each))
        .map(|each| each.written())
        .collect();
    Message::new("the training has no slope for this activation: its value does not tell it")
        .found(format!("hidden_activation {}", activation.written()))
        .expected(trained.join(", "))
        .hint("a network with it that a library trained is read by `policyc new`")
}

/// Loads the files as a user would; faults name the contract, not the temporary folder.
fn check(files: &Files, path: &Path) -> Result<Policy, Error> {
    let fail = |path: &Path| {
        let path = path.to_owned();
        move |error| of_file(&path, &error)
    };
    // through files, because this is the way that a user's policy takes
    let folder = tempfile::tempdir().map_err(fail(&std::env::temp_dir()))?;
    for (name, bytes) in files {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).map_err(fail(&path))?;
    }
    let home = path.parent().unwrap_or(Path::new(""));
    let named = |file: &Path| match file.strip_prefix(folder.path()) {
        Ok(name) if name == Path::new("policy.toml") => path.to_owned(),
        Ok(name) => home.join(name),
        Err(_) => file.to_owned(),
    };
    policy::load(&folder.path().join("policy.toml"))
        .map_err(|mut faults| {
            let rename = |fault: &mut Fault| fault.file = named(&fault.file);
            faults.faults.list.iter_mut().for_each(rename);
            faults.into()
        })
        .map(|mut policy| {
            policy.files = policy.files.iter().map(|file| named(file)).collect();
            policy
        })
}
