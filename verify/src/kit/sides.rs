//! Both sides of each bend of an activation, each action that wins, and Q values that are all below 0: what a random run need not
//! come to.
//!
//! ```text
//! sums     an observation on that side, within its bounds or beyond ─► the network alone
//! argmax   a sound state and a measurement                          ─► a step
//! ```
//!
//! An edit of an activation shows where the sum is on the side that it changes, if what the neuron gives comes to a Q value from there. An
//! argmax that starts at 0 shows where every Q value is below 0 and another one than the first wins. From the usual place one number
//! after the other is drawn anew, and what leads nearer is kept.

use std::collections::BTreeSet;

use interp::{InputError, LayerTrace, Real, Trace};
use policy::{Activation, Interval, Policy};
use random::{Random, SplitMix};

use super::SEED;
use super::course::Course;
use super::place::{Place, Probe};
use crate::traces::Event;

/// Drawn numbers on the way to one side of a sum.
// a convention: what is reached at all is reached within some tens on the policies of the tests
const DRAWS: usize = 240;
/// Drawn numbers on the way to what an argmax is to show.
// a sound state holds less than an observation may be: more of them are needed
const DRAWS_OF_ARGMAX: usize = 1200;
/// Products of the network that all draws may take together: a second or so of a large network.
const WORK: usize = 100_000_000;
/// Words of these moves, however many sides are left.
// a convention, as is everything that bounds a kit's memory: 10 kB
const MOST_WORDS: usize = 2_500;
/// How far an observation goes beyond its bounds where nothing within them leads to a side.
const STRETCHES: [f64; 3] = [1.0, 8.0, 64.0];
/// Numbers of a network beyond this may end as no number, of which the contract does not say which.
const LARGEST: f64 = 1e30;

/// What is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Side {
    /// Every Q value of that output below 0, and another one than the first wins.
    AllBelow(usize),
    /// That action of that output wins.
    Wins { output: usize, action: usize },
    /// The sum of that layer and neuron below a bend of its activation, or above, and what it gives comes to a Q value.
    Sum {
        layer: usize,
        neuron: usize,
        bend: usize,
        above: bool,
    },
}

/// Sums at which an activation changes its course.
fn bends(activation: Activation) -> &'static [f64] {
    match activation {
        Activation::Identity => &[],
        Activation::HardSigmoid | Activation::HardSwish => &[-3.0, 3.0],
        _ => &[0.0],
    }
}

/// Whether the activation gives more for more at that sum, or less.
fn passes(activation: Activation, sum: f64) -> bool {
    match activation {
        Activation::Relu => sum > 0.0,
        Activation::HardSigmoid => (-3.0..3.0).contains(&sum),
        Activation::HardSwish => sum > -3.0,
        _ => true,
    }
}

/// Of each layer the neurons whose numbers come to an output of the network: through weights other than 0 and neurons that pass.
fn shown<T: Real>(policy: &Policy, layers: &[LayerTrace<T>]) -> Vec<Vec<bool>> {
    let mut behind: Vec<bool> = policy.layers.last().map_or(Vec::new(), |last| vec![true; last.outputs]);
    let mut all = vec![behind.clone()];
    for (layer, trace) in policy.layers.iter().zip(layers).skip(1).rev() {
        let passed = behind.iter().zip(&trace.pre_activation);
        let passed: Vec<bool> = passed
            .map(|(shown, sum)| *shown && passes(layer.activation, sum.to_f64()))
            .collect();
        let reaches =
            |input: usize| (0..layer.outputs).any(|o| passed[o] && layer.weights[o * layer.inputs + input] != 0.0);
        behind = (0..layer.inputs).map(reaches).collect();
        all.push(behind.clone());
    }
    all.reverse();
    all
}

/// How far that sum is on a side of a bend: above 0 if it is.
fn beyond<T: Real>(policy: &Policy, layers: &[LayerTrace<T>], layer: usize, neuron: usize, bend: usize) -> f64 {
    let sum = layers.get(layer).and_then(|trace| trace.pre_activation.get(neuron));
    let activation = policy.layers.get(layer).map(|layer| layer.activation);
    let at = activation.and_then(|activation| bends(activation).get(bend));
    sum.zip(at).map_or(0.0, |(sum, at)| sum.to_f64() - at)
}

impl Side {
    /// Every side of a policy; those of the sums last, from the first layer on.
    fn all(policy: &Policy) -> Vec<Side> {
        let mut all = Vec::new();
        for (output, path) in policy.paths().into_iter().enumerate() {
            let actions = path.columns().len();
            if path.head.actions().len() == actions && actions > 1 {
                all.push(Side::AllBelow(output));
                all.extend((0..actions).map(|action| Side::Wins { output, action }));
            }
        }
        for (layer, own) in policy.layers.iter().enumerate() {
            for neuron in 0..own.outputs {
                let bends = 0..bends(own.activation).len();
                all.extend(bends.flat_map(|bend| {
                    [false, true].map(|above| Side::Sum {
                        layer,
                        neuron,
                        bend,
                        above,
                    })
                }));
            }
        }
        all
    }

