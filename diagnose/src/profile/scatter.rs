//! How much a parameter scatters, told by the residuals of the fit itself.
//!
//! The noise of a channel is estimated before anything is known of the causes, and on the safe side where few values tell of it. Once a fit is
//! there, what it leaves tells more: of a parameter that channels hold with the weights of the noise assumed, the variance is that of the noise left
//! in each, weighted with how much the channel moves when the parameter does (White 1980, "A heteroskedasticity-consistent covariance matrix
//! estimator", Econometrica 48, for one variance a channel).

use super::TWO_SIDED;
use crate::noise::{self, channel};
use crate::problem::Problem;
use crate::record::CHANNELS;

/// Fewer degrees of freedom tell less of noise than is known of meters. Student's t of so many reaches 2.3, where a normal one reaches 1.96.
const FEWEST: f64 = 8.0;

/// One channel as one parameter sees it.
struct Seen {
    /// Square of how far the channel moves with the parameter, over its noise.
    moved: f64,
    /// Mean square of what is left, over that of the noise assumed.
    square: f64,
    /// Values.
    count: f64,
}

/// Variance of a parameter over that of the noise assumed, with the width of Student's t in place of the normal one; `moved` are the
/// residuals with the parameter elsewhere and all others fitted, `parameters` how many are fitted.
pub(super) fn of(problem: &Problem, best: &[f64], moved: &[f64], parameters: usize) -> f64 {
    let seen: Vec<Seen> = (0..CHANNELS).filter_map(|n| seen(problem, best, moved, n)).collect();
    of_seen(&seen, parameters)
}

fn seen(problem: &Problem, best: &[f64], moved: &[f64], n: usize) -> Option<Seen> {
    let (mut response, mut square, mut count) = (0.0, 0.0, 0.0);
    for record in 0..problem.records.len() {
        let (at, there) = (channel(problem, best, record, n), channel(problem, moved, record, n));
        for (here, there) in at.iter().zip(&there).filter(|(here, _)| **here != 0.0) {
            response += (there - here).powi(2);
            square += here * here;
            count += 1.0;
        }
    }
    // what rounds or what meters are does not get less by what happens to be left
    let least = (noise::least(problem, n) / problem.sigma[n]).powi(2);
    (count > 0.0).then(|| Seen {
        moved: response,
        square: (square / count).max(least),
        count,
    })
}

fn of_seen(seen: &[Seen], parameters: usize) -> f64 {
    let total: f64 = seen.iter().map(|one| one.count).sum();
    let moved: f64 = seen.iter().map(|one| one.moved).sum();
    // each channel pays for the parameters by its share of the values
    let paid = 1.0 - parameters as f64 / total;
    if !(moved > 0.0 && paid > 0.0) {
        return 1.0;
    }
    let parts = || {
        seen.iter()
            .map(|one| (one.moved / moved * one.square / paid, one.count * paid))
    };
    let square: f64 = parts().map(|part| part.0).sum();
    // of a sum of variances (Satterthwaite 1946)
    let free = square * square / parts().map(|(part, free)| part * part / free).sum::<f64>();
    if !(free >= FEWEST && square.is_finite()) {
        return 1.0;
    }
    square * (student(free) / TWO_SIDED).powi(2)
}

/// Where Student's t of `free` degrees of freedom ends its two-sided 95 % (Fisher and Cornish 1960, to the second order).
fn student(free: f64) -> f64 {
    let z = TWO_SIDED;
    let first = (z.powi(3) + z) / 4.0;
    let second = (5.0 * z.powi(5) + 16.0 * z.powi(3) + 3.0 * z) / 96.0;
    z + first / free + second / (free * free)
}

#[cfg(test)]
mod tests {
    use super::{Seen, of_seen, student};

    fn seen(moved: f64, square: f64, count: f64) -> Seen {
        Seen { moved, square, count }
    }

    #[test]
    fn students_t_is_that_of_the_tables() {
        for (free, known) in [(8.0, 2.306), (10.0, 2.228), (30.0, 2.042), (120.0, 1.980)] {
            assert!((student(free) - known).abs() < 0.006, "{free}: {}", student(free));
        }
    }

    #[test]
    fn a_parameter_scatters_as_the_channels_that_hold_it() {
        // noise twice what was assumed in the channel that does not move
        let of_quiet = of_seen(&[seen(10.0, 0.25, 1e6), seen(0.0, 4.0, 1e6)], 1);
        assert!((of_quiet - 0.25).abs() < 1e-4, "{of_quiet}");
        let of_both = of_seen(&[seen(10.0, 0.25, 1e6), seen(10.0, 4.0, 1e6)], 1);
        assert!((of_both - 2.125).abs() < 1e-4, "{of_both}");
        // 20 values and 10 parameters leave half of the square, and 10 degrees of freedom
        let few = of_seen(&[seen(1.0, 0.5, 20.0)], 10);
        assert!((few - (2.228_f64 / 1.96).powi(2)).abs() < 0.01, "{few}");
    }

    #[test]
    fn few_values_leave_what_is_known_of_meters() {
        assert_eq!(of_seen(&[seen(1.0, 0.01, 9.0)], 3), 1.0);
        assert_eq!(of_seen(&[seen(1.0, 0.01, 3.0)], 3), 1.0);
        assert_eq!(of_seen(&[seen(0.0, 0.01, 300.0)], 3), 1.0);
    }
}
