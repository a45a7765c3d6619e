//! Discrete-time filters (contract section 4).

use policy::Filter as Spec;

use crate::real::{Range, Real};

/// One filter of a chain with its coefficients rounded to the format and its place in the memory.
#[derive(Debug, Clone)]
pub(crate) struct Filter<T> {
    kind: Kind<T>,
    /// First word in the memory of the controller.
    start: usize,
}

#[derive(Debug, Clone, Copy)]
enum Kind<T> {
    Delay {
        samples: usize,
    },
    BackwardDifference {
        k: T,
    },
    LowPass {
        k: T,
    },
    FilteredDerivative {
        p: T,
        k: T,
    },
    MovingAverage {
        samples: usize,
        k: T,
    },
    Integrator {
        k: T,
        range: Range<T>,
        initial: T,
        /// `None` where all is kept: the contract multiplies by no 1.
        leak: Option<T>,
    },
}

impl<T: Real> Filter<T> {
    /// `period` in seconds; `start` is the first free word of the memory.
    pub fn new(spec: Spec, period: f64, start: usize) -> Self {
        // coefficients are rational in time constant and period: an exponential would be that of a libm,
        // another one on another machine; each is computed in binary64 and rounded once
        let kind = match spec {
            Spec::Delay { samples } => Kind::Delay { samples },
            Spec::BackwardDifference => Kind::BackwardDifference {
                k: T::nearest(1.0 / period),
            },
            Spec::LowPass { time_constant } => Kind::LowPass {
                k: T::nearest(period / (time_constant + period)),
            },
            Spec::FilteredDerivative { time_constant } => Kind::FilteredDerivative {
                p: T::nearest(time_constant / (time_constant + period)),
                k: T::nearest(1.0 / (time_constant + period)),
            },
            Spec::MovingAverage { samples } => Kind::MovingAverage {
                samples,
                k: T::nearest(1.0 / samples as f64),
            },
            Spec::Integrator {
                min,
                max,
                initial,
                leak,
            } => Kind::Integrator {
                k: T::nearest(period),
                range: Range {
                    lo: T::nearest(min),
                    hi: T::nearest(max),
                },
                initial: T::nearest(initial),
                leak: (leak != 1.0).then(|| T::nearest(leak)),
            },
        };
        Self { kind, start }
    }

    /// Number of memory words.
    pub fn words(&self) -> usize {
        match self.kind {
            Kind::Delay { samples } => samples,
            // the newest sample is the input itself; the check demands two at least
            Kind::MovingAverage { samples, .. } => samples - 1,
            Kind::BackwardDifference { .. } | Kind::LowPass { .. } | Kind::Integrator { .. } => 1,
            Kind::FilteredDerivative { .. } => 2,
        }
    }

    /// Names of the memory words, oldest first.
    pub fn word_names(&self) -> Vec<String> {
        match self.kind {
            Kind::Delay { samples } => (0..samples).map(|k| format!("delay[{k}]")).collect(),
            Kind::MovingAverage { samples, .. } => (1..samples).map(|k| format!("moving_average[{}]", k - 1)).collect(),
            Kind::BackwardDifference { .. } => vec!["backward_difference.x1".into()],
            Kind::LowPass { .. } => vec!["low_pass.y1".into()],
            Kind::FilteredDerivative { .. } => {
                vec!["filtered_derivative.x1".into(), "filtered_derivative.y1".into()]
            }
            Kind::Integrator { .. } => vec!["integrator.y1".into()],
        }
    }

    /// The output `y` for the input `x`; `memory` is that of the whole controller and is not changed.
    pub fn output(&self, memory: &[T], primed: bool, x: T) -> T {
        let read = |word: usize, unprimed: T| if primed { memory[self.start + word] } else { unprimed };
        match self.kind {
            Kind::Delay { .. } => read(0, x),
            Kind::BackwardDifference { k } => (x - read(0, x)) * k,
            Kind::LowPass { k } => {
                let y1 = read(0, x);
                y1 + k * (x - y1)
            }
            // unprimed the difference is 0 and so is the slope before: no pulse at the start
            Kind::FilteredDerivative { p, k } => p * read(1, T::ZERO) + k * (x - read(0, x)),
            Kind::MovingAverage { samples, k } => {
                // oldest first: the order of a sum of floats is part of its bits
                let mut sum = read(0, x);
                for word in 1..samples - 1 {
                    sum = sum + read(word, x);
                }
                (sum + x) * k
            }
            Kind::Integrator {
                k,
                range,
                initial,
                leak,
            } => {
                let y1 = read(0, initial);
                let kept = leak.map_or(y1, |leak| leak * y1);
                range.clamp(kept + k * x)
            }
        }
    }

