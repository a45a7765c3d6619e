//! The set of observations that signals can cause.
//!
//! Features that read the same samples move together: an error and its negative, a voltage now and the same voltage in
//! another unit. A state is therefore a point of the box of *coordinates*: each signal (and remembered duty) at each delay
//! that a feature looks back, over its plausible range. A feature behind another filter than a delay is a coordinate of
//! its own, for its value depends on a whole history.

use policy::{Expr, Feature, Input, Interval, Policy};
use serde::Serialize;

use crate::form::{Form, Replacement, rounding};
use crate::past::Past;

/// Unit roundoff of binary32.
const UNIT_32: f64 = 1.0 / 16_777_216.0;
/// More than the rounding errors of a feature in the subnormal range.
const TINY_32: f64 = 1e-40;

/// One axis of the set of states.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Coordinate {
    /// Signal or feature, with its delay: `v_out`, `v_out, 1 sample ago`.
    pub name: String,
    /// Unit of the signal; empty for observations and duties.
    pub unit: String,
    /// Plausible range.
    pub range: Interval,
    #[serde(skip)]
    key: Key,
}

/// What a coordinate is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Key {
    Sample { input: Input, delay: usize },
    Observation(usize),
}

/// How far the past of a state is free.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Memory {
    /// Delayed samples are coordinates of their own.
    Free,
    /// Delayed samples equal the present ones, differences are 0: a settled converter.
    Settled,
}

/// Observations as a function of coordinates.
#[derive(Debug, Clone, PartialEq)]
pub struct Domain {
    coordinates: Vec<Coordinate>,
    features: Vec<Affine>,
}

/// A feature that says nothing new: before the clips it is `factor * other + offset`, up to rounding.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct AffineCopy {
    /// Index of the feature.
    pub feature: usize,
    /// Index of an earlier feature.
    pub of: usize,
    /// Factor.
    pub factor: f64,
    /// Offset.
    pub offset: f64,
}

/// A box of coordinates, one interval each.
pub type Cell = Vec<Interval>;

/// An observation before its clip: constant + sum of factors times coordinates, up to `error`.
#[derive(Debug, Clone, PartialEq, Default)]
struct Affine {
    factors: Vec<(usize, f64)>,
    constant: f64,
    /// Largest difference between the computed value and the exact function.
    error: f64,
    /// Bound of the magnitude.
    magnitude: f64,
    clip: Option<Interval>,
    bound: Option<Interval>,
}

impl Domain {
    /// The states of a policy.
    #[must_use]
    pub fn of(policy: &Policy, memory: Memory) -> Self {
        let mut domain = Self {
            coordinates: Vec::new(),
            features: Vec::new(),
        };
        for (index, feature) in policy.features.iter().enumerate() {
            let affine = match Past::of(feature, policy.sample_period, memory) {
                Some(past) => domain.affine(policy, feature, past),
                None => domain.own(index, feature),
            };
            domain.features.push(affine);
        }
        domain
    }

    /// Every observation of the clamped box, each feature a coordinate: the set over which `q_values` is defined.
    #[must_use]
    pub fn observations(policy: &Policy) -> Self {
        let mut domain = Self {
            coordinates: Vec::new(),
            features: Vec::new(),
        };
        for (index, feature) in policy.features.iter().enumerate() {
            let affine = domain.own(index, feature);
            domain.features.push(affine);
        }
        domain
    }

    /// The axes.
    #[must_use]
    pub fn coordinates(&self) -> &[Coordinate] {
        &self.coordinates
    }

    /// Features that are affine copies of an earlier one.
    #[must_use]
    pub fn copies(&self) -> Vec<AffineCopy> {
        let found = self.features.iter().enumerate().filter_map(|(feature, affine)| {
            self.features[..feature].iter().enumerate().find_map(|(of, earlier)| {
                let factor = affine.ratio(earlier)?;
                let offset = affine.constant - factor * earlier.constant;
                // an offset below the rounding of both is none
                let is_rounding = offset.abs() <= affine.error + factor.abs() * earlier.error;
                Some(AffineCopy {
                    feature,
                    of,
                    factor,
                    offset: if is_rounding { 0.0 } else { offset },
                })
            })
        });
        found.collect()
    }

