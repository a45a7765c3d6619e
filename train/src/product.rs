//! Products of matrices for learning, on processors with vectors of sixteen numbers; elsewhere those of ndarray.
//!
//! Both give the same bits wherever products and sums are fused: a sum begins at 0, takes its products in order, 256 at a
//! time, and only then is added to what was there. A training is the same on all of these processors.

use ndarray::linalg::general_mat_mul;
use ndarray::{ArrayView2, ArrayViewMut2};
use wide::{Sixteen, SixteenWork};

/// Numbers in a vector.
const LANES: usize = 16;
/// Products in one sum before it is added to the result: where ndarray's product cuts it.
const DEPTH: usize = 256;

/// A matrix of numbers that lie row by row, or column by column.
#[derive(Clone, Copy)]
pub struct Matrix<'a> {
    values: &'a [f32],
    rows: usize,
    columns: usize,
    turned: bool,
}

impl<'a> Matrix<'a> {
    /// `values` as `[rows][columns]`, row-major.
    pub fn new(values: &'a [f32], rows: usize, columns: usize) -> Self {
        debug_assert_eq!(values.len(), rows * columns, "{rows} x {columns}");
        Self {
            values,
            rows,
            columns,
            turned: false,
        }
    }

    /// The transposed matrix; no number is moved.
    pub fn t(self) -> Self {
        Self {
            rows: self.columns,
            columns: self.rows,
            turned: !self.turned,
            ..self
        }
    }

    /// Steps in memory from row to row, and from column to column.
    fn strides(&self) -> (usize, usize) {
        if self.turned { (1, self.rows) } else { (self.columns, 1) }
    }

    fn view(&self) -> ArrayView2<'a, f32> {
        if self.turned {
            view(self.values, self.columns, self.rows).reversed_axes()
        } else {
            view(self.values, self.rows, self.columns)
        }
    }
}

/// `to` is the product of `a` and `b`, and `to` itself is added where `onto`. `to` lies row by row. `packed` is room for what
/// has to lie otherwise.
pub fn multiply(a: Matrix<'_>, b: Matrix<'_>, onto: bool, to: &mut [f32], packed: &mut Vec<f32>) {
    debug_assert_eq!(
        a.columns, b.rows,
        "{} x {} by {} x {}",
        a.rows, a.columns, b.rows, b.columns
    );
    let product = Product { a, b, onto, to, packed };
    if let Err(product) = wide::sixteen(product) {
        let Product { a, b, onto, to, .. } = product;
        let mut to = view_mut(to, a.rows, b.columns);
        general_mat_mul(1.0, &a.view(), &b.view(), f32::from(u8::from(onto)), &mut to);
    }
}

/// [`multiply`] at work.
struct Product<'a> {
    a: Matrix<'a>,
    b: Matrix<'a>,
    onto: bool,
    to: &'a mut [f32],
    packed: &'a mut Vec<f32>,
}

impl SixteenWork for Product<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Sixteen>(self) {
        let Self { a, b, onto, to, packed } = self;
        let columns = b.columns;
        let padded = columns.next_multiple_of(LANES);
        let right = if b.turned || padded != columns {
            pack(b, padded, packed);
            packed.as_slice()
        } else {
            b.values
        };
        if a.columns == 0 && !onto {
            to.fill(0.0);
        }
        for depth in (0..a.columns).step_by(DEPTH) {
            let part = Part {
                a,
                right,
                padded,
                depth: depth..(depth + DEPTH).min(a.columns),
                onto: onto || depth > 0,
                columns,
            };
            let mut at = 0;
            while at < padded {
                at += match (padded - at) / LANES {
                    4.. => part.columns::<V, 6, 4>(at, to),
                    3 => part.columns::<V, 4, 3>(at, to),
                    2 => part.columns::<V, 8, 2>(at, to),
                    _ => part.columns::<V, 16, 1>(at, to),
                };
            }
        }
    }
}

/// The right matrix row by row, rows filled up with 0 to `padded`.
#[inline(always)]
fn pack(b: Matrix<'_>, padded: usize, packed: &mut Vec<f32>) {
    packed.clear();
    packed.resize(b.rows * padded, 0.0);
    if b.turned {
        for (column, values) in b.values.chunks_exact(b.rows).enumerate() {
            for (row, &value) in packed.chunks_exact_mut(padded).zip(values) {
                row[column] = value;
            }
        }
    } else {
        for (row, values) in packed.chunks_exact_mut(padded).zip(b.values.chunks_exact(b.columns)) {
            row[..b.columns].copy_from_slice(values);
        }
    }
}

/// At most [`DEPTH`] products of every sum.
struct Part<'a> {
    a: Matrix<'a>,
    right: &'a [f32],
    padded: usize,
    depth: std::ops::Range<usize>,
    onto: bool,
    columns: usize,
}

