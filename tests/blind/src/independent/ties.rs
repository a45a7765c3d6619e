//! What else would show the same: every listed cause is fitted to the noise-free records, one at a time.

use crate::independent::algebra::fit;
use crate::independent::causes::Variant;
use crate::independent::program::{Program, Table, World, exact};
use crate::rng::Rng;

/// A cause that leaves this much or less, in units of the noise's variance, cannot be told from the truth.
pub const TIED: f64 = 25.0;

/// A listed cause and what is left with it.
#[derive(Debug, Clone, PartialEq)]
pub struct Rival {
    pub id: &'static str,
    pub wiring: &'static str,
    pub values: Vec<f64>,
    /// Squared distance that stays, in units of the noise's variance.
    pub left: f64,
}

/// Tables of the training programs in units of their noise, laid end to end.
pub fn vector(world: &World, floors: &[f64; 6], programs: &[Program]) -> Vec<f64> {
    let tables = programs.iter().filter(|program| !program.heldout);
    tables
        .flat_map(|program| flat(&exact(world, program, &mut Rng::new(0, &[])), floors))
        .collect()
}

/// A table in units of the noise.
pub fn flat(table: &Table, floors: &[f64; 6]) -> Vec<f64> {
    let channels = table.values.iter().zip(floors);
    channels
        .flat_map(|(values, floor)| values.iter().map(move |value| value / floor))
        .collect()
}

fn square(a: &[f64], b: &[f64]) -> f64 {
    let sum: f64 = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum();
    // a board that does not hold together is far from every record
    if sum.is_finite() { sum } else { f64::MAX }
}

/// Fits every variant to `truth`, best first.
pub fn search(nominal: &World, variants: &[Variant], truth: &[f64], view: &dyn Fn(&World) -> Vec<f64>) -> Vec<Rival> {
    let start = view(nominal);
    let mut rivals: Vec<Rival> = variants
        .iter()
        .map(|variant| fitted(nominal, variant, truth, &start, view))
        .collect();
    rivals.sort_by(|a, b| a.left.total_cmp(&b.left));
    rivals
}

/// Gauss and Newton from the drawn range's middle; a variant that explains nothing at first order is given up early.
fn fitted(
    nominal: &World,
    variant: &Variant,
    truth: &[f64],
    start: &[f64],
    view: &dyn Fn(&World) -> Vec<f64>,
) -> Rival {
    let whole = square(truth, start);
    let mut best = Rival {
        id: variant.id,
        wiring: variant.wiring,
        values: vec![],
        left: whole,
    };
    let mut tries: Vec<Vec<f64>> = vec![variant.knobs.iter().map(|knob| first(knob, 1.0)).collect()];
    if variant.knobs.iter().any(|knob| knob.signed) {
        tries.push(variant.knobs.iter().map(|knob| first(knob, -1.0)).collect());
    }
    for values in tries {
        let mut at = values;
        let mut here = view(&variant.applied(nominal, &at));
        let mut left = square(truth, &here);
        for round in 0..4 {
            let columns: Vec<Vec<f64>> = (0..at.len())
                .map(|k| slope(nominal, variant, &at, &here, k, view))
                .collect();
            let target: Vec<f64> = truth.iter().zip(&here).map(|(a, b)| a - b).collect();
            let Some((step, promised)) = fit(&columns, &target) else {
                break;
            };
            if round == 0 && promised > 0.6 * whole && left > 0.9 * whole {
                break;
            }
            let Some((next, shown, now)) = better(nominal, variant, (&at, &step), left, truth, view) else {
                break;
            };
            let gained = left - now;
            (at, here, left) = (next, shown, now);
            if gained < 0.01 * left || left < 1.0 {
                break;
            }
        }
        if left < best.left {
            (best.left, best.values) = (left, at);
        }
        // the other sign is for what the first did not reach
        if best.left < TIED {
            break;
        }
    }
    best
}

fn first(knob: &crate::independent::causes::Knob, sign: f64) -> f64 {
    let middle = 0.5 * (knob.drawn.0 + knob.drawn.1);
    if knob.signed {
        knob.nominal + 0.5 * sign * middle
    } else {
        0.5 * (knob.drawn.0 + middle)
    }
}

fn slope(
    nominal: &World,
    variant: &Variant,
    at: &[f64],
    here: &[f64],
    k: usize,
    view: &dyn Fn(&World) -> Vec<f64>,
) -> Vec<f64> {
    let knob = &variant.knobs[k];
    let h = 1e-2 * (knob.drawn.1 - knob.drawn.0).max(0.1 * knob.drawn.1);
    let mut moved = at.to_vec();
    moved[k] += if moved[k] + h > knob.allowed.1 { -h } else { h };
    let h = moved[k] - at[k];
    view(&variant.applied(nominal, &moved))
        .iter()
        .zip(here)
        .map(|(a, b)| (a - b) / h)
        .collect()
}

/// The longest of a few lengths of the step that gains something.
fn better(
    nominal: &World,
    variant: &Variant,
    (at, step): (&[f64], &[f64]),
    left: f64,
    truth: &[f64],
    view: &dyn Fn(&World) -> Vec<f64>,
) -> Option<(Vec<f64>, Vec<f64>, f64)> {
    for share in [1.0, 0.35, 0.1] {
        let next: Vec<f64> = at
            .iter()
            .zip(step)
            .zip(&variant.knobs)
            .map(|((x, s), knob)| (x + share * s).clamp(knob.allowed.0, knob.allowed.1))
            .collect();
        let shown = view(&variant.applied(nominal, &next));
        let now = square(truth, &shown);
        if now < left {
            return Some((next, shown, now));
        }
    }
    None
}
