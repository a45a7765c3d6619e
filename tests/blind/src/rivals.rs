//! What the data of a case can tell apart, from ngspice alone: the noise-free records of the hidden bench against those of
//! benches with other causes, in units of the noise.
//!
//! The difference that the truth makes is projected on the differences that one or two listed causes make. What a projection
//! leaves below the threshold no diagnosis can tell from the truth. The directions are finite differences at middle
//! sizes; an allowance for their curvature is part of the threshold.

use crate::bench::Bench;
use crate::case::{Runs, recorded};
use crate::effects::{Effect, Size, listed_effects};
use crate::experiment::Record;
use crate::plan::Plan;
use crate::sensing::Samples;

/// What is left may be this large, in units of the noise's variance: a likelihood ratio at the 0.5 % level for two
/// parameters is 10.6.
const NOISE: f64 = 11.0;
/// Curvature: share of the distance itself.
const CURVATURE: f64 = 1e-3;
/// Sizes beyond a few times the middle one are not plausible: coefficients have this standard deviation.
const PLAUSIBLE: f64 = 4.0;
/// Rows at the start that an unknown initial state may explain.
const START: usize = 20;
/// Effects whose response is no direction: rounding is noise-like.
const NOT_LINEAR: [&str; 2] = ["adc_quantisation", "duty_quantisation"];

/// What explains a case.
#[derive(Debug, Clone, PartialEq)]
pub struct Explanation {
    /// Distance from the nominal bench.
    pub chi2: f64,
    /// The least that one or two listed causes leave of it.
    pub chi2_listed: f64,
    /// Smallest sets of listed causes that leave no more than noise.
    pub sets: Vec<Vec<String>>,
}

/// A cause with the directions in which its parameters move the records.
struct Candidate {
    id: &'static str,
    directions: Vec<Vec<f64>>,
}

/// Explanations of a case by its training records, each with the noise-free samples of hidden and nominal bench. Without `search` the truth alone.
///
/// # Errors
/// If ngspice fails.
pub(crate) fn explanations(
    runs: &mut Runs<'_>,
    training: &[(&Record, Samples, Samples)],
    search: bool,
) -> Result<Explanation, String> {
    let plan = runs.plan;
    let difference = scaled(plan, training.iter().map(|(_, hidden, twin)| (hidden, twin)));
    let chi2 = dot(&difference, &difference);
    if plan.effects.is_empty() || chi2 < NOISE {
        return Ok(Explanation {
            chi2,
            chi2_listed: chi2,
            sets: Vec::new(),
        });
    }
    let mut candidates = Vec::new();
    for effect in listed_effects().filter(|effect| search && !NOT_LINEAR.contains(&effect.id)) {
        if effect.hides_v_in && plan.has_v_in {
            continue;
        }
        let mut directions = Vec::new();
        let hidden = plan.effects.iter().find(|hidden| hidden.id == effect.id);
        for bench in hidden
            .map(|hidden| alone(hidden, plan))
            .into_iter()
            .chain(variants(effect))
        {
            directions.push(direction(runs, training, &bench)?);
        }
        candidates.push(Candidate {
            id: effect.id,
            directions,
        });
    }
    let limit = NOISE + CURVATURE * chi2;
    let (chi2_listed, mut sets) = explained(&candidates, &difference, limit);
    let chi2_listed = chi2_listed.min(chi2);
    let truth: Vec<&str> = plan.effects.iter().map(|effect| effect.id).collect();
    let all_listed = plan.effects.iter().all(|effect| effect.listed);
    let beyond = |set: &Vec<String>| truth.len() < set.len() && truth.iter().all(|id| set.iter().any(|own| own == id));
    sets.retain(|set| !(all_listed && beyond(set)));
    if all_listed && !sets.iter().any(|set| set.iter().all(|id| truth.contains(&id.as_str()))) {
        sets.insert(0, truth.iter().map(|id| (*id).to_owned()).collect());
    }
    Ok(Explanation {
        chi2,
        chi2_listed: if all_listed { 0.0 } else { chi2_listed },
        sets,
    })
}

/// Squared distance of the hidden records from those of another bench.
pub(crate) fn distance(
    runs: &mut Runs<'_>,
    training: &[(&Record, Samples, Samples)],
    other: &Bench,
) -> Result<f64, String> {
    let mut squares = 0.0;
    for (record, hidden, _) in training {
        let samples = runs.exact(other, record)?;
        let apart = scaled(runs.plan, std::iter::once((hidden, &samples)));
        squares += dot(&apart, &apart);
    }
    Ok(squares)
}

/// Smallest sets of one or two candidates that leave less than `limit`, and the least that is left.
fn explained(candidates: &[Candidate], difference: &[f64], limit: f64) -> (f64, Vec<Vec<String>>) {
    let mut least = f64::INFINITY;
    let mut sets: Vec<Vec<String>> = Vec::new();
    let mut judge = |members: &[&Candidate], sets: &mut Vec<Vec<String>>| {
        let directions: Vec<_> = members.iter().flat_map(|candidate| &candidate.directions).collect();
        let left = remainder(difference, &directions);
        least = least.min(left);
        if left < limit {
            sets.push(members.iter().map(|candidate| candidate.id.to_owned()).collect());
        }
    };
    for candidate in candidates {
        judge(&[candidate], &mut sets);
    }
    let alone: Vec<String> = sets.concat();
    let open = || candidates.iter().filter(|c| !alone.iter().any(|id| id == c.id));
    for (number, one) in open().enumerate() {
        for other in open().skip(number + 1) {
            judge(&[one, other], &mut sets);
        }
    }
    (least, sets)
}

