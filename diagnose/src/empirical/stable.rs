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

/// Shares of the usual output voltage from which a run begins, beside rest and the corners of the term's range.
const SHARES: [f64; 2] = [0.9, 1.1];

/// Output voltage and inductor current at the beginning of a run.
type From = (f64, f64);

/// Mean and swing of the output voltage in the last third of a run.
fn run(p: &Parameters, duty: f64, load: &Load, (v, i): From) -> Option<(f64, f64)> {
    let mut plant = Plant::new(p).ok()?;
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

/// Where runs begin: both sides of `v` volts, rest, as at power-up, and the corners of the range in which the term follows the signals.
/// Beyond those it is constant.
fn beginnings(p: &Parameters, v: f64, load: &Load) -> Vec<From> {
    let drawn = |v: f64| load.conductance * v + load.current + if v > 0.0 { load.power / v } else { 0.0 };
    let t = &p.empirical;
    let mut list: Vec<From> = SHARES.iter().map(|share| (share * v, drawn(share * v))).collect();
    list.push((0.0, 0.0));
    for (v_end, i_end) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
        list.push((t.v_centre + v_end * t.v_span, t.i_centre + i_end * t.i_span));
    }
    list
}

/// Whether `with` comes to rest at a duty and a load as `without` does, and at one voltage wherever it begins.
fn rests(without: &Parameters, with: &Parameters, v: f64, (duty, load): (f64, &Load)) -> bool {
    let mut found: Vec<[f64; 2]> = Vec::new();
    for from in beginnings(with, v, load) {
        // no rest without the term either, as with a load of constant power that runs away in open loop: nothing to compare with
        let Some((mean, swing)) = run(without, duty, load, from).filter(|(mean, swing)| *swing <= FAR * mean.abs())
        else {
            continue;
        };
        let Some((other, swings)) = run(with, duty, load, from) else {
            return false;
        };
        let still = SWING * mean.abs();
        if swings > 1.5 * swing + still || (other - mean).abs() > FAR * mean.abs() {
            return false;
        }
        // two points of rest where the converter alone has one: which of them a run takes would be the term's choice
        let is_other = |[alone, term]: &[f64; 2]| {
            let same = still + swing + swings;
            (alone - mean).abs() <= same && (term - other).abs() > 2.0 * same
        };
        if found.iter().any(is_other) {
            return false;
        }
        found.push([mean, other]);
    }
    true
}

/// Whether `with` comes to rest at the duties and loads of the records as `without` does, from all sides.
pub fn is_stable(problem: &Problem, without: &Parameters, with: &Parameters) -> bool {
    let v = problem.bases.v;
    crate::parallel::map(&points(problem), |(duty, load)| rests(without, with, v, (*duty, load)))
        .into_iter()
        .all(|rests| rests)
}

/// Duties and loads of the records, the ends of both among them.
fn points(problem: &Problem) -> Vec<(f64, Load)> {
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
    points
}

#[cfg(test)]
mod tests {
    use plant::{Load, Parameters};

    use super::rests;

    /// Whether a converter that rests at 24 V does so with a term.
    fn holds(change: impl FnOnce(&mut plant::Empirical)) -> bool {
        let mut p = Parameters::ideal(48.0, 100e-6, 100e-6, 100e3);
        p.inductor.dcr = 0.2;
        let mut with = p.clone();
        let t = &mut with.empirical;
        (t.v_centre, t.v_span, t.i_centre, t.i_span) = (24.0, 4.0, 4.0, 4.0);
        change(t);
        rests(&p, &with, 24.0, (0.5, &Load::resistor(6.0)))
    }

    #[test]
    fn a_term_that_moves_the_point_of_rest_a_little_is_stable() {
        assert!(holds(|t| t.constant = 0.02));
        assert!(holds(|t| (t.v, t.i) = (-0.02, 0.01)));
    }

    #[test]
    fn a_term_with_two_points_of_rest_is_not_stable() {
        // 2.4 V of source for each volt in the range: up or down, and there it stays
        assert!(!holds(|t| (t.v, t.v_span) = (0.05, 1.0)));
    }

    #[test]
    fn a_term_that_holds_the_voltage_down_after_power_up_is_not_stable() {
        // nothing at 22 to 26 V, and 19 V less below 11 V
        assert!(!holds(
            |t| (t.constant, t.v, t.v_centre, t.v_span) = (-0.2, 0.2, 12.0, 1.0)
        ));
    }
}
