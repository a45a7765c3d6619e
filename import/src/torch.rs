//! Tensors of a torch archive: `data.pkl` names storages, `data/0`, `data/1`, ... hold their bytes.
//!
//! A state dict, a checkpoint that holds one among other things, or a whole module: each is walked by names, and a module is a
//! map of attributes with the name of its class.

use policy::NamedTensor;
use policy::limits::MAX_TENSOR_NAME_CHARS;
use toml_input::Message;

use crate::pickle::{Id, Item, Object, Pickle};
use crate::recognise::is_mean;
use crate::zip::Archive;

/// What a torch file holds.
#[derive(Debug, Default)]
pub(crate) struct Torch {
    pub tensors: Vec<NamedTensor>,
    pub modules: Vec<Module>,
    /// Epsilon of the modules that have one.
    pub epsilons: Vec<(String, f64)>,
    pub said: Vec<String>,
}

/// A module of a whole module that was saved: its class, and what an activation holds.
#[derive(Debug)]
pub(crate) struct Module {
    pub class: String,
    /// `negative_slope` or `alpha`.
    pub number: Option<f64>,
    pub approximate: Option<String>,
}

/// Keys of what belongs to the training alone.
const TRAINING: [&str; 6] = ["optim", "sched", "scaler", "buffer", "rng", "target"];
// a module within a module within ...: people stop at five
const DEEPEST: usize = 40;
// values may be shared, and shared again: without a bound a small file could be walked for ever
const MOST_VISITS: usize = 200_000;

/// Whether `bytes` are in the format that torch wrote before version 1.6, or a pickle that is none of torch's.
pub(crate) fn is_bare_pickle(bytes: &[u8]) -> bool {
    // a header of safetensors may be 0x0280 bytes long: its length is a number of 8 bytes, and `{` follows
    let is_length = bytes.get(4..9) == Some(b"\0\0\0\0{");
    matches!(bytes, [0x80, 2..=5, ..]) && !is_length
}

pub(crate) fn legacy() -> Message {
    Message::new("this is a pickle without an archive around it, as torch.save wrote before version 1.6")
        .expected("an archive of torch.save, or safetensors")
        .hint("convert it in Python: torch.save(torch.load(\"old.pth\", weights_only=True), \"new.pt\")")
}

/// Whether an archive is torch's.
pub(crate) fn root(archive: &Archive<'_>) -> Option<String> {
    let pickle = archive
        .members
        .keys()
        .find(|name| **name == "data.pkl" || name.ends_with("/data.pkl"))?;
    Some(pickle.strip_suffix("data.pkl").unwrap_or_default().to_owned())
}

/// Reads the tensors of a torch archive; `inside` names the entry of a checkpoint.
pub(crate) fn read(archive: &Archive<'_>, inside: Option<&str>) -> Result<Torch, Message> {
    let root = root(archive).ok_or_else(|| Message::new("the archive holds no `data.pkl`"))?;
    if archive
        .get(&format!("{root}byteorder"))
        .is_some_and(|order| order != b"little")
    {
        return Err(Message::new("the numbers are stored big-endian")
            .expected("little-endian")
            .hint("load and save it on a machine of today"));
    }
    let program = archive.get(&format!("{root}data.pkl")).unwrap_or_default();
    let pickle = Pickle::read(program)?;
    let mut walk = Walk {
        pickle: &pickle,
        archive,
        root: &root,
        found: Torch::default(),
        visits: 0,
        left: archive.size,
    };
    let (start, said) = walk.start(inside)?;
    walk.found.said.extend(said);
    walk.visit(start, "", 0)?;
    if walk.found.tensors.is_empty() {
        return Err(Message::new("the file holds no tensors").expected("a state dict, or a module"));
    }
    walk.found.tensors.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(walk.found)
}

struct Walk<'a> {
    pickle: &'a Pickle,
    archive: &'a Archive<'a>,
    root: &'a str,
    found: Torch,
    visits: usize,
    /// Elements that may still be read.
    left: usize,
}

