//! Activations: one row each, with the facts on which bounds, scales, certificates, training and texts rest.
//!
//! What an activation computes to the bit stands in section 6 of the numeric contract, and in the interpreter and the
//! compiler. Here stands what is *true* of it. Nothing outside of this file compares kinds: who wants to know whether an
//! activation is bounded, or may be scaled, asks for its [`Shape`].

use serde::Serialize;

use crate::interval::Interval;

/// The graph of an activation.
#[derive(Debug, Clone, Copy)]
pub enum Shape {
    /// `x` above 0 and `below * x` elsewhere, `0 <= below <= 1`. Homogeneous: a positive factor before it is the same
    /// factor behind it, which is what allows rows of weights to be scaled.
    Hinge {
        /// Slope below 0.
        below: f64,
    },
    /// A curve within +-1 that no factor passes through unchanged.
    Sigmoid(&'static Sigmoid),
}

/// A real function that is odd, rises, stays within +-1 and is the flatter the farther from 0. So its slope is known from
/// its value, is at most 1 and over an interval lies between those at the points farthest from and nearest to 0.
///
/// No function here is a libm's, which differs from machine to machine, but for `real`.
#[derive(Debug)]
pub struct Sigmoid {
    /// Value, computed in binary64.
    pub value: fn(f64) -> f64,
    /// Slope where the function has this value, in real arithmetic.
    pub slope: fn(f64) -> f64,
    /// The same in binary32, as training multiplies it.
    pub slope_32: fn(f32) -> f32,
    /// More than |value - real function|.
    pub near: f64,
    /// More than |contract's binary32 value - real function|, for every finite number.
    pub error_32: f64,
    /// More than |contract's binary32 value - value|.
    pub apart_32: f64,
    /// The real function by the machine's libm: what tests compare with, never part of a result.
    pub real: fn(f64) -> f64,
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
    Tanh, "tanh", Shape::Sigmoid(&TANH);
    /// x / (1 + |x|).
    Softsign, "softsign", Shape::Sigmoid(&SOFTSIGN);
    /// x or slope * x.
    LeakyRelu { slope = 0.01, "Slope for x < 0, 0 < slope < 1." }, "leaky_relu", Shape::Hinge { below: slope };
    /// None.
    Identity, "identity", Shape::Hinge { below: 1.0 };
}

static TANH: Sigmoid = Sigmoid {
    value: rational_tanh,
    slope: |y| 1.0 - y * y,
    slope_32: |y| 1.0 - y * y,
    // section 6 bounds the binary32 value by 4e-7, section 11 the binary64 value by 4e-8: this holds for both
    near: 4e-7 + 1e-7,
    error_32: 4e-7,
    // at least `near` and `error_32` together, by the triangle inequality
    apart_32: 1e-6,
    real: f64::tanh,
};

static SOFTSIGN: Sigmoid = Sigmoid {
    value: softsign,
    slope: |y| (1.0 - y.abs()) * (1.0 - y.abs()),
    slope_32: |y| (1.0 - y.abs()) * (1.0 - y.abs()),
    // two roundings of binary64, then of binary32, each of at most half a unit of a value up to 1
    near: 3e-16,
    error_32: 1.3e-7,
    apart_32: 1.4e-7,
    // one sum and one quotient: no libm could differ here
    real: softsign,
};

/// Numerator of the contract's tanh, lowest power first.
pub const TANH_NUMERATOR: [f64; 5] = [
    0.999_999_9,
    0.133_732_08,
    0.003_486_593_3,
    2.047_200_7e-5,
    1.318_444_4e-8,
];
/// Denominator of the contract's tanh, lowest power first.
pub const TANH_DENOMINATOR: [f64; 5] = [1.0, 0.467_065_04, 0.025_842_024, 0.000_327_140_35, 7.702_759e-7];
/// Beyond this magnitude the contract's tanh is that of the end of its range.
// tanh(9) lies within 3.1e-8 of 1: cutting off there costs less than the 4e-7 of the whole approximation
pub const TANH_RANGE: f64 = 9.0;

/// Softsign in binary64.
fn softsign(x: f64) -> f64 {
    x / (1.0 + x.abs())
}

/// The contract's tanh in binary64.
fn rational_tanh(x: f64) -> f64 {
    let t = x.clamp(-TANH_RANGE, TANH_RANGE);
    let z = t * t;
    let horner = |c: [f64; 5]| c.iter().rev().fold(0.0, |sum, c| sum * z + c);
    (t * horner(TANH_NUMERATOR) / horner(TANH_DENOMINATOR)).clamp(-1.0, 1.0)
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

    /// Bound of the magnitude, if it has one.
    #[must_use]
    pub fn limit(self) -> Option<f64> {
        match self.shape() {
            Shape::Hinge { .. } => None,
            Shape::Sigmoid(_) => Some(1.0),
        }
    }
}

impl Sigmoid {
    /// Enclosure of the contract's binary32 values over an interval.
    pub(crate) fn image(&self, x: Interval) -> Interval {
        Interval {
            // the contract clamps tanh to +-1, and a softsign rounds to at most 1: the slack need not reach beyond
            low: ((self.value)(x.low) - self.apart_32).max(-1.0),
            high: ((self.value)(x.high) + self.apart_32).min(1.0),
        }
    }

