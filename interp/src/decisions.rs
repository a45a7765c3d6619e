//! What a numeric format does to the decisions: the trainer's observations, answered in the format at hand.
//!
//! A build that equals the interpreter says nothing about this: the interpreter rounds as the build does. So the trainer's
//! actions are compared with those of the rounded network, and each change is weighed by what it gives up of the trainer's
//! own Q values.

use std::ops::Range;

use ndarray::{Array1, Axis, aview1};
use policy::{Golden, Head, NumericFormat, Policy, Scalar};
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
    /// What becomes of each of several outputs, in their order.
    Several(Vec<OutputDecisions>),
}

/// What the numeric format does to one output of several.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OutputDecisions {
    /// Name of the output.
    pub output: String,
    /// As of a contract with this output alone.
    #[serde(flatten)]
    pub decisions: Decisions,
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
            Decisions::Several(outputs) => outputs.iter().all(|own| own.decisions.kept()),
        }
    }

    /// Name of the format.
    #[must_use]
    pub fn numeric_format(&self) -> &'static str {
        match self {
            Decisions::Choice(choices) => choices.numeric_format,
            Decisions::Continuous(duties) => duties.numeric_format,
            Decisions::Schedule(gains) => gains.numeric_format,
            Decisions::Several(outputs) => outputs.first().map_or("", |own| own.decisions.numeric_format()),
        }
    }

    /// Those of each output, with its name; the only ones without.
    #[must_use]
    pub fn each(&self) -> Vec<(Option<&str>, &Decisions)> {
        match self {
            Decisions::Several(outputs) => outputs
                .iter()
                .map(|own| (Some(own.output.as_str()), &own.decisions))
                .collect(),
            one => vec![(None, one)],
        }
    }

    /// The outputs that the format changes more than allowed, with their names.
    pub fn beyond(&self) -> impl Iterator<Item = (Option<&str>, &Decisions)> {
        self.each().into_iter().filter(|(_, own)| !own.kept())
    }

    /// The entries of `[network]` that accept them.
    #[must_use]
    pub fn remedy(&self) -> String {
        let share = self.accepting_share();
        let share = share.map(|share| format!("golden_decisions = {share}"));
        let error = self.told().into_iter().filter_map(|own| match own {
            Decisions::Continuous(duties) => Some(duties.largest),
            Decisions::Schedule(gains) => Some(gains.largest),
            Decisions::Choice(_) | Decisions::Several(_) => None,
        });
        let error = error
            .reduce(f64::max)
            .map(|largest| format!("golden_duty = {}", accepting(largest)));
        let entries: Vec<String> = share.into_iter().chain(error).collect();
        entries.join(" and ")
    }

    /// The smallest share of two digits that accepts every choice among them; `None` without a choice to accept.
    #[must_use]
    pub fn accepting_share(&self) -> Option<f64> {
        let shares = self.told().into_iter().filter_map(|own| match own {
            Decisions::Choice(choices) => Some(choices.accepting_share()),
            _ => None,
        });
        shares.reduce(f64::max)
    }

    /// What there is to accept: of several outputs those that are beyond what is allowed.
    fn told(&self) -> Vec<&Decisions> {
        match self {
            Decisions::Several(_) => self.beyond().map(|(_, own)| own).collect(),
            one => vec![one],
        }
    }
}

/// The number that accepts an error of duties or gains, rounded up to two digits.
#[must_use]
pub fn accepting(largest: f64) -> String {
    let unit = 10_f64.powf(largest.log10().floor() - 1.0);
    format!("{:.1e}", (largest / unit).ceil() * unit)
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
    let golden = policy.golden.as_ref()?;
    let Head::Several(outputs) = &policy.head else {
        let asked = Asked {
            policy,
            head: &policy.head,
            columns: 0..policy.outputs(),
            golden,
        };
        return of_one(&asked, allowed);
    };
    let each = outputs.iter().enumerate().filter_map(|(index, own)| {
        let columns = own.columns();
        let asked = Asked {
            policy,
            head: &own.head,
            golden: &golden.of_output(index, &columns),
            columns,
        };
        Some(OutputDecisions {
            output: own.name.clone(),
            decisions: of_one(&asked, allowed)?,
        })
    });
    Some(Decisions::Several(each.collect()))
}

/// One output with the answers that are its own.
pub(crate) struct Asked<'a> {
    pub policy: &'a Policy,
    pub head: &'a Head,
    /// Of the last layer.
    pub columns: Range<usize>,
    pub golden: &'a Golden,
}

fn of_one(asked: &Asked<'_>, allowed: Option<f64>) -> Option<Decisions> {
    let Asked { policy, golden, .. } = asked;
    if let Some(head) = asked.head.continuous() {
        return Some(Decisions::Continuous(duties(asked, head)));
    }
    if let Some(head) = asked.head.schedule() {
        return gains(policy, head).map(Decisions::Schedule);
    }
    let found = match policy.numeric_format.scalar() {
        Scalar::F32 => actions::<f32>(asked),
        Scalar::F64 => actions::<f64>(asked),
    };
    let reference = reference(asked);
    let allowed = allowed.unwrap_or_else(|| golden.allowed_changes(policy.numeric_format));
    Some(Decisions::Choice(weigh(policy, golden, &reference, &found, allowed)))
}

/// The actions in the policy's own format.
fn actions<T: Real>(asked: &Asked<'_>) -> Vec<usize> {
    let answers = answers_of::<T>(asked, asked.policy);
    answers.iter().map(|q| argmax(q.view())).collect()
}

/// The output's columns of what a policy answers.
pub(crate) fn answers_of<T: Real>(asked: &Asked<'_>, policy: &Policy) -> Vec<Array1<T>> {
    let answers = answers::<T>(&Controller::new(policy), asked.golden);
    let own = |row: Array1<T>| row.slice_axis(Axis(0), asked.columns.clone().into()).to_owned();
    answers.into_iter().map(own).collect()
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
fn reference(asked: &Asked<'_>) -> Vec<Vec<f64>> {
    let known = &asked.golden.q_values;
    if !known.is_empty() {
        let rows = known.chunks_exact(asked.columns.len().max(1));
        return rows.map(|row| row.iter().copied().map(f64::from).collect()).collect();
    }
    // binary64 stands for exact arithmetic: the format at hand must not be its own judge
    let exact = asked.policy.clone().with_format(NumericFormat::F64);
    let answers = answers_of::<f64>(asked, &exact);
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
