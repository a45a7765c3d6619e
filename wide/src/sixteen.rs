//! Vectors of sixteen `f32` whose product and sum are fused, where the processor has them.

/// A vector of sixteen numbers in a register.
pub trait Sixteen: Copy {
    /// Sixteen times the same.
    fn splat(value: f32) -> Self;
    /// From memory.
    fn load(values: &[f32; 16]) -> Self;
    /// To memory.
    fn store(self, values: &mut [f32; 16]);
    /// `self + x * y`, rounded once.
    #[must_use]
    fn add_product(self, x: Self, y: Self) -> Self;
    /// `self + x`.
    #[must_use]
    fn add(self, x: Self) -> Self;
}

/// A computation on such vectors.
pub trait SixteenWork {
    /// What comes out.
    type Output;

    /// Does it. Mark it `#[inline(always)]`, and what it calls.
    fn run<V: Sixteen>(self) -> Self::Output;
}

/// Does the work, or gives it back undone where the processor has no such vectors.
///
/// # Errors
/// The work.
#[inline]
pub fn sixteen<W: SixteenWork>(work: W) -> Result<W::Output, W> {
    #[cfg(target_arch = "x86_64")]
    return x86::sixteen(work);
    #[cfg(not(target_arch = "x86_64"))]
    Err(work)
}

#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code)]
mod x86 {
    use std::arch::x86_64::{
        __m512, _mm512_add_ps, _mm512_fmadd_ps, _mm512_loadu_ps, _mm512_set1_ps, _mm512_storeu_ps,
    };

    use super::{Sixteen, SixteenWork};

    /// Lives inside [`with_sixteen`] only: nobody else can name it.
    #[derive(Clone, Copy)]
    struct Register(__m512);

    impl Sixteen for Register {
        #[inline(always)]
        fn splat(value: f32) -> Self {
            // SAFETY, here and below: the type is used where the processor has avx512f only; references cover 16 numbers
            Self(unsafe { _mm512_set1_ps(value) })
        }

        #[inline(always)]
        fn load(values: &[f32; 16]) -> Self {
            Self(unsafe { _mm512_loadu_ps(values.as_ptr()) })
        }

        #[inline(always)]
        fn store(self, values: &mut [f32; 16]) {
            unsafe { _mm512_storeu_ps(values.as_mut_ptr(), self.0) }
        }

        #[inline(always)]
        fn add_product(self, x: Self, y: Self) -> Self {
            Self(unsafe { _mm512_fmadd_ps(x.0, y.0, self.0) })
        }

        #[inline(always)]
        fn add(self, x: Self) -> Self {
            Self(unsafe { _mm512_add_ps(self.0, x.0) })
        }
    }

    #[inline]
    pub fn sixteen<W: SixteenWork>(work: W) -> Result<W::Output, W> {
        if std::arch::is_x86_feature_detected!("avx512f") {
            // SAFETY: the processor has what the function is compiled for
            return Ok(unsafe { with_sixteen(work) });
        }
        Err(work)
    }

    #[target_feature(enable = "avx512f")]
    fn with_sixteen<W: SixteenWork>(work: W) -> W::Output {
        work.run::<Register>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Chain<'a>(&'a [[f32; 16]]);

    impl SixteenWork for Chain<'_> {
        type Output = [f32; 16];

        #[inline(always)]
        fn run<V: Sixteen>(self) -> [f32; 16] {
            let mut sum = V::splat(0.3);
            for row in self.0 {
                sum = sum.add_product(V::load(row), V::splat(1.1)).add(V::load(row));
            }
            let mut sums = [0.0; 16];
            sum.store(&mut sums);
            sums
        }
    }

    #[test]
    fn vectors_round_as_single_numbers_do() {
        let rows: Vec<[f32; 16]> = (0..50)
            .map(|n| std::array::from_fn(|k| 0.01 / (3 + (n * 16 + k) % 41) as f32))
            .collect();
        let expected: [f32; 16] =
            std::array::from_fn(|k| rows.iter().fold(0.3_f32, |sum, row| row[k].mul_add(1.1, sum) + row[k]));
        if let Ok(sums) = sixteen(Chain(&rows)) {
            assert_eq!(sums, expected);
        }
    }
}