    /// Least and largest slope of the real function over an interval.
    #[must_use]
    pub fn slopes(&self, x: Interval) -> (f64, f64) {
        let far = x.low.abs().max(x.high.abs());
        let near = if x.low <= 0.0 && x.high >= 0.0 {
            0.0
        } else {
            x.low.abs().min(x.high.abs())
        };
        let slope = |x: f64| (self.slope)((self.value)(x));
        // a slope changes by at most twice as much as the value it is taken from
        // (its derivative by y is 2y or 2(1 - |y|)); the rest of 2.5 is room for the roundings of `slope`
        let slack = 2.5 * self.near;
        ((slope(far) - slack).max(0.0), (slope(near) + slack).min(1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sigmoids() -> impl Iterator<Item = (&'static str, &'static Sigmoid)> {
        Activation::EACH.iter().filter_map(|each| match each.shape() {
            Shape::Sigmoid(sigmoid) => Some((each.word(), sigmoid)),
            Shape::Hinge { .. } => None,
        })
    }

    /// Points of a fine grid around 0 and of a coarse one far out, in order.
    fn grid() -> impl Iterator<Item = f64> {
        let near = (-4000..=4000).map(|n| f64::from(n) / 250.0);
        let far = |sign: f64| (0..120).map(move |n| sign * 17.0 * 1.9_f64.powi(n));
        let mut all: Vec<f64> = far(-1.0).chain(near).chain(far(1.0)).collect();
        all.sort_by(f64::total_cmp);
        all.into_iter()
    }

    #[test]
    fn the_facts_of_a_sigmoid_hold() {
        for (word, sigmoid) in sigmoids() {
            let real = sigmoid.real;
            for x in grid() {
                assert!(((sigmoid.value)(x) - real(x)).abs() < sigmoid.near, "{word} {x}");
                assert!(real(x).abs() <= 1.0 && (sigmoid.value)(x).abs() <= 1.0, "{word} {x}");
                assert_eq!(real(-x).to_bits(), (-real(x)).to_bits(), "{word} {x}");
            }
            assert!(sigmoid.apart_32 >= sigmoid.near + sigmoid.error_32, "{word}");
        }
    }

    #[test]
    fn the_slope_of_a_sigmoid_is_that_of_its_graph_and_falls_outwards() {
        for (word, sigmoid) in sigmoids() {
            let points: Vec<f64> = grid().filter(|x| x.abs() <= 16.0).collect();
            for pair in points.windows(2) {
                let (a, b) = (pair[0], pair[1]);
                let quotient = ((sigmoid.real)(b) - (sigmoid.real)(a)) / (b - a);
                let (low, high) = sigmoid.slopes(Interval { low: a, high: b });
                assert!(
                    low <= quotient && quotient <= high,
                    "{word} {a} {b}: {low} {quotient} {high}"
                );
                // sharp: the derivative of a function that is not this one would pass as well if the interval were wide
                assert!(high - low < 0.02, "{word} {a} {b}");
                let y = (sigmoid.real)(a);
                let apart = (f64::from((sigmoid.slope_32)(y as f32)) - (sigmoid.slope)(y)).abs();
                assert!(apart < 1e-6, "{word} {a}");
            }
        }
    }

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