impl<'a> Walk<'a> {
    /// Where the network begins: at the root, or at the only entry that holds one.
    fn start(&mut self, inside: Option<&str>) -> Result<(Id, Option<String>), Message> {
        let root = self.pickle.root;
        if let Some(list) = self.pickle.list(root) {
            return self.one_of(list, inside);
        }
        let entries = self.pickle.entries(root);
        if let Some(key) = inside {
            let found = self.pickle.get(entries, key).map(|id| (id, None));
            return found.ok_or_else(|| self.several("there is no such entry in this checkpoint", key, entries));
        }
        let is_state = entries.iter().any(|(_, value)| self.is_tensor(*value));
        if is_state || entries.is_empty() {
            return Ok((root, None));
        }
        let mut networks = Vec::new();
        for (key, value) in entries {
            let name = self.pickle.text(*key).unwrap_or_default();
            let lower = name.to_ascii_lowercase();
            if TRAINING.iter().any(|word| lower.contains(word)) || !self.holds_tensors(*value) {
                continue;
            }
            networks.push((name, *value));
        }
        match networks.as_slice() {
            [(name, value)] => Ok((
                *value,
                Some(format!("of the checkpoint the entry `{}` is read", name.escape_debug())),
            )),
            [] => Ok((root, None)),
            _ => Err(self.several("the checkpoint holds more than one network", "", entries)),
        }
    }

    /// CleanRL's files for continuous actions save actor and critics as a tuple.
    fn one_of(&self, list: &[Id], inside: Option<&str>) -> Result<(Id, Option<String>), Message> {
        let numbered = list.iter().enumerate().filter(|(_, id)| self.holds_tensors(**id));
        let networks: Vec<(usize, Id)> = numbered.map(|(index, id)| (index, *id)).collect();
        let chosen = match inside {
            Some(key) => networks.iter().filter(|(index, _)| index.to_string() == key).collect(),
            None => {
                let keys = |id: Id| {
                    self.pickle
                        .entries(id)
                        .iter()
                        .filter_map(|(key, _)| self.pickle.text(*key))
                };
                let is_actor = |id: Id| keys(id).any(is_mean);
                let actors: Vec<_> = networks.iter().filter(|(_, id)| is_actor(*id)).collect();
                if networks.len() == 1 {
                    networks.iter().collect()
                } else {
                    actors
                }
            }
        };
        let [(index, id)] = chosen.as_slice() else {
            let numbers: Vec<String> = networks.iter().map(|(index, _)| index.to_string()).collect();
            return Err(
                Message::new("the file holds a tuple of networks, and none is an actor by its names alone")
                    .found(format!("{} networks", networks.len()))
                    .expected(format!("one of {}", numbers.join(", ")))
                    .hint("say which: --inside NUMBER"),
            );
        };
        let said = format!("of the {} networks of the tuple number {index} is read", networks.len());
        Ok((*id, Some(said)))
    }

    fn several(&self, what: &str, found: &str, entries: &[(Id, Id)]) -> Message {
        let keys = entries.iter().filter_map(|(key, _)| self.pickle.text(*key));
        let keys: Vec<String> = keys.map(|key| key.escape_debug().to_string()).collect();
        let found = if found.is_empty() {
            keys.join(", ")
        } else {
            format!("`{}`", found.escape_debug())
        };
        Message::new(what)
            .found(found)
            .expected(format!("one of {}", keys.join(", ")))
            .hint("say which: --inside NAME")
    }

    fn is_tensor(&self, id: Id) -> bool {
        matches!(self.pickle.item(id), Item::Object(object) if object.class.starts_with("torch._utils._rebuild_"))
    }