impl Part<'_> {
    /// `N` vectors of columns from `at` on, of all rows, `R` rows at a time; returns how many columns these are.
    #[inline(always)]
    fn columns<V: Sixteen, const R: usize, const N: usize>(&self, at: usize, to: &mut [f32]) -> usize {
        let whole = self.a.rows - self.a.rows % R;
        for row in (0..whole).step_by(R) {
            self.tile::<V, R, N>(row, at, to);
        }
        for row in whole..self.a.rows {
            self.tile::<V, 1, N>(row, at, to);
        }
        N * LANES
    }

    /// Sums of `R` rows and `N` vectors of columns, all of them in registers.
    #[inline(always)]
    fn tile<V: Sixteen, const R: usize, const N: usize>(&self, row: usize, at: usize, to: &mut [f32]) {
        let (down, along) = self.a.strides();
        let mut sums = [[V::splat(0.0); N]; R];
        let first = self.depth.start;
        let right = self.right[first * self.padded..self.depth.end * self.padded].chunks_exact(self.padded);
        for (k, right) in right.enumerate() {
            let (vectors, _) = right[at..at + N * LANES].as_chunks::<LANES>();
            let vectors: [V; N] = std::array::from_fn(|n| V::load(&vectors[n]));
            let left = &self.a.values[row * down + (first + k) * along..];
            for (r, sums) in sums.iter_mut().enumerate() {
                let x = V::splat(left[r * down]);
                for (sum, &y) in sums.iter_mut().zip(&vectors) {
                    *sum = sum.add_product(x, y);
                }
            }
        }
        if at + N * LANES <= self.columns {
            for (r, sums) in sums.iter().enumerate() {
                let start = (row + r) * self.columns + at;
                let (to, _) = to[start..start + N * LANES].as_chunks_mut::<LANES>();
                for (n, &sum) in sums.iter().enumerate() {
                    let before = if self.onto { V::load(&to[n]) } else { V::splat(-0.0) };
                    before.add(sum).store(&mut to[n]);
                }
            }
        } else {
            let mut all = [[0.0; LANES]; N];
            for (r, sums) in sums.iter().enumerate() {
                for (sum, all) in sums.iter().zip(&mut all) {
                    sum.store(all);
                }
                let start = (row + r) * self.columns + at;
                for (to, &sum) in to[start..(row + r + 1) * self.columns]
                    .iter_mut()
                    .zip(all.as_flattened())
                {
                    *to = if self.onto { *to + sum } else { sum };
                }
            }
        }
    }
}

/// A slice as a matrix, row-major. The lengths follow from the layers; a mismatch is a fault of this crate.
pub fn view(values: &[f32], rows: usize, columns: usize) -> ArrayView2<'_, f32> {
    match ArrayView2::from_shape((rows, columns), values) {
        Ok(view) => view,
        Err(error) => unreachable!("{} values as {rows} x {columns}: {error}", values.len()),
    }
}

/// As [`view`].
pub fn view_mut(values: &mut [f32], rows: usize, columns: usize) -> ArrayViewMut2<'_, f32> {
    match ArrayViewMut2::from_shape((rows, columns), values) {
        Ok(view) => view,
        Err(error) => unreachable!("{rows} x {columns}: {error}"),
    }
}

#[cfg(test)]
mod tests {
    use random::{Random, Xoshiro};

    use super::*;

    fn numbers(count: usize, rng: &mut Xoshiro) -> Vec<f32> {
        (0..count).map(|_| rng.uniform(-1.0, 1.0) as f32).collect()
    }

    // the oracle is the contract of the module, written once more: fused, in order, 256 at a time
    fn expected(a: &[f32], b: &[f32], to: &[f32], (m, k, n): (usize, usize, usize), onto: bool) -> Vec<f32> {
        let mut result = to.to_vec();
        for i in 0..m {
            for j in 0..n {
                let mut value = if onto { Some(to[i * n + j]) } else { None };
                for depth in (0..k).step_by(256) {
                    let sum =
                        (depth..(depth + 256).min(k)).fold(0.0_f32, |sum, l| a[i * k + l].mul_add(b[l * n + j], sum));
                    value = Some(value.map_or(sum, |before| before + sum));
                }
                result[i * n + j] = value.unwrap_or(0.0);
            }
        }
        result
    }

    fn turned(values: &[f32], rows: usize, columns: usize) -> Vec<f32> {
        (0..columns)
            .flat_map(|j| (0..rows).map(move |i| values[i * columns + j]))
            .collect()
    }

    #[test]
    fn products_have_the_stated_bits_and_those_of_ndarray() {
        if !is_fused() {
            return;
        }
        let mut rng = Xoshiro::stream(3, 0);
        let sizes = [
            (1, 1, 1),
            (4, 6, 64),
            (256, 6, 64),
            (37, 70, 12),
            (6, 300, 64),
            (64, 256, 64),
            (5, 600, 130),
            (9, 33, 47),
        ];
        for size @ (m, k, n) in sizes {
            for onto in [false, true] {
                let (a, b, to) = (
                    numbers(m * k, &mut rng),
                    numbers(k * n, &mut rng),
                    numbers(m * n, &mut rng),
                );
                let expected = expected(&a, &b, &to, size, onto);
                let (at, bt) = (turned(&a, m, k), turned(&b, k, n));
                let lefts = [Matrix::new(&a, m, k), Matrix::new(&at, k, m).t()];
                let rights = [Matrix::new(&b, k, n), Matrix::new(&bt, n, k).t()];
                for (left, right) in lefts.into_iter().zip(rights) {
                    let mut result = to.clone();
                    multiply(left, right, onto, &mut result, &mut vec![7.0; 3]);
                    assert!(result == expected, "{size:?} {onto}");
                    let mut result = to.clone();
                    let mut view = view_mut(&mut result, m, n);
                    general_mat_mul(1.0, &left.view(), &right.view(), f32::from(u8::from(onto)), &mut view);
                    assert!(result == expected, "ndarray, {size:?} {onto}");
                }
            }
        }
    }

    /// Whether ndarray fuses here: on a processor without the instruction it rounds twice.
    fn is_fused() -> bool {
        #[cfg(target_arch = "x86_64")]
        return std::arch::is_x86_feature_detected!("fma");
        #[cfg(not(target_arch = "x86_64"))]
        true
    }
}
