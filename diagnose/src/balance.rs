//! Settled points that no converter of the model's topology gives, whatever its losses.
//!
//! In continuous conduction the inductor's volt-seconds balance, with delta the lost duty. For the buck
//!
//! ```text
//! v = (d - delta) (V_in - R_s d i - R_on i) - (1 - d + delta) (V_f + r_d i) - R_L i
//! ```
//! times the gain of its sensor, and its offset. But for the product of R_s, that is b0 + b1 d + b2 i + b3 d i. For boost and
//! buck-boost the inductor carries i / (1 - d), and with x = 1 / (1 - d) the same losses leave
//! b0 + b1 x + b2 x^2 + (b3 + b4 x + b5 x^2) i, b3 of a cable. Points that are not of that form need no search.

use plant::Topology;

use crate::ideal::{self, Ideal};
use crate::normal::solve;
use crate::problem::{Problem, dot};
use crate::record::Record;

/// Share of the voltage that the form may leave. The term that it lacks, R_s d^2 i, leaves 0.3 % for a source that takes away
/// a tenth of the voltage.
const LEFT: f64 = 0.01;
/// Points beyond the terms of the form that must disagree.
const MORE: usize = 3;

/// A settled point: voltage, duty, drawn current.
pub(crate) type Point = (f64, f64, f64);

/// What is wrong, if no such converter gives the settled points of a record, or where the records rest ([`crate::rising`]).
#[must_use]
pub fn broken(problem: &Problem) -> Option<String> {
    let points = problem.records.iter().find_map(|record| of(problem, record));
    points.or_else(|| crate::rising::broken(problem))
}

fn of(problem: &Problem, record: &Record) -> Option<String> {
    let ideal = Ideal::of(record, &problem.base.plant);
    let points: Vec<Point> = (0..record.rows())
        .filter_map(|row| point(&ideal, record, row, record.measured[0][row]))
        .collect();
    let columns = columns(ideal.topology, &points);
    let (count, terms) = (points.len() as f64, columns.len());
    if !record.settled || points.len() < terms + MORE {
        return None;
    }
    let v: Vec<f64> = points.iter().map(|p| p.0).collect();
    let square = |left: f64| left * left;
    let rms = (left(&columns, &v) / (count - terms as f64)).sqrt();
    if rms < LEFT * problem.bases.v || is_of_counter(&ideal, &points, rms) {
        return None;
    }
    // without its losses a converter is off by some percent
    let fits = |of: &Topology| {
        let pairs = points.iter().map(|p| (p.0, of.voltage(1.0, p.1)));
        let (cross, own) = pairs.fold((0.0, 0.0), |(cross, own), (v, x)| (cross + v * x, own + x * x));
        let left = points.iter().map(|p| square(p.0 - cross / own * of.voltage(1.0, p.1)));
        (left.sum::<f64>() / count).sqrt() < rms
    };
    let others = [Topology::Boost, Topology::BuckBoost, Topology::Buck];
    let looks = others.iter().find(|other| **other != ideal.topology && fits(other));
    let looks = looks.map_or(String::new(), |other| {
        format!("; they look like those of a {}", other.word())
    });
    let (rms, name, own) = (crate::words::si(rms, "V"), &record.name, ideal.topology.word());
    let form = match ideal.topology {
        Topology::Buck => "b0 + b1 d + b2 i + b3 d i",
        Topology::Boost | Topology::BuckBoost => "b0 + b1 x + b2 x^2 + (b3 + b4 x + b5 x^2) i with x = 1/(1 - d)",
    };
    Some(format!(
        "no {own} gives the points of {name}, whatever its losses: its voltage is {form}, and theirs is {rms} beside{looks}"
    ))
}

/// What one wrong point leaves of an error goes without it: to a quarter at most. Of points that are of no such form none takes as much with it.
const OF_ONE: f64 = 0.25;

/// Leaves out the voltage of the one settled point of a table without which all others are of the form, and says so among the repairs of its record. A
/// number that is mistyped is off by more than any meter, and no cause makes it.
pub(crate) fn leave_out_odd(problem: &mut Problem) {
    let (plant, usual) = (&problem.base.plant, problem.bases.v);
    for record in problem.records.iter_mut().filter(|record| record.settled) {
        let ideal = Ideal::of(record, plant);
        leave_out_odd_of(record, &ideal, usual);
    }
}

