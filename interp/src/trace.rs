//! Everything a step computes, kept for comparison and explanation.

use ndarray::Array1;

use crate::head::Base;
use crate::real::Real;

/// What leaves the controller (contract section 9).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Command<T> {
    /// Duty to apply, 0..1.
    pub duty: T,
    /// Duty before the mapping, of the chosen action or of a continuous head; the fallback duty in a fallback.
    pub duty_sim: T,
    /// Chosen action; always a valid index, not applied in a fallback.
    pub action_index: u32,
    /// Bits of [`crate::status`].
    pub status: u32,
}

/// One feature on its way into the network (contract sections 3 to 5).
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FeatureTrace<T> {
    /// Value of the source expression.
    pub source: T,
    /// Output of every filter, first to last.
    pub filtered: Vec<T>,
    /// After scale and offset.
    pub unclipped: T,
    /// Whether the clip was active.
    pub clipped: bool,
    /// After the clip.
    pub observation: T,
}

impl<T: Real> FeatureTrace<T> {
    /// Output of the last filter, or the source without filters.
    pub fn filter_output(&self) -> T {
        self.filtered.last().copied().unwrap_or(self.source)
    }
}

/// One layer of the network (contract section 6).
#[derive(Debug, Clone, PartialEq)]
pub struct LayerTrace<T> {
    /// `W x + b`, one value per output.
    pub pre_activation: Array1<T>,
    /// The same behind the activation.
    pub post_activation: Array1<T>,
}

/// Every intermediate value of one step, in the order of the contract.
///
/// Shapes depend on the policy alone: one trace can be reused for all steps of a controller.
#[derive(Debug, Clone, PartialEq)]
pub struct Trace<T> {
    /// Measurement in units of the signals, plausible or not (section 2.1).
    pub measured: Vec<T>,
    /// Per signal: within its plausible range (2.2).
    pub valid: Vec<bool>,
    /// Sanitised signals: measured or held (2.3).
    pub signals: Vec<T>,
    /// All signals valid.
    pub all_valid: bool,
    /// Consecutive bad steps, this one included, saturating at K + 1 (2.4).
    pub bad_count: u32,
    /// More than K bad steps.
    pub expired: bool,
    /// The action of this step is applied; otherwise the fallback (2.5).
    pub usable: bool,
    /// The state was one that the controller can have written (1).
    pub sound: bool,
    /// The state was primed on entry.
    pub primed: bool,
    /// Per observer: current in A, voltage and bias in V, and the surplus in A, 0 without a voltage to hold (2b).
    pub estimates: Vec<[T; 4]>,
    /// Per feature (3 to 5).
    pub features: Vec<FeatureTrace<T>>,
    /// Input of the network, one value per feature (5).
    pub observation: Array1<T>,
    /// Per layer (6).
    pub layers: Vec<LayerTrace<T>>,
    /// What the law of a residual head (8) or the base of a gain schedule (7c) says; 0 and not still of any other.
    pub base: Base<T>,
    /// What the gains of a gain schedule are multiplied with, 1 where that is nothing (7c); empty of any other head.
    pub factors: Vec<T>,
    /// Output of the network: one value per action or gain, or the one of a continuous head.
    pub q_values: Array1<T>,
    /// Greedy action (7); 0 of a continuous head (7b) and a gain schedule (7c).
    pub action_index: u32,
    /// Entry of the action table (8), the law's duty with what is added to it (8), or the duty of a continuous head (7b).
    pub duty_sim: T,
    /// After the mapping; equal to `duty_sim` without one (8).
    pub mapped: T,
    /// After the slew limit, if any (9.1).
    pub slewed: T,
    /// After the soft start, if any (9.2).
    pub soft_started: T,
    /// After the duty limits (9.3).
    pub limited: T,
    /// The bits 3 to 7 that apply to the computation, also where a fallback suppresses them in the command.
    pub computed_status: u32,
    /// What leaves the controller.
    pub command: Command<T>,
    /// The same of several outputs, without the first (9b); empty where there is one.
    pub others: Vec<Decision<T>>,
}

/// From the network to a command, of one output of several; the fields are those of [`Trace`].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Decision<T> {
    /// Greedy action.
    pub action_index: u32,
    /// Duty before the mapping.
    pub duty_sim: T,
    /// After the mapping.
    pub mapped: T,
    /// After the slew limit.
    pub slewed: T,
    /// After the soft start.
    pub soft_started: T,
    /// After the duty limits.
    pub limited: T,
    /// What leaves the controller; its status is that of all outputs.
    pub command: Command<T>,
}

impl<T: Copy> Trace<T> {
    /// What was decided for the output of that index; for the first where there is no such one.
    pub fn decision(&self, index: usize) -> Decision<T> {
        let other = index.checked_sub(1).and_then(|index| self.others.get(index));
        other.copied().unwrap_or(Decision {
            action_index: self.action_index,
            duty_sim: self.duty_sim,
            mapped: self.mapped,
            slewed: self.slewed,
            soft_started: self.soft_started,
            limited: self.limited,
            command: self.command,
        })
    }

    /// Replaces what was decided for the output of that index.
    pub fn set_decision(&mut self, index: usize, to: Decision<T>) {
        match index.checked_sub(1) {
            None => {
                (self.action_index, self.duty_sim) = (to.action_index, to.duty_sim);
                (self.mapped, self.slewed, self.soft_started) = (to.mapped, to.slewed, to.soft_started);
                (self.limited, self.command) = (to.limited, to.command);
            }
            Some(index) => {
                if let Some(other) = self.others.get_mut(index) {
                    *other = to;
                }
            }
        }
    }

    /// What leaves the controller, output by output.
    pub fn commands(&self) -> impl Iterator<Item = Command<T>> {
        std::iter::once(self.command).chain(self.others.iter().map(|other| other.command))
    }
}
