//! A look at a network: load steps at their instants on every converter, as few of them as show that it is not the best.
//!
//! ```text
//!  order of the trials ─► run one ─► worse of its load step ─► bound of the cost ─┬─ below the best ─► next
//!         ▲                                                                       └─ not ─► ruled out
//!         └───────────── what raised the bound comes first in the next look ◄──────────────┘
//! ```
//!
//! A network that its first trials do not rule out, and that surely misses a limit, is put off (`waiting.rs`).
//!
//! Invariant: the bound only grows and ends as the cost, to the bit, whatever the order. So the order decides how long a look
//! takes and how large the bound is that it ends with, and not which network is kept.

use closed_loop::LoadStep;
use closed_loop::environment::{Environment, Varied};
use closed_loop::scenario::{Finding, Instant, Lead, Metrics, Task};
use plant::Sample;

use crate::faults::Error;
use crate::judge::{Place, quick_controller};
use crate::network::Network;
use crate::score::{Score, Scoring};
use crate::trainer::Trainer;

/// How much each trial told in the looks so far, as a share of the cost that rules a network out.
#[derive(Debug, Clone, Default, PartialEq)]
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

    /// Takes the trial out of `left` that tells most for what it takes; of equal ones the first, so that one instant of each load
    /// step comes before the next instant. `takes` gives what one takes, at least 1.
    fn next(&self, left: &mut Vec<usize>, takes: impl Fn(usize) -> f64) -> Option<usize> {
        let worth = |trial: usize| match self.0[trial] {
            // what told nothing stays behind, however little it takes
            told if told > 0.0 => told / takes(trial),
            told => told,
        };
        let mut best: Option<(usize, f64)> = None;
        for (at, trial) in left.iter().enumerate() {
            let worth = worth(*trial);
            if best.is_none_or(|(_, most)| worth > most) {
                best = Some((at, worth));
            }
        }
        // in order: the first of equal ones is to stay the first
        best.map(|(at, _)| left.remove(at))
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

/// How much of the trials a network was run through.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Seen {
    /// All of them: the score is that of the network.
    All,
    /// As many as rule it out.
    Enough,
    /// A part of them, which did not rule it out.
    Some,
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

    /// A look at a network that has seen nothing of it yet.
    pub(crate) fn judging(&self, network: &Network) -> Result<Judging<'_, E, impl Control + use<E>>, Error> {
        let (selection, places) = (&self.settings.selection, self.places());
        let task = &selection.task;
        let steps: Vec<LoadStep> = task.load_steps.iter().map(|&step| step.into()).collect();
        let mut standings = Vec::new();
        for place in &places {
            standings.push(Standing {
                scoring: Scoring::new(&task.load_steps, place.specification, selection.margin),
                findings: steps.iter().map(|step| Finding::new(*step)).collect(),
            });
        }
        Ok(Judging {
            task,
            v_ref: self.settings.reward.v_ref,
            controller: quick_controller(&self.contract, network)?,
            bound: so_far(&standings),
            standings,
            instants: task.all_instants(),
            known: Vec::new(),
            leads: Vec::new(),
            left: (0..self.trial_count()).collect(),
            steps,
            places,
        })
    }
}

/// A controller that can be copied in mid-run.
pub(crate) trait Control: FnMut(&Sample) -> f64 + Clone {}
impl<C: FnMut(&Sample) -> f64 + Clone> Control for C {}

/// A look in mid-work.
pub(crate) struct Judging<'a, E, C> {
    task: &'a Task,
    v_ref: f64,
    controller: C,
    steps: Vec<LoadStep>,
    instants: Vec<Instant>,
    places: Vec<Place<'a, E>>,
    standings: Vec<Standing<'a>>,
    /// Place and load of each lead: steps from the same load have one.
    known: Vec<(usize, f64)>,
    leads: Vec<Lead<'a, Varied<E>, C>>,
    /// Trials that have not been run.
    left: Vec<usize>,
    /// The score of what has been seen: a lower bound of the cost.
    pub bound: Score,
}

