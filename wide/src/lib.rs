//! Runs a computation with the widest vectors that the processor has.
//!
//! A program for every x86-64 processor may use vectors of two doubles only. Here the same code is compiled for wider ones as
//! well, and the processor is asked at run time. The results are the same to the bit: the compiler neither reorders sums nor
//! contracts a product and a sum to a fused operation, however wide the vectors are. Where a computation is to be fused,
//! and hand-made for registers, there is [`sixteen`].

mod sixteen;

pub use sixteen::{Sixteen, SixteenWork, sixteen};

/// A computation, with what it works on.
pub trait Work {
    /// What comes out.
    type Output;

    /// Does it. Mark it `#[inline(always)]`, and what it calls: only what is inlined is compiled for wide vectors.
    fn run(self) -> Self::Output;
}

/// Does the work with the widest vectors that this processor has.
#[inline]
pub fn widest<W: Work>(work: W) -> W::Output {
    #[cfg(target_arch = "x86_64")]
    return x86::widest(work);
    #[cfg(not(target_arch = "x86_64"))]
    work.run()
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::Work;

    #[allow(unsafe_code)]
    #[inline]
    pub fn widest<W: Work>(work: W) -> W::Output {
        if std::arch::is_x86_feature_detected!("avx512f") {
            // SAFETY: the processor has what the function is compiled for
            return unsafe { with_eight(work) };
        }
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: as above
            return unsafe { with_four(work) };
        }
        work.run()
    }

    #[target_feature(enable = "avx512f")]
    fn with_eight<W: Work>(work: W) -> W::Output {
        work.run()
    }

    #[target_feature(enable = "avx2")]
    fn with_four<W: Work>(work: W) -> W::Output {
        work.run()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Sums<'a>(&'a [[f64; 8]]);

    impl Work for Sums<'_> {
        type Output = [f64; 8];

        #[inline(always)]
        fn run(self) -> [f64; 8] {
            let mut sums = [0.1; 8];
            for row in self.0 {
                for (sum, x) in sums.iter_mut().zip(row) {
                    *sum += *sum * x;
                }
            }
            sums
        }
    }

    #[test]
    fn wide_vectors_give_the_same_bits() {
        let rows: Vec<[f64; 8]> = (0..100)
            .map(|n| std::array::from_fn(|k| 0.01 / f64::from(3 + (n * 8 + k as u32) % 41)))
            .collect();
        assert_eq!(widest(Sums(&rows)), Sums(&rows).run());
    }
}