/// [`leave_out_odd`] of one table; `usual` is the usual output voltage, V.
fn leave_out_odd_of(record: &mut Record, ideal: &Ideal, usual: f64) {
    // the current that a wrong voltage would draw is wrong as well, and a point by itself out there bends the others to it
    let at = |row: usize| Some((row, point(ideal, record, row, ideal.volts(record.duty[row]))?));
    let (rows, points): (Vec<usize>, Vec<Point>) = (0..record.rows()).filter_map(at).unzip();
    let v: Vec<f64> = points.iter().map(|p| p.0).collect();
    let own = columns(ideal.topology, &points);
    let free = points.len().saturating_sub(own.len());
    if points.len() > ASKED || free <= MORE {
        return;
    }
    let rms = (left(&own, &v) / free as f64).sqrt();
    let without = |place: usize| {
        let mut others = points.clone();
        others.remove(place);
        let v: Vec<f64> = others.iter().map(|p| p.0).collect();
        let left = left(&columns(ideal.topology, &others), &v);
        ((left / (free - 1) as f64).sqrt(), place)
    };
    let least = (0..points.len()).map(without).min_by(|a, b| a.0.total_cmp(&b.0));
    let Some((least, place)) = least.filter(|(least, _)| *least < OF_ONE * rms && *least < LEFT * usual) else {
        return;
    };
    // with a term for it alone, its weight is what it is off by
    let mut own = own;
    own.push((0..points.len()).map(|n| if n == place { 1.0 } else { 0.0 }).collect());
    let above = weights(&own, &v).last().copied().unwrap_or(f64::NAN);
    // no number is no surety
    let is_sure = above.abs() > LEFT * usual && above.abs() > SURELY * least;
    if !is_sure {
        return;
    }
    let (v, duty, i) = points[place];
    let [v, i, by] = [(v, "V"), (i, "A"), (above.abs(), "V")].map(|(value, unit)| crate::words::si(value, unit));
    record.repairs.push(format!(
        "v_o at a duty of {duty} and a load of {i} is {v}, {by} {} what all other points say: left out. Is it mistyped, or was the converter not at \
         rest?",
        if above > 0.0 { "above" } else { "below" }
    ));
    record.measured[0][rows[place]] = f64::NAN;
}

/// Standard deviations of the others by which a point is surely off: the largest of 64 is 3.5 beside the rest once in thirty tables, 6 once in millions. A
/// convention beyond that: what few others leave is known poorly.
const SURELY: f64 = 10.0;

/// Counts of a period that are tried, as multiples of those whose rounding scatters the voltage by as much as the points are beside.
const AROUND: [f64; 2] = [0.5, 2.0];
/// How far apart they are: half of that moves a duty by a hundredth of a count at most, so that of a table hardly one is rounded otherwise.
const APART: f64 = 0.02;
/// Change of the duty that tells what it does to the voltage.
const NUDGE: f64 = 1e-4;
/// With the rounded duties this share of the error is left at most. Of five points beyond the terms, chi-square falls to a ninth of its mean by
/// chance once in 200; of nineteen, as of a table of 23 points, once in ten million, and there are thousands of counts.
const OF_COUNTER: f64 = 1.0 / 3.0;
/// Fewest points beyond the terms.
const MORE_FOR_COUNTER: usize = 12;
/// Counts beyond which none is sought: half a step of half as many is the accuracy of ideal edges ([`crate::problem::duty_accuracy`]), and tens of
/// thousands would take seconds.
const MOST_COUNTS: f64 = 2000.0;
/// Most points that are asked: of thousands each count would cost as much as a simulation.
const ASKED: usize = 64;

/// Whether the points are those of a converter whose counter knows few duties: the commanded ones are not what the switch did.
fn is_of_counter(ideal: &Ideal, points: &[Point], rms: f64) -> bool {
    let points: Vec<Point> = points
        .iter()
        .copied()
        .step_by(points.len().div_ceil(ASKED).max(1))
        .collect();
    let v: Vec<f64> = points.iter().map(|p| p.0).collect();
    let least = least_of_counters(ideal, &points, rms, |rounded| {
        let columns = columns(ideal.topology, rounded);
        (left(&columns, &v), columns.len())
    });
    least.is_some_and(|(least, _)| least < OF_COUNTER * rms)
}

