//! Affine forms (zonotopes) with outward rounding: a vector of values, each
//! `centre + sum over symbols of coefficient * symbol + [-slack, slack]`, every symbol somewhere in `[-1, 1]`.
//!
//! Soundness in binary64: what an operation loses by rounding is bounded before it happens and added to the slack.
//! A computed sum of n products differs from the exact one by at most `gamma(n) * sum |w||x|` (Higham, Accuracy and
//! Stability, 3.1), gamma(n) = n u / (1 - n u), u = 2^-53, in whatever order; every coefficient of an output is such a sum over
//! the same weights, and symbols are at most 1 in magnitude, so the errors of all coefficients of an output together stay below
//! `gamma(n) * sum |w_i| m_i` with `m_i` the sum of magnitudes of input i. Twice that is added, which also covers the
//! roundings of the bound itself, and [`TINY`] covers underflow.

use policy::Interval;

/// Unit roundoff of binary64.
const UNIT: f64 = 1.0 / 9_007_199_254_740_992.0;
/// More than what all underflows of an operation can add up to.
const TINY: f64 = 1e-300;

/// Closed interval around `[low, high]` after `operations` roundings of values of at most this magnitude.
pub(crate) fn outward(low: f64, high: f64, magnitude: f64, operations: usize) -> Interval {
    let slack = rounding(magnitude, operations);
    Interval {
        // the difference is rounded once more: one number further out
        low: (low - slack).next_down(),
        high: (high + slack).next_up(),
    }
}

/// More than the error of `operations` roundings on values whose magnitudes sum up to `magnitude`.
pub(crate) fn rounding(magnitude: f64, operations: usize) -> f64 {
    // twice and four more: gamma(n) is a little more than n u, and this product is rounded itself
    2.0 * UNIT * (operations + 4) as f64 * magnitude + TINY
}

/// A matrix, rows one after the other.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Matrix {
    pub rows: usize,
    pub columns: usize,
    pub data: Vec<f64>,
}

impl Matrix {
    pub fn zeros(rows: usize, columns: usize) -> Self {
        Self {
            rows,
            columns,
            data: vec![0.0; rows * columns],
        }
    }

    pub fn row(&self, index: usize) -> &[f64] {
        &self.data[index * self.columns..][..self.columns]
    }

    pub fn row_mut(&mut self, index: usize) -> &mut [f64] {
        &mut self.data[index * self.columns..][..self.columns]
    }

    /// With zeros on the right.
    fn widened(&self, columns: usize) -> Self {
        let mut wide = Matrix::zeros(self.rows, columns);
        for row in 0..self.rows {
            wide.row_mut(row)[..self.columns].copy_from_slice(self.row(row));
        }
        wide
    }
}

/// A vector of affine forms. Two forms over the same inputs share the symbols of `shared`; those of `own` belong to one.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Form {
    pub centre: Vec<f64>,
    pub shared: Matrix,
    pub own: Matrix,
    pub slack: Vec<f64>,
}

impl Form {
    /// Zeros over `symbols` shared symbols.
    pub fn zeros(values: usize, symbols: usize) -> Self {
        Self {
            centre: vec![0.0; values],
            shared: Matrix::zeros(values, symbols),
            own: Matrix::zeros(values, 0),
            slack: vec![0.0; values],
        }
    }

    pub fn len(&self) -> usize {
        self.centre.len()
    }

    fn symbols(&self) -> usize {
        self.shared.columns + self.own.columns
    }

    /// Largest distance from the centre, rounded up.
    pub fn radius(&self, index: usize) -> f64 {
        let coefficients = self.shared.row(index).iter().chain(self.own.row(index));
        let sum: f64 = coefficients.map(|c| c.abs()).sum::<f64>() + self.slack[index];
        sum + rounding(sum, self.symbols())
    }

    /// Bound of the magnitude.
    pub fn magnitude(&self, index: usize) -> f64 {
        (self.centre[index].abs() + self.radius(index)).next_up()
    }

    /// Enclosure of one value.
    pub fn bounds(&self, index: usize) -> Interval {
        let radius = self.radius(index);
        Interval {
            low: (self.centre[index] - radius).next_down(),
            high: (self.centre[index] + radius).next_up(),
        }
    }

