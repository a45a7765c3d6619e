//! A look at a network: load steps at their instants on every converter, as few of them as show that it is not the best.
//!
//! ```text
//!  order of the trials ─► run one ─► worse of its load step ─► bound of the cost ─┬─ below the best ─► next
//!         ▲                                                                       └─ not ─► ruled out
//!         └───────────── what raised the bound comes first in the next look ◄──────────────┘
//! ```
//!
//! Invariant: the bound only grows and ends as the cost, to the bit, whatever the order. So the order decides how long a look
//! takes and how large the bound is that it ends with, and not which network is kept.

use closed_loop::LoadStep;
use closed_loop::environment::{Environment, Varied};
use closed_loop::scenario::{Finding, Lead, Metrics};

use crate::faults::Error;
use crate::judge::quick_controller;
use crate::network::Network;
use crate::score::{Score, Scoring};
use crate::trainer::Trainer;

/// How much each trial told in the looks so far, as a share of the cost that rules a network out.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Told(pub Vec<f64>);

/// What a look leaves of what the looks before it said of a trial.
// networks change slowly, but which of two neighbouring instants is the worse one changes from look to look
const KEPT: f64 = 0.7;
/// What a trial that told nothing loses beside it, so that one which was never run comes before it.
const VAIN: f64 = 1e-6;

impl Told {
    /// Nothing of so many.
    pub fn new(count: usize) -> Self {
        Self(vec![0.0; count])
    }

    /// The trials, the most telling first; of equal ones one instant of each load step before the next instant.
    fn order(&self) -> Vec<usize> {
        let mut order: Vec<usize> = (0..self.0.len()).collect();
        order.sort_by(|&a, &b| self.0[b].total_cmp(&self.0[a]));
        order
    }

    /// Takes in by which share of the cost a trial raised the bound.
    fn learn(&mut self, trial: usize, share: f64) {
        // a network that is lost is beyond every cost
        let share = share.clamp(0.0, 1.0);
        let kept = KEPT * self.0[trial] + (1.0 - KEPT) * share;
        self.0[trial] = if share > 0.0 { kept } else { kept - VAIN };
    }
}

/// What is known of a policy on one converter.
struct Standing<'a> {
    scoring: Scoring<'a>,
    findings: Vec<Finding>,
}

/// The score of all converters together from what is known so far: a lower bound of the cost.
fn so_far(standings: &[Standing<'_>]) -> Score {
    let scores = standings
        .iter()
        .map(|standing| standing.scoring.score(&standing.findings));
    let share = standings.len() as f64;
    scores.fold(Score { met: true, cost: 0.0 }, |whole, score| Score {
        met: whole.met && score.met,
        cost: whole.cost + score.cost / share,
    })
}

impl<E: Environment> Trainer<E> {
    /// Number of trials of a whole look.
    pub(crate) fn trial_count(&self) -> usize {
        let task = &self.settings.selection.task;
        (1 + self.settings.spread.len()) * task.load_steps.len() * task.all_instants().len()
    }

    /// The score of a network on the selection scenarios. One that cannot be better than the best is not run through the rest,
    /// and its cost is a lower bound.
    pub(crate) fn judge(&self, network: &Network, told: &mut Told) -> Result<Score, Error> {
        let (selection, v_ref) = (&self.settings.selection, self.settings.reward.v_ref);
        let task = &selection.task;
        let steps: Vec<LoadStep> = task.load_steps.iter().map(|&step| step.into()).collect();
        let controller = quick_controller(&self.contract, network)?;
        let best = self.best.as_ref().map_or(f64::INFINITY, |best| best.score.cost);
        // of the first network that is judged: the cost of one that just holds
        let whole = if best.is_finite() {
            best.max(f64::MIN_POSITIVE)
        } else {
            1.0
        };
        let (instants, places) = (task.all_instants(), self.places());
        let mut standings: Vec<Standing<'_>> = places
            .iter()
            .map(|place| Standing {
                scoring: Scoring::new(&task.load_steps, place.specification, selection.margin),
                findings: steps.iter().map(|step| Finding::new(*step)).collect(),
            })
            .collect();
        // steps from the same load have one lead
        let mut known: Vec<(usize, f64)> = Vec::new();
        let mut leads: Vec<Lead<'_, Varied<E>, _>> = Vec::new();
        let mut bound = so_far(&standings);
        for trial in told.order() {
            let (step_at, place_at) = (trial % steps.len(), trial / steps.len() % places.len());
            let instant = instants[trial / (steps.len() * places.len())];
            let step = steps[step_at];
            let key = (place_at, step.values[0]);
            let lead = match known.iter().position(|other| *other == key) {
                Some(at) => at,
                None => {
                    let converter = &places[place_at].converter;
                    leads.push(Lead::new(converter, &controller, v_ref, task, &step)?);
                    known.push(key);
                    leads.len() - 1
                }
            };
            let before = standings[place_at].findings[step_at];
            let mut bound_with = |metrics: &Metrics| {
                standings[place_at].findings[step_at] = before;
                standings[place_at].findings[step_at].add(instant, *metrics);
                so_far(&standings)
            };
            let mut asked = Metrics::default();
            let metrics = leads[lead].run(&step, instant, |metrics| {
                // most periods change nothing, and the bound of all load steps costs as much as some of them
                let grown = metrics.deviation > asked.deviation
                    || metrics.settling > asked.settling
                    || metrics.tail_max > asked.tail_max;
                asked = *metrics;
                !grown || bound_with(metrics).cost < best
            })?;
            let with = bound_with(&metrics);
            told.learn(trial, (with.cost - bound.cost) / whole);
            bound = with;
            if bound.cost >= best {
                // cut short, so nothing can be said of the rest
                bound.met = false;
                break;
            }
        }
        Ok(bound)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_told_most_comes_first_and_what_told_nothing_last() {
        let mut told = Told::new(4);
        for (trial, share) in [(2, 0.5), (1, f64::INFINITY), (0, 0.0)] {
            told.learn(trial, share);
        }
        assert_eq!(told.order(), [1, 2, 3, 0]);
    }
}