impl<E: Environment, C: Control> Judging<'_, E, C> {
    /// Trials that show each load step once, where nothing is known of them.
    fn few(&self) -> usize {
        self.steps.len() * self.places.len()
    }

    /// Runs so many trials more, or as few as show that the cost does not stay below `bar`.
    pub fn advance(&mut self, bar: f64, count: usize, told: &mut Told) -> Result<Seen, Error> {
        // of the first network that is judged: the cost of one that just holds
        let whole = if bar.is_finite() {
            bar.max(f64::MIN_POSITIVE)
        } else {
            1.0
        };
        let with_lead = 1.0 + self.task.lead as f64 / self.task.after.max(1) as f64;
        for _ in 0..count {
            let mut left = std::mem::take(&mut self.left);
            let takes = |trial| match self.known.contains(&self.lead_of(trial)) {
                true => 1.0,
                false => with_lead,
            };
            let next = told.next(&mut left, takes);
            self.left = left;
            let Some(trial) = next else { break };
            let before = self.bound.cost;
            self.run(trial, bar)?;
            told.learn(trial, (self.bound.cost - before) / whole);
            if self.bound.cost >= bar {
                return Ok(Seen::Enough);
            }
        }
        Ok(if self.left.is_empty() { Seen::All } else { Seen::Some })
    }

    /// Load step, place and instant of a trial.
    fn of(&self, trial: usize) -> (usize, usize, Instant) {
        let step = trial % self.steps.len();
        let place = trial / self.steps.len() % self.places.len();
        (step, place, self.instants[trial / self.few()])
    }

    fn lead_of(&self, trial: usize) -> (usize, f64) {
        let (step, place, _) = self.of(trial);
        (place, self.steps[step].values[0])
    }

    /// Runs a trial, up to where the cost does not stay below `bar`.
    fn run(&mut self, trial: usize, bar: f64) -> Result<(), Error> {
        let (step_at, place_at, instant) = self.of(trial);
        let (step, key) = (self.steps[step_at], self.lead_of(trial));
        let lead = match self.known.iter().position(|other| *other == key) {
            Some(at) => at,
            None => {
                let converter = &self.places[place_at].converter;
                let lead = Lead::new(converter, &self.controller, self.v_ref, self.task, &step)?;
                self.leads.push(lead);
                self.known.push(key);
                self.leads.len() - 1
            }
        };
        let standings = &mut self.standings;
        let before = standings[place_at].findings[step_at];
        let mut bound_with = |metrics: &Metrics| {
            standings[place_at].findings[step_at] = before;
            standings[place_at].findings[step_at].add(instant, *metrics);
            so_far(standings)
        };
        let mut asked = Metrics::default();
        let metrics = self.leads[lead].run(&step, instant, |metrics| {
            // most periods change nothing, and the bound of all load steps costs as much as some of them
            let grown = metrics.deviation > asked.deviation
                || metrics.settling > asked.settling
                || metrics.tail_max > asked.tail_max;
            asked = *metrics;
            !grown || bound_with(metrics).cost < bar
        })?;
        self.bound = bound_with(&metrics);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_told_most_for_what_it_takes_comes_first_and_what_told_nothing_last() {
        let mut told = Told::new(5);
        for (trial, share) in [(2, 0.5), (1, f64::INFINITY), (0, 0.0), (4, 0.7)] {
            told.learn(trial, share);
        }
        let order = |takes: &dyn Fn(usize) -> f64| {
            let mut left: Vec<usize> = (0..5).collect();
            let next = |_| told.next(&mut left, takes);
            (0..5).filter_map(next).collect::<Vec<_>>()
        };
        assert_eq!(order(&|_| 1.0), [1, 4, 2, 3, 0]);
        assert_eq!(order(&|trial| if trial == 4 { 2.0 } else { 1.0 }), [1, 2, 4, 3, 0]);
    }
}
