//! How much a cause gains by what is no white noise: a line, its harmonics, the ring that edges kick.
//!
//! ```text
//! in    the response of the signals to a cause, and what the fit leaves
//! do    shift the one against the other by all numbers of rows, and take the score at each
//! out   the mean square of the scores over that of white noise
//! ```
//! A score is the sum of the products of response and residual; the square of it over that of the response is what the cause gains. White
//! noise gives each shift the same score in the mean. A residual with a colour gives more where the response has that colour as well: what
//! a cause gains is then held against what its response gains where its steps are not. This is the covariance with the autocorrelation of the
//! residuals in it (the sandwich of White, and of Newey and West), without a lag at which it is cut off.

use crate::attribute::Attribution;
use crate::causes::Search;
use crate::fast::transform;
use crate::fit::Fitter;
use crate::noise::channel;
use crate::problem::{Problem, axpy, dot};
use crate::record::{CHANNELS, Record};

/// For each cause of the best explanation the square of its scores over that in white noise, 1. It is 1 where a cause moves by whole steps
/// only, which have no response at first order.
#[must_use]
pub fn scatter(problem: &Problem, attribution: &Attribution) -> Vec<f64> {
    let Some(best) = &attribution.best else {
        return Vec::new();
    };
    let basis = problem.basis(&best.state.model, &best.state.starts, &best.state.residual);
    let fitter = Fitter {
        basis: &basis,
        ..attribution.fitter(problem)
    };
    let columns: Vec<Vec<Vec<f64>>> = (best.causes.iter())
        .map(|cause| fitter.sensitivity(*cause, &best.state))
        .collect();
    let of = |member: usize| {
        let others = columns.iter().enumerate().filter(|(n, _)| *n != member);
        let others: Vec<Vec<f64>> = others.flat_map(|(_, own)| own.clone()).collect();
        let own = columns[member].iter();
        own.map(|column| of_column(problem, &beside(column, &others), &best.state.residual))
            .fold(1.0, f64::max)
    };
    (0..best.causes.len()).map(of).collect()
}

/// Rows of the longest rhythm that is told from a ripple of the source. Mains and their harmonics are slower: 300 Hz at 10 kHz are 33 rows.
const LONGEST: f64 = 16.0;
/// How near to a whole number of rows its period is, in standard deviations of the frequency, and at least, over what the record resolves.
// of 250 rows the frequencies up to a fifth of the rate are within it by chance once in twenty
const NEAR: f64 = 3.0;
const LEAST_NEAR: f64 = 0.1;

/// Whether a cause of the best explanation is a line of the source that comes again in a whole number of rows: a source does not know when the
/// switch closes. What the control does, limit cycles and dithers, comes so.
#[must_use]
pub fn is_of_rows(problem: &Problem, attribution: &Attribution, member: usize) -> bool {
    let Some(best) = &attribution.best else { return false };
    let form = attribution.candidates[best.causes[member]].form;
    let place = form.knobs.iter().position(|knob| knob.name == "frequency");
    let (Search::Line, Some(place)) = (form.search, place) else {
        return false;
    };
    let before: usize = (best.causes[..member].iter())
        .map(|cause| attribution.candidates[*cause].own.len())
        .sum();
    let number = before + place;
    let sd = (best.covariance[number][number].max(0.0) * attribution.inflation).sqrt();
    let rows = problem.records.iter().map(Record::rows).max().unwrap_or(1) as f64;
    is_whole(best.values[number] * problem.bases.t_sw, sd * problem.bases.t_sw, rows)
}

/// Whether the period of a line at `frequency`, known to `sd`, is a whole number of rows; both over the rate of so many `rows`.
fn is_whole(frequency: f64, sd: f64, rows: f64) -> bool {
    let period = libm::round(frequency.recip());
    // a frequency that is hardly known is near to any
    let near = (NEAR * sd).min(1.0 / rows).max(LEAST_NEAR / rows);
    (2.0..=LONGEST).contains(&period) && (frequency - period.recip()).abs() < near
}

/// A response without what others can do as well.
fn beside(column: &[f64], others: &[Vec<f64>]) -> Vec<f64> {
    let mut known: Vec<Vec<f64>> = Vec::new();
    let without = |mut one: Vec<f64>, known: &[Vec<f64>]| {
        for other in known {
            let share = dot(other, &one) / dot(other, other).max(f64::MIN_POSITIVE);
            axpy(&mut one, -share, other);
        }
        one
    };
    for other in others {
        let one = without(other.clone(), &known);
        known.push(one);
    }
    without(column.to_vec(), &known)
}