/// The least root mean square that is left beside the duties of any counter whose rounding may scatter the voltage by `rms`; `left_by` tells the sum of
/// squares and the terms for points at the duties of one; and how many were tried. Nothing where there are too few points for such a search.
pub(crate) fn least_of_counters(
    ideal: &Ideal,
    points: &[Point],
    rms: f64,
    left_by: impl Fn(&[Point]) -> (f64, usize),
) -> Option<(f64, usize)> {
    if points.len() > ASKED || rms.is_nan() || rms <= 0.0 {
        return None;
    }
    let mean = points.iter().map(|p| p.1).sum::<f64>() / points.len().max(1) as f64;
    let slope = (ideal.volts(mean + NUDGE) - ideal.volts(mean)) / NUDGE;
    // a duty that is rounded is off by its step over the root of twelve
    let counts = slope.abs() / (rms * libm::sqrt(12.0));
    let [low, high] = AROUND.map(|share| share * counts);
    if high > MOST_COUNTS {
        return None;
    }
    let tried = (0..=((high - low) / APART) as usize).map(|n| low + n as f64 * APART);
    let beside = |counts: f64, cut: f64| {
        let rounded = |p: &Point| (p.0, libm::floor(p.1 * counts + cut) / counts, p.2);
        let rounded: Vec<Point> = points.iter().map(rounded).collect();
        // no counter leaves a switch on for ever
        if rounded.iter().any(|p| p.1 >= 1.0) {
            return None;
        }
        let (square, terms) = left_by(&rounded);
        let free = points.len().saturating_sub(terms);
        (free >= MORE_FOR_COUNTER).then(|| (square / free as f64).sqrt())
    };
    let mut tries = 0;
    let each = tried.flat_map(|counts| [0.0, 0.5].map(|cut| beside(counts, cut)));
    let least = each.flatten().inspect(|_| tries += 1).reduce(f64::min)?;
    Some((least, tries))
}

/// Least inductance of the bench over that of the model, as far as it decides which points are told: with half of it the ripple is twice as large, and
/// the current behind a diode rests where the model's does not. A convention: an inductance that is further off is named from what moves.
const LEAST_INDUCTANCE: f64 = 0.5;

/// A row as a point, where the current never rests that its load draws at an output of `at`.
fn point(ideal: &Ideal, record: &Record, row: usize, at: f64) -> Option<Point> {
    let (v, d, i) = (
        record.measured[0][row],
        record.duty[row],
        ideal::drawn(&record.load[row], at),
    );
    let surely = match ideal.may_rest() {
        true => LEAST_INDUCTANCE,
        false => 1.0,
    };
    // at a duty of 1 the form of a boost has no value
    (v.is_finite() && d < 1.0 && ideal.never_rests(surely * i, d)).then_some((v, d, i))
}

/// What of each column is in some values.
fn weights(columns: &[Vec<f64>], values: &[f64]) -> Vec<f64> {
    let matrix: Vec<Vec<f64>> = columns
        .iter()
        .map(|a| columns.iter().map(|b| dot(a, b)).collect())
        .collect();
    let right: Vec<f64> = columns.iter().map(|a| dot(a, values)).collect();
    solve(&matrix, &right)
}

/// The sum of squares that the columns leave of some values.
pub(crate) fn left(columns: &[Vec<f64>], values: &[f64]) -> f64 {
    let weights = weights(columns, values);
    let fitted = |n: usize| {
        let terms = columns.iter().zip(&weights);
        terms.map(|(column, weight)| column[n] * weight).sum::<f64>()
    };
    let each = values.iter().enumerate().map(|(n, value)| value - fitted(n));
    each.map(|left| left * left).sum()
}

/// The terms of the form at each point, around their means, so that the equations are well conditioned.
pub(crate) fn columns(topology: Topology, points: &[Point]) -> Vec<Vec<f64>> {
    let count = points.len().max(1) as f64;
    let mean = |of: fn(&Point) -> f64| points.iter().map(of).sum::<f64>() / count;
    let of_duty: fn(&Point) -> f64 = match topology {
        Topology::Buck => |p| p.1,
        Topology::Boost | Topology::BuckBoost => |p| 1.0 / (1.0 - p.1),
    };
    let (x_mean, i_mean) = (mean(of_duty), mean(|p| p.2));
    let at = |p: &Point| {
        let (x, i) = (of_duty(p) - x_mean, p.2 / i_mean - 1.0);
        match topology {
            Topology::Buck => vec![1.0, x, i, x * i],
            Topology::Boost | Topology::BuckBoost => vec![1.0, x, x * x, i, x * i, x * x * i],
        }
    };
    let rows: Vec<Vec<f64>> = points.iter().map(at).collect();
    let terms = rows.first().map_or(0, Vec::len);
    (0..terms).map(|k| rows.iter().map(|row| row[k]).collect()).collect()
}
