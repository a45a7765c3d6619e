//! Tensor names to dense layers: PyTorch `<layer>.weight`, Keras and Flax `<layer>/kernel`.

use super::tensors::Tensor;

/// What a tensor is in its layer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Role {
    /// `[out, in]`.
    Weight,
    /// `[in, out]`.
    Kernel,
    Bias,
}

/// A dense layer as named in the file; shapes as the layer means them, after any transposition.
#[derive(Debug, Clone)]
pub(crate) struct Dense {
    pub stem: String,
    /// Index of the weight in the list of tensors.
    pub weight: usize,
    /// Index of the bias in the list of tensors.
    pub bias: Option<usize>,
    pub transposed: bool,
    pub inputs: usize,
    pub outputs: usize,
}

impl Dense {
    /// Shape of the stored tensor for a layer of these sizes.
    pub fn stored_shape(&self, outputs: usize, inputs: usize) -> [usize; 2] {
        if self.transposed {
            [inputs, outputs]
        } else {
            [outputs, inputs]
        }
    }
}

/// The layers of a file in natural order of their names.
#[derive(Debug, Default)]
pub(crate) struct Layers {
    pub dense: Vec<Dense>,
    /// Biases (index) without a weight.
    pub orphans: Vec<usize>,
}

/// Stem and role of a tensor by its name.
pub(crate) fn role(name: &str) -> Option<(&str, Role)> {
    // TensorFlow puts the number of an operation's output behind a name
    let name = name.strip_suffix(":0").unwrap_or(name);
    let (stem, leaf) = name.rsplit_once(['.', '/'])?;
    let role = match leaf {
        "weight" => Role::Weight,
        "kernel" => Role::Kernel,
        "bias" => Role::Bias,
        _ => return None,
    };
    (!stem.is_empty()).then_some((stem, role))
}

/// Groups tensors into layers; `transpose` overrides what the names say.
pub(crate) fn group(tensors: &[Tensor], transpose: Option<bool>) -> Layers {
    let mut layers = Layers::default();
    for (index, tensor) in tensors.iter().enumerate() {
        let Some((stem, role @ (Role::Weight | Role::Kernel))) = role(&tensor.name) else {
            continue;
        };
        // other shapes are named where they matter: as strangers, or if no chain fits
        let [rows, columns] = tensor.shape[..] else { continue };
        // PyTorch stores [out, in] as `weight`, Keras and Flax [in, out] as `kernel`
        let transposed = transpose.unwrap_or(role == Role::Kernel);
        let (outputs, inputs) = if transposed { (columns, rows) } else { (rows, columns) };
        let stem = stem.to_owned();
        layers.dense.push(Dense {
            stem,
            weight: index,
            bias: None,
            transposed,
            inputs,
            outputs,
        });
    }
    for (index, tensor) in tensors.iter().enumerate() {
        let Some((stem, Role::Bias)) = role(&tensor.name) else {
            continue;
        };
        match layers.dense.iter_mut().find(|layer| layer.stem == stem) {
            Some(layer) => layer.bias = Some(index),
            None => layers.orphans.push(index),
        }
    }
    layers.dense.sort_by(|a, b| Place::of(&a.stem).cmp(&Place::of(&b.stem)));
    layers
}

/// Where a layer stands among its siblings: everything around the last number, and the number.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Place<'a> {
    pub family: (&'a str, &'a str),
    pub number: Option<u64>,
}

impl<'a> Place<'a> {
    /// `fc10` is the 10th of `fc`, `net.4` the 4th of `net`, and Keras' `dense` comes before `dense_1`.
    pub fn of(stem: &'a str) -> Self {
        let Some(end) = stem.rfind(|c: char| c.is_ascii_digit()).map(|last| last + 1) else {
            return Place {
                family: (stem, ""),
                number: None,
            };
        };
        let start = stem[..end]
            .rfind(|c: char| !c.is_ascii_digit())
            .map_or(0, |before| before + 1);
        // so that Keras' `dense` and `dense_1` are of one family
        let family = stem[..start].trim_end_matches(['.', '/', '_', '-']);
        Place {
            family: (family, &stem[end..]),
            // more digits than 64 bits hold: it stands last, whatever it says
            number: Some(stem[start..end].parse().unwrap_or(u64::MAX)),
        }
    }
}

/// Whether the path names a target network, which training keeps beside the one in use.
pub(crate) fn is_target(stem: &str) -> bool {
    stem.split(['.', '/'])
        .any(|part| part == "target" || part.starts_with("target_") || part.ends_with("_target"))
}

/// All folders above a layer, the empty one for the file included.
pub(crate) fn ancestors(stem: &str) -> impl Iterator<Item = &str> {
    let inner = stem
        .char_indices()
        .filter(|(_, c)| matches!(c, '.' | '/'))
        .map(|(at, _)| &stem[..at]);
    std::iter::once("").chain(inner)
}

/// Whether the layer lies under `prefix`, which ends where a part of the name ends.
pub(crate) fn is_under(stem: &str, prefix: &str) -> bool {
    stem.strip_prefix(prefix).is_some_and(|rest| {
        let free = prefix.is_empty() || prefix.ends_with(['.', '/', '_']);
        free || rest.is_empty() || rest.starts_with(['.', '/']) || rest.starts_with(|c: char| c.is_ascii_digit())
    })
}

#[cfg(test)]
mod tests {
    use super::is_under;

    #[test]
    fn a_prefix_ends_where_a_part_of_the_name_ends() {
        for (stem, prefix, under) in [
            ("actor.0", "", true),
            ("actor.0", "actor.", true),
            ("actor.0", "actor", true),
            ("actor", "actor", true),
            ("fc1", "fc", true),
            ("actor_target.0", "actor", false),
            ("critic.0", "actor", false),
        ] {
            assert_eq!(is_under(stem, prefix), under, "{stem} under `{prefix}`");
        }
    }
}