    /// Moves the memory on by one sample: `x` went in, `y` came out.
    pub fn push(&self, memory: &mut [T], primed: bool, x: T, y: T) {
        let line = &mut memory[self.start..self.start + self.words()];
        match self.kind {
            Kind::Delay { .. } | Kind::BackwardDifference { .. } | Kind::MovingAverage { .. } => shift(line, primed, x),
            Kind::LowPass { .. } | Kind::Integrator { .. } => shift(line, primed, y),
            // two lines of one word: a push sets them, primed or not
            Kind::FilteredDerivative { .. } => line.copy_from_slice(&[x, y]),
        }
    }
}

/// Drops the oldest and appends, or fills the whole line if the state was not primed.
fn shift<T: Real>(line: &mut [T], primed: bool, newest: T) {
    if let [only] = line {
        *only = newest;
    } else if primed {
        line.rotate_left(1);
        if let Some(last) = line.last_mut() {
            *last = newest;
        }
    } else {
        // the first good sample stands for a past that nobody has measured: zeros would be a step from 0
        line.fill(newest);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs a filter from an unprimed state whose memory holds garbage.
    fn run<T: Real>(spec: Spec, period: f64, inputs: &[f64]) -> Vec<T> {
        let filter = Filter::<T>::new(spec, period, 1);
        let mut memory = vec![T::nearest(1234.5); filter.words() + 2];
        let outputs = inputs
            .iter()
            .enumerate()
            .map(|(n, &x)| {
                let x = T::nearest(x);
                let y = filter.output(&memory, n > 0, x);
                filter.push(&mut memory, n > 0, x, y);
                y
            })
            .collect();
        assert_eq!(memory[0], T::nearest(1234.5), "word before the filter's memory");
        assert_eq!(
            memory[filter.words() + 1],
            T::nearest(1234.5),
            "word behind the filter's memory"
        );
        outputs
    }

    #[test]
    fn delay_gives_the_first_sample_until_k_samples_have_passed() {
        assert_eq!(
            run::<f32>(Spec::Delay { samples: 1 }, 1.0, &[5.0, 6.0, 7.0]),
            [5.0, 5.0, 6.0]
        );
        assert_eq!(
            run::<f32>(Spec::Delay { samples: 3 }, 1.0, &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]),
            [1.0, 1.0, 1.0, 1.0, 2.0, 3.0]
        );
    }

    #[test]
    fn backward_difference_of_a_ramp_is_its_slope_after_one_sample() {
        // T = 0.25: k = 4, all values exact
        assert_eq!(
            run::<f32>(Spec::BackwardDifference, 0.25, &[3.0, 3.5, 4.0, 4.0]),
            [0.0, 2.0, 2.0, 0.0]
        );
    }

    #[test]
    fn backward_difference_multiplies_by_the_rounded_reciprocal() {
        let expected = (0.3_f32 - 0.1_f32) * (1.0_f64 / 3e-4) as f32;
        assert_eq!(
            run::<f32>(Spec::BackwardDifference, 3e-4, &[0.1_f32.into(), 0.3_f32.into()])[1],
            expected
        );
    }

    #[test]
    fn low_pass_step_response_is_one_minus_a_power() {
        // tau = T: k = 1/2, so 1 - 2^-n from a step at n = 1, exact in binary
        let y = run::<f32>(Spec::LowPass { time_constant: 1e-3 }, 1e-3, &[0.0, 1.0, 1.0, 1.0, 1.0]);
        assert_eq!(y, [0.0, 0.5, 0.75, 0.875, 0.9375]);
    }

    #[test]
    fn low_pass_starts_at_its_first_input() {
        assert_eq!(
            run::<f32>(Spec::LowPass { time_constant: 0.7 }, 1e-3, &[4.2, 4.2])[1],
            4.2
        );
    }

    #[test]
    fn filtered_derivative_of_a_step_decays_with_p() {
        // tau = 3 T, T = 0.25: p = 3/4, k = 1/(1) = 1; step of 1 gives k, k p, k p^2
        let y = run::<f32>(
            Spec::FilteredDerivative { time_constant: 0.75 },
            0.25,
            &[2.0, 3.0, 3.0, 3.0],
        );
        assert_eq!(y, [0.0, 1.0, 0.75, 0.5625]);
    }

    #[test]
    fn filtered_derivative_of_a_ramp_tends_to_its_slope() {
        let ramp: Vec<f64> = (0..200).map(|n| 0.5 * f64::from(n)).collect();
        let y = run::<f64>(Spec::FilteredDerivative { time_constant: 0.75 }, 0.25, &ramp);
        assert!((y[199] - 2.0).abs() < 1e-12, "{}", y[199]);
    }

    #[test]
    fn moving_average_primes_with_the_first_sample_and_then_slides() {
        let y = run::<f32>(
            Spec::MovingAverage { samples: 4 },
            1.0,
            &[4.0, 8.0, 0.0, 4.0, 4.0, 4.0, 4.0],
        );
        // windows: 4444, 4448, 4480, 4804, 8044, 0444, 4444
        assert_eq!(y, [4.0, 5.0, 4.0, 4.0, 4.0, 3.0, 4.0]);
    }

    #[test]
    fn moving_average_adds_oldest_first() {
        // 2^24 + 1 + 1: the ones vanish one by one if added to 2^24, and stay if added first
        let big = 16_777_216.0;
        let oldest_big = run::<f32>(Spec::MovingAverage { samples: 3 }, 1.0, &[big, 1.0, 1.0]);
        // at n = 2 the window is big, 1, 1 (oldest first)
        assert_eq!(oldest_big[2], 16_777_216.0_f32 * (1.0_f64 / 3.0) as f32);
        let newest_big = run::<f32>(Spec::MovingAverage { samples: 3 }, 1.0, &[1.0, 1.0, big]);
        assert_eq!(newest_big[2], 16_777_218.0_f32 * (1.0_f64 / 3.0) as f32);
    }

    #[test]
    fn moving_average_of_two_has_one_word() {
        assert_eq!(
            run::<f32>(Spec::MovingAverage { samples: 2 }, 1.0, &[1.0, 2.0, 4.0]),
            [1.0, 1.5, 3.0]
        );
    }

    #[test]
    fn integrator_starts_at_initial_adds_t_x_and_stops_at_its_clamp() {
        let spec = Spec::Integrator {
            min: -1.0,
            max: 1.0,
            initial: 0.5,
            leak: 1.0,
        };
        // T = 0.25: the first output already contains the first input; no wind-up beyond the clamp
        assert_eq!(
            run::<f32>(spec, 0.25, &[1.0, 1.0, 1.0, -1.0, -8.0, -8.0, 4.0]),
            [0.75, 1.0, 1.0, 0.75, -1.0, -1.0, 0.0]
        );
    }

    #[test]
    fn a_leaky_integrator_keeps_its_share_of_the_value_before_also_of_initial() {
        let spec = Spec::Integrator {
            min: -1.0,
            max: 1.0,
            initial: 0.5,
            leak: 0.75,
        };
        // T = 0.25: 3/8 + 1/8, 3/8 + 1/4, clamped at 1, 3/4 of it: all exact
        assert_eq!(run::<f32>(spec, 0.25, &[0.5, 1.0, 8.0, 0.0]), [0.5, 0.625, 1.0, 0.75]);
        // each product is rounded before the sum
        let spec = Spec::Integrator {
            min: -10.0,
            max: 10.0,
            initial: 0.0,
            leak: 0.9,
        };
        let first = 1e-3_f32 * 3.3_f32;
        let second = 0.9_f32 * first + 1e-3_f32 * 7.7_f32;
        let inputs = [3.3_f32.into(), 7.7_f32.into()];
        assert_eq!(run::<f32>(spec, 1e-3, &inputs), [first, second]);
    }

    #[test]
    fn unprimed_filters_overwrite_every_word_of_their_line() {
        let filter = Filter::<f32>::new(Spec::Delay { samples: 3 }, 1.0, 0);
        let mut memory = [7.0, 8.0, 9.0];
        filter.push(&mut memory, false, 1.0, 0.0);
        assert_eq!(memory, [1.0; 3]);
        filter.push(&mut memory, true, 2.0, 0.0);
        assert_eq!(memory, [1.0, 1.0, 2.0]);
    }
}
