//! Settled points that no buck gives, whatever its losses.
//!
//! In continuous conduction the inductor's volt-seconds balance, with delta the lost duty:
//!
//! ```text
//! v = (d - delta) (V_in - R_s d i - R_on i) - (1 - d + delta) (V_f + r_d i) - R_L i
//! ```
//! times the gain of its sensor, and its offset. But for the product of R_s, that is b0 + b1 d + b2 i + b3 d i. Points that are not of
//! that form need no search.

use crate::normal::solve;
use crate::problem::{Problem, dot};
use crate::record::Record;

/// Share of the voltage that the form may leave. The term that it lacks, R_s d^2 i, leaves 0.3 % for a source that takes away
/// a tenth of the voltage.
const LEFT: f64 = 0.01;
/// Terms of the form, and points beyond these that must disagree.
const TERMS: usize = 4;
const MORE: usize = 3;
/// Below this many times half the ripple the current may rest, and the voltage is above the form.
const CONTINUOUS: f64 = 1.2;

/// What is wrong, if no buck gives the settled points of a record.
#[must_use]
pub fn broken(problem: &Problem) -> Option<String> {
    problem.records.iter().find_map(|record| of(problem, record))
}

fn of(problem: &Problem, record: &Record) -> Option<String> {
    let p = &problem.base.plant.converter;
    let v_in = p.v_in * record.v_in_ratio;
    let points = (0..record.rows()).filter_map(|row| {
        let (v, d, load) = (record.measured[0][row], record.duty[row], &record.load[row]);
        let i = v * load.conductance + load.current + if v > 0.0 { load.power / v } else { 0.0 };
        let half = 0.5 * v_in * d * (1.0 - d) / (p.inductance * p.f_sw);
        (v.is_finite() && i > CONTINUOUS * half).then_some((v, d, i))
    });
    let points: Vec<(f64, f64, f64)> = points.collect();
    if !record.settled || points.len() < TERMS + MORE {
        return None;
    }
    let count = points.len() as f64;
    let mean = |of: fn(&(f64, f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / count;
    // around their means, so that the equations are well conditioned
    let (d_mean, i_mean) = (mean(|p| p.1), mean(|p| p.2));
    let of_point = |p: &(f64, f64, f64)| {
        let (d, i) = (p.1 - d_mean, p.2 / i_mean - 1.0);
        [1.0, d, i, d * i]
    };
    let columns: Vec<Vec<f64>> = (0..TERMS)
        .map(|k| points.iter().map(|p| of_point(p)[k]).collect())
        .collect();
    let v: Vec<f64> = points.iter().map(|p| p.0).collect();
    let matrix: Vec<Vec<f64>> = columns
        .iter()
        .map(|a| columns.iter().map(|b| dot(a, b)).collect())
        .collect();
    let right: Vec<f64> = columns.iter().map(|a| dot(a, &v)).collect();
    let terms = solve(&matrix, &right);
    let square = |left: f64| left * left;
    let left: f64 = (points.iter().zip(&v))
        .map(|(p, v)| square(v - dot(&of_point(p), &terms)))
        .sum();
    let rms = (left / (count - TERMS as f64)).sqrt();
    if rms < LEFT * problem.bases.v {
        return None;
    }
    let nearest = [
        ("boost", Box::new(|d: f64| 1.0 / (1.0 - d)) as Box<dyn Fn(f64) -> f64>),
        ("buck-boost", Box::new(|d: f64| d / (1.0 - d))),
    ];
    // without its losses a converter is off by some percent
    let fits = |of: &dyn Fn(f64) -> f64| {
        let pairs = points.iter().map(|p| (p.0, of(p.1)));
        let (cross, own) = pairs.fold((0.0, 0.0), |(cross, own), (v, x)| (cross + v * x, own + x * x));
        let left: f64 = points.iter().map(|p| square(p.0 - cross / own * of(p.1))).sum();
        (left / count).sqrt() < rms
    };
    let looks = nearest.iter().find(|(_, of)| fits(of.as_ref()));
    let looks = looks.map_or(String::new(), |(name, _)| format!("; they look like those of a {name}"));
    let (rms, name) = (crate::words::si(rms, "V"), &record.name);
    Some(format!(
        "no buck gives the points of {name}, whatever its losses: its voltage is b0 + b1 d + b2 i + b3 d i, and theirs is {rms} beside{looks}"
    ))
}