    /// Whether the value is exactly 0.
    fn is_zero(&self, index: usize) -> bool {
        let zero = |row: &[f64]| row.iter().all(|c| *c == 0.0);
        self.centre[index] == 0.0
            && self.slack[index] == 0.0
            && zero(self.shared.row(index))
            && zero(self.own.row(index))
    }

    /// `sum of W x + bias` over terms that share their symbols; only the first may have symbols of its own.
    pub fn linear(terms: &[(&Matrix, &Form)], bias: &[f64]) -> Form {
        let outputs = bias.len();
        let columns = |pick: fn(&Form) -> usize| terms.iter().map(|(_, x)| pick(x)).max().unwrap_or_default();
        let mut y = Form {
            centre: bias.to_vec(),
            shared: Matrix::zeros(outputs, columns(|x| x.shared.columns)),
            own: Matrix::zeros(outputs, columns(|x| x.own.columns)),
            slack: vec![0.0; outputs],
        };
        let mut count = 1;
        let mut magnitudes: Vec<f64> = bias.iter().map(|b| b.abs()).collect();
        for (weights, x) in terms {
            count += x.len();
            // a neuron that is 0 everywhere adds nothing
            let live: Vec<usize> = (0..x.len()).filter(|i| !x.is_zero(*i)).collect();
            let sizes: Vec<f64> = (0..x.len()).map(|i| x.magnitude(i)).collect();
            for (output, total) in magnitudes.iter_mut().enumerate() {
                let row = weights.row(output);
                for &i in &live {
                    let w = row[i];
                    if w == 0.0 {
                        continue;
                    }
                    y.centre[output] += w * x.centre[i];
                    add(y.shared.row_mut(output), w, x.shared.row(i));
                    add(y.own.row_mut(output), w, x.own.row(i));
                    // a slack has no symbol and cannot cancel: magnitudes add up
                    y.slack[output] += w.abs() * x.slack[i];
                    *total += w.abs() * sizes[i];
                }
            }
        }
        for (slack, magnitude) in y.slack.iter_mut().zip(magnitudes) {
            // twice: the slack itself is a rounded sum, and is part of the magnitude
            *slack += 2.0 * rounding(magnitude, count);
        }
        y
    }

    /// Replaces each value by `factor * value + shift +- radius`, each radius a new symbol: shared if `is_shared`.
    pub fn replaced(&self, steps: &[Replacement], is_shared: bool, shared_columns: usize) -> Form {
        let fresh = steps.iter().filter(|step| step.radius > 0.0).count();
        let mut y = Form {
            centre: vec![0.0; self.len()],
            shared: self
                .shared
                .widened(shared_columns.max(self.shared.columns + if is_shared { fresh } else { 0 })),
            own: self.own.widened(self.own.columns + if is_shared { 0 } else { fresh }),
            slack: vec![0.0; self.len()],
        };
        // new symbols stand behind those that are there: columns of both forms keep their meaning
        let mut column = if is_shared {
            self.shared.columns
        } else {
            self.own.columns
        };
        for (index, step) in steps.iter().enumerate() {
            let factor = step.factor;
            y.centre[index] = factor * self.centre[index] + step.shift;
            for row in [y.shared.row_mut(index), y.own.row_mut(index)] {
                for c in row {
                    *c *= factor;
                }
            }
            y.slack[index] = factor.abs() * self.slack[index];
            // a factor of 0 or 1 without a shift rounds nothing
            if factor != 0.0 && factor != 1.0 || step.shift != 0.0 {
                let magnitude = factor.abs() * self.magnitude(index) + step.shift.abs();
                // two roundings in the centre, one in each coefficient and in the slack, whose magnitudes add up to
                // this one: 4. Twice, since the magnitude is rounded itself
                y.slack[index] += 2.0 * rounding(magnitude, 4);
            }
            if step.radius > 0.0 {
                let row = if is_shared {
                    y.shared.row_mut(index)
                } else {
                    y.own.row_mut(index)
                };
                row[column] = step.radius;
                column += 1;
            }
        }
        y
    }

