//! A policy's network twice: in real arithmetic, and what its numeric format makes of it.

use policy::scales::{self, SLOPE_BITS, power_of_two, round_half_up};
use policy::{Activation, NumericFormat, Policy, Shape};

use crate::form::{Form, Matrix};

/// Unit roundoff of binary32.
const UNIT_32: f64 = 1.0 / 16_777_216.0;
/// More than the rounding errors of a layer in the subnormal range of binary32.
const TINY_32: f64 = 1e-40;
/// An observation becomes an integer by rounding half up; `trunc(fl(x + 32768.5)) - 32768` behind a curve is at most this
/// far from x: one half, and half of the last bit below 2^16.
const TO_INTEGER: f64 = 0.5 + 1.0 / 512.0;

/// A layer with the weights of the policy and with those of the format.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Layer {
    pub weights: Matrix,
    pub bias: Vec<f64>,
    pub activation: Activation,
    /// As the format holds them; in floats the same.
    pub held: Matrix,
    /// `held - weights`; its rounding in binary64 is one more in the sum of products.
    pub excess: Matrix,
    pub bias_excess: Vec<f64>,
    step: Step,
}

/// Where a format rounds within a layer.
#[derive(Debug, Clone, PartialEq)]
enum Step {
    Float {
        is_fused: bool,
    },
    Integer {
        /// Per output: integer / 2^exponent is the sum.
        accumulators: Vec<i32>,
        /// The same behind the activation.
        outputs: Vec<i32>,
        shift: u32,
    },
}

/// Largest errors that the format adds around an activation.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Rounding {
    /// Before the activation.
    pub before: f64,
    /// Behind it, for the value 0 before it.
    pub after: f64,
    /// Behind it, in addition per magnitude before it.
    pub after_relative: f64,
}

/// A network in real arithmetic beside the same network in the policy's format.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Network {
    /// Largest |observation in the format - observation|, per feature.
    pub input_rounding: Vec<f64>,
    pub layers: Vec<Layer>,
}

impl Network {
    pub fn new(policy: &Policy) -> Self {
        let scales = scales::of(policy);
        let input_rounding = match &scales {
            Some(scales) => scales
                .inputs
                .iter()
                .map(|input| TO_INTEGER * power_of_two(-input.exponent) + TINY_32)
                .collect(),
            // floats take the observation as it is
            None => vec![0.0; policy.features.len()],
        };
        let layer = |(index, layer): (usize, &policy::Layer)| {
            let scale = scales.as_ref().and_then(|scales| scales.layers.get(index));
            Layer::new(layer, scale, policy.numeric_format)
        };
        Self {
            input_rounding,
            layers: policy.layers.iter().enumerate().map(layer).collect(),
        }
    }
}

impl Layer {
    fn new(layer: &policy::Layer, scale: Option<&scales::LayerScale>, format: NumericFormat) -> Self {
        let weights = Matrix {
            rows: layer.outputs,
            columns: layer.inputs,
            data: layer.weights.iter().map(|w| f64::from(*w)).collect(),
        };
        let bias: Vec<f64> = layer.bias.iter().map(|b| f64::from(*b)).collect();
        let (mut held, mut held_bias) = (weights.clone(), bias.clone());
        let mut step = Step::Float {
            is_fused: format == NumericFormat::F32Fma,
        };
        if let Some(scale) = scale {
            // an integer times a power of two: exact in binary64
            let grid =
                |x: f64, exponent: i32| round_half_up(x * power_of_two(exponent)) as f64 * power_of_two(-exponent);
            for (row, (bias, accumulator)) in held_bias.iter_mut().zip(&scale.accumulators).enumerate() {
                for (w, input) in held.row_mut(row).iter_mut().zip(&scale.inputs) {
                    *w = grid(*w, accumulator - input);
                }
                *bias = grid(*bias, *accumulator);
            }
            step = Step::Integer {
                accumulators: scale.accumulators.clone(),
                outputs: scale.outputs.clone(),
                shift: scale.shift,
            };
        }
        let mut excess = held.clone();
        for (excess, w) in excess.data.iter_mut().zip(&weights.data) {
            *excess -= w;
        }
        Self {
            bias_excess: held_bias.iter().zip(&bias).map(|(held, b)| held - b).collect(),
            activation: layer.activation,
            weights,
            bias,
            held,
            excess,
            step,
        }
    }

