//! What a controller does at rest, where it should do nothing.
//!
//! A controller of few duties, or one whose network does not rank them finely, goes to and fro between duties although the
//! voltage stands still. The voltage hardly shows it; losses, the capacitor's life and the ear do.

use serde::Serialize;

/// How restless a run was over its tail.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Chatter {
    /// Root of the mean square of the duty's changes from a control period to the next.
    pub duty_activity: f64,
    /// Peak to peak of the sampled inductor current, over the ripple that a loss-free converter has within a period: 0 for
    /// a duty that stands still.
    pub current_swing: f64,
    /// Amplitude of the strongest line of the duty at a half, a third and a quarter of the sampling frequency.
    pub subharmonic: f64,
    /// Control periods of that line: 2, 3 or 4; 0 if there is none.
    pub subharmonic_periods: u32,
}

/// Periods of the lines that are looked at.
// a limit cycle of a sampled loop with a few duties mostly has two periods, with a delay three or four
const LINES: [u32; 3] = [2, 3, 4];
/// The longest of them.
const LONGEST: usize = 4;
/// A window that is a multiple of it holds whole periods of each line.
const WHOLE: usize = 12;
/// Lines below this are rounding.
// the sum of some hundred duties around 1 is exact to 1e-14
const NO_LINE: f64 = 1e-12;

impl Chatter {
    /// Of the commanded duties and the sampled inductor currents (A) of the tail; `ripple` is that of a loss-free converter,
    /// A peak to peak.
    #[must_use]
    pub fn new(duties: &[f64], currents: &[f64], ripple: f64) -> Self {
        if duties.iter().chain(currents).any(|x| !x.is_finite()) {
            return Self {
                duty_activity: f64::INFINITY,
                current_swing: f64::INFINITY,
                subharmonic: f64::INFINITY,
                subharmonic_periods: 0,
            };
        }
        let squares = duties.windows(2).map(|pair| (pair[1] - pair[0]).powi(2));
        let changes = duties.len().saturating_sub(1).max(1) as f64;
        let highest = currents.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let lowest = currents.iter().copied().fold(f64::INFINITY, f64::min);
        let (subharmonic, subharmonic_periods) = strongest(duties);
        Self {
            duty_activity: (squares.sum::<f64>() / changes).sqrt(),
            current_swing: (highest - lowest).max(0.0) / ripple,
            subharmonic,
            subharmonic_periods,
        }
    }

    /// Figure by figure the larger.
    #[must_use]
    pub fn worst(self, other: Self) -> Self {
        let line = if other.subharmonic > self.subharmonic {
            other
        } else {
            self
        };
        Self {
            duty_activity: self.duty_activity.max(other.duty_activity),
            current_swing: self.current_swing.max(other.current_swing),
            subharmonic: line.subharmonic,
            subharmonic_periods: line.subharmonic_periods,
        }
    }
}

/// Amplitude and periods of the strongest of [`LINES`].
fn strongest(duties: &[f64]) -> (f64, u32) {
    // the newest: what settles late is farthest away
    let duties = &duties[duties.len() % WHOLE..];
    let none = (0.0, 0);
    if duties.is_empty() {
        return none;
    }
    let found = amplitudes(duties)
        .into_iter()
        .fold(none, |best, line| if line.0 > best.0 { line } else { best });
    if found.0 < NO_LINE { none } else { found }
}

/// Amplitudes of the [`LINES`] under a Hann window, by which a duty that drifts slowly leaves none.
fn amplitudes(duties: &[f64]) -> [(f64, u32); LINES.len()] {
    let n = duties.len() as f64;
    // not `f64::cos`: that of each platform ends in other digits, and a metric is the same everywhere
    let turn = |k: usize, periods: u32| libm::sincos(std::f64::consts::TAU * k as f64 / f64::from(periods));
    // each sine once, not once for each duty
    let turns = LINES.map(|periods| std::array::from_fn::<_, LONGEST, _>(|k| turn(k % periods as usize, periods)));
    let mut sums = [[0.0; 2]; LINES.len()];
    for (k, duty) in duties.iter().enumerate() {
        let weight = 1.0 - libm::cos(std::f64::consts::TAU * k as f64 / n);
        for (([real, imaginary], turns), periods) in sums.iter_mut().zip(&turns).zip(LINES) {
            let (sin, cos) = turns[k % periods as usize];
            *real += weight * duty * cos;
            *imaginary += weight * duty * sin;
        }
    }
    std::array::from_fn(|line| {
        let ([real, imaginary], periods) = (sums[line], LINES[line]);
        // the weights add up to n. At half the sampling frequency both halves of the spectrum are one line
        let halves = if periods == 2 { 1.0 } else { 2.0 };
        (halves * libm::hypot(real, imaginary) / n, periods)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(duty: impl Fn(usize) -> f64) -> Chatter {
        let duties: Vec<f64> = (0..100).map(duty).collect();
        Chatter::new(&duties, &[], 1.0)
    }

    #[test]
    fn a_duty_that_alternates_has_its_half_step_as_line_and_its_step_as_activity() {
        let found = of(|n| if n % 2 == 0 { 0.6 } else { 0.4 });
        assert!(
            (found.subharmonic - 0.1).abs() < 1e-12 && found.subharmonic_periods == 2,
            "{found:?}"
        );
        assert!((found.duty_activity - 0.2).abs() < 1e-12);
    }

    #[test]
    fn lines_of_three_and_four_periods_have_their_amplitude() {
        for periods in [3, 4] {
            let found = of(|n| 0.5 + 0.03 * (std::f64::consts::TAU * n as f64 / f64::from(periods)).cos());
            assert!((found.subharmonic - 0.03).abs() < 1e-12, "{found:?}");
            assert_eq!(found.subharmonic_periods, periods);
        }
    }

    #[test]
    fn a_duty_that_stands_still_or_drifts_has_no_line() {
        assert_eq!(of(|_| 0.3).subharmonic, 0.0);
        // a slow drift of .1 over the tail, far more than a settled loop has: its line is below every digit that is shown
        let drift = of(|n| 0.3 + 1e-3 * n as f64);
        assert!(drift.subharmonic < 1e-4, "{drift:?}");
        assert!((drift.duty_activity - 1e-3).abs() < 1e-12);
    }

    #[test]
    fn the_swing_is_in_ripples_and_a_run_that_diverged_is_the_worst() {
        let found = Chatter::new(&[0.5; 3], &[1.0, 3.0, 2.0], 4.0);
        assert_eq!(found.current_swing, 0.5);
        let lost = Chatter::new(&[0.5, f64::NAN], &[1.0], 4.0);
        assert_eq!(found.worst(lost).duty_activity, f64::INFINITY);
        assert_eq!(lost.worst(found).subharmonic, f64::INFINITY);
    }
}
