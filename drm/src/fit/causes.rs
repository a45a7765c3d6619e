//! Which causes explain a table, and which of them it cannot tell apart.
//!
//! In steady state and continuous conduction `v_out = d v_in - sum of what is lost`. Each candidate is one column:
//! series resistance `R i`, diode `V_f (1 - d)`, lost duty `delta v_in`, gain of the voltage `g d v_in`. The first order
//! suffices to see ties; the figures are no estimates of parts.

use serde::Serialize;

use crate::fit::validation::{rms, without};
use crate::table::Point;

/// One or two causes together, fitted to a table.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Explanation {
    /// Each cause with its value.
    pub causes: Vec<(Cause, f64)>,
    /// What it leaves of the measured voltage, rms, V.
    pub rms_v: f64,
    /// Leave-one-out, rms, V.
    pub left_out_v: f64,
}

/// A cause of the difference between `v_out` and `d v_in`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Cause {
    /// Resistance of inductor, switch and diode together, ohm.
    Resistance,
    /// Forward voltage of the diode, V.
    Diode,
    /// Dead time and delays of the switch, or an offset of the voltage sensor, as a duty ratio.
    LostDuty,
    /// Gain error of the voltage sensor, or a wrong input voltage, 1.
    Gain,
}

impl Cause {
    /// All of them.
    pub const ALL: [Cause; 4] = [Cause::Resistance, Cause::Diode, Cause::LostDuty, Cause::Gain];

    /// What it takes away from `d v_in` for each unit of itself, V.
    fn takes(self, point: &Point) -> f64 {
        match self {
            Cause::Resistance => point.i_out,
            Cause::Diode => 1.0 - point.d_real,
            Cause::LostDuty => point.v_in,
            Cause::Gain => -point.d_real * point.v_in,
        }
    }

    /// Whether a converter can have it: nothing gives voltage for nothing, and a fifth of the duty or the gain is a fault of
    /// another kind.
    fn can_be(self, value: f64) -> bool {
        match self {
            Cause::Resistance | Cause::Diode => value >= 0.0,
            // a convention: the tests hold from 0.1 on, and 0.03 refuses causes that are real
            Cause::LostDuty | Cause::Gain => value.abs() < 0.2,
        }
    }

    /// Its value with unit, for a reader.
    #[must_use]
    pub fn describe(self, value: f64) -> String {
        match self {
            Cause::Resistance => format!("series resistance {value:.4} ohm"),
            Cause::Diode => format!("diode {value:.3} V"),
            Cause::LostDuty => format!("lost duty {value:+.5} (or v_out offset)"),
            Cause::Gain => format!("v_out gain {:+.3} % (or wrong v_in)", 100.0 * value),
        }
    }
}

/// Every single cause and every pair, the best first within each size; left out is what the table cannot solve.
///
/// The second list has what no converter can have, such as a diode that lifts the voltage.
pub(crate) fn explain(points: &[Point]) -> (Vec<Explanation>, Vec<Explanation>) {
    let mut sets: Vec<Vec<Cause>> = Cause::ALL.iter().map(|cause| vec![*cause]).collect();
    for (index, one) in Cause::ALL.iter().enumerate() {
        sets.extend(Cause::ALL[index + 1..].iter().map(|other| vec![*one, *other]));
    }
    let mut list: Vec<Explanation> = sets.iter().filter_map(|set| explanation(set, points)).collect();
    list.sort_by(|a, b| a.causes.len().cmp(&b.causes.len()).then(a.rms_v.total_cmp(&b.rms_v)));
    let all =
        |e: &Explanation, holds: fn(Cause, f64) -> bool| e.causes.iter().all(|(cause, value)| holds(*cause, *value));
    // a gain of nothing at all explains everything: v_out = v_out
    list.retain(|e| {
        all(e, |cause, value| {
            matches!(cause, Cause::Resistance | Cause::Diode) || cause.can_be(value)
        })
    });
    list.into_iter().partition(|e| all(e, Cause::can_be))
}

