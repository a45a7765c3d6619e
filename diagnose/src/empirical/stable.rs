//! Whether a converter with an empirical term comes to rest where it does without one.

use plant::{Load, Parameters, Plant};

use crate::problem::Problem;

/// Time constants of the filter that are simulated: a filter that rings for ten periods has long come to rest.
const LONG: f64 = 120.0;
/// Least and most periods: a slow filter at a fast switching frequency would take minutes.
const PERIODS: (f64, f64) = (400.0, 20_000.0);
/// How far the voltage may still swing at the end, beyond one and a half times what it does without the term, share of it.
const SWING: f64 = 0.005;
/// How far the settled voltage may be from that without the term, share of it: what is farther is no correction. A convention.
const FAR: f64 = 0.25;

/// Mean and swing of the output voltage in the last third of a run, from `v` V.
fn run(p: &Parameters, duty: f64, load: &Load, v: f64) -> Option<(f64, f64)> {
    let mut plant = Plant::new(p).ok()?;
    let i = load.conductance * v + load.current + if v > 0.0 { load.power / v } else { 0.0 };
    plant.reset_at(v, i, load);
    let tau = (p.converter.inductance * p.converter.capacitance).sqrt() / p.t_sw();
    let periods = (LONG * tau).clamp(PERIODS.0, PERIODS.1) as usize;
    let (mut low, mut high, mut sum, mut count) = (f64::INFINITY, f64::NEG_INFINITY, 0.0, 0.0);
    for n in 0..periods {
        let v = plant.step(duty, load).v_out;
        if n * 3 >= periods * 2 {
            (low, high, sum, count) = (low.min(v), high.max(v), sum + v, count + 1.0);
        }
    }
    let mean = sum / count;
    mean.is_finite().then_some((mean, high - low))
}

/// Whether `with` comes to rest at the duties and loads of the records as `without` does, from both sides.
pub fn is_stable(problem: &Problem, without: &Parameters, with: &Parameters) -> bool {
    let mut points: Vec<(f64, Load)> = Vec::new();
    for record in &problem.records {
        let mut rows: Vec<usize> = (0..record.rows()).collect();
        rows.sort_by(|a, b| record.duty[*a].total_cmp(&record.duty[*b]));
        let by_duty = [rows.first(), rows.get(rows.len() / 2), rows.last()];
        let mut chosen: Vec<usize> = by_duty.into_iter().flatten().copied().collect();
        let drawn = |row: &usize| {
            let load = &record.load[*row];
            load.conductance * problem.bases.v + load.current + load.power / problem.bases.v
        };
        rows.sort_by(|a, b| drawn(a).total_cmp(&drawn(b)));
        chosen.extend([rows.first(), rows.last()].into_iter().flatten());
        points.extend(chosen.into_iter().map(|row| (record.duty[row], record.load[row])));
    }
    // records repeat each other; the first in this order are as many as it takes
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    points.dedup_by(|a, b| (a.0 - b.0).abs() < 1e-3 && a.1 == b.1);
    let rests = |&(duty, load): &(f64, Load)| {
        [0.9, 1.1].into_iter().all(|share| {
            let v = share * problem.bases.v;
            let Some((mean, swing)) = run(without, duty, &load, v) else {
                // no rest without the term either: nothing to compare with
                return true;
            };
            // a load of constant power that runs away in open loop does so with any term
            if swing > FAR * mean.abs() {
                return true;
            }
            run(with, duty, &load, v).is_some_and(|(other, swings)| {
                swings <= 1.5 * swing + SWING * mean.abs() && (other - mean).abs() <= FAR * mean.abs()
            })
        })
    };
    crate::parallel::map(&points, rests).into_iter().all(|rests| rests)
}
