//! The activations of section 6 that are more than a selection.

use crate::float::Float;
use crate::term::Term;

/// `n0..n4` and `d0..d4`.
const NUMERATOR: [f64; 5] = [
    0.999_999_9,
    0.133_732_08,
    0.003_486_593_3,
    2.047_200_7e-5,
    1.318_444_4e-8,
];
const DENOMINATOR: [f64; 5] = [1.0, 0.467_065_04, 0.025_842_024, 0.000_327_140_35, 7.702_759e-7];

/// The quotient `fl(p / q)` and tanh.
pub(crate) fn tanh(float: Float<'_>, x: Term) -> (Term, Term) {
    let number = |value: f64| float.constant(float.format.nearest(value));
    let t = float.clamp(x, number(-9.0), number(9.0));
    let z = float.mul(t, t);
    let polynomial = |[c0, c1, c2, c3, c4]: [f64; 5]| {
        let lower = [c3, c2, c1, c0].into_iter();
        lower.fold(number(c4), |sum, c| float.add(float.mul(sum, z), number(c)))
    };
    let p = float.mul(polynomial(NUMERATOR), t);
    let quotient = float.div(p, polynomial(DENOMINATOR));
    (quotient, float.clamp(quotient, number(-1.0), number(1.0)))
}

/// `fl(x / fl(1 + |x|))`
pub(crate) fn softsign(float: Float<'_>, x: Term) -> Term {
    let magnitude = float.terms.binary("bvand", x, float.terms.unary("bvnot", float.sign()));
    float.div(x, float.add(float.constant(1.0), magnitude))
}
