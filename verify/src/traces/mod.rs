//! The stream of events that the interpreter and all builds are put through: deterministic from a seed.
//!
//! Segments of random length follow each other: closed loop with a surrogate plant, uniform values, edge values,
//! bursts of bad samples around the hold count, values at the ends of the clips, plateaus
//! long enough for integrators to reach their clamps. Attempts to replace the mapping
//! coefficients, resets and fresh starts are strewn in.

mod edges;
mod plant;
mod recorded;
#[cfg(test)]
mod tests;

use std::ops::Range;

use interp::{Controller, Real, Sample};
use policy::{Interval, Mapping, Policy, Scalar};
use random::{Random, SplitMix};

use crate::codes::Grid;

use edges::Edges;
use plant::Plant;
pub use recorded::Recorded;
pub(crate) use recorded::SignalColumns;

/// What happens to a controller in one move.
#[derive(Debug, Clone, PartialEq)]
pub enum Event {
    /// One control step with a sample per signal.
    Step(Vec<Sample>),
    /// An attempt to replace the mapping coefficients, numbers of the format; `r` in the four-term form only.
    SetMapping {
        /// Index of the output, 0 where there is one.
        output: usize,
        /// Gain on the duty.
        a: f64,
        /// Per ampere.
        b: f64,
        /// Constant.
        c: f64,
        /// Product term per ampere.
        r: Option<f64>,
    },
    /// `reset`: keeps the mapping coefficients.
    Reset,
    /// `init`: a new controller.
    Init,
    /// The network alone on an observation (known answers).
    Network(Vec<f64>),
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Segment {
    ClosedLoop,
    Uniform,
    Edges,
    Bursts,
    Clips,
    Plateaus,
}

const SEGMENTS: [Segment; 7] = [
    Segment::ClosedLoop,
    Segment::ClosedLoop,
    Segment::Uniform,
    Segment::Edges,
    Segment::Bursts,
    Segment::Clips,
    Segment::Plateaus,
];

// conventions; tests.rs counts what a stream of 20,000 steps reaches with them
/// Steps between two attempts to replace the mapping coefficients, on average.
const STEPS_PER_SET_MAPPING: usize = 50;
/// Steps between two resets, on average.
const STEPS_PER_RESET: usize = 400;
/// Steps between two fresh starts, on average.
const STEPS_PER_INIT: usize = 1500;
/// Steps of a plateau, on average.
const STEPS_PER_PLATEAU: usize = 60;
/// Longest part of a segment given to one burst cycle.
// a contract may hold for a million steps, and other segments have to come
const MAX_SEGMENT: usize = 20_000;

/// Longest first segment.
const FIRST_SEGMENT: usize = 200;

/// Endless source of events for one policy.
#[derive(Debug, Clone)]
pub struct Stream<'a> {
    policy: &'a Policy,
    scalar: Scalar,
    rng: SplitMix,
    plant: Plant,
    edges: Vec<Edges>,
    segment: Segment,
    /// Steps left in the segment.
    left: usize,
    /// Steps left in the burst of bad samples (positive) or in the gap after it.
    bad_left: usize,
    good_left: usize,
    /// Outputs with a mapping, by index.
    mapped: Vec<(usize, Mapping)>,
    /// Values kept for a while.
    plateau: Vec<Sample>,
    /// Events that come before anything random, last first.
    queued: Vec<Event>,
    /// Combinations of codes that come before anything random, a fresh controller each.
    codes: Option<(&'a Grid, Range<u64>)>,
}

impl<'a> Stream<'a> {
    /// The stream of `seed`; recordings are played first, each after a reset.
    pub fn new(policy: &'a Policy, seed: u64, recorded: &[Recorded]) -> Self {
        let mut queued: Vec<Event> = Vec::new();
        for recording in recorded {
            queued.push(Event::Reset);
            queued.extend(recording.steps().iter().cloned().map(Event::Step));
        }
        // taken from the end, which is quick in a vector
        queued.reverse();
        let mut rng = SplitMix::new(seed);
        Self {
            policy,
            scalar: policy.numeric_format.scalar(),
            plant: Plant::new(policy, &mut rng),
            edges: (0..policy.signals.len())
                .map(|index| Edges::new(policy, index))
                .collect(),
            rng,
            // hold and fallback first, so that short runs see them too
            segment: Segment::Bursts,
            // room for a few bursts of about K steps, but a short one where a contract holds for long
            left: (4 * (policy.fallback.hold as usize).saturating_add(4)).min(FIRST_SEGMENT),
            bad_left: 0,
            good_left: 0,
            mapped: mapped(policy),
            plateau: Vec::new(),
            queued,
            codes: None,
        }
    }

