//! The end of a graph whose outputs are commands: what bounds them, and what scales each.

use policy::Activation;
use toml_input::Message;

use super::model::Node;
use super::{Walk, unknown};
use crate::actor::Squash;

impl Walk<'_> {
    /// Whether the last layer has one output, and something makes a command of it.
    pub(super) fn is_one(&self) -> bool {
        let is_known = self.picked.is_some() || self.gains;
        self.layers.last().is_some_and(|layer| is_known || layer.outputs == 1)
    }

    pub(super) fn is_command(&self) -> bool {
        self.is_one() && self.is_bounded()
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
