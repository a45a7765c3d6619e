//! Neurons whose ReLU does nothing over the clamped box of observations.

use policy::{Interval, Policy};

use crate::{Certifier, Domain, propagate};

/// What is proven of the neurons of a hidden ReLU layer, in the policy's numeric format.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Neurons {
    /// Never above 0 before the activation: +0 behind it, for every observation.
    pub dead: Vec<usize>,
    /// Never below 0 before it: the activation changes nothing.
    pub always_on: Vec<usize>,
}

impl Certifier {
    /// Proven neurons of each layer, over the bounds of the features and the golden observations.
    ///
    /// They hold for the arithmetic of the format, its rounding included; layers without ReLU, and the last, have none.
    #[must_use]
    pub fn neurons(&self, policy: &Policy) -> Vec<Neurons> {
        let sums = propagate::sums(
            &self.network,
            self.observations.form(&whole(policy, &self.observations)),
        );
        let last = policy.layers.len().saturating_sub(1);
        let mut dead_inputs: Vec<usize> = Vec::new();
        let mut found = Vec::with_capacity(sums.len());
        for (index, (layer, sums)) in policy.layers.iter().zip(&sums).enumerate() {
            let mut neurons = Neurons::default();
            if layer.activation.is_rectifier() && index < last {
                for (output, sum) in sums.iter().enumerate() {
                    let row = &layer.weights[output * layer.inputs..][..layer.inputs];
                    let mut weights = row.iter().enumerate();
                    // adding products that are 0 leaves the bias as it is
                    let is_silent = weights.all(|(input, w)| *w == 0.0 || dead_inputs.contains(&input));
                    // 0 itself is dead, too: behind the activation it is the same +0
                    if sum.high <= 0.0 || is_silent && layer.bias[output] <= 0.0 {
                        neurons.dead.push(output);
                    } else if sum.low >= 0.0 {
                        neurons.always_on.push(output);
                    }
                }
            }
            // layer by layer: what is dead here is a zero input of the next
            dead_inputs.clone_from(&neurons.dead);
            found.push(neurons);
        }
        found
    }
}

/// The box of observations with the golden ones, which a trainer may have drawn elsewhere.
fn whole(policy: &Policy, observations: &Domain) -> Vec<Interval> {
    let mut whole = observations.whole();
    if let Some(golden) = &policy.golden {
        for observation in golden.observations.chunks_exact(whole.len().max(1)) {
            for (range, o) in whole.iter_mut().zip(observation) {
                range.low = range.low.min(f64::from(*o));
                range.high = range.high.max(f64::from(*o));
            }
        }
    }
    whole
}
