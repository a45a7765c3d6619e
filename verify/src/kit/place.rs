//! A sound, primed state and a measurement that are looked for: what each signal and each number of the memories is.

use std::collections::BTreeMap;

use interp::{Controller, Real, Sample, State, Trace};
use policy::{Policy, Scalar, Signal};
use random::{Random, SplitMix};

use super::damage::Damage;
use super::directed::usual;
use crate::traces::sample_of;

/// What differs from the usual samples and a fresh state.
#[derive(Debug, Clone, Default)]
pub struct Place(BTreeMap<usize, f64>);

impl Place {
    /// The same with another value at that knob.
    pub fn with(&self, knob: usize, value: f64) -> Self {
        let mut place = self.clone();
        place.0.insert(knob, value);
        place
    }
}

/// A controller that is put to places.
pub struct Probe<'a, T> {
    policy: &'a Policy,
    controller: Controller<T>,
    fresh: State<T>,
    usual: Vec<Sample>,
    /// From where to where each knob goes: the signals, then the memories that a step reads.
    ends: Vec<(f64, f64)>,
    /// Place of each knob behind the signals among the numbers of the state.
    numbers: Vec<usize>,
}

impl<'a, T: Real> Probe<'a, T> {
    pub fn new(policy: &'a Policy) -> Self {
        let controller = Controller::<T>::new(policy);
        let (signals, memory) = (policy.signals.len(), controller.state().memory.len());
        let ends = controller.sound_ends().into_iter().enumerate();
        let memories = ends.skip(signals).take(memory);
        let memories: Vec<(usize, (T, T))> = memories.filter_map(|(at, ends)| Some((at, ends?))).collect();
        let ranges = policy
            .signals
            .iter()
            .map(|signal| (signal.range.low, signal.range.high));
        let of_memory = memories.iter().map(|(_, (low, high))| (low.to_f64(), high.to_f64()));
        Self {
            policy,
            fresh: controller.state().clone(),
            usual: usual(policy),
            ends: ranges.chain(of_memory).collect(),
            numbers: memories.iter().map(|(at, _)| *at).collect(),
            controller,
        }
    }

    pub fn scalar(&self) -> Scalar {
        self.policy.numeric_format.scalar()
    }

    /// From where to where each knob goes.
    pub fn ends(&self) -> &[(f64, f64)] {
        &self.ends
    }

    pub fn samples(&self, place: &Place) -> Vec<Sample> {
        let scalar = self.policy.numeric_format.scalar();
        let signals = self.policy.signals.iter().zip(&self.usual).enumerate();
        let sample = |(index, (signal, usual)): (usize, (&Signal, &Sample))| match place.0.get(&index) {
            Some(value) => sample_of(scalar, signal, *value),
            None => *usual,
        };
        signals.map(sample).collect()
    }

    /// The state of a place.
    pub fn damage(&self, place: &Place) -> Damage<T> {
        let signals = self.policy.signals.len();
        let numbers = place.0.range(signals..);
        let number = |(knob, value): (&usize, &f64)| Some((*self.numbers.get(knob - signals)?, T::nearest(*value)));
        Damage::primed(numbers.filter_map(number).collect())
    }

    fn put(&mut self, place: &Place) {
        let mut state = self.fresh.clone();
        self.damage(place).apply(&mut state);
        self.controller.restore(&state);
    }

    /// A step from there; nothing where a sample is refused.
    pub fn step(&mut self, place: &Place) -> Option<Trace<T>> {
        self.put(place);
        self.controller.eval(&self.samples(place)).ok()
    }

    /// The same without the network.
    pub fn sense(&mut self, place: &Place) -> Option<Trace<T>> {
        self.put(place);
        let mut trace = self.controller.blank_trace();
        self.controller.sense_into(&self.samples(place), &mut trace).ok()?;
        Some(trace)
    }

    /// A value of a knob: its ends as often as what lies between.
    pub fn value(&self, knob: usize, random: &mut SplitMix) -> f64 {
        let (low, high) = self.ends[knob];
        match random.below(4) {
            0 => low,
            1 => high,
            _ => random.uniform(low, high),
        }
    }

    /// A place where every knob is drawn.
    pub fn anywhere(&self, random: &mut SplitMix) -> Place {
        let knobs = 0..self.ends.len();
        Place(knobs.map(|knob| (knob, self.value(knob, random))).collect())
    }
}
