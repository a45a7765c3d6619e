//! Small linear systems.

/// Solves an augmented system by Gauss' elimination with pivots; none where it is singular.
pub fn solve(matrix: &mut [Vec<f64>]) -> Option<Vec<f64>> {
    let n = matrix.len();
    for column in 0..n {
        let pivot = (column..n).max_by(|&a, &b| matrix[a][column].abs().total_cmp(&matrix[b][column].abs()))?;
        matrix.swap(column, pivot);
        let head = matrix[column][column];
        if head.is_nan() || head.abs() <= 1e-13 {
            return None;
        }
        for row in column + 1..n {
            let factor = matrix[row][column] / head;
            if factor == 0.0 {
                continue;
            }
            let (above, below) = matrix.split_at_mut(row);
            for (value, head) in below[0][column..].iter_mut().zip(&above[column][column..]) {
                *value -= factor * head;
            }
        }
    }
    let mut x = vec![0.0; n];
    for row in (0..n).rev() {
        let known: f64 = (row + 1..n).map(|k| matrix[row][k] * x[k]).sum();
        x[row] = (matrix[row][n] - known) / matrix[row][row];
    }
    x.iter().all(|value| value.is_finite()).then_some(x)
}

/// Least squares: the amounts of the `columns` that come nearest to `target`, and the square of what is left.
pub fn fit(columns: &[Vec<f64>], target: &[f64]) -> Option<(Vec<f64>, f64)> {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let scale: Vec<f64> = columns.iter().map(|column| dot(column, column).sqrt()).collect();
    if scale.iter().any(|scale| scale.is_nan() || *scale <= 0.0) {
        return None;
    }
    let mut matrix: Vec<Vec<f64>> = columns
        .iter()
        .zip(&scale)
        .map(|(row, row_scale)| {
            let mut line: Vec<f64> = columns
                .iter()
                .zip(&scale)
                .map(|(c, s)| dot(row, c) / (row_scale * s))
                .collect();
            line.push(dot(row, target) / row_scale);
            line
        })
        .collect();
    // a ridge of rounding alone: columns of one direction share an amount
    for (n, row) in matrix.iter_mut().enumerate() {
        row[n] += 1e-10;
    }
    let amounts: Vec<f64> = solve(&mut matrix)?.iter().zip(&scale).map(|(x, s)| x / s).collect();
    let mut left = target.to_vec();
    for (column, amount) in columns.iter().zip(&amounts) {
        for (left, value) in left.iter_mut().zip(column) {
            *left -= amount * value;
        }
    }
    Some((amounts, dot(&left, &left)))
}
