//! Partial least squares with one response (PLS1, NIPALS), with the scaling of scikit-learn's `PLSRegression`.
//!
//! Predictors and response are centred and divided by their standard deviation (n - 1); a predictor that does not vary
//! takes no part. With as many components as the predictors have independent directions this is ordinary least squares.

/// Predictors by column, all of one length.
pub type Columns = [Vec<f64>];

/// A linear regression `y = coefficients . x + intercept`.
#[derive(Debug, Clone, PartialEq)]
pub struct Pls {
    /// One for each predictor, in the unit of y over the predictor's.
    pub coefficients: Vec<f64>,
    /// In the unit of y.
    pub intercept: f64,
    /// Components used: those asked for, or fewer if nothing was left to explain.
    pub components: usize,
    rows: usize,
    means: Vec<f64>,
    scales: Vec<f64>,
    /// For each component: weights on the scaled predictors, and the sum of squares of its scores.
    scores: Vec<(Vec<f64>, f64)>,
}

/// A spread below this share of a column's largest value is rounding.
// thousands of rows lose 1e-16 each; with 0 a constant column takes part, and scikit-learn's answers are missed
const CONSTANT: f64 = 1e-12;
/// What is left of predictors times response, relative to the start, when only rounding is left.
// the tests hold up to 1e-10; at 1e-6 the last component of scikit-learn's tables goes missing
const NOTHING_LEFT: f64 = 1e-14;

impl Pls {
    /// Fits `components` components.
    ///
    /// `x` holds the predictors by column, `y` the response, at least two rows.
    #[must_use]
    pub fn fit(x: &Columns, y: &[f64], components: usize) -> Pls {
        let (means, scales): (Vec<f64>, Vec<f64>) = x.iter().map(|column| centre_and_scale(column)).unzip();
        let (y_mean, y_scale) = centre_and_scale(y);
        let mut residual: Vec<Vec<f64>> = x
            .iter()
            .zip(means.iter().zip(&scales))
            .map(|(column, (mean, scale))| column.iter().map(|v| (v - mean) * inverse(*scale)).collect())
            .collect();
        let mut y_residual: Vec<f64> = y.iter().map(|v| (v - y_mean) * inverse(y_scale)).collect();
        let size = residual.iter().map(|c| dot(c, c)).sum::<f64>().sqrt() * dot(&y_residual, &y_residual).sqrt();
        let mut scaled = vec![0.0; x.len()];
        let mut scores: Vec<(Vec<f64>, f64)> = Vec::new();
        let mut loadings: Vec<Vec<f64>> = Vec::new();
        for _ in 0..components.min(x.len()) {
            let mut weights: Vec<f64> = residual.iter().map(|column| dot(column, &y_residual)).collect();
            let norm = dot(&weights, &weights).sqrt();
            // an exact table on a balanced grid needs fewer components than asked for: no error, as in scikit-learn
            if norm <= NOTHING_LEFT * size {
                break;
            }
            weights.iter_mut().for_each(|w| *w /= norm);
            let score = combine(&residual, &weights, y.len());
            let square = dot(&score, &score);
            let loading: Vec<f64> = residual.iter().map(|column| dot(column, &score) / square).collect();
            let share = dot(&y_residual, &score) / square;
            for (column, p) in residual.iter_mut().zip(&loading) {
                column.iter_mut().zip(&score).for_each(|(v, t)| *v -= p * t);
            }
            y_residual.iter_mut().zip(&score).for_each(|(v, t)| *v -= share * t);
            // the weights on the predictors as they were before deflation
            let mut direct = weights.clone();
            for ((earlier, _), p) in scores.iter().zip(&loadings) {
                let overlap = dot(p, &weights);
                direct.iter_mut().zip(earlier).for_each(|(r, e)| *r -= overlap * e);
            }
            scaled.iter_mut().zip(&direct).for_each(|(b, r)| *b += share * r);
            scores.push((direct, square));
            loadings.push(loading);
        }
        let coefficients: Vec<f64> = scaled
            .iter()
            .zip(&scales)
            .map(|(b, scale)| b * y_scale * inverse(*scale))
            .collect();
        Pls {
            intercept: y_mean - dot(&coefficients, &means),
            coefficients,
            components: scores.len(),
            rows: y.len(),
            means,
            scales,
            scores,
        }
    }

    /// The response at `x`, one value for each predictor.
    #[must_use]
    pub fn predict(&self, x: &[f64]) -> f64 {
        dot(&self.coefficients, x) + self.intercept
    }

    /// Variance of the fitted value at `x` over that of the noise: 1/n plus the distance from the centre.
    #[must_use]
    pub fn leverage(&self, x: &[f64]) -> f64 {
        let scaled: Vec<f64> = x
            .iter()
            .zip(self.means.iter().zip(&self.scales))
            .map(|(v, (mean, scale))| (v - mean) * inverse(*scale))
            .collect();
        let distance = |(weights, square): &(Vec<f64>, f64)| {
            let score = dot(weights, &scaled);
            score * score / square
        };
        1.0 / self.rows as f64 + self.scores.iter().map(distance).sum::<f64>()
    }
}

/// Mean and standard deviation (n - 1); 0 for a column that does not vary.
pub(crate) fn centre_and_scale(column: &[f64]) -> (f64, f64) {
    let n = column.len() as f64;
    let mean = column.iter().sum::<f64>() / n;
    let squares: f64 = column.iter().map(|v| (v - mean) * (v - mean)).sum();
    // over n - 1 as in scikit-learn: another divisor would move the coefficients of fewer components
    let scale = (squares / (n - 1.0).max(1.0)).sqrt();
    let largest = column.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
    (mean, if scale <= CONSTANT * largest { 0.0 } else { scale })
}

/// 1/x, and 0 for 0: what does not vary takes no part.
fn inverse(x: f64) -> f64 {
    if x == 0.0 { 0.0 } else { 1.0 / x }
}

fn combine(columns: &Columns, weights: &[f64], rows: usize) -> Vec<f64> {
    let mut sum = vec![0.0; rows];
    for (column, weight) in columns.iter().zip(weights) {
        sum.iter_mut().zip(column).for_each(|(s, v)| *s += weight * v);
    }
    sum
}

pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}
