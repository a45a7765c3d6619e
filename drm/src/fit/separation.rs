//! What a table determines and what it cannot.

use policy::Interval;
use serde::Serialize;

use crate::fit::regression::{Form, Model, hull};
use crate::pls::{centre_and_scale, dot};
use crate::table::Point;

/// How well the predictors of a table are told apart.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Separation {
    /// Largest over smallest singular value of the standardised predictors; 1 is best. Infinite values are null in JSON.
    pub condition: f64,
    /// Independent directions the table has for the predictors (beside the constant).
    pub directions: usize,
    /// Predictors: d_sim, i_out and, in the four-term form, their product.
    pub predictors: usize,
    /// What the table does not determine, in words.
    pub findings: Vec<String>,
}

/// Beyond this condition a direction is rounding or noise: it takes no part in the fit.
// measured tables have three to four digits; the tests hold from 1e2 to 1e6
const LOST: f64 = 1e3;
/// Beyond this condition coefficients are poorly separated (Belsley, Kuh and Welsch, 1980).
const WEAK: f64 = 30.0;
/// A range of d_sim below this cannot say how the duty must change.
// 0.2 V at 200 V: noise of 0.02 V would make a uncertain by a tenth
pub(crate) const LEAST_D_SIM: f64 = 1e-3;
/// A range of the load current below this share of its largest value counts as none.
// what meters are off by; a convention, of which the tests ask nothing from 0.1 % to 5 %
const LEAST_LOAD: f64 = 0.01;
/// A corner of the box farther than this share of its sides from every point was not measured.
// above a third: a grid of four levels may lack a corner, its neighbours are near. One of three levels (a half) may not
const FAR: f64 = 0.35;

/// Whether the load current varies too little to say anything about it.
pub(crate) fn is_constant_load(points: &[Point]) -> bool {
    let range = hull(points.iter().map(|p| p.i_out));
    range.high - range.low <= LEAST_LOAD * range.low.abs().max(range.high.abs())
}

pub(crate) fn examine(model: &Model, points: &[Point]) -> Separation {
    let (condition, directions) = condition(model, points);
    let predictors = model.form.predictors();
    let mut findings = Vec::new();
    if model.constant_load {
        findings.push(
            "the load current does not vary: b cannot be told from c; b is written as 0 and the mapping holds at this \
             current only"
                .to_owned(),
        );
    } else if model.form == Form::ThreeTerm && model.assumed_a.is_none() {
        on_a_line(points, condition, &mut findings);
    } else if condition > LOST {
        findings.push("the product i_out d_sim cannot be told from d_sim and i_out".to_owned());
    } else if condition > WEAK {
        findings.push(format!(
            "a, b and r are poorly separated (condition {condition:.0}): their sum holds better than each alone"
        ));
    }
    Separation {
        condition,
        // a fit has one component at least; without a direction that one finds nothing to explain
        directions: directions.max(1),
        predictors,
        findings,
    }
}

/// Largest over smallest singular value of the predictors that vary, and how many directions are determined.
fn condition(model: &Model, points: &[Point]) -> (f64, usize) {
    let columns: Vec<Vec<f64>> = model
        .columns(points)
        .iter()
        // a column that is constant by intent (no load current, a given) would make every condition infinite
        .filter_map(|column| standardised(column))
        .collect();
    let values = eigenvalues(&correlation(&columns));
    let largest = values.first().copied().unwrap_or(0.0);
    let smallest = values.last().copied().unwrap_or(0.0).max(0.0);
    // eigenvalues of the correlation are squares of the singular values
    let directions = values.iter().filter(|value| **value * LOST * LOST > largest).count();
    let condition = if smallest > 0.0 {
        (largest / smallest).sqrt()
    } else {
        f64::INFINITY
    };
    (condition, directions)
}

/// i_out as a line in d_sim.
struct LoadLine {
    slope: f64,
    offset: f64,
}

impl LoadLine {
    fn of(points: &[Point]) -> Self {
        let d: Vec<f64> = points.iter().map(Point::d_sim).collect();
        let i: Vec<f64> = points.iter().map(|p| p.i_out).collect();
        let ((d_mean, d_scale), (i_mean, i_scale)) = (centre_and_scale(&d), centre_and_scale(&i));
        let together = dot(&d, &i) - d_mean * i_mean * d.len() as f64;
        // the ratio of the spreads: a regression would depend on which of the two is taken for the cause
        let slope = together.signum() * i_scale / d_scale;
        LoadLine {
            slope,
            offset: i_mean - slope * d_mean,
        }
    }
}

