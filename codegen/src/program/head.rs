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
    /// All outputs as numbers, some columns for each of several duties.
    Several {
        /// In the order of the duties.
        parts: Vec<HeadPart>,
        /// The curve that each column is taken through, if any.
        curves: Vec<Option<Activation>>,
    },
}

/// What decides one of several duties.
#[derive(Debug, Clone, PartialEq)]
pub struct HeadPart {
    /// First column.
    pub column: usize,
    /// Duty per action; none where one column is a number.
    pub duties: Vec<Literal>,
}

impl HeadPart {
    /// Whether argmax decides.
    #[must_use]
    pub fn is_choice(&self) -> bool {
        !self.duties.is_empty()
    }

    /// Name of the table of duties of the part of that index.
    #[must_use]
    pub fn table(index: usize) -> String {
        format!("duties{index}")
    }
}

impl Head {
    /// Outputs of the network.
    #[must_use]
    pub fn outputs(&self) -> usize {
        match self {
            Head::Choice(duties) => duties.len(),
            Head::Output { .. } => 1,
            Head::Gains { curves } | Head::Several { curves, .. } => curves.len(),
        }
    }

    /// Duty per action; none of a head without a choice.
    #[must_use]
    pub fn duties(&self) -> &[Literal] {
        match self {
            Head::Choice(duties) => duties,
            Head::Output { .. } | Head::Gains { .. } | Head::Several { .. } => &[],
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

    /// Whether all outputs are handed on to the command as they are.
    #[must_use]
    pub fn hands_on_all(&self) -> bool {
        matches!(self, Head::Gains { .. } | Head::Several { .. })
    }

    /// What decides each of several duties; nothing where there is one.
    #[must_use]
    pub fn parts(&self) -> &[HeadPart] {
        match self {
            Head::Several { parts, .. } => parts,
            Head::Choice(_) | Head::Output { .. } | Head::Gains { .. } => &[],
        }
    }

    /// The curves that it takes its outputs through.
    #[must_use]
    pub fn curves(&self) -> &[Option<Activation>] {
        match self {
            Head::Choice(_) => &[],
            Head::Output { curve } => std::slice::from_ref(curve),
            Head::Gains { curves } | Head::Several { curves, .. } => curves,
        }
    }

    /// The curve that it takes the output of that index through.
    #[must_use]
    pub fn curve(&self, output: usize) -> Option<Activation> {
        *self.curves().get(output)?
    }
}
