//! Least squares of a few columns: normal equations and their solution.

use crate::problem::dot;

/// Normal equations.
#[derive(Debug, Clone)]
pub struct Normal {
    matrix: Vec<Vec<f64>>,
    right: Vec<f64>,
}

impl Normal {
    /// Of columns and a right side.
    #[must_use]
    pub fn new(columns: &[Vec<f64>], residual: &[f64]) -> Self {
        Normal {
            matrix: columns
                .iter()
                .map(|a| columns.iter().map(|b| dot(a, b)).collect())
                .collect(),
            right: columns.iter().map(|a| dot(a, residual)).collect(),
        }
    }

    /// Products of the columns.
    #[must_use]
    pub fn matrix(&self) -> &[Vec<f64>] {
        &self.matrix
    }

    /// The least squares.
    #[must_use]
    pub fn solved(&self) -> Vec<f64> {
        self.step(0.0)
    }

    pub(crate) fn step(&self, damping: f64) -> Vec<f64> {
        self.step_beside(damping, &[])
    }

    /// The step of the others where those with a value take that one.
    pub(crate) fn step_beside(&self, damping: f64, given: &[Option<f64>]) -> Vec<f64> {
        let given: Vec<Option<f64>> = (0..self.right.len()).map(|n| given.get(n).copied().flatten()).collect();
        let mut matrix = self.matrix.clone();
        let mut right = self.right.clone();
        for (n, row) in matrix.iter_mut().enumerate() {
            // a parameter without any effect has an equation of zeros; that of any other counts squared deviations in noises,
            // and is far above this
            row[n] = row[n] * (1.0 + damping) + 1e-12;
            for (m, value) in given.iter().enumerate() {
                let Some(value) = value else { continue };
                right[n] -= row[m] * value;
                row[m] = 0.0;
            }
        }
        for (n, value) in given.iter().enumerate() {
            let Some(value) = value else { continue };
            matrix[n].fill(0.0);
            matrix[n][n] = 1.0;
            right[n] = *value;
        }
        solve(&matrix, &right)
    }

    pub(crate) fn covariance(&self, smooth: &[usize], scale: &[f64], out: &mut [Vec<f64>]) {
        let n = self.right.len();
        let mut matrix = self.matrix.clone();
        for (k, row) in matrix.iter_mut().enumerate() {
            // two parameters with one effect would make the matrix singular; this bounds their variance instead
            row[k] = row[k] * (1.0 + 1e-9) + 1e-12;
        }
        for column in 0..n {
            let unit: Vec<f64> = (0..n).map(|k| if k == column { 1.0 } else { 0.0 }).collect();
            for (row, value) in solve(&matrix, &unit).into_iter().enumerate() {
                out[smooth[row]][smooth[column]] = value * scale[row] * scale[column];
            }
        }
    }
}

/// Solves a symmetric positive system by Cholesky's method; a direction without weight gets 0.
#[must_use]
pub fn solve(matrix: &[Vec<f64>], right: &[f64]) -> Vec<f64> {
    let n = right.len();
    let mut l = vec![vec![0.0; n]; n];
    let mut y = vec![0.0; n];
    for row in 0..n {
        for column in 0..=row {
            let known: f64 = (0..column).map(|k| l[row][k] * l[column][k]).sum();
            let rest = matrix[row][column] - known;
            l[row][column] = match row == column {
                true => rest.max(0.0).sqrt(),
                false if l[column][column] > 0.0 => rest / l[column][column],
                false => 0.0,
            };
        }
        // rounding of the sums, a thousand units of binary64 for as many rows: such a direction would get a step of any size
        if l[row][row] * l[row][row] < 1e-13 * matrix[row][row] {
            l[row][row] = 0.0;
        }
        let known: f64 = (0..row).map(|k| l[row][k] * y[k]).sum();
        y[row] = if l[row][row] > 0.0 {
            (right[row] - known) / l[row][row]
        } else {
            0.0
        };
    }
    let mut x = vec![0.0; n];
    for row in (0..n).rev() {
        let known: f64 = (row + 1..n).map(|k| l[k][row] * x[k]).sum();
        x[row] = if l[row][row] > 0.0 {
            (y[row] - known) / l[row][row]
        } else {
            0.0
        };
    }
    x
}

#[cfg(test)]
mod tests {
    use super::{Normal, solve};

    #[test]
    fn a_given_step_is_taken_and_the_others_take_the_best_one_beside_it() {
        let normal = Normal::new(&[vec![1.0, 0.0], vec![1.0, 1.0]], &[3.0, 5.0]);
        let free = normal.step_beside(0.0, &[None, None]);
        assert!((free[0] + 2.0).abs() < 1e-6 && (free[1] - 5.0).abs() < 1e-6, "{free:?}");
        let beside = normal.step_beside(0.0, &[None, Some(1.0)]);
        // 3 - 1 is left for the first
        assert!((beside[0] - 2.0).abs() < 1e-6 && beside[1] == 1.0, "{beside:?}");
    }

    #[test]
    fn a_system_is_solved_and_a_direction_without_weight_stays_at_0() {
        let x = solve(&[vec![4.0, 2.0], vec![2.0, 3.0]], &[2.0, 5.0]);
        assert!((x[0] + 0.5).abs() < 1e-12 && (x[1] - 2.0).abs() < 1e-12, "{x:?}");
        let x = solve(&[vec![1.0, 1.0], vec![1.0, 1.0]], &[3.0, 3.0]);
        assert!((x[0] + x[1] - 3.0).abs() < 1e-9, "{x:?}");
    }
}
