//! Noise of settled points beside what losses may do, whatever the order of the rows. Rows that are written down duty by duty, or in none, have other
//! loads beside them, and their differences show the losses as noise.
//!
//! Where the inductor current never rests the losses leave the few terms of [`crate::balance`]. Where it rests in each period no such form is known;
//! what is left there is taken for a surface over duty and current, of the second order if the points can carry it.

use plant::Rectifier;

use crate::balance::{self, Point, left};
use crate::ideal::{self, Ideal};
use crate::problem::Problem;
use crate::record::Record;

/// Points beyond the terms from which on they tell a noise: five degrees of freedom tell it to a third, and the noise of so few values counts half as
/// much again ([`super::few`]).
const TELLING: usize = 5;
/// Points from which on a surface has its second order: twice its terms.
const OF_SECOND: usize = 12;

/// What a counter leaves, at most, of what the best of so many leaves of noise by chance: of noise in n directions the best of m directions leaves
/// m^(-1/n) of its size, give or take a quarter where n is a dozen. A convention below that.
const SURE: f64 = 0.5;

/// A value at a point.
type Valued = (Point, f64);

/// Standard deviation of `values` of channel `n`, one for each row of a settled record and 0 where nothing counts.
#[must_use]
pub(super) fn scatter(problem: &Problem, record: &Record, values: &[f64], n: usize) -> Option<f64> {
    let ideal = Ideal::of(record, &problem.base.plant);
    let is_driven = problem.base.plant.converter.rectifier == Rectifier::Synchronous;
    let rows = (0..record.rows()).filter(|row| values.get(*row).is_some_and(|value| *value != 0.0));
    let (mut never, mut rests): (Vec<Valued>, Vec<Valued>) = (Vec::new(), Vec::new());
    for row in rows {
        let (duty, load) = (record.duty[row], &record.load[row]);
        if duty <= 0.0 || duty >= 1.0 {
            continue;
        }
        // what a resistor draws at the measured voltage holds that one's noise, which would then be explained by itself
        let v = ideal.volts(duty);
        let i = ideal::drawn(load, v);
        if is_driven || ideal.never_rests(i, duty) {
            never.push(((v, duty, i), values[row]));
        } else {
            let v = ideal.volts_into(load, duty);
            rests.push(((v, duty, ideal::drawn(load, v)), values[row]));
        }
    }
    let form = |points: &[Point]| balance::columns(ideal.topology, points);
    let parts = [beside(&never, form), beside(&rests, surface)];
    let (square, free) = parts
        .iter()
        .fold((0.0, 0), |(square, free), part| (square + part.0, free + part.1));
    let rms = (free >= TELLING).then(|| (square / free as f64).sqrt())?;
    let is_of_voltage = n == 0 && rests.is_empty();
    let least = is_of_voltage.then(|| beside_counter(problem, &ideal, &never, rms));
    Some(least.flatten().unwrap_or(rms))
}

/// What is left of a voltage where a counter of few counts explains nearly all of it: its roundings lie in no order, and look like noise.
fn beside_counter(problem: &Problem, ideal: &Ideal, valued: &[Valued], rms: f64) -> Option<f64> {
    let (points, values): (Vec<Point>, Vec<f64>) = valued.iter().copied().unzip();
    let own = balance::columns(ideal.topology, &points);
    let (least, tries) = balance::least_of_counters(ideal, &points, rms * problem.sigma[0], |rounded| {
        let moved = points.iter().zip(rounded);
        let moved = moved.map(|(point, rounded)| ideal.volts(rounded.1) - ideal.volts(point.1));
        let columns = [&own[..], &[moved.collect()]].concat();
        (left(&columns, &values), columns.len())
    })?;
    let free = points.len().saturating_sub(own.len()) as f64;
    let by_chance = libm::pow(tries.max(1) as f64, -1.0 / free);
    (least < SURE * by_chance * rms).then_some(least)
}

/// The sum of squares that terms leave, and the points beyond them; nothing where there are no more points than terms.
fn beside(valued: &[Valued], terms: impl Fn(&[Point]) -> Vec<Vec<f64>>) -> (f64, usize) {
    let (points, values): (Vec<Point>, Vec<f64>) = valued.iter().copied().unzip();
    let columns = terms(&points);
    match points.len().saturating_sub(columns.len()) {
        0 => (0.0, 0),
        free => (left(&columns, &values), free),
    }
}

/// The terms of a surface over duty and current around their means.
fn surface(points: &[Point]) -> Vec<Vec<f64>> {
    let count = points.len().max(1) as f64;
    let d_mean = points.iter().map(|p| p.1).sum::<f64>() / count;
    let i_mean = points.iter().map(|p| p.2).sum::<f64>() / count;
    let at = points.iter().map(|p| (p.1 - d_mean, p.2 / i_mean - 1.0));
    let of = |term: fn((f64, f64)) -> f64| at.clone().map(term).collect::<Vec<f64>>();
    let mut columns = vec![of(|_| 1.0), of(|(d, _)| d), of(|(_, i)| i)];
    if points.len() >= OF_SECOND {
        columns.extend([of(|(d, i)| d * i), of(|(d, _)| d * d), of(|(_, i)| i * i)]);
    }
    columns
}
