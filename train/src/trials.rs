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

/// The order of the trials of the coming look: indices into all of them.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Order(pub Vec<u64>);

impl Order {
    /// One instant of each load step first, in the order of the file: what fails there needs none of the others.
    pub fn new(count: usize) -> Self {
        Self((0..count as u64).collect())
    }

    /// Whether each of `count` trials is in it, once.
    pub fn holds_all(&self, count: usize) -> bool {
        let mut sorted = self.0.clone();
        sorted.sort_unstable();
        sorted.into_iter().eq(0..count as u64)
    }

    /// What raised the bound comes first, the largest rise in front; then what was not run; last what was run in vain.
    fn learn(&mut self, rises: &[f64]) {
        let mut ran: Vec<(u64, f64)> = self.0.iter().copied().zip(rises.iter().copied()).collect();
        let (vain, mut telling): (Vec<_>, Vec<_>) = ran.drain(..).partition(|(_, rise)| *rise <= 0.0);
        // stable: of equal rises the order of before
        telling.sort_by(|(_, a), (_, b)| b.total_cmp(a));
        let others = self.0[rises.len()..].iter().copied();
        let order = telling.iter().map(|(trial, _)| *trial).chain(others);
        self.0 = order.chain(vain.iter().map(|(trial, _)| *trial)).collect();
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
    pub(crate) fn judge(&self, network: &Network, order: &mut Order) -> Result<Score, Error> {
        let (selection, v_ref) = (&self.settings.selection, self.settings.reward.v_ref);
        let task = &selection.task;
        let steps: Vec<LoadStep> = task.load_steps.iter().map(|&step| step.into()).collect();
        let controller = quick_controller(&self.contract, network)?;
        let best = self.best.as_ref().map_or(f64::INFINITY, |best| best.score.cost);
        let (instants, places) = (task.all_instants(), self.places());
        let mut standings: Vec<Standing<'_>> = places
            .iter()
            .map(|place| Standing {
                scoring: Scoring::new(&task.load_steps, place.specification, selection.margin),
                findings: steps.iter().map(|step| Finding::new(*step)).collect(),
            })
            .collect();
        // steps from the same load have one lead
        let mut leads: Vec<((usize, f64), Lead<'_, Varied<E>, _>)> = Vec::new();
        let (mut rises, mut bound) = (Vec::new(), so_far(&standings));
        for trial in &order.0 {
            let trial = *trial as usize;
            let (step_at, place_at) = (trial % steps.len(), trial / steps.len() % places.len());
            let instant = instants[trial / (steps.len() * places.len())];
            let step = steps[step_at];
            let key = (place_at, step.values[0]);
            let lead = match leads.iter().position(|(known, _)| *known == key) {
                Some(at) => at,
                None => {
                    let converter = &places[place_at].converter;
                    leads.push((key, Lead::new(converter, &controller, v_ref, task, &step)?));
                    leads.len() - 1
                }
            };
            let known = standings[place_at].findings[step_at];
            let mut bound_with = |metrics: &Metrics| {
                standings[place_at].findings[step_at] = known;
                standings[place_at].findings[step_at].add(instant, *metrics);
                so_far(&standings)
            };
            let metrics = leads[lead]
                .1
                .run(&step, instant, |metrics| bound_with(metrics).cost < best)?;
            let with = bound_with(&metrics);
            rises.push(with.cost - bound.cost);
            bound = with;
            if bound.cost >= best {
                // cut short, so nothing can be said of the rest
                bound.met = false;
                break;
            }
        }
        order.learn(&rises);
        Ok(bound)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_told_most_comes_first_and_what_told_nothing_last() {
        let mut order = Order(vec![4, 1, 0, 3, 2]);
        order.learn(&[0.0, 1.0, 2.0]);
        assert_eq!(order.0, [0, 1, 3, 2, 4]);
    }
}
