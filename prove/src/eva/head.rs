//! What the head of a policy means for a driver.

use policy::{Activation, Head, Squash};

use super::driver::Writer;

/// What the network hands on to the command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Answer {
    /// The index of an action.
    Index,
    /// One number.
    Output,
    /// So many numbers.
    Gains(usize),
}

/// Whether a head makes a NaN of a NaN: a clip does, a curve by masks does not.
pub(super) fn passes_nan(head: &Head) -> bool {
    let passes = |squash: Squash| matches!(squash, Squash::Clip(_) | Squash::Curve(Activation::Softsign));
    match head {
        Head::Choice(_) | Head::Residual(_) => false,
        Head::Several(outputs) => outputs.iter().any(|output| passes_nan(&output.head)),
        Head::Continuous(head) => passes(head.squash),
        Head::Schedule(head) => head.gains.iter().any(|gain| gain.squash.is_none_or(passes)),
    }
}

/// Whether a law of control reads the state, beside what the network says.
pub(super) fn reads_state(head: &Head) -> bool {
    matches!(head, Head::Residual(_) | Head::Schedule(_))
}

impl Writer<'_> {
    /// Whether something is made of an output before anything bounds it.
    pub fn takes_output_as_it_is(&self) -> bool {
        let gains = self.policy.head.schedule().map_or(&[][..], |head| &head.gains);
        gains.iter().any(|gain| gain.squash.is_none())
    }

    /// What the network hands on to the command.
    pub fn answer(&self) -> Answer {
        match &self.policy.head {
            Head::Choice(_) | Head::Residual(_) => Answer::Index,
            Head::Several(_) => Answer::Gains(self.policy.outputs()),
            Head::Continuous(_) => Answer::Output,
            Head::Schedule(head) => Answer::Gains(head.gains.len()),
        }
    }
}
