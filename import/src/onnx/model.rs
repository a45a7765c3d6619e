//! The parts of an ONNX model that a chain of dense layers has: nodes, attributes and constants. The numbers of the fields are
//! those of onnx.proto.

use std::collections::BTreeMap;
use std::path::{Component, Path};

use policy::limits::MAX_WEIGHT_BYTES;
use toml_input::{FileName, Message};

use super::wire::{Value, broken, fields, numbers};

/// A constant of the graph.
#[derive(Debug, Clone)]
pub(crate) struct Constant {
    pub shape: Vec<usize>,
    /// Empty where the elements are no floats.
    pub values: Vec<f64>,
}

#[derive(Debug, Clone, Default)]
pub(crate) struct Node {
    pub name: String,
    pub operation: String,
    pub inputs: Vec<String>,
    pub outputs: Vec<String>,
    pub floats: BTreeMap<String, f64>,
    pub integers: BTreeMap<String, i64>,
    pub texts: BTreeMap<String, String>,
}

impl Node {
    /// What people know it by: its name, which ONNX does not ask for; else the tensor of its weights, else what it gives.
    pub fn label(&self) -> &str {
        let has_weights = matches!(self.operation.as_str(), "Gemm" | "MatMul");
        let weights = self.inputs.get(1).filter(|_| has_weights);
        let known = [Some(&self.name), weights, self.outputs.first()];
        let mut known = known.into_iter().flatten();
        known.find(|name| !name.is_empty()).map_or("", String::as_str)
    }
}

#[derive(Debug, Default)]
pub(crate) struct Graph {
    pub nodes: Vec<Node>,
    pub constants: BTreeMap<String, Constant>,
    /// Names of what the graph takes, without constants.
    pub inputs: Vec<String>,
    pub outputs: Vec<String>,
}

impl Graph {
    /// Keras's exporter shares one constant among layers by `Identity`.
    fn pass_constants_on(&mut self) {
        let Graph { nodes, constants, .. } = self;
        // nodes stand in the order in which they are computed
        nodes.retain(|node| {
            let copied = match (node.operation.as_str(), node.inputs.as_slice(), node.outputs.as_slice()) {
                ("Identity", [from], [to]) => constants.get(from).cloned().map(|constant| (to.clone(), constant)),
                _ => None,
            };
            let is_used = copied.is_none();
            constants.extend(copied);
            is_used
        });
    }
}

/// Reads a model; tensors outside it lie in its own folder.
pub(crate) fn read(file: &FileName, bytes: &[u8]) -> Result<Graph, Message> {
    let model = fields(bytes)?;
    let graph = model.iter().find_map(|field| match field {
        (7, Value::Bytes(bytes)) => Some(*bytes),
        _ => None,
    });
    let mut graph_read = Graph::default();
    let mut outside = Outside {
        file,
        read: BTreeMap::new(),
    };
    for (number, value) in fields(graph.ok_or_else(broken)?)? {
        let Value::Bytes(bytes) = value else { continue };
        match number {
            1 => {
                let (node, constant) = node(bytes, &mut outside)?;
                match (constant, node.outputs.first()) {
                    (Some(constant), Some(name)) if node.operation == "Constant" => {
                        graph_read.constants.insert(name.clone(), constant);
                    }
                    _ => graph_read.nodes.push(node),
                }
            }
            5 => {
                let (name, constant) = tensor(bytes, &mut outside)?;
                graph_read.constants.insert(name, constant);
            }
            11 => graph_read.inputs.push(text_of(bytes, 1)?),
            12 => graph_read.outputs.push(text_of(bytes, 1)?),
            _ => {}
        }
    }
    graph_read.pass_constants_on();
    // older exporters list constants among the inputs
    let Graph { constants, inputs, .. } = &mut graph_read;
    inputs.retain(|input| !constants.contains_key(input));
    Ok(graph_read)
}

fn text(bytes: &[u8]) -> Result<String, Message> {
    let text = std::str::from_utf8(bytes).map_err(|_| broken())?;
    Ok(text.chars().filter(|c| !c.is_control()).take(200).collect())
}

fn text_of(message: &[u8], number: u64) -> Result<String, Message> {
    for (found, value) in fields(message)? {
        if let (true, Value::Bytes(bytes)) = (found == number, value) {
            return text(bytes);
        }
    }
    Ok(String::new())
}