/// Mean square of the scores of one response at all shifts, over that in white noise.
fn of_column(problem: &Problem, response: &[f64], residual: &[f64]) -> f64 {
    let (mut sum, mut white) = (0.0, 0.0);
    for (index, record) in problem.records.iter().enumerate() {
        if !is_in_time(record) {
            continue;
        }
        let channels: Vec<[Vec<f64>; 2]> = (0..CHANNELS)
            .map(|n| [response, residual].map(|values| channel(problem, values, index, n)))
            .filter(|[_, left]| left.iter().any(|v| *v != 0.0))
            .collect();
        sum += of_record(&channels);
        white += channels
            .iter()
            .map(|[response, _]| dot(response, response))
            .sum::<f64>();
    }
    if white > 0.0 { sum / white } else { 1.0 }
}

/// Settled points have no order in time.
fn is_in_time(record: &Record) -> bool {
    !record.settled && record.capture.is_none()
}

/// Mean square of the scores of a record, whose channels hold a response and a residual each.
fn of_record(channels: &[[Vec<f64>; 2]]) -> f64 {
    let rows = channels.iter().map(|[_, left]| left.len()).max().unwrap_or(0);
    if rows == 0 {
        return 0.0;
    }
    // so long that what is shifted out at one end does not come in at the other
    let length = (2 * rows).next_power_of_two();
    let (mut re, mut im) = (vec![0.0; length], vec![0.0; length]);
    for [response, left] in channels {
        let [a, b] = [response, left].map(|values| {
            let (mut re, mut im) = (values.clone(), vec![0.0; length]);
            re.resize(length, 0.0);
            transform(&mut re, &mut im);
            (re, im)
        });
        for n in 0..length {
            re[n] += a.0[n] * b.0[n] + a.1[n] * b.1[n];
            im[n] += a.0[n] * b.1[n] - a.1[n] * b.0[n];
        }
    }
    // Parseval: the squares of the transform are those of the scores at all shifts, times its length
    (dot(&re, &re) + dot(&im, &im)) / (length * rows) as f64
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::{is_whole, of_record};
    use crate::noise::tests::normal;
    use crate::problem::dot;

    /// A response that begins at one step and fades.
    fn response(rows: usize, at: usize, fades: f64) -> Vec<f64> {
        (0..rows)
            .map(|row| {
                if row < at {
                    0.0
                } else {
                    (-((row - at) as f64) / fades).exp()
                }
            })
            .collect()
    }

    #[test]
    fn a_line_in_step_with_the_rows_is_told_from_one_that_is_not() {
        assert!(
            is_whole(0.125, 1e-5, 300.0) && is_whole(0.1252, 1e-5, 300.0) && is_whole(1.0 / 11.0 + 5e-4, 2e-4, 300.0)
        );
        assert!(!is_whole(0.13, 1e-5, 300.0) && !is_whole(0.13, 1.0, 300.0));
        // harmonics of mains
        assert!(!is_whole(0.01, 1e-5, 300.0) && !is_whole(0.03, 1e-5, 300.0));
    }

    #[test]
    fn in_white_noise_a_score_scatters_as_if_all_rows_were_independent() {
        let mut state = 5;
        for rows in [150, 400] {
            let mean = (0..40).map(|_| {
                let left: Vec<f64> = (0..rows).map(|_| normal(&mut state)).collect();
                let other: Vec<f64> = (0..rows).map(|_| normal(&mut state)).collect();
                let channels = [[response(rows, 50, 20.0), left], [response(rows, 50, 8.0), other]];
                let white: f64 = channels.iter().map(|[response, _]| dot(response, response)).sum();
                of_record(&channels) / white
            });
            let mean = mean.sum::<f64>() / 40.0;
            assert!((mean - 1.0).abs() < 0.1, "{rows}: {mean}");
        }
    }

    // The oracle is the score itself, at random phases of the line: of a line of amplitude 1 its square is half of that of the response's
    // Fourier transform.
    #[test]
    fn beside_a_line_it_scatters_as_the_line_at_any_phase_makes_it() {
        let rows = 300;
        for (frequency, fades) in [(0.04, 15.0), (0.1, 15.0), (0.25, 3.0)] {
            let response = response(rows, 60, fades);
            let score = |phase: f64| {
                let line = (0..rows).map(|row| libm::sin(TAU * (frequency * row as f64 + phase)));
                line.zip(&response).map(|(a, b)| a * b).sum::<f64>().powi(2)
            };
            let expected = (0..100).map(|n| score(f64::from(n) / 100.0)).sum::<f64>() / 100.0;
            let line: Vec<f64> = (0..rows).map(|row| libm::sin(TAU * frequency * row as f64)).collect();
            let found = of_record(&[[response.clone(), line]]);
            // what is shifted out at the ends has no line any more
            assert!(
                (found / expected - 1.0).abs() < 0.25,
                "{frequency}: {found} of {expected}"
            );
        }
    }
}