    /// How far the layers are on that side of a sum: above 0 if they are, and the sum shows.
    fn of_sum<T: Real>(self, policy: &Policy, layers: &[LayerTrace<T>]) -> Option<f64> {
        let Side::Sum {
            layer,
            neuron,
            bend,
            above,
        } = self
        else {
            return None;
        };
        let beyond = beyond(policy, layers, layer, neuron, bend);
        let distance = if above { beyond } else { -beyond };
        let is_shown = || shown(policy, layers).get(layer).is_some_and(|own| own[neuron]);
        // one that does not show is as good as one just before the side
        Some(if distance > 0.0 && !is_shown() { 0.0 } else { distance })
    }

    /// How far a step is there: above 0 if it is.
    fn of_step<T: Real>(self, policy: &Policy, trace: &Trace<T>) -> Option<f64> {
        let columns = |output: usize| policy.paths().get(output).map(|path| path.columns());
        let values = |output: usize| -> Option<Vec<f64>> {
            let columns = columns(output)?;
            let own = trace.q_values.iter().skip(columns.start).take(columns.len());
            Some(own.map(|q| q.to_f64()).collect())
        };
        let highest = |values: &[f64], but: usize| {
            let others = values.iter().enumerate().filter(|(at, _)| *at != but);
            others.map(|(_, q)| *q).fold(f64::MIN, f64::max)
        };
        match self {
            Side::AllBelow(output) => {
                let values = values(output)?;
                let others = highest(&values, 0);
                Some((others - values.first()?).min(-others))
            }
            Side::Wins { output, action } => {
                let values = values(output)?;
                Some(values.get(action)? - highest(&values, action))
            }
            Side::Sum { .. } => None,
        }
    }
}

/// The sides that the moves so far have come to.
#[derive(Debug, Default)]
pub struct Sides(BTreeSet<Side>);

impl Sides {
    /// Those of a step.
    pub fn note<T: Real>(&mut self, policy: &Policy, trace: &Trace<T>) {
        // the network runs and is compared in any case, and what wins shows where the step is usable
        self.note_layers(policy, &trace.layers);
        if trace.usable {
            let new = |side: &Side| side.of_step(policy, trace).is_some_and(|distance| distance > 0.0);
            self.0.extend(Side::all(policy).into_iter().filter(new));
        }
    }

    /// Those of the network alone.
    pub fn note_layers<T: Real>(&mut self, policy: &Policy, layers: &[LayerTrace<T>]) {
        let shown = shown(policy, layers);
        for (layer, own) in policy.layers.iter().enumerate() {
            for neuron in (0..own.outputs).filter(|neuron| shown.get(layer).is_some_and(|own| own[*neuron])) {
                for bend in 0..bends(own.activation).len() {
                    let beyond = beyond(policy, layers, layer, neuron, bend);
                    if beyond != 0.0 {
                        self.0.insert(Side::Sum {
                            layer,
                            neuron,
                            bend,
                            above: beyond > 0.0,
                        });
                    }
                }
            }
        }
    }
}

/// How much is left to look for.
struct Left {
    draws: usize,
    /// Words of the moves at which no more are made.
    end: usize,
}