    /// Whether a tensor lies in `id` or one below: a state dict, or a module.
    fn holds_tensors(&self, id: Id) -> bool {
        let pickle = self.pickle;
        let direct = pickle.entries(id).iter().any(|(_, value)| self.is_tensor(*value));
        direct || pickle.get(pickle.attributes(id), "_modules").is_some()
    }

    fn visit(&mut self, id: Id, name: &str, depth: usize) -> Result<(), Message> {
        self.visits += 1;
        if depth > DEEPEST || self.visits > MOST_VISITS {
            return Err(
                Message::new("the file is nested deeper than a network is").expected("a state dict, or a module")
            );
        }
        if self.is_tensor(id) {
            let tensor = self.tensor(id, name)?;
            // counters have no axis; names go into messages and comments
            if tensor.values.is_some() {
                sound(name, &tensor.shape)?;
            }
            self.found.tensors.push(tensor);
            return Ok(());
        }
        let pickle = self.pickle;
        let attributes = pickle.attributes(id);
        if let (Item::Object(object), Some(modules)) = (pickle.item(id), pickle.get(attributes, "_modules")) {
            let attribute = |key| pickle.get(attributes, key);
            self.found.modules.push(Module {
                class: object.class.clone(),
                number: attribute("negative_slope")
                    .or_else(|| attribute("alpha"))
                    .and_then(|id| pickle.number(id)),
                approximate: attribute("approximate")
                    .and_then(|id| pickle.text(id))
                    .map(str::to_owned),
            });
            if let Some(epsilon) = pickle.get(attributes, "eps").and_then(|id| pickle.number(id)) {
                self.found.epsilons.push((name.to_owned(), epsilon));
            }
            for part in ["_parameters", "_buffers"] {
                if let Some(part) = pickle.get(attributes, part) {
                    self.visit(part, name, depth + 1)?;
                }
            }
            return self.visit(modules, name, depth + 1);
        }
        for (key, value) in pickle.entries(id) {
            let key = match pickle.item(*key) {
                Item::Text(text) => text.clone(),
                Item::Int(number) => number.to_string(),
                _ => continue,
            };
            let joined = if name.is_empty() { key } else { format!("{name}.{key}") };
            self.visit(*value, &joined, depth + 1)?;
        }
        Ok(())
    }

    fn tensor(&mut self, id: Id, name: &str) -> Result<NamedTensor, Message> {
        let Item::Object(object) = self.pickle.item(id) else {
            return Err(odd(name));
        };
        let arguments = self.pickle.list(object.arguments).unwrap_or_default();
        // a parameter holds a tensor
        if object.class.starts_with("torch._utils._rebuild_parameter") {
            let inner = arguments.first().filter(|inner| self.is_plain_tensor(**inner));
            return self.tensor(*inner.ok_or_else(|| odd(name))?, name);
        }
        let [storage, offset, shape, strides, ..] = arguments else {
            return Err(odd(name));
        };
        let (kind, bytes) = self.storage(*storage).ok_or_else(|| odd(name))?;
        let sizes = |id: Id| {
            self.pickle
                .list(id)?
                .iter()
                .map(|id| self.pickle.size(*id))
                .collect::<Option<Vec<usize>>>()
        };
        let (shape, strides) = sizes(*shape).zip(sizes(*strides)).ok_or_else(|| odd(name))?;
        let offset = self.pickle.size(*offset).ok_or_else(|| odd(name))?;
        let element = |index: usize| match kind {
            Kind::F32 => number(bytes, index).map(f32::from_le_bytes).map(f64::from),
            Kind::F64 => number(bytes, index).map(f64::from_le_bytes),
            Kind::F16 => number(bytes, index).map(half::f16::from_le_bytes).map(f64::from),
            Kind::Bf16 => number(bytes, index).map(half::bf16::from_le_bytes).map(f64::from),
            Kind::Other => None,
        };
        let count = shape
            .iter()
            .try_fold(1_usize, |product, size| product.checked_mul(*size));
        let count = count
            .filter(|_| shape.len() == strides.len())
            .ok_or_else(|| odd(name))?;
        // views may overlap: their sum, too, is held against the file
        self.left = self.left.checked_sub(count).ok_or_else(|| odd(name))?;
        let values = match kind {
            Kind::Other => None,
            _ => Some(
                (0..count)
                    .map(|index| element(place(index, offset, &shape, &strides)?))
                    .collect::<Option<Vec<f64>>>(),
            ),
        };
        let values = values.map(|values| values.ok_or_else(|| odd(name))).transpose()?;
        if values.iter().flatten().any(|value| !value.is_finite()) {
            return Err(Message::new(format!(
                "the tensor `{}` holds a number that is not finite",
                name.escape_debug()
            ))
            .expected("finite numbers")
            .hint("the training has diverged, or the file was damaged"));
        }
        Ok(NamedTensor {
            name: name.to_owned(),
            shape,
            values,
        })
    }

