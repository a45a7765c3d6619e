//! Leave-one-out: every point foretold by a fit without it.

use policy::Coefficients;

use crate::fit::regression::{Model, error_v};
use crate::pls::Pls;
use crate::table::Point;

/// What a fit without each point makes of it.
#[derive(Debug, Clone)]
pub(crate) struct LeftOut {
    /// Measured minus foretold voltage, V.
    pub errors_v: Vec<f64>,
    /// Coefficients of each fit.
    pub coefficients: Vec<Coefficients>,
}

pub(crate) fn leave_one_out(model: &Model, points: &[Point], components: usize) -> LeftOut {
    let mut left_out = LeftOut {
        errors_v: Vec::new(),
        coefficients: Vec::new(),
    };
    for (index, point) in points.iter().enumerate() {
        let rest = without(points, index);
        let pls = model.fit(&rest, components);
        left_out
            .errors_v
            .push(error_v(&model.map(&rest, &pls), point, model.load_line));
        left_out.coefficients.push(model.coefficients(&pls));
    }
    left_out
}

/// All points but one.
pub(crate) fn without(points: &[Point], index: usize) -> Vec<Point> {
    [&points[..index], &points[index + 1..]].concat()
}

/// Root mean square.
pub(crate) fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

/// A smaller error counts only if it is smaller by more than this share: equal errors mean fewer components.
// between the rounding of the errors (1e-10 of them) and any that matters: the tests hold from 0 to a tenth
const CLEARLY: f64 = 1e-6;

/// The number of components with the least leave-one-out error, and that error in V for one, two, ... components.
pub(crate) fn choose_components(model: &Model, points: &[Point], most: usize) -> (usize, Vec<f64>) {
    let errors: Vec<f64> = (1..=most)
        .map(|components| rms(&leave_one_out(model, points, components).errors_v))
        .collect();
    let mut best = 0;
    for (index, error) in errors.iter().enumerate() {
        if *error < (1.0 - CLEARLY) * errors[best] {
            best = index;
        }
    }
    (best + 1, errors)
}

/// Standard errors of a, b, c, r by the jackknife: from how the coefficients move when one point is left out.
pub(crate) fn standard_errors(left_out: &LeftOut) -> Coefficients {
    let n = left_out.coefficients.len() as f64;
    let spread = |of: &dyn Fn(&Coefficients) -> f64| {
        let mean = left_out.coefficients.iter().map(of).sum::<f64>() / n;
        let squares: f64 = left_out
            .coefficients
            .iter()
            .map(|k| (of(k) - mean) * (of(k) - mean))
            .sum();
        // not over n - 1: fits that share all points but one hardly differ, and the factor makes up for that
        ((n - 1.0) / n * squares).sqrt()
    };
    let product = left_out.coefficients.iter().any(|k| k.r.is_some());
    Coefficients {
        a: spread(&|k| k.a),
        b: spread(&|k| k.b),
        c: spread(&|k| k.c),
        r: product.then(|| spread(&|k| k.r.unwrap_or(0.0))),
    }
}

/// A fit without a point, as far as judging that point needs it.
pub(crate) struct Deleted {
    /// Deviation of the point from the fit without it, over the standard deviation that such a deviation has.
    pub studentised: f64,
    /// Measured minus foretold voltage, V.
    pub error_v: f64,
}

/// Judges a point by a fit without it; `degrees` of freedom are left to estimate the noise.
pub(crate) fn deleted(model: &Model, points: &[Point], index: usize, components: usize) -> Option<(Deleted, usize)> {
    let rest = without(points, index);
    let pls: Pls = model.fit(&rest, components);
    let degrees = rest
        .len()
        .checked_sub(pls.components + 1)
        // with one degree of freedom t would have to exceed 6366
        .filter(|degrees| *degrees >= 2)?;
    let deviation = |point: &Point| model.response(point) - pls.predict(&model.row(point));
    let squares: f64 = rest.iter().map(|point| deviation(point) * deviation(point)).sum();
    let noise = (squares / degrees as f64).sqrt();
    let point = &points[index];
    // a point that took no part scatters by its own noise and by that of the fit
    let expected = noise * (1.0 + pls.leverage(&model.row(point))).sqrt();
    let deleted = Deleted {
        studentised: deviation(point).abs() / expected.max(f64::MIN_POSITIVE),
        error_v: error_v(&model.map(&rest, &pls), point, model.load_line),
    };
    Some((deleted, degrees))
}
