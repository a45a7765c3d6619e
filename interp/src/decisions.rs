//! What a numeric format does to the decisions: the trainer's observations, answered in the format at hand.
//!
//! A build that equals the interpreter says nothing about this: the interpreter rounds as the build does. So the trainer's
//! actions are compared with those of the rounded network, and each change is weighed by what it gives up of the trainer's
//! own Q values.

use ndarray::{Array1, aview1};
use policy::{Golden, NumericFormat, Policy, Scalar};
use serde::Serialize;

use crate::duties::{Duties, duties};
use crate::gains::{Gains, gains};
use crate::{Controller, Real, argmax};

/// Changes that are told one by one: the worst of them; a user looks at one or two.
const TOLD: usize = 3;

/// What the numeric format does to the trainer's decisions.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Decisions {
    /// Which actions are chosen.
    Choice(Choices),
    /// Which duties a continuous head commands.
    Continuous(Duties),
    /// Which gains a gain schedule sets.
    Schedule(Gains),
}

/// The trainer's choices against those of the numeric format.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Choices {
    /// Name of the format.
    pub numeric_format: &'static str,
    /// Observations that were compared: all golden vectors.
    pub observations: usize,
    /// Observations with another action, ties left out.
    pub changed: usize,
    /// Observations with another action that gives up no more of Q than `golden_tolerance` allows for a rounding.
    pub ties: usize,
    /// Allowed share of changed decisions, 0..1.
    pub allowed: f64,
    /// Mean of the distance between the best and the worst Q value of an observation, in the trainer's network; the unit
    /// of the losses.
    pub operating_range: f64,
    /// Largest Q that a change gives up, as a share of [`operating_range`](Self::operating_range).
    pub largest_loss: f64,
    /// Mean over all observations, as a share of [`operating_range`](Self::operating_range).
    pub mean_loss: f64,
    /// The changes that give up most, the worst first.
    pub worst: Vec<Change>,
}

/// One changed decision.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Change {
    /// Row of the golden vectors.
    pub row: usize,
    /// The observation, in network input order.
    pub observation: Vec<f32>,
    /// Action of the trainer.
    pub expected: usize,
    /// Action in the format.
    pub found: usize,
    /// What it gives up of Q, as a share of the operating range.
    pub loss: f64,
}

impl Decisions {
    /// The format does no more to them than allowed.
    #[must_use]
    pub fn kept(&self) -> bool {
        match self {
            Decisions::Choice(choices) => choices.kept(),
            Decisions::Continuous(duties) => duties.kept(),
            Decisions::Schedule(gains) => gains.kept(),
        }
    }

    /// Name of the format.
    #[must_use]
    pub fn numeric_format(&self) -> &'static str {
        match self {
            Decisions::Choice(choices) => choices.numeric_format,
            Decisions::Continuous(duties) => duties.numeric_format,
            Decisions::Schedule(gains) => gains.numeric_format,
        }
    }

    /// The entry of `[network]` that accepts them.
    #[must_use]
    pub fn remedy(&self) -> String {
        match self {
            Decisions::Choice(choices) => format!("golden_decisions = {}", choices.accepting_share()),
            Decisions::Continuous(duties) => accepting_error(duties.largest),
            Decisions::Schedule(gains) => accepting_error(gains.largest),
        }
    }
}

/// The entry that accepts an error of duties or gains, rounded up to two digits.
fn accepting_error(largest: f64) -> String {
    let unit = 10_f64.powf(largest.log10().floor() - 1.0);
    format!("golden_duty = {:.1e}", (largest / unit).ceil() * unit)
}

impl Choices {
    /// No more decisions changed than allowed; ties are no changes.
    #[must_use]
    pub fn kept(&self) -> bool {
        self.changed as f64 <= self.allowed * self.observations as f64
    }

    /// Share of changed decisions, 0..1.
    #[must_use]
    pub fn share(&self) -> f64 {
        self.changed as f64 / self.observations.max(1) as f64
    }

    /// The smallest number of two digits that accepts [`Choices::share`].
    #[must_use]
    pub fn accepting_share(&self) -> f64 {
        (self.share() * 100.0).ceil() / 100.0
    }
}

