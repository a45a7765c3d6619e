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
    /// All outputs as numbers, the gains of a law; what makes a duty of them are operations of [`super::Decide`].
    Gains {
        /// The curve that each is taken through, if any.
        curves: Vec<Option<Activation>>,
    },
}

impl Head {
    /// Outputs of the network.
    #[must_use]
    pub fn outputs(&self) -> usize {
        match self {
            Head::Choice(duties) => duties.len(),
            Head::Output { .. } => 1,
            Head::Gains { curves } => curves.len(),
        }
    }

    /// Duty per action; none of a head without a choice.
    #[must_use]
    pub fn duties(&self) -> &[Literal] {
        match self {
            Head::Choice(duties) => duties,
            Head::Output { .. } | Head::Gains { .. } => &[],
        }
    }

    /// Whether it is one output.
    #[must_use]
    pub fn is_output(&self) -> bool {
        matches!(self, Head::Output { .. })
    }

    /// Whether argmax decides.
    #[must_use]
    pub fn is_choice(&self) -> bool {
        matches!(self, Head::Choice(_))
    }

    /// Whether the outputs are gains.
    #[must_use]
    pub fn is_gains(&self) -> bool {
        matches!(self, Head::Gains { .. })
    }

    /// The curves that it takes its outputs through.
    #[must_use]
    pub fn curves(&self) -> &[Option<Activation>] {
        match self {
            Head::Choice(_) => &[],
            Head::Output { curve } => std::slice::from_ref(curve),
            Head::Gains { curves } => curves,
        }
    }

    /// The curve that it takes the output of that index through.
    #[must_use]
    pub fn curve(&self, output: usize) -> Option<Activation> {
        *self.curves().get(output)?
    }
}