    /// The same behind a fresh controller and a step for each of these combinations.
    #[must_use]
    pub fn after_codes(self, codes: Option<(&'a Grid, Range<u64>)>) -> Self {
        Self { codes, ..self }
    }

    /// The next event. `controller` is the interpreter in the state before it: the closed loop needs its duty, the
    /// clip segments its filter memories.
    pub fn next_event<T: Real>(&mut self, controller: &Controller<T>) -> Event {
        // nothing random in between: a recording is played whole
        if let Some(event) = self.queued.pop() {
            return event;
        }
        if let Some((grid, combinations)) = &mut self.codes
            && let Some(next) = combinations.next()
        {
            self.queued.push(Event::Step(grid.samples(next)));
            return Event::Init;
        }
        if !self.mapped.is_empty() && self.rng.one_in(STEPS_PER_SET_MAPPING) {
            return self.set_mapping();
        }
        if self.rng.one_in(STEPS_PER_RESET) {
            return Event::Reset;
        }
        if self.rng.one_in(STEPS_PER_INIT) {
            return Event::Init;
        }
        if self.left == 0 {
            self.start_segment();
        }
        self.left -= 1;
        Event::Step(match self.segment {
            Segment::ClosedLoop => self.closed_loop(controller.state().previous_command.to_f64()),
            Segment::Uniform => self.uniform(),
            Segment::Edges => self.with_edges(),
            Segment::Bursts => self.bursts(),
            Segment::Clips => self.at_a_clip(controller),
            Segment::Plateaus => self.plateau(),
        })
    }

    fn start_segment(&mut self) {
        self.segment = self.rng.pick(&SEGMENTS, Segment::Uniform);
        self.left = 50 + self.rng.below(350);
        match self.segment {
            Segment::ClosedLoop => self.plant = Plant::new(self.policy, &mut self.rng),
            Segment::Bursts => {
                let hold = self.policy.fallback.hold as usize;
                self.left = self.left.max(4 * (hold.saturating_add(4))).min(MAX_SEGMENT);
            }
            Segment::Uniform | Segment::Edges | Segment::Clips | Segment::Plateaus => {}
        }
    }

    fn closed_loop(&mut self, duty: f64) -> Vec<Sample> {
        let values = self.plant.advance(duty, &mut self.rng);
        self.policy
            .signals
            .iter()
            .zip(values)
            .map(|(signal, x)| sample_of(self.scalar, signal, x))
            .collect()
    }

    fn uniform(&mut self) -> Vec<Sample> {
        let (scalar, rng) = (self.scalar, &mut self.rng);
        self.policy
            .signals
            .iter()
            .map(|signal| sample_of(scalar, signal, rng.uniform(signal.range.low, signal.range.high)))
            .collect()
    }

    /// Uniform values, one of them often replaced by an edge; sometimes all.
    fn with_edges(&mut self) -> Vec<Sample> {
        let mut samples = self.uniform();
        let rng = &mut self.rng;
        if rng.one_in(8) {
            for (sample, edges) in samples.iter_mut().zip(&self.edges) {
                *sample = edges.inside(rng, *sample);
            }
        } else {
            let index = rng.below(samples.len());
            if let (Some(sample), Some(edges)) = (samples.get_mut(index), self.edges.get(index)) {
                *sample = if rng.one_in(2) {
                    edges.inside(rng, *sample)
                } else {
                    edges.any(rng, *sample)
                };
            }
        }
        samples
    }

    /// Bad samples for about K steps, then good ones for a few.
    fn bursts(&mut self) -> Vec<Sample> {
        let hold = self.policy.fallback.hold as usize;
        let mut samples = self.uniform();
        if self.bad_left == 0 && self.good_left == 0 {
            // K bad steps are bridged and K + 1 are not; the last entry lies anywhere up to 2K + 3
            let around = [
                1,
                hold.max(1),
                hold.saturating_add(1),
                1 + self.rng.below(hold.saturating_mul(2) + 3),
            ];
            self.bad_left = self.rng.pick(&around, 1);
            self.good_left = 1 + self.rng.below(5);
        }
        if self.bad_left == 0 {
            self.good_left -= 1;
            return samples;
        }
        self.bad_left -= 1;
        let index = self.rng.below(samples.len());
        if let (Some(sample), Some(edges)) = (samples.get_mut(index), self.edges.get(index)) {
            *sample = edges.outside(&mut self.rng, *sample);
        }
        samples
    }

    /// The same values for many steps, some of them at an edge.
    fn plateau(&mut self) -> Vec<Sample> {
        if self.plateau.is_empty() || self.rng.one_in(STEPS_PER_PLATEAU) {
            self.plateau = self.uniform();
            for (sample, edges) in self.plateau.iter_mut().zip(&self.edges) {
                if self.rng.one_in(3) {
                    *sample = edges.inside(&mut self.rng, *sample);
                }
            }
        }
        self.plateau.clone()
    }

    /// Moves one signal so that one observation comes to lie within a few units in the last place of a clip's end.
    ///
    /// Every filter is affine in its input for a given state, so two evaluations give the place.
    fn at_a_clip<T: Real>(&mut self, controller: &Controller<T>) -> Vec<Sample> {
        let scalar = self.scalar;
        let mut samples = self.uniform();
        let clipped: Vec<(usize, Interval)> = self
            .policy
            .features
            .iter()
            .enumerate()
            .filter_map(|(n, f)| Some((n, f.clip?)))
            .collect();
        let index = self.rng.below(samples.len());
        let (Some(signal), Some(&(feature, clip))) = (
            self.policy.signals.get(index),
            clipped.get(self.rng.below(clipped.len())),
        ) else {
            return samples;
        };
        let (low, high) = (signal.range.low, signal.range.high);
        let mut unclipped_at = |x: f64| {
            samples[index] = sample_of(scalar, signal, x);
            controller
                .eval(&samples)
                .ok()
                .map(|trace| trace.features[feature].unclipped.to_f64())
        };
        // stay off the ends, where rounding could leave the range
        let (x0, x1) = (low + 0.25 * (high - low), low + 0.75 * (high - low));
        let (Some(o0), Some(o1)) = (unclipped_at(x0), unclipped_at(x1)) else {
            return samples;
        };
        let end = if self.rng.one_in(2) { clip.low } else { clip.high };
        // a feature that does not read the signal gives o1 = o0 and an x that is not in the range: a uniform value then
        let x = x0 + (end - o0) / (o1 - o0) * (x1 - x0);
        samples[index] = if x >= low && x <= high {
            nudged(sample_of(scalar, signal, x), self.rng.below(7) as i32 - 3)
        } else {
            sample_of(scalar, signal, self.rng.uniform(low, high))
        };
        samples
    }

    /// Valid, at the ends, just outside, not a number, or the policy's own coefficients again.
    fn set_mapping(&mut self) -> Event {
        // one mapping takes no draw: the streams of policies with one stay what they were
        let own = match self.mapped.len() {
            0 | 1 => 0,
            count => self.rng.below(count),
        };
        let Some((output, mapping)) = self.mapped.get(own) else {
            return Event::Reset;
        };
        let (scalar, rng) = (self.scalar, &mut self.rng);
        let own = mapping.coefficients;
        let mut values = [own.a, own.b, own.c, own.r.unwrap_or(0.0)].map(|value| scalar.nearest(value));
        let ranges = [mapping.adjust_a, mapping.adjust_b, mapping.adjust_c, mapping.adjust_r];
        // 0: the policy's own, 1: inside, 2: at an end, 3: at an end or no number, 4: where the mapping ceases to rise
        let style = rng.below(5);
        if style != 0 {
            for (value, range) in values.iter_mut().zip(ranges) {
                *value = scalar.nearest(rng.uniform(range.low, range.high));
            }
        }
        let index = rng.below(if own.r.is_some() { 4 } else { 3 });
        if style == 2 || style == 3 {
            let end = scalar.nearest(if rng.one_in(2) {
                ranges[index].low
            } else {
                ranges[index].high
            });
            values[index] = rng.pick(&[end, scalar.next_up(end), scalar.next_down(end)], end);
        }
        if style == 3 && rng.one_in(2) {
            let infinity = f64::INFINITY;
            let bad = [
                f64::NAN,
                -f64::NAN,
                infinity,
                -infinity,
                scalar.next_down(infinity),
                -scalar.next_down(infinity),
                0.0,
                -0.0,
            ];
            values[index] = rng.pick(&bad, f64::NAN);
        }
        if style == 4 && own.r.is_some() {
            // a + r i close to 0 at one end of the current: where the mapping ceases to rise
            let valid = mapping.valid_i_out;
            let i = scalar.nearest(if rng.one_in(2) { valid.low } else { valid.high });
            let a = -scalar.nearest(values[3] * i);
            values[0] = rng.pick(&[a, scalar.next_up(a), scalar.next_down(a)], a);
        }
        let [a, b, c, r] = values;
        Event::SetMapping {
            output: *output,
            a,
            b,
            c,
            r: own.r.map(|_| r),
        }
    }
}

/// Outputs with a mapping.
fn mapped(policy: &Policy) -> Vec<(usize, Mapping)> {
    let paths = policy.paths();
    let paths = paths.iter().enumerate();
    paths
        .filter_map(|(index, path)| Some((index, *path.mapping?)))
        .collect()
}

/// `x` in the unit of the signal as the sample that arrives in `scalar`: rounded, or the nearest ADC code.
pub fn sample_of(scalar: Scalar, signal: &policy::Signal, x: f64) -> Sample {
    match signal.adc {
        None => physical(scalar, x),
        // `as` saturates
        Some(adc) => Sample::Code(((x - adc.offset) / adc.gain).round() as i32),
    }
}

/// The number `x` as a sample in `scalar`.
fn physical(scalar: Scalar, x: f64) -> Sample {
    match scalar {
        Scalar::F32 => Sample::Physical(x as f32),
        Scalar::F64 => Sample::Wide(x),
    }
}

/// The sample `ulps` units in the last place (or codes) further.
pub fn nudged(sample: Sample, ulps: i32) -> Sample {
    let moved = |scalar: Scalar, mut x: f64| {
        for _ in 0..ulps.abs() {
            x = if ulps > 0 {
                scalar.next_up(x)
            } else {
                scalar.next_down(x)
            };
        }
        physical(scalar, x)
    };
    match sample {
        // a code moves by whole steps of the converter
        Sample::Code(code) => Sample::Code(code.saturating_add(ulps)),
        Sample::Physical(x) => moved(Scalar::F32, x.into()),
        Sample::Wide(x) => moved(Scalar::F64, x),
    }
}
