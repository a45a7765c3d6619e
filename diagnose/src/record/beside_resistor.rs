//! A load current beside a resistor, of which the meter shows the sum.
//!
//! ```text
//! i_out = v_out / R + I        R the same throughout, I in levels
//! ```
//! A bench often has a resistor that draws always and an electronic load that steps. While the output swings neither levels nor one conductance fit, and
//! the sum of both does. The conductance is what makes levels of the rest: first from rows near each other, of which few see a step, then
//! within the stretches that were found with it.

use super::levels::{Form, Rows};

/// Rows between the two ends of a difference: several periods of a filter's swing have some tens of rows, and steps are farther apart.
const APART: usize = 4;
/// Rounds of stretches and conductance: the first has the stretches nearly right.
const ROUNDS: usize = 3;
/// Standard deviations of the conductance that make a resistor of it: the rounds choose what they then judge.
const SEEN: f64 = 6.0;

/// The conductance, S, and the rows of the current beside it with the places where it steps. Nothing where there is no such conductance.
pub fn find(known: &[usize], i_out: &[f64], v_out: &[f64], noise: f64) -> Option<(f64, Rows, Vec<usize>)> {
    let v: Vec<f64> = known
        .iter()
        .map(|n| v_out.get(*n).copied().unwrap_or(f64::NAN))
        .collect();
    if v.iter().any(|v| !v.is_finite()) {
        return None;
    }
    let i: Vec<f64> = known.iter().map(|n| i_out[*n]).collect();
    let mut conductance = of_differences(&i, &v)?;
    for round in 0..ROUNDS {
        let beside: Vec<f64> = (i_out.iter().enumerate())
            .map(|(n, i)| i - conductance * v_out.get(n).copied().unwrap_or(f64::NAN))
            .collect();
        let rows = Rows::new(Form::Current, known, &beside, v_out, noise)?;
        let cuts = rows.cuts()?;
        let (next, swing) = within(&rows.stretches(&cuts), &i, &v)?;
        if round + 1 == ROUNDS {
            let is_seen = conductance * swing * (known.len() as f64).sqrt() > SEEN * noise;
            return is_seen.then_some((conductance, rows, cuts));
        }
        conductance = next;
    }
    None
}

/// The conductance that most differences of neighbouring rows have: the weighted median of their ratios, which steps of the load do not move.
fn of_differences(i: &[f64], v: &[f64]) -> Option<f64> {
    let of = |values: &[f64], n: usize| values[n + APART] - values[n];
    let count = i.len().checked_sub(APART)?;
    let mut ratios: Vec<(f64, f64)> = (0..count)
        .map(|n| (of(i, n) / of(v, n), of(v, n).abs()))
        .filter(|(ratio, weight)| ratio.is_finite() && *weight > 0.0)
        .collect();
    ratios.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = 0.5 * ratios.iter().map(|(_, weight)| weight).sum::<f64>();
    let mut below = 0.0;
    ratios.into_iter().find_map(|(ratio, weight)| {
        below += weight;
        (below >= half).then_some(ratio)
    })
}

/// The conductance by least squares within stretches, and the standard deviation of the voltage there.
fn within(stretches: &[(usize, usize)], i: &[f64], v: &[f64]) -> Option<(f64, f64)> {
    let (mut vv, mut vi, mut count) = (0.0, 0.0, 0usize);
    for (from, to) in stretches.iter().copied() {
        let mean = |values: &[f64]| values[from..to].iter().sum::<f64>() / (to - from) as f64;
        let (of_v, of_i) = (mean(v), mean(i));
        for (v, i) in v[from..to].iter().zip(&i[from..to]) {
            vv += (v - of_v) * (v - of_v);
            vi += (v - of_v) * (i - of_i);
        }
        count += to - from;
    }
    (vv > 0.0).then(|| (vi / vv, (vv / count as f64).sqrt()))
}

#[cfg(test)]
mod tests {
    use crate::record::levels::find;

    /// 20 ohm beside a current that steps from 3 to 5 A, while the output swings by 8 V.
    #[test]
    fn a_current_beside_a_resistor_is_told_from_it() {
        let v: Vec<f64> = (0..300).map(|n| 100.0 + 8.0 * (f64::from(n) * 0.23).sin()).collect();
        // steps of 1 mA: the noise of this meter
        let shown = |(n, v): (usize, &f64)| {
            let current = if n < 140 { 3.0 } else { 5.0 };
            let noise = 0.004 * (n as f64 * 1.7).sin() * (n as f64 * 2.9).cos();
            ((v / 20.0 + current + noise) * 1e3).round() / 1e3
        };
        let i: Vec<f64> = v.iter().enumerate().map(shown).collect();
        let found = find(&i, &v, 1e-3, 0.5).unwrap();
        assert!((found.load[7].conductance - 0.05).abs() < 2e-4, "{:?}", found.load[7]);
        assert!((found.load[7].current - 3.0).abs() < 0.02, "{:?}", found.load[7]);
        assert!((found.load[299].current - 5.0).abs() < 0.02, "{:?}", found.load[299]);
        assert!(found.words.contains("beside a resistor of 20.0"), "{}", found.words);
    }

    /// A current that is levels, and a voltage that swings: no resistor.
    #[test]
    fn levels_alone_have_no_resistor_beside_them() {
        let v: Vec<f64> = (0..300).map(|n| 100.0 + 8.0 * (f64::from(n) * 0.23).sin()).collect();
        let i: Vec<f64> = (0..300)
            .map(|n| {
                let noise = 0.004 * (f64::from(n) * 1.7).sin() * (f64::from(n) * 2.9).cos();
                ((if n < 140 { 3.0 } else { 5.0 } + noise) * 1e3).round() / 1e3
            })
            .collect();
        let found = find(&i, &v, 1e-3, 0.5).unwrap();
        assert!(found.load.iter().all(|load| load.conductance == 0.0), "{}", found.words);
    }
}
