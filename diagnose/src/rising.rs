//! Records whose voltage does not rise with the duty where both rest: no converter of the three makes them, whatever its losses, and a search
//! among causes would take its longest.
//!
//! At rest in continuous conduction v = k0 + k1 x + k2 i, with x what the duty makes without losses and i what the load is set to draw. Losses bend
//! that line: a source that gives away the share s of its voltage leaves (1 - 2 s)/(1 - s) of its slope, a third at two fifths.

use crate::balance::left;
use crate::ideal::{self, Ideal};
use crate::normal::Normal;
use crate::problem::Problem;
use crate::record::{Record, V_IN, still};

/// Least slope, as a share of the level, that is taken for that of a converter; a gain of the sensor is in both.
const LEAST: f64 = 0.25;
/// Standard deviations of the slope that lie between.
const SURE: f64 = 4.0;
/// Points beyond the terms of the line, so that its error is known at all.
const MORE: usize = 3;
/// Duties that have to lie between the lowest and the highest. The coarsest counter that is thought of has eight steps in a period, and within one the
/// voltage rests while the duty rises; ...
const APART: f64 = 0.13;
/// ... but there is none with which it falls.
const APART_FALLING: f64 = 0.05;
/// What the load's current has to leave of the scatter of x: a controller that holds the voltage moves the duty with the load alone.
const OWN: f64 = 0.3;
/// Highest duty of a converter that steps up: above, a winding of a few percent of the load makes the voltage fall.
const STEPS_UP: f64 = 0.6;
/// Where the load is what a meter shows, it is no second term: a resistor's current goes with the voltage. Losses at a load that grows with the duty
/// take less than this share of the source.
const LOST: f64 = 0.2;

/// A point at rest: in units of the source voltage what the duty makes and what was measured; the current that the load draws at one
/// voltage, and the duty.
struct Point {
    x: f64,
    v: f64,
    i: f64,
    duty: f64,
}

/// What is wrong, if the records as a whole rest at voltages that do not rise with the duty.
pub fn broken(problem: &Problem) -> Option<String> {
    let records = || problem.records.iter().filter(|record| record.capture.is_none());
    let points: Vec<Point> = records().flat_map(|record| of(problem, record)).collect();
    let is_metered = records().any(|record| record.metered.is_some());
    let columns = columns(&points, is_metered);
    let (count, terms) = (points.len(), columns.len());
    if count < terms + MORE {
        return None;
    }
    let v: Vec<f64> = points.iter().map(|p| p.v).collect();
    let slope = Normal::new(&columns, &v).solved()[1];
    let (x, others) = (&columns[1], [&columns[..1], &columns[2..]].concat());
    let own = left(&others, x);
    let all = left(&columns[..1], x);
    let error = (left(&columns, &v) / (count - terms) as f64 / own).sqrt();
    let mean = |of: fn(&Point) -> f64| points.iter().map(of).sum::<f64>() / count as f64;
    // as a share of what the level alone tells
    let level = mean(|p| p.v).abs() / mean(|p| p.x);
    let (low, high) = span(&points, |p| p.duty);
    let is_sure = own > OWN * all && slope + SURE * error < LEAST * level;
    let falls = slope + SURE * error < 0.0 && high - low >= APART_FALLING;
    let (x_low, x_high) = span(&points, |p| p.x);
    let is_more_than_losses = !is_metered || -slope * (x_high - x_low) > LOST;
    if !(is_sure && is_more_than_losses && (falls || high - low >= APART)) {
        return None;
    }
    let does = if falls {
        "falls with the duty"
    } else {
        "does not rise with the duty"
    };
    Some(format!(
        "no {} gives the records, whatever its losses: where duty and load rest, v_out {does}, from {low:.2} to {high:.2}, at {slope:+.2} of the \
         slope without losses: is the duty that of the other switch, 1 - d, or the column another's?",
        problem.base.plant.converter.topology.word(),
    ))
}

fn of<'a>(problem: &'a Problem, record: &'a Record) -> impl Iterator<Item = Point> + 'a {
    let ideal = Ideal::of(record, &problem.base.plant);
    let reference = problem.bases.v;
    still::points(record, &ideal)
        .into_iter()
        .filter_map(move |(row, volts)| {
            let duty = record.duty[row];
            let made = ideal.volts(duty);
            let never_rests = duty > 0.0 && ideal.never_rests(ideal::drawn(&record.load[row], made), duty);
            let is_told = never_rests && (ideal.topology == plant::Topology::Buck || duty < STEPS_UP);
            // a source that is not held is another at each row
            let shown = record.measured[V_IN][row];
            let v_in = if shown.is_finite() && shown > 0.0 {
                shown
            } else {
                ideal.v_in
            };
            is_told.then(|| Point {
                x: made / ideal.v_in,
                v: volts / v_in,
                i: ideal::drawn(&record.load[row], reference),
                duty,
            })
        })
}

/// The terms of the line, around their means.
fn columns(points: &[Point], is_metered: bool) -> Vec<Vec<f64>> {
    let around = |of: fn(&Point) -> f64| {
        let mean = points.iter().map(of).sum::<f64>() / points.len().max(1) as f64;
        points.iter().map(|p| of(p) - mean).collect::<Vec<f64>>()
    };
    let (low, high) = span(points, |p| p.i);
    let mut columns = vec![vec![1.0; points.len()], around(|p| p.x)];
    if !is_metered && high - low > 1e-6 * high.abs() {
        columns.push(around(|p| p.i));
    }
    columns
}

/// The lowest and the highest value.
fn span(points: &[Point], of: fn(&Point) -> f64) -> (f64, f64) {
    let values = points.iter().map(of);
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
        (low.min(v), high.max(v))
    })
}
