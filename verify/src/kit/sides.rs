//! Both sides of each sum of the network, and Q values that are all below 0: what a random run need not come to.
//!
//! An edit of an activation shows where the sum is on the side that it changes, and an argmax that starts at 0 shows where every Q
//! value is below. From the usual place one number after the other is drawn anew, and what leads nearer is kept.

use std::collections::BTreeSet;

use interp::{InputError, Real, Trace};
use policy::Policy;
use random::{Random, SplitMix};

use super::SEED;
use super::course::Course;
use super::place::{Place, Probe};
use crate::traces::Event;

/// Drawn numbers on the way to one side.
// a convention: what is reached at all is reached within some tens on the policies of the tests
const DRAWS: usize = 120;
/// Products of the network that all draws may take together: a second or so of a large network.
const WORK: usize = 100_000_000;
/// Words of these moves, however many sides are left.
// a convention, as is everything that bounds a kit's memory: 10 kB
const MOST_WORDS: usize = 2_500;

/// What is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Side {
    /// The sum of that layer and neuron below 0, or above.
    Sum { layer: usize, neuron: usize, above: bool },
    /// Every Q value of that output below 0.
    AllBelow(usize),
}

impl Side {
    /// Every side of a policy.
    fn all(policy: &Policy) -> Vec<Side> {
        let choices = policy.paths().into_iter().enumerate();
        let choices = choices.filter(|(_, path)| path.columns().len() > 1);
        let of_layer = |(layer, outputs): (usize, usize)| {
            let both = move |neuron| [false, true].map(|above| Side::Sum { layer, neuron, above });
            (0..outputs).flat_map(both)
        };
        let layers = policy.layers.iter().map(|layer| layer.outputs).enumerate();
        choices
            .map(|(output, _)| Side::AllBelow(output))
            .chain(layers.flat_map(of_layer))
            .collect()
    }

    /// How far a step is on that side: above 0 if it is.
    fn distance<T: Real>(self, policy: &Policy, trace: &Trace<T>) -> f64 {
        match self {
            Side::Sum { layer, neuron, above } => {
                let sums = trace.layers.get(layer).map(|layer| &layer.pre_activation);
                let sum = sums.and_then(|sums| sums.get(neuron)).map_or(0.0, |sum| sum.to_f64());
                if above { sum } else { -sum }
            }
            Side::AllBelow(output) => {
                let columns = policy.paths().get(output).map_or(0..0, |path| path.columns());
                let own = trace.q_values.iter().skip(columns.start).take(columns.len());
                -own.map(|q| q.to_f64()).fold(f64::MIN, f64::max)
            }
        }
    }
}

/// The sides that the moves so far have come to.
#[derive(Debug, Default)]
pub struct Sides(BTreeSet<Side>);

impl Sides {
    /// Those of a step.
    pub fn note<T: Real>(&mut self, policy: &Policy, trace: &Trace<T>) {
        // of a step that is not usable nothing shows
        if trace.usable {
            let all = Side::all(policy).into_iter();
            self.0.extend(all.filter(|side| side.distance(policy, trace) > 0.0));
        }
    }
}

impl<T: Real> Course<'_, T> {
    /// A step on each side that no move has come to, as far as one is found.
    pub fn sided(&mut self) -> Result<(), InputError> {
        let policy = self.policy;
        let mut probe = Probe::<T>::new(policy);
        let mut random = SplitMix::new(SEED);
        let products: usize = policy.layers.iter().map(|layer| layer.weights.len()).sum();
        let mut left = WORK / products.max(1);
        let end = self.trace.words().len() + MOST_WORDS;
        for side in Side::all(policy) {
            if self.sides.0.contains(&side) {
                continue;
            }
            if left < DRAWS || self.trace.words().len() > end {
                break;
            }
            left -= DRAWS;
            if let Some(place) = towards(side, policy, &mut probe, &mut random) {
                self.play(Event::Init)?;
                let damage = probe.damage(&place);
                self.put(|state| damage.apply(state));
                self.play(Event::Step(probe.samples(&place)))?;
            }
        }
        Ok(())
    }
}

fn towards<T: Real>(side: Side, policy: &Policy, probe: &mut Probe<'_, T>, random: &mut SplitMix) -> Option<Place> {
    let mut best = Place::default();
    let mut nearest = f64::MIN;
    for _ in 0..DRAWS {
        let knob = random.below(probe.ends().len());
        let place = best.with(knob, probe.value(knob, random));
        let Some(trace) = probe.step(&place) else { continue };
        let distance = side.distance(policy, &trace);
        if trace.usable && distance > 0.0 {
            return Some(place);
        }
        if distance > nearest {
            (best, nearest) = (place, distance);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Counted on the interpreter's own trace of the moves, apart from what led there.
    #[test]
    fn more_sides_are_reached_than_by_the_other_moves() {
        let policy = crate::kit::constructs().unwrap();
        let mut course = Course::<f32>::new(&policy);
        course.directed().unwrap();
        course.damaged().unwrap();
        let before = course.sides.0.len();
        course.sided().unwrap();
        let all = Side::all(&policy);
        let missing: Vec<_> = all.iter().filter(|side| !course.sides.0.contains(side)).collect();
        println!(
            "{before} of {}, then {}: not {missing:?}",
            all.len(),
            course.sides.0.len()
        );
        assert!(course.sides.0.len() > before);
    }
}