impl<T: Real> Course<'_, T> {
    fn left(&self) -> Left {
        let products: usize = self.policy.layers.iter().map(|layer| layer.weights.len()).sum();
        Left {
            draws: WORK / products.max(1),
            end: self.trace.words().len() + MOST_WORDS,
        }
    }

    /// The sides of the argmax that no move has come to, each by a step if one is found.
    pub fn sided(&mut self) -> Result<(), InputError> {
        let policy = self.policy;
        let mut probe = Probe::<T>::new(policy);
        let mut random = SplitMix::new(SEED);
        let mut left = self.left();
        for side in Side::all(policy) {
            let is_of_sum = matches!(side, Side::Sum { .. });
            if is_of_sum || self.sides.0.contains(&side) {
                continue;
            }
            if left.draws < DRAWS_OF_ARGMAX || self.trace.words().len() > left.end {
                break;
            }
            left.draws -= DRAWS_OF_ARGMAX;
            if let Some(place) = towards(side, policy, &mut probe, &mut random) {
                self.play(Event::Init)?;
                let damage = probe.damage(&place);
                self.put(|state| damage.apply(state));
                self.play(Event::Step(probe.samples(&place)))?;
            }
        }
        Ok(())
    }

    /// An observation on each side of a sum that no move has come to, as far as one is found.
    pub fn summed(&mut self) -> Result<(), InputError> {
        let policy = self.policy;
        let mut random = SplitMix::new(SEED);
        let mut left = self.left();
        for side in Side::all(policy) {
            let is_of_sum = matches!(side, Side::Sum { .. });
            if !is_of_sum || self.sides.0.contains(&side) {
                continue;
            }
            if left.draws < DRAWS || self.trace.words().len() > left.end {
                break;
            }
            left.draws -= DRAWS;
            if let Some(observation) = self.observed(side, &mut random)? {
                self.play(Event::Network(observation))?;
            }
        }
        Ok(())
    }

    /// An observation that leads a sum to a side.
    fn observed(&self, side: Side, random: &mut SplitMix) -> Result<Option<Vec<f64>>, InputError> {
        let policy = self.policy;
        let bounds: Vec<Interval> = policy.features.iter().map(|feature| feature.bound).collect();
        let middle = |bound: &Interval| 0.5 * (bound.low + bound.high);
        let mut best: Vec<f64> = bounds.iter().map(middle).collect();
        let mut nearest = f64::MIN;
        for draw in 0..DRAWS {
            let mut next = best.clone();
            let at = random.below(bounds.len());
            let bound = bounds[at];
            // integers have a scale that ends with the bounds
            let is_within = policy.numeric_format.is_integer() || draw < DRAWS / 2;
            let stretch = if is_within {
                1.0
            } else {
                STRETCHES[random.below(STRETCHES.len())]
            };
            let end = match random.below(4) {
                0 => bound.low,
                1 => bound.high,
                _ => random.uniform(bound.low, bound.high),
            };
            next[at] = middle(&bound) + stretch * (end - middle(&bound));
            let Some(layers) = self.layers(&next)? else { continue };
            let Some(distance) = side.of_sum(policy, &layers) else {
                continue;
            };
            if distance > 0.0 {
                return Ok(Some(next));
            }
            // as near will do: a way may lead over places that differ in another neuron
            if distance >= nearest {
                (best, nearest) = (next, distance);
            }
        }
        Ok(None)
    }

    /// The network's layers for an observation, if all in them are numbers that are not too large.
    pub(super) fn layers(&self, observation: &[f64]) -> Result<Option<Vec<LayerTrace<T>>>, InputError> {
        let observation: Vec<T> = observation.iter().map(|x| T::nearest(*x)).collect();
        let layers = self.oracle.controller().layers(&observation.as_slice().into())?;
        let is_small = |x: &T| x.to_f64().abs() < LARGEST;
        let are_small = layers
            .iter()
            .all(|layer| layer.pre_activation.iter().chain(&layer.post_activation).all(is_small));
        Ok(are_small.then_some(layers))
    }
}

/// A place where a step shows what an argmax is asked for; of Q values that are all below 0, the lowest that are found.
fn towards<T: Real>(side: Side, policy: &Policy, probe: &mut Probe<'_, T>, random: &mut SplitMix) -> Option<Place> {
    let mut best = Place::default();
    let mut nearest = f64::MIN;
    for _ in 0..DRAWS_OF_ARGMAX {
        let knob = random.below(probe.ends().len());
        let place = best.with(knob, probe.value(knob, random));
        let Some(trace) = probe.step(&place).filter(|trace| trace.usable) else {
            continue;
        };
        let Some(distance) = side.of_step(policy, &trace) else {
            continue;
        };
        if distance > nearest {
            (best, nearest) = (place, distance);
        }
        // an argmax may start at any number: the lower they are, the more of them show
        if nearest > 0.0 && !matches!(side, Side::AllBelow(_)) {
            break;
        }
    }
    (nearest > 0.0).then_some(best)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Counted on the interpreter's own trace of the moves, apart from what led there.
    #[test]
    fn every_side_of_the_suite_is_reached() {
        let policy = crate::kit::constructs().unwrap();
        let mut course = Course::<f32>::new(&policy);
        course.directed().unwrap();
        course.damaged().unwrap();
        let before = course.sides.0.len();
        course.sided().unwrap();
        course.summed().unwrap();
        let all = Side::all(&policy);
        let missing: Vec<_> = all.iter().filter(|side| !course.sides.0.contains(side)).collect();
        println!("{before} of {}, then {}", all.len(), course.sides.0.len());
        assert!(course.sides.0.len() > before);
        assert!(missing.is_empty(), "{missing:?}");
    }

    /// By hand: the second neuron goes through a rectifier that is shut for it.
    #[test]
    fn a_neuron_behind_a_shut_rectifier_does_not_show() {
        let mut policy = crate::kit::constructs().unwrap();
        let layer = |inputs: usize, weights: Vec<f32>, activation| policy::Layer {
            name: String::new(),
            inputs,
            outputs: weights.len() / inputs,
            bias: vec![0.0; weights.len() / inputs],
            weights,
            activation,
            bounds: vec![],
        };
        policy.layers = vec![
            layer(1, vec![1.0, 1.0], Activation::Tanh),
            layer(2, vec![1.0, 0.0, 0.0, -1.0], Activation::Relu),
            layer(2, vec![1.0, 1.0], Activation::Identity),
        ];
        let trace = |sums: &[f32]| LayerTrace {
            pre_activation: sums.to_vec().into(),
            post_activation: sums.to_vec().into(),
        };
        let layers = [trace(&[1.0, 1.0]), trace(&[0.8, -0.8]), trace(&[0.8])];
        assert_eq!(
            shown(&policy, &layers),
            [vec![true, false], vec![true, true], vec![true]]
        );
    }
}
