//! Activations with their literals, and the contract's rational function for tanh.

use policy::{Activation, Layer, Scalar};

use crate::program::{ActivationCode, Literal};

/// Numerator of the tanh approximation, lowest power first (contract section 6).
pub const TANH_NUMERATOR: [f64; 5] = [
    0.999_999_9,
    0.133_732_08,
    0.003_486_593_3,
    2.047_200_7e-5,
    1.318_444_4e-8,
];
/// Denominator of the tanh approximation, lowest power first (contract section 6).
pub const TANH_DENOMINATOR: [f64; 5] = [1.0, 0.467_065_04, 0.025_842_024, 0.000_327_140_35, 7.702_759e-7];
/// Beyond this magnitude the approximation is evaluated at the end of its range.
pub const TANH_RANGE: f64 = 9.0;

/// Activation with its literals.
pub fn activation(scalar: Scalar, layer: &Layer) -> ActivationCode {
    match layer.activation {
        Activation::Identity => ActivationCode::Identity,
        Activation::Relu => ActivationCode::Relu,
        Activation::LeakyRelu { slope } => ActivationCode::LeakyRelu(Literal::nearest(scalar, slope)),
        Activation::Tanh => ActivationCode::Tanh,
    }
}
