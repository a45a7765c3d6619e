//! Small networks from a seed, so that binary fixtures can be made again, and the code generated from a policy.

use std::collections::BTreeMap;

use codegen::{CodegenError, Output};
use policy::Policy;
use random::{Random, SplitMix};
use safetensors::tensor::TensorView;
use safetensors::{Dtype, SafeTensorError};
use targets::TargetSpec;

/// How a network is drawn: `# network: seed 7, widths 3-33-20`, or with `, biases 0.25` behind it.
#[derive(Debug, Clone, PartialEq)]
pub struct Recipe {
    /// Seed of the weights.
    pub seed: u64,
    /// Inputs, then outputs of each layer.
    pub widths: Vec<usize>,
    /// Spread of the biases in that of the weights: with small ones the sums of every layer come to both sides of 0.
    pub biases: f64,
}

impl Recipe {
    /// The recipe in a contract's text, if one stands there.
    #[must_use]
    pub fn of(contract: &str) -> Option<Self> {
        let line = contract
            .lines()
            .find_map(|line| line.strip_prefix("# network: seed "))?;
        let (seed, rest) = line.split_once(", widths ")?;
        let (widths, biases) = rest.split_once(", biases ").unwrap_or((rest, "1"));
        let widths: Result<Vec<usize>, _> = widths.trim().split('-').map(str::parse).collect();
        Some(Self {
            seed: seed.parse().ok()?,
            widths: widths.ok()?,
            biases: biases.trim().parse().ok()?,
        })
    }

    /// The network as a safetensors file, tensors `fc0.weight`, `fc0.bias`, ...
    ///
    /// # Errors
    /// If the widths make no network.
    pub fn network(&self) -> Result<Vec<u8>, SafeTensorError> {
        let mut rng = SplitMix::new(self.seed);
        let mut tensors = Vec::new();
        for (layer, pair) in self.widths.windows(2).enumerate() {
            let (inputs, outputs) = (pair[0], pair[1]);
            let spread = 1.5 / (inputs as f64).sqrt();
            let mut draw = |count: usize, spread: f64| -> Vec<u8> {
                let values = (0..count).map(|_| rng.uniform(-spread, spread) as f32);
                values.flat_map(f32::to_le_bytes).collect()
            };
            tensors.push((
                format!("fc{layer}.weight"),
                vec![outputs, inputs],
                draw(inputs * outputs, spread),
            ));
            tensors.push((
                format!("fc{layer}.bias"),
                vec![outputs],
                draw(outputs, self.biases * spread),
            ));
        }
        let views = tensors
            .iter()
            .map(|(name, shape, data)| Ok((name, TensorView::new(Dtype::F32, shape.clone(), data)?)))
            .collect::<Result<Vec<_>, SafeTensorError>>()?;
        safetensors::serialize(views, None)
    }
}

/// Place of the first value of a tensor in a safetensors file.
#[must_use]
pub fn first_byte(file: &[u8], tensor: &str) -> Option<usize> {
    let (length, rest) = file.split_first_chunk::<8>()?;
    let length = usize::try_from(u64::from_le_bytes(*length)).ok()?;
    let header: serde_json::Value = serde_json::from_slice(rest.get(..length)?).ok()?;
    let offset = usize::try_from(header[tensor]["data_offsets"][0].as_u64()?).ok()?;
    Some(8 + length + offset)
}

/// Everything that `policyc compile` writes for these outputs, apart from the kit: file name to text.
///
/// # Errors
/// Only for a fault in the compiler.
pub fn generate(
    policy: &Policy,
    target: &TargetSpec,
    outputs: &[Output],
) -> Result<BTreeMap<String, String>, CodegenError> {
    Ok(codegen::generate(policy, target, outputs, None)?.files)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_recipe_is_read_from_the_contract() {
        let recipe = Recipe::of("# a\n# network: seed 12, widths 3-5-4\nname = 1\n").unwrap();
        assert_eq!((recipe.seed, recipe.widths, recipe.biases), (12, vec![3, 5, 4], 1.0));
        let recipe = Recipe::of("# network: seed 12, widths 3-5-4, biases 0.25").unwrap();
        assert_eq!((recipe.widths, recipe.biases), (vec![3, 5, 4], 0.25));
        assert_eq!(Recipe::of("name = 1\n"), None);
    }

    #[test]
    fn a_value_is_found_in_the_file() {
        let recipe = Recipe {
            seed: 1,
            widths: vec![2, 3, 2],
            biases: 1.0,
        };
        let file = recipe.network().unwrap();
        let start = first_byte(&file, "fc1.bias").unwrap();
        let tensors = safetensors::SafeTensors::deserialize(&file).unwrap();
        assert_eq!(tensors.tensor("fc1.bias").unwrap().data(), &file[start..start + 8]);
        assert_eq!(first_byte(&file, "fc2.bias"), None);
    }

    #[test]
    fn equal_seeds_give_equal_networks_and_others_do_not() {
        let network = |seed| {
            Recipe {
                seed,
                widths: vec![2, 3],
                biases: 1.0,
            }
            .network()
            .unwrap()
        };
        assert_eq!(network(1), network(1));
        assert_ne!(network(1), network(2));
    }
}
