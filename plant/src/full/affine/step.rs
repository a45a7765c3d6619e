//! The matrices of one step.

use super::{Circuit, Matrix, Tangent};
use crate::full::V_LOAD;

/// Largest step of the series, as the sum of all rates times its length; a longer one is made of halves.
// ten orders leave 1.5^11 / 11! = 2e-6 of what changes if all of it moves at that sum of rates, and 3e-8 of what moves at the
// largest of them (`FEWER`)
const LARGEST: f64 = 1.5;

/// `1 / (k + 2)!`
const INVERSE: [f64; 9] = [
    1.0 / 2.0,
    1.0 / 6.0,
    1.0 / 24.0,
    1.0 / 120.0,
    1.0 / 720.0,
    1.0 / 5040.0,
    1.0 / 40320.0,
    1.0 / 362880.0,
    1.0 / 3628800.0,
];

/// What a step makes of the states, and of what the tangent leaves at its start and end.
pub(super) struct Step<const N: usize> {
    keep: Matrix<N>,
    add: [f64; N],
    rest: [[f64; N]; 2],
}

impl<const N: usize> Step<N> {
    /// Of `h` seconds; `total` is the sum of all rates, 1/s.
    #[inline(always)]
    pub fn new(circuit: &Circuit<N>, h: f64, total: f64) -> Self {
        let mut halvings = 0;
        let mut part = h;
        while total * part > LARGEST && halvings < 64 {
            part *= 0.5;
            halvings += 1;
        }
        let x = scaled(&circuit.a, part);
        let square = times(&x, &x);
        let cube = times(&x, &square);
        // Paterson and Stockmeyer: eight orders of phi_2 by four products
        let low = polynomial([INVERSE[0], INVERSE[1], INVERSE[2]], [&x, &square]);
        let middle = polynomial([INVERSE[3], INVERSE[4], INVERSE[5]], [&x, &square]);
        let high = polynomial([INVERSE[6], INVERSE[7], INVERSE[8]], [&x, &square]);
        let mut phi_2 = plus(&times(&cube, &plus(&times(&cube, &high), &middle)), &low);
        let mut phi_1 = plus_one(times(&x, &phi_2));
        let mut keep = plus_one(times(&x, &phi_1));
        for _ in 0..halvings {
            let sum = plus(&times(&keep, &phi_2), &plus(&phi_1, &phi_2));
            phi_2 = scaled(&sum, 0.25);
            phi_1 = scaled(&plus(&times(&keep, &phi_1), &phi_1), 0.5);
            keep = times(&keep, &keep);
        }
        let Tangent { state, factor, .. } = circuit.tangent;
        let mut step = Step {
            add: apply(&phi_1, &circuit.b),
            keep,
            rest: [phi_1[state], phi_2[state]],
        };
        for n in 0..N {
            step.add[n] *= h;
            step.rest[1][n] *= h * factor;
            step.rest[0][n] = h * factor * step.rest[0][n] - step.rest[1][n];
        }
        step
    }

    /// Takes the states over the step, with `r` at its start; returns that at its end.
    #[inline(always)]
    pub fn take(&self, tangent: &Tangent, x: &mut [f64; N], r: f64) -> f64 {
        let mut next = apply(&self.keep, x);
        let is_linear = tangent.leaves_nothing();
        let [start, end] = &self.rest;
        for (next, add) in next.iter_mut().zip(&self.add) {
            *next += add;
        }
        if is_linear {
            *x = next;
            return 0.0;
        }
        let v = next[V_LOAD] + (start[V_LOAD] + end[V_LOAD]) * r;
        if v < tangent.fold {
            // there the rest is another one; the caller sees it and takes other steps
            next[V_LOAD] = v;
            *x = next;
            return 0.0;
        }
        let after = tangent.rest(v);
        for n in 0..N {
            x[n] = next[n] + (start[n] * r + end[n] * after);
        }
        after
    }
}

#[inline(always)]
pub(super) fn apply<const N: usize>(matrix: &Matrix<N>, x: &[f64; N]) -> [f64; N] {
    // in pairs: what waits for the sum before it costs most in a step; column by column, which are vectors
    let mut pairs = [[0.0; N]; 2];
    for (k, column) in matrix.iter().enumerate() {
        for (sum, factor) in pairs[k % 2].iter_mut().zip(column) {
            *sum += factor * x[k];
        }
    }
    let [mut sum, odd] = pairs;
    for (sum, odd) in sum.iter_mut().zip(&odd) {
        *sum += odd;
    }
    sum
}

#[inline(always)]
fn times<const N: usize>(a: &Matrix<N>, b: &Matrix<N>) -> Matrix<N> {
    let mut product = *b;
    for column in &mut product {
        *column = apply(a, column);
    }
    product
}

#[inline(always)]
fn plus<const N: usize>(a: &Matrix<N>, b: &Matrix<N>) -> Matrix<N> {
    let mut sum = *a;
    for n in 0..N {
        for m in 0..N {
            sum[n][m] += b[n][m];
        }
    }
    sum
}

#[inline(always)]
fn scaled<const N: usize>(a: &Matrix<N>, by: f64) -> Matrix<N> {
    let mut scaled = *a;
    for column in &mut scaled {
        for x in column {
            *x *= by;
        }
    }
    scaled
}

#[inline(always)]
fn plus_one<const N: usize>(mut a: Matrix<N>) -> Matrix<N> {
    for (n, column) in a.iter_mut().enumerate() {
        column[n] += 1.0;
    }
    a
}

/// `c_0 + c_1 X + c_2 X^2`.
#[inline(always)]
fn polynomial<const N: usize>(c: [f64; 3], [x, square]: [&Matrix<N>; 2]) -> Matrix<N> {
    let mut sum = *x;
    for n in 0..N {
        for m in 0..N {
            sum[n][m] = c[1] * x[n][m] + c[2] * square[n][m];
        }
        sum[n][n] += c[0];
    }
    sum
}