    /// Enclosure of `(self + other)[plus] - (self + other)[minus]`.
    pub fn difference(&self, other: Option<&Form>, plus: usize, minus: usize) -> Interval {
        let forms = std::iter::once(self).chain(other);
        let (mut centre, mut slack, mut magnitude, mut operations) = (0.0, 0.0, 0.0, 0);
        let mut shared = vec![0.0; self.shared.columns];
        let mut radius = 0.0;
        for form in forms {
            centre += form.centre[plus] - form.centre[minus];
            slack += form.slack[plus] + form.slack[minus];
            magnitude += form.magnitude(plus) + form.magnitude(minus);
            operations += 2 + form.symbols();
            // shared symbols mean the same in both forms, so what cancels cancels before the magnitude is taken
            for (sum, (a, b)) in shared
                .iter_mut()
                .zip(form.shared.row(plus).iter().zip(form.shared.row(minus)))
            {
                *sum += a - b;
            }
            // symbols of its own a form shares with no other
            let own = form.own.row(plus).iter().zip(form.own.row(minus));
            radius += own.map(|(a, b)| (a - b).abs()).sum::<f64>();
        }
        radius += shared.iter().map(|c: &f64| c.abs()).sum::<f64>() + slack;
        outward(centre - radius, centre + radius, magnitude, operations + 4)
    }
}

fn add(sums: &mut [f64], factor: f64, row: &[f64]) {
    for (sum, c) in sums.iter_mut().zip(row) {
        *sum += factor * c;
    }
}

/// `factor * x + shift +- radius` as an enclosure of a function of x.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Replacement {
    pub factor: f64,
    pub shift: f64,
    pub radius: f64,
}

impl Replacement {
    pub const IDENTITY: Self = Self::scaled(1.0, 0.0);

    /// `factor * x +- radius`.
    pub const fn scaled(factor: f64, radius: f64) -> Self {
        Self {
            factor,
            shift: 0.0,
            radius,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn form(centre: &[f64], rows: &[&[f64]]) -> Form {
        Form {
            centre: centre.to_vec(),
            shared: Matrix {
                rows: rows.len(),
                columns: rows[0].len(),
                data: rows.concat(),
            },
            own: Matrix::zeros(rows.len(), 0),
            slack: vec![0.0; rows.len()],
        }
    }

    #[test]
    fn a_difference_knows_that_both_sides_move_together() {
        let x = form(&[3.0, 1.0], &[&[10.0, 0.5], &[10.0, -0.5]]);
        let difference = x.difference(None, 0, 1);
        assert!(difference.low <= 1.0 && difference.low > 0.999);
        assert!(difference.high >= 3.0 && difference.high < 3.001);
    }

    #[test]
    fn a_sum_that_rounds_encloses_the_exact_one() {
        // 0.1 * 3 - 0.3 is not 0 in binary64, and 0.1, 0.3 are not the decimals: exact value 2^-54 * 0.4...
        let weights = Matrix {
            rows: 1,
            columns: 2,
            data: vec![3.0, -1.0],
        };
        let y = Form::linear(&[(&weights, &form(&[0.1, 0.3], &[&[0.0], &[0.0]]))], &[0.0]);
        let bounds = y.bounds(0);
        // 3 * fl(0.1) - fl(0.3), by integers: mantissas 0x1999999999999a * 2^-56 and 0x13333333333333 * 2^-54
        let exact = (3 * 0x19_9999_9999_999a_i64 - 4 * 0x13_3333_3333_3333_i64) as f64 / 2_f64.powi(56);
        assert!(bounds.low <= exact && exact <= bounds.high, "{bounds:?} {exact:e}");
        assert!(bounds.high - bounds.low < 1e-14);
    }

    #[test]
    fn a_new_symbol_widens_by_its_radius() {
        let x = form(&[1.0], &[&[0.5]]);
        let step = Replacement {
            factor: 2.0,
            shift: 1.0,
            radius: 0.25,
        };
        for is_shared in [true, false] {
            let y = x.replaced(&[step], is_shared, 0);
            let bounds = y.bounds(0);
            assert!(bounds.low <= 1.75 && bounds.low > 1.749, "{bounds:?}");
            assert!(bounds.high >= 4.25 && bounds.high < 4.251, "{bounds:?}");
        }
    }
}
