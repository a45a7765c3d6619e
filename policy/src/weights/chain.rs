//! Which layers in which order form the network: the chain of dense layers from features to actions.
//!
//! ```text
//!   q_net.0 (6 -> 64)   q_net.2 (64 -> 64)   q_net.4 (64 -> 12)      candidates: groups by name, then orders by width
//!   target.0  ...                                                     target networks only if nothing else fits
//!
//!   features = 6 ─► 0 ─► 64 ─► 2 ─► 64 ─► 4 ─► 12 = actions           a path that uses every layer of its group once
//! ```
//!
//! One chain is the answer. None and several are faults: a chain that fits by accident would compute something else.

use std::collections::{BTreeMap, BTreeSet};

use super::layers::{Dense, Place, ancestors, is_target};
use crate::limits::{MAX_LAYERS, MIN_ACTIONS};

/// Sizes the chain must have; `None` fits anything.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ends {
    pub inputs: Option<usize>,
    pub outputs: Option<usize>,
}

/// Orders looked at before a group counts as undecided.
// more than the two that show a doubt: one of them may be the order in which numbers come first
const MOST_ORDERS: usize = 16;

/// Indices of layers, first to last.
pub(crate) type Chain = Vec<usize>;

/// All chains that use every layer of some natural group: numbered siblings, a folder, or the whole file. Target
/// networks count only if nothing else fits; the second value lists those passed over.
pub(crate) fn candidates(layers: &[Dense], ends: Ends) -> (Vec<Chain>, Vec<usize>) {
    // training keeps a target network of the same shape beside each: with both, every file would be ambiguous
    let (targets, own): (Vec<usize>, Vec<usize>) = (0..layers.len()).partition(|&i| is_target(&layers[i].stem));
    let chains = chains_of(layers, &own, ends);
    if !chains.is_empty() || targets.is_empty() {
        return (chains, targets);
    }
    let all: Vec<usize> = (0..layers.len()).collect();
    (chains_of(layers, &all, ends), Vec::new())
}

fn chains_of(layers: &[Dense], members: &[usize], ends: Ends) -> Vec<Chain> {
    let mut chains: Vec<Chain> = Vec::new();
    for group in groups(layers, members) {
        for chain in orders(layers, &group, ends) {
            // a single output leaves nothing to choose: a value net beside the policy, unless the contract asks for one
            let is_asked = ends.outputs == Some(1);
            let chooses = chain.last().is_some_and(|&last| layers[last].outputs >= MIN_ACTIONS);
            if (chooses || is_asked) && !chains.contains(&chain) {
                chains.push(chain);
            }
        }
    }
    chains
}

/// Sets of layers that belong together by name, the narrow ones first.
fn groups(layers: &[Dense], members: &[usize]) -> Vec<Vec<usize>> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    let mut add = |group: Vec<usize>| {
        if !group.is_empty() && group.len() <= MAX_LAYERS && !groups.contains(&group) {
            groups.push(group);
        }
    };
    let families: BTreeSet<_> = members.iter().map(|&i| Place::of(&layers[i].stem).family).collect();
    for family in families {
        add(members
            .iter()
            .copied()
            .filter(|&i| Place::of(&layers[i].stem).family == family)
            .collect());
    }
    let folders: BTreeSet<_> = members.iter().flat_map(|&i| ancestors(&layers[i].stem)).collect();
    // a folder sorts before what lies in it: backwards the inner ones come first
    for folder in folders.into_iter().rev() {
        add(members
            .iter()
            .copied()
            .filter(|&i| ancestors(&layers[i].stem).any(|a| a == folder))
            .collect());
    }
    groups
}

/// Orders in which all of `group` join up; two are enough to know that shapes and numbers do not decide.
pub(crate) fn orders(layers: &[Dense], group: &[usize], ends: Ends) -> Vec<Chain> {
    if !balanced(layers, group, ends) {
        return Vec::new();
    }
    let mut search = Search {
        layers,
        group,
        ends,
        path: Vec::new(),
        found: Vec::new(),
    };
    search.extend(ends.inputs);
    let natural = |chain: &&Chain| numbered_first(layers, chain);
    match search.found.iter().filter(natural).collect::<Vec<_>>().as_slice() {
        // exactly one order is the natural one: `fc1`, `fc2`, `out`, and not `out` in the middle
        [only] => vec![(*only).clone()],
        _ => search.found,
    }
}

/// Whether the order is the one that the names suggest: `fc1`, `fc2`, then `out`.
fn numbered_first(layers: &[Dense], chain: &Chain) -> bool {
    let numbered = chain.iter().map(|&i| Place::of(&layers[i].stem).number.is_some());
    let numbered: Vec<bool> = numbered.collect();
    numbered.iter().any(|&n| n) && numbered.is_sorted_by(|a, b| a >= b)
}

/// Whether widths match up as in a path: each is left as often as it is entered, the ends apart. Without this the
/// search below would try all orders of layers that can never join.
fn balanced(layers: &[Dense], group: &[usize], ends: Ends) -> bool {
    let mut balance: BTreeMap<usize, i64> = BTreeMap::new();
    for layer in group.iter().map(|&i| &layers[i]) {
        *balance.entry(layer.outputs).or_default() += 1;
        *balance.entry(layer.inputs).or_default() -= 1;
    }
    let open = ends.inputs.is_none() || ends.outputs.is_none();
    ends.inputs
        .into_iter()
        .for_each(|n| *balance.entry(n).or_default() += 1);
    ends.outputs
        .into_iter()
        .for_each(|n| *balance.entry(n).or_default() -= 1);
    // with an unknown end a width may be left over on either side
    open || balance.values().all(|&n| n == 0)
}

struct Search<'a> {
    layers: &'a [Dense],
    group: &'a [usize],
    ends: Ends,
    path: Chain,
    found: Vec<Chain>,
}

impl Search<'_> {
    fn extend(&mut self, inputs: Option<usize>) {
        if self.path.len() == self.group.len() {
            self.found.push(self.path.clone());
            return;
        }
        let last = self.path.len() + 1 == self.group.len();
        for &next in self.group {
            let layer = &self.layers[next];
            let joins = inputs.is_none_or(|n| n == layer.inputs);
            let ends = !last || self.ends.outputs.is_none_or(|n| n == layer.outputs);
            // nine equal layers have 362,880 orders
            if self.found.len() < MOST_ORDERS
                && joins
                && ends
                && !self.path.contains(&next)
                && self.is_next_sibling(next)
            {
                self.path.push(next);
                self.extend(Some(layer.outputs));
                self.path.pop();
            }
        }
    }

    /// Numbered siblings keep their order.
    fn is_next_sibling(&self, next: usize) -> bool {
        let place = Place::of(&self.layers[next].stem);
        self.group.iter().filter(|i| !self.path.contains(i)).all(|&other| {
            let rival = Place::of(&self.layers[other].stem);
            rival.family != place.family || rival.number >= place.number
        })
    }
}
