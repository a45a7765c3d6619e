//! Which steps of a duty counter could have made a residual: the response to the rounding of the duty, by the averaged
//! circuit linearised around each row, for thousands of steps.

use crate::parallel;
use crate::problem::{Basis, Problem, dot};
use crate::record::{CHANNELS, Record};

/// Counts per period that are looked at, and how far apart: half a count of the duty moves by less than a tenth.
const FEWEST: f64 = 8.0;
const MOST: f64 = 1000.0;
const APART: f64 = 0.1;
/// Steps of the integration in a period.
const FINE: usize = 4;

/// The counts per period (whole or not) whose rounding looks most like `residual`, best first.
pub(crate) fn likely(problem: &Problem, basis: &Basis, residual: &[f64], count: usize) -> Vec<f64> {
    let numbers: Vec<f64> = (0..=((MOST - FEWEST) / APART) as usize)
        .map(|n| FEWEST + n as f64 * APART)
        .collect();
    let gains = parallel::map(&numbers, |counts| {
        let mut column = response(problem, *counts);
        for (value, left) in column.iter_mut().zip(residual) {
            // where nothing counts
            if *left == 0.0 {
                *value = 0.0;
            }
        }
        basis.project(&mut column);
        let (along, length) = (dot(&column, residual), dot(&column, &column));
        if along > 0.0 && length > 0.0 {
            along * along / length
        } else {
            0.0
        }
    });
    let mut order: Vec<usize> = (0..numbers.len()).collect();
    order.sort_by(|a, b| gains[*b].total_cmp(&gains[*a]).then(a.cmp(b)));
    order.into_iter().take(count).map(|n| numbers[n]).collect()
}

/// Change of the signals over their noise when the duty is rounded to `counts` per period.
fn response(problem: &Problem, counts: f64) -> Vec<f64> {
    let mut out = vec![0.0; problem.len()];
    for (record, offset) in problem.records.iter().zip(&problem.offsets).filter(|(r, _)| !r.settled) {
        for segment in &record.segments {
            let (mut v, mut i) = (0.0, 0.0);
            for row in segment.clone() {
                out[offset + row * CHANNELS] = v / problem.sigma[0];
                out[offset + row * CHANNELS + 1] = i / problem.sigma[1];
                let next = (row + 1).min(record.rows() - 1);
                for (row, share) in [(row, 1.0 - record.phase), (next, record.phase)] {
                    (v, i) = advanced(problem, record, row, counts, share, (v, i));
                }
            }
        }
    }
    out
}

/// A share of the period of `row`.
fn advanced(
    problem: &Problem,
    record: &Record,
    row: usize,
    counts: f64,
    share: f64,
    (mut v, mut i): (f64, f64),
) -> (f64, f64) {
    let p = &problem.base.plant;
    let duty = record.duty[row];
    let rounded = (libm::floor(duty * counts + 0.5) / counts).min(1.0);
    let pushed = p.converter.v_in * record.v_in_ratio * (rounded - duty);
    let r = p.inductor.dcr + 0.5 * (p.switch.r_ds_on + p.switch.r_d);
    let load = &record.load[row];
    let g = load.conductance - load.power / (problem.bases.v * problem.bases.v);
    let h = share * problem.bases.t_sw / FINE as f64;
    for _ in 0..FINE {
        i += h / p.converter.inductance * (pushed - v - r * i);
        v += h / p.converter.capacitance * (i - g * v);
    }
    (v, i)
}