/// The slope of i_out over d_sim, A, if a table knows the two on one line only; 0 if not.
pub(crate) fn load_line(points: &[Point]) -> f64 {
    let model = Model {
        form: Form::ThreeTerm,
        constant_load: is_constant_load(points),
        assumed_a: None,
        load_line: 0.0,
    };
    // two points always lie on a line
    let apart = model.constant_load || points.len() < 3 || condition(&model, points).0 <= LOST;
    if apart { 0.0 } else { LoadLine::of(points).slope }
}

/// What a single resistor does to a table.
fn on_a_line(points: &[Point], condition: f64, findings: &mut Vec<String>) {
    if condition <= WEAK {
        return;
    }
    let LoadLine { slope, offset } = LoadLine::of(points);
    let v_in = points.iter().map(|p| p.v_in).sum::<f64>() / points.len() as f64;
    // 1 % of the current at full duty: what a real resistor and a meter leave. It only words the note
    let resistor = match slope > 0.0 && offset.abs() < 0.01 * slope {
        true => format!(", as with one resistor of {:.3} ohm", v_in / slope),
        false => String::new(),
    };
    let how = if condition > LOST { "cannot" } else { "can hardly" };
    findings.push(format!(
        "i_out = {slope:.4} d_sim {offset:+.4} A throughout{resistor}: a and b {how} be told apart, only a + {slope:.4} b \
         is known, and off this line the mapping is a guess; vary the load at equal duty, or give a with --assume-a (the \
         gain that the controller sees; 1 for small losses)"
    ));
}

/// Corners of the box of validity with no point near.
pub(crate) fn unmeasured_corners(points: &[Point], i_out: Interval, d_sim: Interval) -> Vec<String> {
    let width = |interval: Interval| (interval.high - interval.low).max(f64::MIN_POSITIVE);
    let mut corners = Vec::new();
    for (i_name, i) in [("low", i_out.low), ("high", i_out.high)] {
        for (d_name, d) in [("low", d_sim.low), ("high", d_sim.high)] {
            let distance = |p: &Point| {
                let along_i = (p.i_out - i).abs() / width(i_out);
                along_i.max((p.d_sim() - d).abs() / width(d_sim))
            };
            if points.iter().all(|p| distance(p) > FAR) {
                corners.push(format!("{d_name} d_sim with {i_name} i_out ({d:.3}, {i:.3} A)"));
            }
        }
    }
    corners
}

/// A column of mean 0 and length 1; `None` if it does not vary.
fn standardised(column: &[f64]) -> Option<Vec<f64>> {
    let (mean, scale) = centre_and_scale(column);
    let length = scale * (column.len() as f64 - 1.0).sqrt();
    (scale > 0.0).then(|| column.iter().map(|v| (v - mean) / length).collect())
}

fn correlation(columns: &[Vec<f64>]) -> Vec<Vec<f64>> {
    columns
        .iter()
        .map(|a| columns.iter().map(|b| dot(a, b)).collect())
        .collect()
}

/// Eigenvalues of a small symmetric matrix, largest first, by Jacobi's rotations.
fn eigenvalues(matrix: &[Vec<f64>]) -> Vec<f64> {
    let n = matrix.len();
    let mut a = matrix.to_vec();
    // Jacobi converges quadratically, so three columns need far fewer turns; a fixed number needs no bound to stop at
    for _ in 0..30 {
        for p in 0..n {
            for q in p + 1..n {
                // the angle is a quotient over this element
                if a[p][q] != 0.0 {
                    rotate(&mut a, p, q);
                }
            }
        }
    }
    let mut values: Vec<f64> = (0..n).map(|k| a[k][k]).collect();
    values.sort_by(|x, y| y.total_cmp(x));
    values
}

/// Makes `a[p][q]` zero.
fn rotate(a: &mut [Vec<f64>], p: usize, q: usize) {
    let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
    let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
    let t = if t.is_finite() { t } else { 0.0 };
    let c = 1.0 / (t * t + 1.0).sqrt();
    let s = t * c;
    for row in a.iter_mut() {
        (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
    }
    let (row_p, row_q) = (a[p].clone(), a[q].clone());
    let turned = |x: f64, y: f64| row_p.iter().zip(&row_q).map(|(p, q)| x * p + y * q).collect();
    (a[p], a[q]) = (turned(c, -s), turned(s, c));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eigenvalues_of_a_small_matrix_are_those_of_its_polynomial() {
        // (2 - x)((2 - x)^2 - 2) = 0
        let matrix = vec![vec![2.0, 1.0, 0.0], vec![1.0, 2.0, 1.0], vec![0.0, 1.0, 2.0]];
        let root = 2.0_f64.sqrt();
        for (value, expected) in eigenvalues(&matrix).iter().zip([2.0 + root, 2.0, 2.0 - root]) {
            assert!((value - expected).abs() < 1e-12, "{value}");
        }
    }
}
