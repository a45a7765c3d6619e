//! What the outputs of the network mean.

use policy::Activation;

use super::literal::Literal;

/// From the network to a duty.
#[derive(Debug, Clone, PartialEq)]
pub enum Head {
    /// Argmax: duty per action.
    Choice(Vec<Literal>),
    /// One output as a number; what makes a duty of it are operations of [`super::Decide`].
    Output {
        /// The curve of [`super::Op::Squash`]; `None` where a clamp stands in its place.
        curve: Option<Activation>,
    },
}

impl Head {
    /// Outputs of the network.
    #[must_use]
    pub fn outputs(&self) -> usize {
        match self {
            Head::Choice(duties) => duties.len(),
            Head::Output { .. } => 1,
        }
    }

    /// Duty per action; none of a continuous head.
    #[must_use]
    pub fn duties(&self) -> &[Literal] {
        match self {
            Head::Choice(duties) => duties,
            Head::Output { .. } => &[],
        }
    }

    /// Whether it is one output.
    #[must_use]
    pub fn is_output(&self) -> bool {
        matches!(self, Head::Output { .. })
    }

    /// The curve that it takes its output through.
    #[must_use]
    pub fn curve(&self) -> Option<Activation> {
        match self {
            Head::Choice(_) => None,
            Head::Output { curve } => *curve,
        }
    }
}
