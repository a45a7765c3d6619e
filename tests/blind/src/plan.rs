//! What is hidden in which case: all of it follows from the seed and the case's index.

use crate::bench::Bench;
use crate::effects::{EFFECTS, Effect, effect, listed_effects};
use crate::experiment::{self, Extent, Record};
use crate::rng::Rng;

/// What kind of case it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// Nothing is hidden.
    None,
    /// One listed effect.
    Single,
    /// Two listed effects.
    Pair,
    /// One effect of nobody's list.
    Unlisted,
    /// One listed effect, too small to matter.
    Small,
}

/// A case before it is measured.
#[derive(Debug)]
pub struct Plan {
    /// Seed of the set.
    pub seed: u64,
    /// Number in the set.
    pub index: usize,
    /// Kind.
    pub kind: Kind,
    /// What is hidden.
    pub effects: Vec<&'static Effect>,
    /// The bench with it.
    pub bench: Bench,
    /// What is done at the bench.
    pub records: Vec<Record>,
    /// The measured input voltage is recorded.
    pub has_v_in: bool,
}

/// Eight cases in a row: two without effect, four single, an unlisted one, and in turn a pair or a small one.
const ROUND: [Kind; 8] = [
    Kind::Single,
    Kind::None,
    Kind::Single,
    Kind::Unlisted,
    Kind::Single,
    Kind::None,
    Kind::Pair,
    Kind::Single,
];

/// Case `index` of the set `seed`. Every cause comes before one comes twice.
#[must_use]
pub fn plan(seed: u64, index: usize, extent: Extent) -> Plan {
    let round = index / ROUND.len();
    let mut order = ROUND;
    Rng::new(seed, &[1, round as u64]).shuffle(&mut order);
    let place = index % ROUND.len();
    let mut kind = order[place];
    if kind == Kind::Pair && round % 3 == 2 {
        kind = Kind::Small;
    }
    let before = order[..place].iter().filter(|&&other| other == order[place]).count();
    let singles = ROUND.iter().filter(|&&k| k == Kind::Single).count();
    let effects = match kind {
        Kind::None => Vec::new(),
        Kind::Single => dealt(seed, true, round * singles + before),
        Kind::Unlisted => dealt(seed, false, round),
        Kind::Small => dealt(seed, true, 7 * index + 3),
        Kind::Pair => pair(seed, index),
    };
    planned(seed, index, kind, effects, extent)
}

/// A case with these effects, or `None` where an id is unknown; an empty list is a case without effect.
#[must_use]
pub fn plan_of(seed: u64, index: usize, ids: &[&str], extent: Extent) -> Option<Plan> {
    let effects: Vec<_> = ids.iter().map(|id| effect(id)).collect::<Option<_>>()?;
    let kind = match effects[..] {
        [] => Kind::None,
        [one] if one.listed => Kind::Single,
        [_] => Kind::Unlisted,
        _ => Kind::Pair,
    };
    Some(planned(seed, index, kind, effects, extent))
}

fn planned(seed: u64, index: usize, kind: Kind, effects: Vec<&'static Effect>, extent: Extent) -> Plan {
    let mut rng = Rng::new(seed, &[2, index as u64]);
    let records = experiment::draw(extent, &mut rng);
    let has_v_in = !rng.chance(0.2) && !effects.iter().any(|effect| effect.hides_v_in);
    let mut bench = Bench::nominal();
    let scale = if kind == Kind::Small { 0.01 } else { 1.0 };
    for effect in &effects {
        effect.hide(&mut bench, scale, &mut rng);
    }
    Plan {
        seed,
        index,
        kind,
        effects,
        bench,
        records,
        has_v_in,
    }
}

/// The `nth` card of the endlessly reshuffled effects.
fn dealt(seed: u64, listed: bool, nth: usize) -> Vec<&'static Effect> {
    let mut deck: Vec<_> = EFFECTS.iter().filter(|effect| effect.listed == listed).collect();
    let turn = nth / deck.len();
    Rng::new(seed, &[3, u64::from(listed), turn as u64]).shuffle(&mut deck);
    vec![deck[nth % deck.len()]]
}

fn pair(seed: u64, index: usize) -> Vec<&'static Effect> {
    let mut deck: Vec<_> = listed_effects().collect();
    Rng::new(seed, &[4, index as u64]).shuffle(&mut deck);
    deck.truncate(2);
    deck
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forty_eight_cases_hold_every_kind_and_every_cause() {
        for seed in [1, 77] {
            let plans: Vec<_> = (0..48).map(|index| plan(seed, index, Extent::Full)).collect();
            let count = |kind| plans.iter().filter(|plan| plan.kind == kind).count();
            assert_eq!(count(Kind::None), 12);
            assert_eq!(count(Kind::Single), 24);
            assert_eq!(count(Kind::Pair), 4);
            assert_eq!(count(Kind::Small), 2);
            assert_eq!(count(Kind::Unlisted), 6);
            let single = plans.iter().filter(|plan| plan.kind == Kind::Single);
            let mut ids: Vec<_> = single.map(|plan| plan.effects[0].id).collect();
            ids.sort_unstable();
            ids.dedup();
            assert_eq!(ids.len(), 24);
        }
    }

    #[test]
    fn kind_does_not_show_in_the_index() {
        let kinds = |seed| {
            (0..8)
                .map(|index| plan(seed, index, Extent::Full).kind)
                .collect::<Vec<_>>()
        };
        assert_ne!(kinds(1), kinds(2));
    }
}