    /// How much a coordinate moves the observation, per unit of its own: in widths of the features' bounds.
    fn influence(&self, coordinate: usize) -> f64 {
        let moved = self.features.iter().flat_map(|feature| {
            let width = feature.bound.map_or(1.0, |bound| bound.high - bound.low);
            let terms = feature.factors.iter().filter(|(index, _)| *index == coordinate);
            terms.map(move |(_, factor)| if width > 0.0 { factor.abs() / width } else { 0.0 })
        });
        moved.sum()
    }

    /// Both halves of a cell, across the coordinate that moves the observation most; the same for equal cells.
    #[must_use]
    pub fn halves(&self, cell: &[Interval]) -> (Cell, Cell, usize) {
        let effects = cell
            .iter()
            .enumerate()
            .map(|(index, range)| self.influence(index) * (range.high - range.low));
        // the first among equals, so that equal cells are always cut alike
        let (widest, _) = effects
            .enumerate()
            .fold((0, f64::NEG_INFINITY), |best, (index, effect)| {
                if effect > best.1 { (index, effect) } else { best }
            });
        let (mut lower, mut upper) = (cell.to_vec(), cell.to_vec());
        if let Some(range) = cell.get(widest) {
            let middle = 0.5 * (range.low + range.high);
            lower[widest].high = middle;
            upper[widest].low = middle;
        }
        (lower, upper, widest)
    }

    /// The whole set.
    #[must_use]
    pub fn whole(&self) -> Cell {
        self.coordinates.iter().map(|coordinate| coordinate.range).collect()
    }

    /// A state drawn from the box of coordinates, `uniform` from 0..1.
    pub fn draw(&self, uniform: &mut dyn FnMut() -> f64) -> Vec<f64> {
        let one = |coordinate: &Coordinate| {
            let Interval { low, high } = coordinate.range;
            (low + uniform() * (high - low)).min(high)
        };
        self.coordinates.iter().map(one).collect()
    }

    /// Observation at a point of the coordinates, clipped.
    #[must_use]
    pub fn observation(&self, point: &[f64]) -> Vec<f32> {
        let one = |feature: &Affine| {
            let terms = feature.factors.iter().map(|(index, factor)| factor * point[*index]);
            let o = (terms.sum::<f64>() + feature.constant) as f32;
            [feature.clip, feature.bound]
                .into_iter()
                .flatten()
                .fold(o, |o, limit| o.max(limit.low as f32).min(limit.high as f32))
        };
        self.features.iter().map(one).collect()
    }

    /// All observations of a cell.
    pub(crate) fn form(&self, cell: &[Interval]) -> Form {
        let mut form = Form::zeros(self.features.len(), cell.len());
        let mut steps = Vec::with_capacity(self.features.len());
        for (row, feature) in self.features.iter().enumerate() {
            let mut centre = feature.constant;
            let mut magnitude = feature.constant.abs();
            for (index, factor) in &feature.factors {
                let (low, high) = (cell[*index].low, cell[*index].high);
                centre += factor * (0.5 * (low + high));
                // the sum of several terms on one coordinate
                form.shared.row_mut(row)[*index] += factor * (0.5 * (high - low));
                magnitude += factor.abs() * low.abs().max(high.abs());
            }
            form.centre[row] = centre;
            // centre and coefficients each round the sum of two ends, a product, and n sums: below 4 + n. Twice for the
            // two of them, and twice more since the magnitude is a rounded sum itself
            form.slack[row] = feature.error + 4.0 * rounding(magnitude, 4 + feature.factors.len());
            steps.push(feature.clipped(form.bounds(row)));
        }
        if steps.iter().all(|step| *step == Replacement::IDENTITY) {
            form
        } else {
            form.replaced(&steps, true, 0)
        }
    }

