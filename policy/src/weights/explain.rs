//! Why no chain of layers fits: the closest one, and the first tensor in it that does not.

use toml_input::{Fault, FileName};

use super::catalogue;
use super::chain::{Chain, Ends};
use super::layers::{Dense, Layers, Place, is_target};
use super::tensors::Tensor;
use crate::limits::MAX_LAYERS;

/// Everything the explanation looks at.
pub(crate) struct Scene<'a> {
    pub file: &'a FileName,
    pub tensors: &'a [Tensor],
    pub layers: &'a Layers,
    pub ends: Ends,
}

impl Scene<'_> {
    fn dense(&self, index: usize) -> &Dense {
        &self.layers.dense[index]
    }

    fn fault(&self, layer: &Dense, message: toml_input::Message) -> Fault {
        self.file.tensor_fault(&self.tensors[layer.weight].name, message)
    }

    /// Faults of a file in which no chain fits; `members` are the layers that were tried.
    pub fn explain(&self, members: &[usize]) -> Vec<Fault> {
        // first what explains the rest: without its weight a layer is missing, and widths cannot join
        let orphans: Vec<_> = self.layers.orphans.iter().map(|&bias| self.orphan(bias)).collect();
        if !orphans.is_empty() {
            return orphans;
        }
        let odd = self.odd_shapes();
        if !odd.is_empty() {
            return odd;
        }
        if members.is_empty() {
            let names: Vec<String> = self.tensors.iter().map(|tensor| format!("`{}`", tensor.name)).collect();
            return vec![self.file.fault(catalogue::no_layers(&names.join(", ")))];
        }
        let closest = self.closest(members);
        match self.mismatch(&closest) {
            Some(fault) => vec![fault],
            None if closest.len() > MAX_LAYERS => vec![self.file.fault(catalogue::too_deep(closest.len()))],
            None => {
                let names: Vec<_> = members.iter().map(|&i| self.describe(i)).collect();
                vec![self.file.fault(catalogue::no_order(&names.join(", ")))]
            }
        }
    }

    fn describe(&self, index: usize) -> String {
        let layer = self.dense(index);
        format!("{} ({} -> {})", layer.stem, layer.inputs, layer.outputs)
    }

    fn orphan(&self, bias: usize) -> Fault {
        let name = &self.tensors[bias].name;
        let weight = name.replace("bias", "weight");
        let message = catalogue::missing_tensor(&weight, &format!("there is a `{name}` but no weight beside it"));
        self.file.tensor_fault(&weight, message)
    }

    /// Weights that are no matrix.
    fn odd_shapes(&self) -> Vec<Fault> {
        let weights = self.tensors.iter().filter(|tensor| {
            let role = super::layers::role(&tensor.name);
            tensor.shape.len() != 2 && role.is_some_and(|(_, role)| role != super::layers::Role::Bias)
        });
        let fault = |tensor: &Tensor| {
            let message = catalogue::wrong_shape("a dense layer's weight", &tensor.shape, &[], None);
            self.file
                .tensor_fault(&tensor.name, message.expected("two axes: [out, in]"))
        };
        weights.map(fault).collect()
    }

    /// The longest row of numbered siblings, own before target network; all layers if no row has two.
    fn closest(&self, members: &[usize]) -> Chain {
        let own: Vec<usize> = members
            .iter()
            .copied()
            .filter(|&i| !is_target(&self.dense(i).stem))
            .collect();
        // training keeps target networks beside the one in use, and that one is to be explained
        let members = if own.is_empty() { members } else { &own };
        let family = |i: usize| Place::of(&self.dense(i).stem).family;
        let row = |i: usize| {
            members
                .iter()
                .copied()
                .filter(|&j| family(j) == family(i))
                .collect::<Chain>()
        };
        let mut best = Chain::new();
        for &i in members {
            let row = row(i);
            if row.len() > best.len() {
                best = row;
            }
        }
        if best.len() < 2 { members.to_vec() } else { best }
    }

    /// The first layer of `chain` that does not fit what is before or behind it.
    pub fn mismatch(&self, chain: &[usize]) -> Option<Fault> {
        let mut inputs = self.ends.inputs;
        for (position, &index) in chain.iter().enumerate() {
            let layer = self.dense(index);
            let last = position + 1 == chain.len();
            let wanted_inputs = inputs.unwrap_or(layer.inputs);
            let wanted_outputs = self.ends.outputs.filter(|_| last).unwrap_or(layer.outputs);
            if (layer.inputs, layer.outputs) != (wanted_inputs, wanted_outputs) {
                let next = chain.get(position + 1).map(|&next| self.dense(next));
                let flipped = self.fits_flipped(chain, layer, wanted_inputs, next);
                let (outputs, inputs) = if flipped {
                    (layer.inputs, layer.outputs)
                } else {
                    (wanted_outputs, wanted_inputs)
                };
                let hint = self.hint(chain, position, flipped);
                let expected = layer.stored_shape(outputs, inputs);
                let what = format!("layer `{}`", layer.stem);
                let found = &self.tensors[layer.weight].shape;
                return Some(self.fault(layer, catalogue::wrong_shape(&what, found, &expected, hint)));
            }
            inputs = Some(layer.outputs);
        }
        None
    }

    fn fits_flipped(&self, chain: &[usize], layer: &Dense, inputs: usize, next: Option<&Dense>) -> bool {
        let follows = match next {
            Some(next) => next.inputs == layer.inputs || self.all_flipped(chain),
            None => self.ends.outputs.is_none_or(|outputs| outputs == layer.inputs),
        };
        layer.outputs == inputs && follows
    }

    /// Whether the whole chain fits with every weight the other way round.
    fn all_flipped(&self, chain: &[usize]) -> bool {
        let mut inputs = self.ends.inputs;
        for &index in chain {
            let layer = self.dense(index);
            if inputs.is_some_and(|n| n != layer.outputs) {
                return false;
            }
            inputs = Some(layer.inputs);
        }
        // an unknown end fits whatever comes
        inputs == self.ends.outputs.or(inputs)
    }

    fn hint(&self, chain: &[usize], position: usize, flipped: bool) -> Option<String> {
        // before the single tensor: if the whole chain fits flipped, one setting mends it
        if self.all_flipped(chain) {
            let setting = !self.dense(chain[position]).transposed;
            return Some(format!(
                "all weights are the other way round: set `transpose = {setting}` in [network]"
            ));
        }
        if flipped {
            return Some("this tensor alone is transposed: export it again".to_owned());
        }
        let layer = self.dense(chain[position]);
        if position == 0 && self.ends.inputs.is_some_and(|n| n != layer.inputs) {
            let features = self.ends.inputs.unwrap_or_default();
            return Some(format!(
                "the network takes {} inputs, the contract lists {features} features",
                layer.inputs
            ));
        }
        let last = position + 1 == chain.len();
        let actions = self.ends.outputs.filter(|n| last && *n != layer.outputs)?;
        Some(format!(
            "the network has {} outputs, the contract lists {actions} actions",
            layer.outputs
        ))
    }
}
