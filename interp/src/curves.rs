//! The curves of section 6 that rest on its tanh, from the contract's text alone.
//!
//! The constants are typed from the page and not taken from `policy`, as the compiler's are: a wrong digit in one of them shows.

use crate::activation::{relu, tanh};
use crate::real::{Range, Real};

/// `clamp(x, -limit, limit)`
fn limited<T: Real>(x: T, limit: f64) -> T {
    let ends = Range {
        lo: T::nearest(-limit),
        hi: T::nearest(limit),
    };
    ends.clamp(x)
}

/// |x|; of -0 it is +0, and a NaN stays one.
fn magnitude<T: Real>(x: T) -> T {
    if x > T::ZERO {
        x
    } else if x < T::ZERO {
        -x
    } else if x == T::ZERO {
        T::ZERO
    } else {
        x
    }
}

fn number<T: Real>(value: f64) -> T {
    T::nearest(value)
}

/// The terms from the highest power down.
fn polynomial<T: Real>(terms: &[f64], z: T) -> T {
    let Some((highest, lower)) = terms.split_last() else {
        return T::ZERO;
    };
    let start = number(*highest);
    lower.iter().rev().fold(start, |sum, term| sum * z + number(*term))
}

/// `x` above 0 less what the tanh of `u` leaves of `a`.
fn gate<T: Real>(x: T, a: T, u: T) -> T {
    let h = number::<T>(0.5) - tanh(u) * number(0.5);
    relu(x) - a * h
}

pub(crate) fn sigmoid<T: Real>(x: T) -> T {
    tanh(x * number(0.5)) * number(0.5) + number(0.5)
}

pub(crate) fn hard_sigmoid<T: Real>(x: T) -> T {
    limited(x * number(1.0 / 6.0), 0.5) + number(0.5)
}

pub(crate) fn elu<T: Real>(x: T) -> T {
    let m = relu(-x);
    let t = magnitude(tanh(m * number(0.5)));
    relu(x) - (t + t) / (number::<T>(1.0) + t)
}

pub(crate) fn softplus<T: Real>(x: T) -> T {
    let t = tanh(magnitude(x) * number(0.5));
    let v = (number::<T>(1.0) - t) / (number::<T>(3.0) + t);
    let p = polynomial(&[2.0, 0.6667614, 0.3956726, 0.3439754], v * v);
    relu(x) + p * v
}

pub(crate) fn silu<T: Real>(x: T) -> T {
    let a = magnitude(limited(x, 18.0));
    gate(x, a, a * number(0.5))
}

pub(crate) fn gelu<T: Real>(x: T) -> T {
    const TERMS: [f64; 6] = [
        0.797872165,
        0.0363667808,
        -5.86389284e-5,
        -4.70567926e-5,
        2.77552846e-6,
        -5.57596219e-8,
    ];
    let a = magnitude(limited(x, 5.6));
    gate(x, a, a * polynomial(&TERMS, a * a))
}

pub(crate) fn gelu_tanh<T: Real>(x: T) -> T {
    let a = magnitude(limited(x, 6.0));
    gate(x, a, a * polynomial(&[0.7978845608028654, 0.035677408136300125], a * a))
}

pub(crate) fn hard_swish<T: Real>(x: T) -> T {
    let a = magnitude(limited(x, 3.0));
    let h = number::<T>(0.5) - limited(a * number(1.0 / 6.0), 0.5);
    relu(x) - a * h
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_magnitude_has_no_sign_and_a_nan_stays_one() {
        for (x, expected) in [(-0.0_f32, 0.0_f32), (0.0, 0.0), (-2.5, 2.5), (2.5, 2.5)] {
            assert_eq!(magnitude(x).to_bits(), expected.to_bits(), "{x}");
        }
        assert!(magnitude(f32::NAN).is_nan());
    }
}