    fn coordinate(&mut self, key: Key, name: String, unit: &str, range: Interval) -> usize {
        let found = self.coordinates.iter().position(|coordinate| coordinate.key == key);
        found.unwrap_or_else(|| {
            self.coordinates.push(Coordinate {
                name,
                unit: unit.to_owned(),
                range,
                key,
            });
            self.coordinates.len() - 1
        })
    }

    /// A feature that is its own coordinate.
    fn own(&mut self, index: usize, feature: &Feature) -> Affine {
        let coordinate = self.coordinate(Key::Observation(index), feature.name.clone(), "", feature.bound);
        Affine {
            factors: vec![(coordinate, 1.0)],
            magnitude: feature.bound.low.abs().max(feature.bound.high.abs()),
            bound: Some(feature.bound),
            ..Affine::default()
        }
    }

    fn affine(&mut self, policy: &Policy, feature: &Feature, past: Past) -> Affine {
        let mut y = if past.is_difference {
            Affine::default()
        } else {
            self.expression(policy, &feature.source, past.delay)
        };
        // a filter's memory settles up to its own rounding
        y.error += past.roundings * UNIT_32 * y.magnitude + past.remains;
        // the contract's order: scale, offset, clip
        y = y.scaled(feature.scale).plus(&Affine::constant(feature.offset));
        y.clip = feature.clip.map(|clip| Interval {
            low: f64::from(clip.low as f32),
            high: f64::from(clip.high as f32),
        });
        y.bound = Some(feature.bound);
        y
    }

    fn expression(&mut self, policy: &Policy, expr: &Expr, delay: usize) -> Affine {
        match expr {
            Expr::Input(input) => {
                let (name, unit, range) = described(policy, *input);
                let name = match delay {
                    0 => name,
                    1 => format!("{name}, 1 sample ago"),
                    n => format!("{name}, {n} samples ago"),
                };
                let magnitude = range.low.abs().max(range.high.abs());
                let index = self.coordinate(Key::Sample { input: *input, delay }, name, &unit, range);
                Affine {
                    factors: vec![(index, 1.0)],
                    magnitude,
                    ..Affine::default()
                }
            }
            Expr::Constant(value) => Affine::constant(*value),
            Expr::Neg(e) => {
                let mut y = self.expression(policy, e, delay);
                y.constant = -y.constant;
                for (_, factor) in &mut y.factors {
                    *factor = -*factor;
                }
                y
            }
            Expr::Add(a, b) => {
                let a = self.expression(policy, a, delay);
                a.plus(&self.expression(policy, b, delay))
            }
            Expr::Sub(a, b) => {
                let a = self.expression(policy, a, delay);
                let mut b = self.expression(policy, b, delay);
                b.constant = -b.constant;
                for (_, factor) in &mut b.factors {
                    *factor = -*factor;
                }
                a.plus(&b)
            }
            Expr::Scale(factor, e) => self.expression(policy, e, delay).scaled(*factor),
        }
    }
}

impl Affine {
    fn constant(value: f64) -> Self {
        Self {
            constant: value,
            error: UNIT_32 * value.abs(),
            magnitude: value.abs(),
            ..Self::default()
        }
    }

    fn plus(mut self, other: &Self) -> Self {
        for (index, factor) in &other.factors {
            match self.factors.iter_mut().find(|(found, _)| found == index) {
                Some((_, sum)) => *sum += factor,
                None => self.factors.push((*index, *factor)),
            }
        }
        self.constant += other.constant;
        self.magnitude += other.magnitude;
        // the sum is rounded once in binary32, its factors in binary64 here
        // a rounded sum is larger than the exact one by its own error: 1.001 covers that second order
        self.error = (self.error + other.error + UNIT_32 * self.magnitude) * 1.001 + TINY_32;
        self
    }

    fn scaled(mut self, scale: f64) -> Self {
        if scale == 1.0 {
            return self;
        }
        self.constant *= scale;
        for (_, factor) in &mut self.factors {
            *factor *= scale;
        }
        self.magnitude *= scale.abs();
        // the factor and the product are rounded
        self.error = (scale.abs() * self.error + 2.0 * UNIT_32 * self.magnitude) * 1.001 + TINY_32;
        self
    }