/// Answers the golden observations in the policy's format; `None` if the policy has none.
///
/// `allowed` is the share of choices that may change, in the place of the contract's; a head without a choice has none.
#[must_use]
pub fn decisions(policy: &Policy, allowed: Option<f64>) -> Option<Decisions> {
    if let Some(head) = policy.head.continuous() {
        return duties(policy, head).map(Decisions::Continuous);
    }
    if let Some(head) = policy.head.schedule() {
        return gains(policy, head).map(Decisions::Schedule);
    }
    let golden = policy.golden.as_ref()?;
    let found = match policy.numeric_format.scalar() {
        Scalar::F32 => actions::<f32>(policy, golden),
        Scalar::F64 => actions::<f64>(policy, golden),
    };
    let reference = reference(policy, golden);
    let allowed = allowed.unwrap_or_else(|| golden.allowed_changes(policy.numeric_format));
    Some(Decisions::Choice(weigh(policy, golden, &reference, &found, allowed)))
}

/// The actions in the policy's own format.
fn actions<T: Real>(policy: &Policy, golden: &Golden) -> Vec<usize> {
    let answers = answers::<T>(&Controller::new(policy), golden);
    answers.iter().map(|q| argmax(q.view())).collect()
}

/// Outputs for each golden observation; a controller that refuses an observation, which the check rules out, gives 0.
pub(crate) fn answers<T: Real>(controller: &Controller<T>, golden: &Golden) -> Vec<Array1<T>> {
    let features = golden.observations.len() / golden.count.max(1);
    let rows = golden.observations.chunks_exact(features.max(1));
    rows.map(|row| {
        let observation: Vec<T> = row.iter().map(|x| T::widen(*x)).collect();
        let outputs = controller.q_values(&aview1(&observation));
        outputs.unwrap_or_else(|_| Array1::from_elem(controller.outputs(), T::ZERO))
    })
    .collect()
}

/// The trainer's Q values; where it gave actions only, those of its network in binary64.
fn reference(policy: &Policy, golden: &Golden) -> Vec<Vec<f64>> {
    if !golden.q_values.is_empty() {
        let rows = golden.q_values.chunks_exact(policy.outputs().max(1));
        return rows.map(|row| row.iter().copied().map(f64::from).collect()).collect();
    }
    // binary64 stands for exact arithmetic: the format at hand must not be its own judge
    let exact = policy.clone().with_format(NumericFormat::F64);
    let answers = answers::<f64>(&Controller::new(&exact), golden);
    answers.into_iter().map(|q| q.to_vec()).collect()
}

fn weigh(policy: &Policy, golden: &Golden, reference: &[Vec<f64>], found: &[usize], allowed: f64) -> Choices {
    // losses are shares of what the trainer tells apart, not of the whole box of observations: Q spans far more
    // there than where a converter works, so that every loss would look small
    let spans = reference.iter().map(|q| {
        let highest = q.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        highest - q.iter().copied().fold(f64::INFINITY, f64::min)
    });
    let operating_range = spans.sum::<f64>() / golden.count.max(1) as f64;
    // a network with one value for all actions has no range: a loss of 0 is 0 of it
    let unit = operating_range.max(f64::MIN_POSITIVE);
    let mut ties = 0;
    let mut total = 0.0;
    let mut worst = Vec::new();
    let features = policy.features.len().max(1);
    let rows = golden.observations.chunks_exact(features);
    for (row, ((q, found), observation)) in reference.iter().zip(found).zip(rows).enumerate() {
        let given = golden.action_indices.get(row).map(|action| *action as usize);
        let expected = given.unwrap_or_else(|| argmax(aview1(q)));
        if expected == *found {
            continue;
        }
        let value = |action: usize| q.get(action).copied().unwrap_or(f64::NAN);
        // the trainer's action may be one of two that are equal in its own arithmetic: then nothing is given up
        let lost = (value(expected) - value(*found)).max(0.0);
        // the same measure as in `golden`: a tie is what the trainer's own rounding could have turned
        let largest = q.iter().fold(f64::MIN_POSITIVE, |largest, q| largest.max(q.abs()));
        if lost <= golden.tolerance * largest {
            ties += 1;
            continue;
        }
        total += lost;
        worst.push(Change {
            row,
            observation: observation.to_vec(),
            expected,
            found: *found,
            loss: lost / unit,
        });
    }
    let changed = worst.len();
    worst.sort_by(|a, b| b.loss.total_cmp(&a.loss).then(a.row.cmp(&b.row)));
    worst.truncate(TOLD);
    Choices {
        numeric_format: policy.numeric_format.name(),
        observations: golden.count,
        changed,
        ties,
        allowed,
        operating_range,
        largest_loss: worst.first().map_or(0.0, |change| change.loss),
        mean_loss: total / golden.count.max(1) as f64 / unit,
        worst,
    }
}