/// Benches that show in which directions a cause moves the data: a parameter at a time, or, where a second parameter is the
/// place at which the first one acts, both ends of that place.
fn variants(effect: &Effect) -> Vec<Bench> {
    let nominal = Bench::nominal();
    let with = |changes: &[(usize, f64)]| {
        let mut bench = nominal.clone();
        for &(place, value) in changes {
            effect.parameters[place].set(&mut bench, value);
        }
        bench
    };
    let middle = |place: usize| {
        let parameter = &effect.parameters[place];
        parameter.middle(parameter.get(&nominal))
    };
    match effect.parameters {
        [_] if effect.id == "duty_delay" => vec![with(&[(0, 1.0)])],
        [_] => vec![with(&[(0, middle(0))])],
        [_, second] => match second.size {
            Size::Value(low, high) => vec![with(&[(0, middle(0)), (1, low)]), with(&[(0, middle(0)), (1, high)])],
            _ => vec![with(&[(0, middle(0))]), with(&[(1, middle(1))])],
        },
        _ => Vec::new(),
    }
}

/// The nominal bench with this hidden effect only.
fn alone(effect: &Effect, plan: &Plan) -> Bench {
    let mut bench = Bench::nominal();
    for parameter in effect.parameters {
        parameter.set(&mut bench, parameter.get(&plan.bench));
    }
    bench
}

fn direction(runs: &mut Runs<'_>, training: &[(&Record, Samples, Samples)], bench: &Bench) -> Result<Vec<f64>, String> {
    let mut moved = Vec::new();
    for (record, _, _) in training {
        moved.push(runs.exact(bench, record)?);
    }
    Ok(scaled(
        runs.plan,
        moved.iter().zip(training.iter().map(|(_, _, twin)| twin)),
    ))
}

/// Differences of all recorded samples over their standard deviations.
fn scaled<'a>(plan: &Plan, pairs: impl Iterator<Item = (&'a Samples, &'a Samples)>) -> Vec<f64> {
    let s = &plan.bench.sensors;
    let deviation = |noise: f64, lsb: f64| (noise * noise + lsb * lsb / 12.0).sqrt();
    let (v, i) = (deviation(s.v_noise, s.v_lsb), deviation(s.i_noise, s.i_lsb));
    let deviations = [v, i, i, v];
    let mut all = Vec::new();
    for (a, b) in pairs {
        for (a, b) in a.iter().zip(b).skip(START) {
            let columns = (0..a.len()).filter(|&column| recorded(plan, column));
            all.extend(columns.map(|column| (a[column] - b[column]) / deviations[column]));
        }
    }
    all
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Squared length of what the best combination of `directions` leaves of `difference`, plus what an implausible size costs
/// (Gram and Schmidt, twice for rounding; the sizes are further components).
fn remainder(difference: &[f64], directions: &[&Vec<f64>]) -> f64 {
    let mut basis: Vec<Vec<f64>> = Vec::new();
    let mut left = difference.to_vec();
    left.extend(directions.iter().map(|_| 0.0));
    for (number, direction) in directions.iter().enumerate() {
        let mut own = (*direction).clone();
        own.extend((0..directions.len()).map(|other| if other == number { 1.0 / PLAUSIBLE } else { 0.0 }));
        for _ in 0..2 {
            for unit in &basis {
                take_off(&mut own, unit);
            }
        }
        let norm = dot(&own, &own).sqrt();
        own.iter_mut().for_each(|x| *x /= norm);
        take_off(&mut left, &own);
        basis.push(own);
    }
    dot(&left, &left)
}

fn take_off(from: &mut [f64], unit: &[f64]) {
    let share = dot(from, unit);
    from.iter_mut().zip(unit).for_each(|(x, u)| *x -= share * u);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn candidate(id: &'static str, directions: &[[f64; 3]]) -> Candidate {
        Candidate {
            id,
            directions: directions.iter().map(|d| d.to_vec()).collect(),
        }
    }

    #[test]
    fn a_projection_leaves_what_is_orthogonal_and_charges_absurd_sizes() {
        let directions = [vec![200.0, 0.0, 0.0], vec![200.0, 1e-3, 0.0], vec![100.0, 100.0, 0.0]];
        let left = |chosen: &[usize]| {
            let chosen: Vec<_> = chosen.iter().map(|&number| &directions[number]).collect();
            remainder(&[3.0, 4.0, 5.0], &chosen)
        };
        assert!((left(&[0]) - 41.0).abs() < 1e-2);
        assert!((left(&[0, 1]) - 41.0).abs() < 1e-2);
        assert!((left(&[0, 2]) - 25.0).abs() < 1e-2);
    }

    #[test]
    fn parallel_causes_tie_and_pairs_are_listed_without_those_that_suffice_alone() {
        let candidates = [
            candidate("a", &[[10.0, 0.0, 0.0]]),
            candidate("b", &[[20.0, 0.01, 0.0]]),
            candidate("c", &[[0.0, 10.0, 0.0]]),
        ];
        let (least, sets) = explained(&candidates, &[20.0, 0.0, 0.0], 1.0);
        assert!(least < 0.5);
        assert_eq!(sets, [["a"], ["b"]]);
        let (_, sets) = explained(&candidates, &[20.0, 20.0, 0.0], 1.0);
        assert_eq!(sets, [["a", "c"], ["b", "c"]]);
    }

    #[test]
    fn what_no_two_causes_reach_has_no_explanation() {
        let candidates = [
            candidate("a", &[[100.0, 0.0, 0.0]]),
            candidate("b", &[[0.0, 100.0, 0.0]]),
        ];
        let (least, sets) = explained(&candidates, &[3.0, 4.0, 5.0], 1.0);
        assert!((least - 25.0).abs() < 1e-2);
        assert!(sets.is_empty());
    }
}