    /// The factor from another function's slopes to these, if there is one.
    fn ratio(&self, other: &Self) -> Option<f64> {
        let (first, slope) = self.factors.first()?;
        let at =
            |function: &Self, index: usize| function.factors.iter().find(|(found, _)| *found == index).map(|f| f.1);
        let factor = slope / at(other, *first)?;
        let is_copy = self.factors.iter().all(|(index, slope)| {
            // thousands of roundings of binary64: two formulas of the same slopes differ by a few
            at(other, *index).is_some_and(|theirs| (slope - factor * theirs).abs() <= 1e-12 * slope.abs())
        });
        (is_copy && self.factors.len() == other.factors.len() && factor.is_finite() && factor != 0.0).then_some(factor)
    }

    /// Behind the clip, and within what the check has bounded.
    fn clipped(&self, x: Interval) -> Replacement {
        let Some(clip) = self.clip else {
            return Replacement::IDENTITY;
        };
        if x.low >= clip.low && x.high <= clip.high {
            return Replacement::IDENTITY;
        }
        // a range and no line: it forgets the samples it came from, but holds on both sides of the clip
        let inside = |x: f64| x.max(clip.low).min(clip.high);
        let (low, high) = (inside(x.low), inside(x.high));
        let shift = 0.5 * (low + high);
        Replacement {
            factor: 0.0,
            shift,
            radius: 0.5 * (high - low) * (1.0 + 1e-12) + if high > low { rounding(shift.abs(), 2) } else { 0.0 },
        }
    }
}

/// Name, unit and plausible range of what a source reads.
fn described(policy: &Policy, input: Input) -> (String, String, Interval) {
    let paths = policy.paths();
    let duties = |path: &policy::DutyPath<'_>, values: &mut dyn Iterator<Item = f64>| {
        let start = [path.limits.initial_duty, path.fallback];
        let (low, high) = start
            .into_iter()
            .chain(values)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
                (low.min(x), high.max(x))
            });
        Interval {
            // the state holds the duty rounded to the format, which may be to either side
            low: f64::from(low as f32).min(low),
            high: f64::from(high as f32).max(high),
        }
    };
    match input {
        Input::Signal(index) => match policy.signals.get(index) {
            Some(signal) => (signal.name.clone(), signal.unit.clone(), signal.range),
            None => ("?".to_owned(), String::new(), Interval { low: 0.0, high: 0.0 }),
        },
        Input::Estimate(index, estimate) => {
            let range = policy.observers.get(index).map(|observer| observer.range(estimate));
            let range = range.unwrap_or(Interval { low: 0.0, high: 0.0 });
            let name = input.name(&policy.signals, &policy.observers);
            // the clamp holds its ends rounded to the format, which may be to either side
            let rounded = Interval {
                low: f64::from(range.low as f32).min(range.low),
                high: f64::from(range.high as f32).max(range.high),
            };
            (name, estimate.unit().to_owned(), rounded)
        }
        Input::PreviousDuty | Input::PreviousCommand | Input::OutputDuty(_) | Input::OutputCommand(_) => {
            let (index, word) = match input {
                Input::OutputDuty(index) => (index, "previous_duty"),
                Input::OutputCommand(index) => (index, "previous_command"),
                Input::PreviousDuty => (0, "previous_duty"),
                _ => (0, "previous_command"),
            };
            let Some(path) = paths.get(index) else {
                // the reader knows every output that a source names; no duty is outside of this
                return (word.to_owned(), String::new(), Interval { low: 0.0, high: 1.0 });
            };
            let name = path.name.map_or(word.to_owned(), |name| format!("{name}_{word}"));
            let range = match word {
                "previous_duty" => duties(path, &mut path.head.duties().into_iter()),
                _ => duties(path, &mut [path.limits.duty.low, path.limits.duty.high].into_iter()),
            };
            (name, String::new(), range)
        }
    }
}
