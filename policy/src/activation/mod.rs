//! Activations: one row each, with the facts on which bounds, scales, certificates, training and texts rest.
//!
//! What an activation computes to the bit stands in section 6 of the numeric contract, and in the interpreter and the
//! compiler. Here stands what is *true* of it. Nothing outside of this file compares kinds: who wants to know whether an
//! activation is bounded, or may be scaled, asks for its [`Shape`].

mod curve;
mod functions;

use serde::Serialize;

use crate::interval::Interval;

pub use curve::{Bend, Curve, Error};
pub use functions::{
    GELU_RANGE, GELU_TANH_RANGE, GELU_TANH_TERMS, GELU_TERMS, HARD_RANGE, HARD_SLOPE, SILU_RANGE, SOFTPLUS_TERMS,
    TANH_DENOMINATOR, TANH_NUMERATOR, TANH_RANGE,
};

/// The graph of an activation.
#[derive(Debug, Clone, Copy)]
pub enum Shape {
    /// `x` above 0 and `below * x` elsewhere, `0 <= below <= 1`. Homogeneous: a positive factor before it is the same
    /// factor behind it, which is what allows rows of weights to be scaled.
    Hinge {
        /// Slope below 0.
        below: f64,
    },
    /// Any other function: no factor passes through it unchanged.
    Curve(&'static Curve),
}

/// Writes the enum and its list from the same rows, so that no kind can be in one and not in the other.
macro_rules! activations {
    ($($(#[doc = $meaning:literal])+ $kind:ident $({ $parameter:ident = $example:literal, $about:literal })?, $word:literal, $shape:expr;)+) => {
        /// Activation behind a layer (contract section 6).
        #[derive(Debug, Clone, Copy, PartialEq, Serialize)]
        #[serde(rename_all = "snake_case")]
        pub enum Activation {
            $($(#[doc = $meaning])+ $kind $({ #[doc = $about] $parameter: f64 })?,)+
        }

        impl Activation {
            /// One of each kind, with an example of its parameter.
            pub const EACH: &'static [Activation] = &[$(Activation::$kind $({ $parameter: $example })?),+];

            /// The word in a contract.
            #[must_use]
            pub fn word(self) -> &'static str {
                match self { $(Activation::$kind { .. } => $word,)+ }
            }

            /// Its graph.
            #[must_use]
            pub fn shape(self) -> Shape {
                match self { $(Activation::$kind $({ $parameter })? => $shape,)+ }
            }

            /// Name and value of the parameter of those that have one.
            #[must_use]
            pub fn parameter(self) -> Option<(&'static str, f64)> {
                match self {
                    $($(Activation::$kind { $parameter } => Some((stringify!($parameter), $parameter)),)?)+
                    _ => None,
                }
            }
        }
    };
}

activations! {
    /// max(x, 0).
    Relu, "relu", Shape::Hinge { below: 0.0 };
    /// Rational approximation without libm.
    Tanh, "tanh", Shape::Curve(&functions::TANH);
    /// x / (1 + |x|).
    Softsign, "softsign", Shape::Curve(&functions::SOFTSIGN);
    /// x or slope * x.
    LeakyRelu { slope = 0.01, "Slope for x < 0, 0 < slope < 1." }, "leaky_relu", Shape::Hinge { below: slope };
    /// None.
    Identity, "identity", Shape::Hinge { below: 1.0 };
    /// 1 / (1 + exp(-x)).
    Sigmoid, "sigmoid", Shape::Curve(&functions::SIGMOID);
    /// min(max(x + 3, 0), 6) / 6.
    HardSigmoid, "hard_sigmoid", Shape::Curve(&functions::HARD_SIGMOID);
    /// x above 0, exp(x) - 1 below.
    Elu, "elu", Shape::Curve(&functions::ELU);
    /// ln(1 + exp(x)).
    Softplus, "softplus", Shape::Curve(&functions::SOFTPLUS);
    /// x / (1 + exp(-x)), also called swish.
    Silu, "silu", Shape::Curve(&functions::SILU);
    /// x (1 + erf(x / sqrt(2))) / 2.
    Gelu, "gelu", Shape::Curve(&functions::GELU);
    /// The approximation of [`Activation::Gelu`] by a tanh.
    GeluTanh, "gelu_tanh", Shape::Curve(&functions::GELU_TANH);
    /// x min(max(x + 3, 0), 6) / 6.
    HardSwish, "hard_swish", Shape::Curve(&functions::HARD_SWISH);
}

impl Activation {
    /// The activation of that word, if it has no parameter.
    #[must_use]
    pub fn find(word: &str) -> Option<Activation> {
        // a slope that nobody wrote would be a guess: the reader asks for it
        Self::plain().find(|activation| activation.word() == word)
    }

    /// Those without a parameter.
    pub fn plain() -> impl Iterator<Item = Activation> {
        Self::EACH.iter().copied().filter(|each| each.parameter().is_none())
    }

    /// As a contract says it: `"relu"`, `{ leaky_relu = 0.01 }`.
    #[must_use]
    pub fn written(self) -> String {
        match self.parameter() {
            Some((_, value)) => format!("{{ {} = {value:?} }}", self.word()),
            None => format!("\"{}\"", self.word()),
        }
    }

    /// For people: `relu`, `leaky relu, slope 0.01`.
    #[must_use]
    pub fn label(self) -> String {
        let words = self.word().replace('_', " ");
        match self.parameter() {
            Some((name, value)) => format!("{words}, {name} {value}"),
            None => words,
        }
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_identity(self) -> bool {
        // equality is exact: the slope of a contract lies between 0 and 1, ends excluded, so 1 is the identity alone
        matches!(self.shape(), Shape::Hinge { below } if below == 1.0)
    }

    /// Whether everything that is not above 0 becomes +0, zeros of both signs included.
    #[must_use]
    pub fn is_rectifier(self) -> bool {
        matches!(self.shape(), Shape::Hinge { below } if below == 0.0)
    }

    /// Whether a positive factor before it is the same factor behind it.
    #[must_use]
    pub fn is_homogeneous(self) -> bool {
        matches!(self.shape(), Shape::Hinge { .. })
    }

    /// The curve, if it is one.
    #[must_use]
    pub fn curve(self) -> Option<&'static Curve> {
        match self.shape() {
            Shape::Hinge { .. } => None,
            Shape::Curve(curve) => Some(curve),
        }
    }

    /// Least and largest value, if no value leaves them.
    #[must_use]
    pub fn range(self) -> Option<Interval> {
        self.curve().and_then(|curve| curve.range)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_and_texts_are_those_of_a_contract() {
        let words: Vec<&str> = Activation::EACH.iter().map(|each| each.word()).collect();
        for (word, each) in words.iter().zip(Activation::EACH) {
            assert_eq!(words.iter().filter(|other| *other == word).count(), 1, "{word}");
            assert_eq!(Activation::find(word).is_some(), each.parameter().is_none(), "{word}");
        }
        let leaky = Activation::LeakyRelu { slope: 0.01 };
        assert_eq!(leaky.written(), "{ leaky_relu = 0.01 }");
        assert_eq!(leaky.label(), "leaky relu, slope 0.01");
        assert_eq!(Activation::Relu.written(), "\"relu\"");
    }

    #[test]
    fn rectifier_and_identity_are_the_two_ends_of_a_hinge() {
        let which = |wanted: fn(Activation) -> bool| {
            let found = Activation::EACH.iter().filter(|each| wanted(**each));
            found.map(|each| each.word()).collect::<Vec<_>>()
        };
        assert_eq!(which(Activation::is_identity), ["identity"]);
        assert_eq!(which(Activation::is_rectifier), ["relu"]);
    }
}