    /// One more level of parameters would let a file recurse.
    fn is_plain_tensor(&self, id: Id) -> bool {
        matches!(self.pickle.item(id), Item::Object(Object { class, .. }) if class.starts_with("torch._utils._rebuild_tensor"))
    }

    /// Type and bytes of a storage: `("storage", torch.FloatStorage, "0", "cpu", 96)`.
    fn storage(&self, id: Id) -> Option<(Kind, &'a [u8])> {
        let Item::Persistent(id) = self.pickle.item(id) else {
            return None;
        };
        let [_, class, key, ..] = self.pickle.list(*id)? else {
            return None;
        };
        let Item::Global(class) = self.pickle.item(*class) else {
            return None;
        };
        let kind = match class.as_str() {
            "torch.FloatStorage" => Kind::F32,
            "torch.DoubleStorage" => Kind::F64,
            "torch.HalfStorage" => Kind::F16,
            "torch.BFloat16Storage" => Kind::Bf16,
            _ => Kind::Other,
        };
        let bytes = self
            .archive
            .get(&format!("{}data/{}", self.root, self.pickle.text(*key)?))?;
        Some((kind, bytes))
    }
}

#[derive(Clone, Copy)]
enum Kind {
    F32,
    F64,
    F16,
    Bf16,
    Other,
}

fn number<const N: usize>(bytes: &[u8], index: usize) -> Option<[u8; N]> {
    bytes.get(index.checked_mul(N)?..)?.first_chunk::<N>().copied()
}

/// Where an element of a view lies in its storage; the last axis runs fastest.
fn place(index: usize, offset: usize, shape: &[usize], strides: &[usize]) -> Option<usize> {
    let (mut rest, mut place) = (index, offset);
    for (size, stride) in shape.iter().zip(strides).rev() {
        place = place.checked_add((rest % size).checked_mul(*stride)?)?;
        rest /= size;
    }
    Some(place)
}

/// Whether a name can stand in messages and comments, and the tensor holds anything; as in safetensors.
pub(crate) fn sound(name: &str, shape: &[usize]) -> Result<(), Message> {
    let allowed = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '.' | '/' | ':' | '-');
    if name.is_empty() || name.len() > MAX_TENSOR_NAME_CHARS || !name.chars().all(allowed) {
        let short: String = name.chars().take(MAX_TENSOR_NAME_CHARS).collect();
        return Err(Message::new("this tensor name is not safe to print")
            .found(format!("\"{}\"", short.escape_debug()))
            .expected("1 to 128 of A-Z, a-z, 0-9, _ . / : -"));
    }
    if shape.contains(&0) {
        return Err(odd(name));
    }
    Ok(())
}

fn odd(name: &str) -> Message {
    Message::new(format!("the tensor `{}` cannot be read", name.escape_debug()))
        .expected("a dense tensor of 16, 32 or 64-bit floats whose storage lies in the archive")
        .hint("save the network alone, on the CPU: torch.save(net.cpu().state_dict(), \"weights.pt\")")
}