fn node(message: &[u8], outside: &mut Outside<'_>) -> Result<(Node, Option<Constant>), Message> {
    let mut node = Node::default();
    let mut constant = None;
    for (number, value) in fields(message)? {
        let Value::Bytes(bytes) = value else { continue };
        match number {
            1 => node.inputs.push(text(bytes)?),
            2 => node.outputs.push(text(bytes)?),
            3 => node.name = text(bytes)?,
            4 => node.operation = text(bytes)?,
            5 => {
                let name = text_of(bytes, 1)?;
                for (number, value) in fields(bytes)? {
                    match (number, value) {
                        (2, Value::Fixed32(bytes)) => {
                            node.floats.insert(name.clone(), f32::from_le_bytes(bytes).into());
                        }
                        (3, Value::Number(number)) => {
                            node.integers.insert(name.clone(), number as i64);
                        }
                        (4, Value::Bytes(bytes)) => drop(node.texts.insert(name.clone(), text(bytes)?)),
                        (5, Value::Bytes(bytes)) if node_is_constant(&name) => {
                            constant = Some(tensor(bytes, outside)?.1);
                        }
                        _ => {}
                    }
                }
            }
            _ => {}
        }
    }
    Ok((node, constant))
}

fn node_is_constant(attribute: &str) -> bool {
    attribute == "value"
}

fn tensor(message: &[u8], outside: &mut Outside<'_>) -> Result<(String, Constant), Message> {
    let (mut name, mut shape, mut kind) = (String::new(), Vec::new(), 0);
    let (mut data, mut floats, mut place) = (None, Vec::new(), BTreeMap::new());
    for (number, value) in fields(message)? {
        match (number, value) {
            (1, value) => {
                for size in numbers(value)? {
                    shape.push(usize::try_from(size).map_err(|_| broken())?);
                }
            }
            (2, Value::Number(number)) => kind = number,
            (4, Value::Bytes(packed)) => floats.extend(
                packed
                    .as_chunks::<4>()
                    .0
                    .iter()
                    .map(|b| f64::from(f32::from_le_bytes(*b))),
            ),
            (4, Value::Fixed32(one)) => floats.push(f32::from_le_bytes(one).into()),
            (8, Value::Bytes(bytes)) => name = text(bytes)?,
            (9, Value::Bytes(bytes)) => data = Some(bytes.to_vec()),
            (10, Value::Bytes(packed)) => {
                floats.extend(packed.as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b)))
            }
            (13, Value::Bytes(entry)) => drop(place.insert(text_of(entry, 1)?, text_of(entry, 2)?)),
            _ => {}
        }
    }
    if !place.is_empty() {
        data = Some(outside.slice(&place)?);
    }
    let values = match (kind, data) {
        (1, Some(data)) => data
            .as_chunks::<4>()
            .0
            .iter()
            .map(|b| f64::from(f32::from_le_bytes(*b)))
            .collect(),
        (11, Some(data)) => data.as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b)).collect(),
        (10, Some(data)) => data
            .as_chunks::<2>()
            .0
            .iter()
            .map(|b| half::f16::from_le_bytes(*b).to_f64())
            .collect(),
        (1 | 11, None) => floats,
        // shapes and axes
        _ => {
            return Ok((
                name,
                Constant {
                    shape,
                    values: Vec::new(),
                },
            ));
        }
    };
    let count = shape
        .iter()
        .try_fold(1_usize, |product, size| product.checked_mul(*size));
    if count != Some(values.len()) || values.iter().any(|value: &f64| !value.is_finite()) {
        return Err(Message::new(format!("the constant `{name}` is not sound"))
            .found(format!("{} finite numbers or fewer for shape {shape:?}", values.len()))
            .expected("a finite number for each element"));
    }
    Ok((name, Constant { shape, values }))
}

/// Files of external data, each read once.
struct Outside<'a> {
    file: &'a FileName,
    read: BTreeMap<String, Vec<u8>>,
}

impl Outside<'_> {
    fn slice(&mut self, place: &BTreeMap<String, String>) -> Result<Vec<u8>, Message> {
        let location = place.get("location").map_or("", String::as_str);
        let mut parts = Path::new(location).components();
        // a model from elsewhere could name any file of this machine
        if location.is_empty() || !parts.all(|part| matches!(part, Component::Normal(_))) {
            return Err(Message::new("the model's external data lie outside its folder")
                .found(format!("`{}`", location.escape_debug()))
                .expected("a file beside the model"));
        }
        if !self.read.contains_key(location) {
            let bytes = self.file.beside(location).read(MAX_WEIGHT_BYTES)?;
            self.read.insert(location.to_owned(), bytes);
        }
        let bytes = self.read.get(location).map_or(&[][..], Vec::as_slice);
        let number = |key: &str| {
            place
                .get(key)
                .map(|text| text.parse::<usize>().map_err(|_| broken()))
                .transpose()
        };
        let offset = number("offset")?.unwrap_or(0);
        let end = match number("length")? {
            Some(length) => offset.checked_add(length).ok_or_else(broken)?,
            None => bytes.len(),
        };
        bytes.get(offset..end).map(<[u8]>::to_vec).ok_or_else(|| {
            Message::new("the model's external data are cut off")
                .found(format!("{} bytes in `{location}`", bytes.len()))
                .expected(format!("at least {end}"))
        })
    }
}
