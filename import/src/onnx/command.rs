//! The end of a graph whose outputs are commands: what bounds them, and what scales each.

use policy::Activation;
use policy::limits::MAX_OUTPUTS;
use toml_input::Message;

use super::Walk;
use super::model::Node;
use super::words::{other, unknown};
use crate::actor::{self, Actor, Duty, Squash};

/// What the outputs of a graph command.
pub(super) struct Commands {
    /// The one duty.
    pub one: Option<Actor>,
    /// Each, where they are gains.
    pub gains: Vec<Actor>,
    /// Each, where each is a duty of its own.
    pub several: Vec<Duty>,
}

impl Walk<'_> {
    /// Bounds are those of commands, a choice is one among actions: side by side they say two things.
    pub(super) fn no_choice_behind(&self, actor: Option<Actor>) -> Result<(), Message> {
        match (actor, &self.ended) {
            (Some(_), Some(end)) if self.is_several() => Err(other(
                "the outputs are bounded as commands are, and a choice stands behind them",
                end,
                "commands, or values of actions",
            )),
            _ => Ok(()),
        }
    }

    /// The commands, each with its own scale and offset.
    pub(super) fn commands(&self, actor: Option<Actor>) -> Commands {
        let of = |output: usize| {
            actor.map(|actor| Actor {
                affine: Some(actor::scaled(self.affine_of(output))),
                ..actor
            })
        };
        let each = (0..self.outputs()).filter_map(of);
        let mut commands = Commands {
            one: None,
            gains: Vec::new(),
            several: Vec::new(),
        };
        if self.is_several() {
            commands.several = each.map(Duty::Command).collect();
            return commands;
        }
        if self.gains {
            commands.gains = each.collect();
        }
        commands.one = of(self.picked.unwrap_or(0));
        commands
    }

    /// Whether the last layer has no more outputs than a contract has duties, or somebody said what they are.
    pub(super) fn is_few(&self) -> bool {
        let is_known = self.picked.is_some() || self.gains;
        self.layers
            .last()
            .is_some_and(|layer| is_known || layer.outputs <= MAX_OUTPUTS)
    }

    pub(super) fn is_command(&self) -> bool {
        self.is_few() && self.is_bounded()
    }

    /// Whether each of several outputs is a duty of its own.
    pub(super) fn is_several(&self) -> bool {
        self.outputs() > 1 && self.picked.is_none() && !self.gains
    }

    /// Whether a clip or a curve with two ends stands behind the last layer.
    pub(super) fn is_bounded(&self) -> bool {
        let is_curve = |last: Activation| Squash::curve(last).is_some();
        self.cut.is_some() || self.activations.last().copied().flatten().is_some_and(is_curve)
    }

    pub(super) fn outputs(&self) -> usize {
        self.layers.last().map_or(0, |layer| layer.outputs)
    }

    /// What scales a command, or each of several.
    pub(super) fn behind_command(&mut self, node: &Node, steps: &[(f64, f64)]) -> Result<(), Message> {
        let outputs = self.outputs();
        let before = self.scaled.take().unwrap_or_else(|| vec![(1.0, 0.0)]);
        let count = before.len().max(steps.len());
        let fits = [before.len(), steps.len()].iter().all(|n| *n == 1 || *n == count);
        if !(fits && (count == 1 || count == outputs)) {
            return Err(unknown(node));
        }
        let at = |list: &[(f64, f64)], index: usize| list.get(index.min(list.len() - 1)).copied().unwrap_or((1.0, 0.0));
        let both = (0..count).map(|index| {
            let ((own, offset), (scale, shift)) = (at(&before, index), at(steps, index));
            (own * scale, offset * scale + shift)
        });
        self.scaled = Some(both.collect());
        Ok(())
    }

    /// Scale and offset of the command of that index.
    pub(super) fn affine_of(&self, output: usize) -> Option<(f64, f64)> {
        let scaled = self.scaled.as_ref()?;
        scaled.get(output.min(scaled.len().checked_sub(1)?)).copied()
    }
}