fn explanation(set: &[Cause], points: &[Point]) -> Option<Explanation> {
    // without one point there must still be one more than unknowns, else leave-one-out leaves nothing
    if points.len() < set.len() + 2 {
        return None;
    }
    let values = solve(set, points)?;
    let errors: Vec<f64> = points.iter().map(|point| missing(set, &values, point)).collect();
    let left_out = points.iter().enumerate().map(|(index, point)| {
        let values = solve(set, &without(points, index))?;
        Some(missing(set, &values, point))
    });
    Some(Explanation {
        causes: set.iter().copied().zip(values).collect(),
        rms_v: rms(&errors),
        left_out_v: rms(&left_out.collect::<Option<Vec<f64>>>()?),
    })
}

/// What the causes leave unexplained of a point, V.
fn missing(set: &[Cause], values: &[f64], point: &Point) -> f64 {
    let taken: f64 = set
        .iter()
        .zip(values)
        .map(|(cause, value)| value * cause.takes(point))
        .sum();
    point.v_out - (point.d_real * point.v_in - taken)
}

/// Least squares by the normal equations of one or two columns.
fn solve(set: &[Cause], points: &[Point]) -> Option<Vec<f64>> {
    let sum = |f: &dyn Fn(&Point) -> f64| points.iter().map(f).sum::<f64>();
    let gap = |p: &Point| p.d_real * p.v_in - p.v_out;
    match set {
        [one] => {
            // a cause that acts at no point, such as a diode at full duty, has no value
            let square = sum(&|p| one.takes(p) * one.takes(p));
            (square > 0.0).then(|| vec![sum(&|p| one.takes(p) * gap(p)) / square])
        }
        [one, two] => {
            let (a, c) = (
                sum(&|p| one.takes(p) * one.takes(p)),
                sum(&|p| two.takes(p) * two.takes(p)),
            );
            let b = sum(&|p| one.takes(p) * two.takes(p));
            let (x, y) = (sum(&|p| one.takes(p) * gap(p)), sum(&|p| two.takes(p) * gap(p)));
            let determinant = a * c - b * b;
            // over a c this is the squared sine between the columns: below an angle of 1e-3 they are one. The bound
            // also limits what the normal equations lose, to six of sixteen digits
            (determinant > 1e-6 * a * c).then(|| vec![(c * x - b * y) / determinant, (a * y - b * x) / determinant])
        }
        _ => None,
    }
}

/// An explanation whose error is larger than the best one's by less than this factor fits as well.
// the rms of a dozen errors scatters by a fifth (1 / root of 2 n). The tests hold from 1 to 2
const AS_WELL: f64 = 1.2;

/// Those of `list` that fit as well as the best of `ties` and are as simple.
pub(crate) fn as_good<'a>(list: &'a [Explanation], ties: &[&Explanation]) -> Vec<&'a Explanation> {
    let best = ties.iter().map(|e| e.rms_v).fold(f64::INFINITY, f64::min);
    let size = ties.first().map_or(0, |e| e.causes.len());
    // a table without noise leaves rounding, of which no factor is meaningful
    let fits = |e: &&Explanation| e.causes.len() == size && e.rms_v <= AS_WELL * best + 1e-9;
    list.iter().filter(fits).collect()
}

/// Explanations of the same size as the best that fit as well as it.
pub(crate) fn ties(list: &[Explanation]) -> Vec<&Explanation> {
    let Some(size) = list.iter().map(|e| e.causes.len()).max() else {
        return Vec::new();
    };
    let same: Vec<&Explanation> = list.iter().filter(|e| e.causes.len() == size).collect();
    let best = same.iter().map(|e| e.rms_v).fold(f64::INFINITY, f64::min);
    same.into_iter().filter(|e| e.rms_v <= AS_WELL * best + 1e-9).collect()
}
