//! From points to coefficients.

use policy::{Coefficients, Interval};
use serde::Serialize;

use crate::mapping::DutyRatioMap;
use crate::pls::Pls;
use crate::table::Point;

/// Which terms a mapping has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Form {
    /// `a d_sim + b i_out + c`, the paper's.
    ThreeTerm,
    /// With the product `r i_out d_sim`.
    FourTerm,
}

impl Form {
    /// Number of predictors beside the constant.
    #[must_use]
    pub fn predictors(self) -> usize {
        match self {
            Form::ThreeTerm => 2,
            Form::FourTerm => 3,
        }
    }

    /// Fewest points for a fit that can be judged: one more than coefficients.
    #[must_use]
    pub fn fewest_points(self) -> usize {
        self.predictors() + 2
    }

    /// As a reader calls it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Form::ThreeTerm => "three-term",
            Form::FourTerm => "four-term",
        }
    }
}

/// What is fitted to what.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Model {
    pub form: Form,
    /// The load current does not vary and takes no part.
    pub constant_load: bool,
    /// `a` is not fitted but given.
    pub assumed_a: Option<f64>,
    /// How i_out follows d_sim where the table cannot tell the two apart, A; 0 where it can.
    pub load_line: f64,
}

impl Model {
    /// Predictors by column; one that takes no part is 0 throughout.
    pub fn columns(&self, points: &[Point]) -> Vec<Vec<f64>> {
        let column = |index: usize| points.iter().map(|point| self.row(point)[index]).collect();
        (0..self.form.predictors()).map(column).collect()
    }

    pub fn row(&self, point: &Point) -> Vec<f64> {
        // a column of zeros has no spread and gets the coefficient 0, so that the others keep their places
        let d_sim = if self.assumed_a.is_some() { 0.0 } else { point.d_sim() };
        let i_out = if self.constant_load { 0.0 } else { point.i_out };
        let product = if self.constant_load {
            0.0
        } else {
            point.i_out * point.d_sim()
        };
        [d_sim, i_out, product][..self.form.predictors()].to_vec()
    }

    pub fn response(&self, point: &Point) -> f64 {
        point.d_real - self.assumed_a.unwrap_or(0.0) * point.d_sim()
    }

    pub fn fit(&self, points: &[Point], components: usize) -> Pls {
        let response: Vec<f64> = points.iter().map(|point| self.response(point)).collect();
        Pls::fit(&self.columns(points), &response, components)
    }

    pub fn coefficients(&self, pls: &Pls) -> Coefficients {
        Coefficients {
            a: self.assumed_a.unwrap_or(pls.coefficients[0]),
            b: pls.coefficients[1],
            c: pls.intercept,
            r: pls.coefficients.get(2).copied(),
        }
    }

    pub fn map(&self, points: &[Point], pls: &Pls) -> DutyRatioMap {
        DutyRatioMap {
            coefficients: self.coefficients(pls),
            // no bound at 0: a load may deliver current, and the table then says so
            valid_i_out: widened(hull(points.iter().map(|p| p.i_out)), f64::NEG_INFINITY, f64::INFINITY),
            valid_d_sim: widened(hull(points.iter().map(Point::d_sim)), 0.0, 1.0),
        }
    }
}

/// Measured minus expected voltage, V.
///
/// What is missing in duty is turned into volts at constant load current; where the table knows d_sim and i_out on one
/// line only (slope `load_line`, A), along that line: a alone would be an arbitrary part of the slope there.
pub(crate) fn error_v(map: &DutyRatioMap, point: &Point, load_line: f64) -> f64 {
    let slope = map.slope(point.i_out) + load_line * map.coefficients.b;
    (map.apply(point.d_sim(), point.i_out) - point.d_real) / slope * point.v_per_duty()
}

pub(crate) fn hull(values: impl Iterator<Item = f64>) -> Interval {
    let empty = Interval {
        low: f64::INFINITY,
        high: f64::NEG_INFINITY,
    };
    values.fold(empty, |hull, x| Interval {
        low: hull.low.min(x),
        high: hull.high.max(x),
    })
}

/// A range of next to no width would call every sample invalid: it gets 1 % of its middle to either side.
fn widened(range: Interval, low: f64, high: f64) -> Interval {
    let middle = 0.5 * (range.low + range.high);
    // the noise of a held current or voltage stays within; a convention
    let least = 0.01 * middle.abs();
    if range.high - range.low >= least {
        return Interval {
            low: range.low.max(low),
            high: range.high.min(high),
        };
    }
    Interval {
        low: (middle - least).max(low),
        high: (middle + least).min(high),
    }
}
