//! Numbers that are linear in the states, one and four at once.

/// A number that is linear in the states.
#[derive(Clone, Copy)]
pub(super) struct Row<const N: usize> {
    pub of: [f64; N],
    pub add: f64,
}

impl<const N: usize> Row<N> {
    #[inline(always)]
    pub fn at(&self, x: &[f64; N]) -> f64 {
        let mut sum = self.add;
        for (factor, x) in self.of.iter().zip(x) {
            sum += factor * x;
        }
        sum
    }
}

/// What is asked at both ends of a step.
#[derive(Clone, Copy)]
pub(super) struct End {
    pub v_out: f64,
    pub rises: f64,
    pub left: f64,
    pub i_l: f64,
}

/// The four of an [`End`], by state: the bits of each [`Row`], in a vector.
pub(super) struct Ends<const N: usize> {
    of: [[f64; 4]; N],
    add: [f64; 4],
}

impl<const N: usize> Ends<N> {
    /// In the order of [`End`].
    #[inline(always)]
    pub fn new(rows: [&Row<N>; 4]) -> Self {
        Self {
            of: std::array::from_fn(|state| rows.map(|row| row.of[state])),
            add: rows.map(|row| row.add),
        }
    }

    #[inline(always)]
    pub fn at(&self, x: &[f64; N]) -> End {
        let mut sums = self.add;
        for (factors, x) in self.of.iter().zip(x) {
            for (sum, factor) in sums.iter_mut().zip(factors) {
                *sum += factor * x;
            }
        }
        let [v_out, rises, left, i_l] = sums;
        End {
            v_out,
            rises,
            left,
            i_l,
        }
    }
}
