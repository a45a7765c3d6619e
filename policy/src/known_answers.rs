//! What the trainer says that its network answers.

use crate::model::NumericFormat;

/// Known answers from the trainer: observation in, Q values and action out.
#[derive(Debug, Clone, PartialEq)]
pub struct Golden {
    /// Number of vectors.
    pub count: usize,
    /// Vectors of the file that are left out, because the controller can never see their observation.
    pub outside: usize,
    /// Row-major `[count][features]`.
    pub observations: Vec<f32>,
    /// Row-major `[count][outputs]`; may be empty if the trainer gave actions or duties only.
    pub q_values: Vec<f32>,
    /// `[count]`; empty if the trainer gave Q values only, and for a continuous head.
    pub action_indices: Vec<u32>,
    /// `[count]`: what a continuous head or a gain schedule makes of the observation; empty for a choice, or if the trainer gave
    /// outputs only.
    pub duties: Vec<f32>,
    /// Row-major `[count][1 + gains]`: base and factors of a gain schedule, as far as the observation tells them; NaN in rows where
    /// a clip hides one. Empty of any other head, and without duties.
    pub law: Vec<f64>,
    /// What the trainer made of each of several outputs, in their order; empty where there is one, whose answers stand above.
    pub outputs: Vec<OutputAnswers>,
    /// Allowed |Q - golden| relative to the largest |Q| of the vector; for a continuous head the allowed error of its duty,
    /// and for a gain schedule of each gain and of the duty, as a share of its range.
    pub tolerance: f64,
    /// Share of the vectors, 0..1, whose action the numeric format may change; `None` if the contract does not say.
    pub decisions: Option<f64>,
    /// Largest error of the duty of a continuous head, or of a gain, as a share of its range, that the numeric format may cause;
    /// `None` if the contract does not say.
    pub duty_error: Option<f64>,
}

/// What the trainer made of one output of several.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct OutputAnswers {
    /// `[count]` of a choice; empty of a continuous output, or if the trainer gave the last layer only.
    pub action_indices: Vec<u32>,
    /// `[count]` of a continuous output; empty of a choice, or if the trainer gave the last layer only.
    pub duties: Vec<f32>,
}

/// `golden_tolerance` of a contract that does not say it.
// a tolerance and not bits, because trainers add in an order of their own
pub(crate) const TOLERANCE: f64 = 1e-5;

impl Golden {
    /// The answers of one output of several as those of a contract with it alone: its columns of the last layer, and what the trainer
    /// made of it.
    #[must_use]
    pub fn of_output(&self, index: usize, columns: &std::ops::Range<usize>) -> Self {
        let width = self.q_values.len() / self.count.max(1);
        let own = self.outputs.get(index).cloned().unwrap_or_default();
        let cut = |row: &[f32]| row.get(columns.clone()).unwrap_or_default().to_vec();
        Golden {
            q_values: self.q_values.chunks_exact(width.max(1)).flat_map(cut).collect(),
            action_indices: own.action_indices,
            duties: own.duties,
            outputs: Vec::new(),
            ..self.clone()
        }
    }

    /// Share of the vectors whose action the format may change: what the contract says; otherwise none for real formats,
    /// which compute the trainer's network, and 2 % for integers, whose rounding is a choice to look at.
    #[must_use]
    pub fn allowed_changes(&self, format: NumericFormat) -> f64 {
        /// What is left with scales from the operating range and 64-bit sums: the best that 16 bits were seen to do.
        const INTEGER: f64 = 0.02;
        let usual = if format.is_integer() { INTEGER } else { 0.0 };
        self.decisions.unwrap_or(usual)
    }

    /// Error of the duty of a continuous head, or of a gain, as a share of its range, that the format may cause: what the contract says;
    /// otherwise the tolerance for real formats, which compute the trainer's network, and a thousandth for integers.
    #[must_use]
    pub fn allowed_duty_error(&self, format: NumericFormat) -> f64 {
        /// A step of a 10-bit pulse width over the head's range.
        const INTEGER: f64 = 1e-3;
        let usual = if format.is_integer() { INTEGER } else { self.tolerance };
        self.duty_error.unwrap_or(usual)
    }
}
