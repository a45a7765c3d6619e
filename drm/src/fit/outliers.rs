//! Points that the others contradict.

use serde::Serialize;

use crate::fit::regression::Model;
use crate::fit::validation::{deleted, without};
use crate::table::Point;

/// A point left out of the fit because the others contradict it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Outlier {
    /// Line of the table.
    pub line: usize,
    /// Measured voltage minus what a fit without the point foretells, V.
    pub error_v: f64,
    /// The same in standard deviations.
    pub sigmas: f64,
}

/// Student's t at 1 - 0.00005 for 1, 2, ... degrees of freedom: one good point in 10,000 lies beyond.
const CRITICAL: [f64; 30] = [
    6366.2, 99.99, 28.0, 15.54, 11.18, 9.08, 7.88, 7.12, 6.59, 6.21, 5.92, 5.69, 5.51, 5.36, 5.24, 5.13, 5.04, 4.97,
    4.9, 4.84, 4.78, 4.74, 4.69, 4.65, 4.62, 4.59, 4.56, 4.53, 4.51, 4.48,
];
/// The same for more.
// that of 30 degrees; the normal distribution has 3.89. In doubt a point stays
const CRITICAL_MANY: f64 = 4.48;
/// No smaller deviation makes an outlier, as a share of v_in: the forms themselves are not better.
// on tables of ngspice three terms leave 2.3e-4 rms, four 3.6e-5
const FLOOR: f64 = 1e-4;
/// At most this share of the points may be outliers.
// a convention: who contradicts a fifth of a table contradicts the bench
const MOST: f64 = 0.2;

/// Finds outliers one by one, the worst first. `points` keeps the others.
pub(crate) fn remove(model: &Model, points: &mut Vec<Point>, components: usize) -> Vec<Outlier> {
    let most = ((points.len() as f64 * MOST) as usize).max(1);
    let mut outliers = Vec::new();
    while outliers.len() < most {
        let Some((index, outlier)) = worst(model, points, components) else {
            break;
        };
        // the others are judged anew: a bad point has moved the fits that judged them
        outliers.push(outlier);
        *points = without(points, index);
    }
    outliers.sort_by_key(|outlier: &Outlier| outlier.line);
    outliers
}

fn worst(model: &Model, points: &[Point], components: usize) -> Option<(usize, Outlier)> {
    let mut worst: Option<(usize, Outlier)> = None;
    for (index, point) in points.iter().enumerate() {
        let (deleted, degrees) = deleted(model, points, index, components)?;
        // `deleted` gives two degrees or more
        let critical = CRITICAL.get(degrees - 1).copied().unwrap_or(CRITICAL_MANY);
        let beyond = deleted.studentised > critical && deleted.error_v.abs() > FLOOR * point.v_in;
        if beyond
            && worst
                .as_ref()
                .is_none_or(|(_, worst)| deleted.studentised > worst.sigmas)
        {
            let outlier = Outlier {
                line: point.line,
                error_v: deleted.error_v,
                sigmas: deleted.studentised,
            };
            worst = Some((index, outlier));
        }
    }
    worst
}