    /// What the format rounds at an output, given the real inputs, their errors and the magnitude before the activation
    /// in the format.
    pub fn rounding(&self, output: usize, inputs: &[f64], magnitude: f64) -> Rounding {
        match &self.step {
            Step::Float { is_fused } => self.float_rounding(output, inputs, *is_fused),
            Step::Integer {
                accumulators,
                outputs,
                shift,
            } => self.integer_rounding((accumulators[output], outputs[output]), *shift, magnitude),
        }
    }

    /// Each product and each partial sum is rounded once: half a unit in the last place of its magnitude at most.
    fn float_rounding(&self, output: usize, inputs: &[f64], is_fused: bool) -> Rounding {
        let (mut partial, mut rounded) = (self.bias[output].abs(), 0.0);
        for (w, x) in self.held.row(output).iter().zip(inputs) {
            let product = w.abs() * x;
            partial += product;
            // a product counts twice: it is rounded, and part of the sum that is; fused, it is not rounded by itself
            rounded += partial + if is_fused { 0.0 } else { product };
        }
        // the rounded sums are larger than the exact ones by their own errors: second order
        let before = UNIT_32 * rounded * (1.0 + 4.0 * UNIT_32 * inputs.len() as f64) * (1.0 + 1e-9) + TINY_32;
        // slope and product are rounded: two units, and a hundredth for the second order
        let relative = 2.01 * UNIT_32;
        match self.activation.shape() {
            Shape::Hinge { .. } if self.is_exact() => Rounding {
                before,
                ..Rounding::default()
            },
            Shape::Hinge { .. } => Rounding {
                before,
                after: TINY_32,
                after_relative: relative,
            },
            Shape::Curve(curve) => Rounding {
                before,
                after: curve.error_32.absolute,
                after_relative: curve.error_32.relative,
            },
        }
    }

    fn integer_rounding(&self, (accumulator, behind): (i32, i32), shift: u32, magnitude: f64) -> Rounding {
        let unit = power_of_two(shift.cast_signed() - accumulator);
        // the bias holds half of the last bit kept, so the shift rounds to nearest
        let cut = if shift == 0 { 0.0 } else { 0.5 * unit };
        match self.activation.shape() {
            Shape::Hinge { .. } if self.is_exact() => Rounding {
                before: cut,
                ..Rounding::default()
            },
            Shape::Hinge { below } => {
                // the slope as the format holds it; its product is rounded to the nearest integer
                let held = scales::slope_integer(below) as f64 * power_of_two(-SLOPE_BITS.cast_signed());
                Rounding {
                    before: cut,
                    after: 0.5 * unit,
                    after_relative: (held - below).abs().next_up(),
                }
            }
            Shape::Curve(curve) => Rounding {
                // the sum becomes a binary32 number; the power of two behind it rounds nothing
                before: 1.01 * UNIT_32 * magnitude + TINY_32,
                after: TO_INTEGER * power_of_two(-behind) + curve.error_32.absolute,
                after_relative: curve.error_32.relative,
            },
        }
    }

    /// Whether the activation itself rounds nothing: it keeps a value or clears it.
    fn is_exact(&self) -> bool {
        self.activation.is_identity() || self.activation.is_rectifier()
    }

    /// Real sums.
    pub fn real(&self, x: &Form) -> Form {
        Form::linear(&[(&self.weights, x)], &self.bias)
    }

    /// Sums of the format less the real ones: `held * error + (held - weights) * x + (held - real) bias`.
    pub fn error(&self, error: &Form, x: &Form) -> Form {
        Form::linear(&[(&self.held, error), (&self.excess, x)], &self.bias_excess)
    }
}
