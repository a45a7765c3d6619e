//! A feature's filters in binary64, as the contract has them and as an environment may have made them instead.
//!
//! Not the interpreter's: it knows only what the contract can say, and these are to be wrong on purpose.

use policy::{Feature, Filter};

/// One filter of a chain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Link {
    Delay(usize),
    Difference,
    LowPass {
        tau: f64,
        /// Starts from 0 in the place of the first sample.
        from_zero: bool,
    },
    Derivative {
        tau: f64,
    },
    Average(usize),
    Integral(Integral),
}

/// An integral over time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Integral {
    pub min: f64,
    pub max: f64,
    pub initial: f64,
    pub rule: Rule,
    pub start: Start,
    /// The sum goes on behind the clamp: only what is shown is held there.
    pub winds_up: bool,
    /// Share of the sum that is kept in each period.
    pub leak: f64,
}

/// What an integral adds in each row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Rule {
    /// T x, as in the contract.
    Rectangle,
    /// T (x + x1) / 2.
    Trapezoid,
    /// T x1: the row before.
    Before,
}

/// What it adds in the first row of an episode, in shares of T x.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Start {
    Whole,
    Half,
    Nothing,
}

/// What a filter remembers within an episode.
#[derive(Debug, Clone, Default)]
struct Memory {
    line: Vec<f64>,
    y: f64,
}

impl From<Filter> for Link {
    fn from(filter: Filter) -> Self {
        match filter {
            Filter::Delay { samples } => Link::Delay(samples),
            Filter::BackwardDifference => Link::Difference,
            Filter::LowPass { time_constant } => Link::LowPass {
                tau: time_constant,
                from_zero: false,
            },
            Filter::FilteredDerivative { time_constant } => Link::Derivative { tau: time_constant },
            Filter::MovingAverage { samples } => Link::Average(samples),
            Filter::Integrator {
                min,
                max,
                initial,
                leak,
            } => Link::Integral(Integral {
                min,
                max,
                initial,
                leak,
                rule: Rule::Rectangle,
                start: Start::Whole,
                winds_up: false,
            }),
        }
    }
}

impl Link {
    fn next(&self, memory: &mut Memory, is_first: bool, period: f64, x: f64) -> f64 {
        if is_first {
            // as in the contract: the first sample stands for a past that nobody has measured
            memory.line = vec![x; self.words()];
            memory.y = x;
        }
        let x1 = memory.line.first().copied().unwrap_or(x);
        let y = match *self {
            Link::Delay(_) => x1,
            Link::Difference => (x - x1) / period,
            Link::LowPass { tau, from_zero } => {
                let y1 = if is_first && from_zero { 0.0 } else { memory.y };
                y1 + period / (tau + period) * (x - y1)
            }
            Link::Derivative { tau } => {
                let y1 = if is_first { 0.0 } else { memory.y };
                (tau * y1 + (x - x1)) / (tau + period)
            }
            Link::Average(samples) => (memory.line.iter().sum::<f64>() + x) / samples as f64,
            Link::Integral(integral) => integral.next(if is_first { None } else { Some((memory.y, x1)) }, period, x),
        };
        if !memory.line.is_empty() {
            memory.line.rotate_left(1);
            if let Some(last) = memory.line.last_mut() {
                *last = x;
            }
        }
        memory.y = y;
        match self {
            Link::Integral(integral) => y.clamp(integral.min, integral.max),
            _ => y,
        }
    }

    /// Inputs that it keeps.
    pub fn words(&self) -> usize {
        match self {
            Link::Delay(samples) => *samples,
            Link::Average(samples) => samples.saturating_sub(1),
            Link::Difference | Link::Derivative { .. } | Link::Integral(_) => 1,
            Link::LowPass { .. } => 0,
        }
    }
}

impl Integral {
    /// The sum behind `x`; before it were the sum and the input of the row before, if there was one.
    fn next(&self, before: Option<(f64, f64)>, period: f64, x: f64) -> f64 {
        let (sum, added) = match (before, self.rule) {
            (Some((sum, _)), Rule::Rectangle) => (sum, x),
            (Some((sum, x1)), Rule::Trapezoid) => (sum, 0.5 * (x + x1)),
            (Some((sum, x1)), Rule::Before) => (sum, x1),
            (None, _) => {
                let share = match self.start {
                    Start::Whole => 1.0,
                    Start::Half => 0.5,
                    Start::Nothing => 0.0,
                };
                (self.initial, share * x)
            }
        };
        let sum = self.leak * sum + period * added;
        match self.winds_up {
            true => sum,
            false => sum.clamp(self.min, self.max),
        }
    }
}

/// What these filters make of a source.
pub(super) fn filtered(links: &[Link], source: &[f64], begins: &[bool], period: f64) -> Vec<f64> {
    let mut memories = vec![Memory::default(); links.len()];
    let rows = source.iter().zip(begins).map(|(x, begins)| {
        let chained = links.iter().zip(&mut memories);
        chained.fold(*x, |x, (link, memory)| link.next(memory, *begins, period, x))
    });
    rows.collect()
}

/// What a feature would be with these filters, clip included.
pub(super) fn observation(feature: &Feature, links: &[Link], source: &[f64], begins: &[bool], period: f64) -> Vec<f64> {
    let rows = filtered(links, source, begins, period).into_iter().map(|y| {
        let y = feature.scale * y + feature.offset;
        match feature.clip {
            Some(clip) => y.clamp(clip.low, clip.high),
            None => y,
        }
    });
    rows.collect()
}
