//! One duty of a policy: what its columns of the last layer mean, and what is said of them.

use std::ops::Range;

use policy::{Head, Policy};

use crate::propagate::Enclosure;
use crate::{Bound, actor, law};

/// What is decided from some columns of the last layer; a policy has one of these for each output.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Part {
    /// Name of the output; `None` where there is one.
    pub name: Option<String>,
    pub head: Head,
    pub columns: Range<usize>,
}

impl Part {
    /// All of a policy, in the order of its outputs.
    pub fn all(policy: &Policy) -> Vec<Self> {
        let one = |path: &policy::DutyPath<'_>| Self {
            name: path.name.map(str::to_owned),
            head: path.head.clone(),
            columns: path.columns(),
        };
        policy.paths().iter().map(one).collect()
    }

    /// How many numbers the format says of it at an observation: a Q value for each action, the duty of an actor, or the gains.
    pub fn answers(&self) -> usize {
        match &self.head {
            Head::Continuous(_) => 1,
            head => head.outputs(),
        }
    }

    /// Bounds of what it has: of a choice its Q values, of another head its duty.
    pub fn bound(&self, enclosure: &Enclosure) -> Bound {
        let outputs: Vec<_> = self
            .columns
            .clone()
            .map(|column| (enclosure.q_value(column), enclosure.error_bound(column)))
            .collect();
        Bound::of(match (&self.head, outputs.as_slice()) {
            (Head::Continuous(head), [(real, error)]) => vec![actor::duty_bound(head, *real, *error)],
            (Head::Schedule(head), _) => vec![law::duty_bound(head, &outputs)],
            _ => outputs.iter().map(|(_, error)| *error).collect(),
        })
    }

    /// The action that is proven to be greedy among its columns, counted from the first of them; `None` of a head without a choice.
    pub fn decided(&self, enclosure: &Enclosure) -> Option<usize> {
        if !self.head.is_choice() {
            return None;
        }
        let greedy = enclosure.candidate(&self.columns);
        enclosure
            .decides(&self.columns, greedy)
            .then(|| greedy - self.columns.start)
    }
}
