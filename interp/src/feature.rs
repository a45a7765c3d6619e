//! From sanitised signals to the observation (contract sections 3 to 5).

use policy::{Expr, Input};

use crate::filter::Filter;
use crate::real::{Range, Real};
use crate::state::Remembered;
use crate::trace::FeatureTrace;

/// What a source expression can read.
#[derive(Clone, Copy)]
pub(crate) struct Inputs<'a, T> {
    pub signals: &'a [T],
    pub estimates: &'a [[T; 4]],
    pub previous_duty: T,
    pub previous_command: T,
    /// Of the outputs behind the first.
    pub others: &'a [Remembered<T>],
}

/// A source expression with its constants rounded to the format.
#[derive(Debug, Clone)]
pub(crate) enum Source<T> {
    Input(Input),
    Constant(T),
    Neg(Box<Source<T>>),
    Add(Box<Source<T>>, Box<Source<T>>),
    Sub(Box<Source<T>>, Box<Source<T>>),
    Scale(T, Box<Source<T>>),
}

impl<T: Real> Source<T> {
    pub fn new(expr: &Expr) -> Self {
        let boxed = |expr: &Expr| Box::new(Self::new(expr));
        match expr {
            Expr::Input(input) => Self::Input(*input),
            Expr::Constant(value) => Self::Constant(T::nearest(*value)),
            Expr::Neg(x) => Self::Neg(boxed(x)),
            Expr::Add(x, y) => Self::Add(boxed(x), boxed(y)),
            Expr::Sub(x, y) => Self::Sub(boxed(x), boxed(y)),
            Expr::Scale(k, x) => Self::Scale(T::nearest(*k), boxed(x)),
        }
    }

    /// A leaf in place, since most operands are one and a call costs more than they do; other expressions by [`Source::tree`].
    #[inline(always)]
    pub fn value(&self, inputs: Inputs<'_, T>) -> T {
        match self {
            Self::Input(Input::Signal(index)) => inputs.signals[*index],
            Self::Input(Input::Estimate(index, estimate)) => inputs.estimates[*index][*estimate as usize],
            Self::Input(Input::PreviousDuty | Input::OutputDuty(0)) => inputs.previous_duty,
            Self::Input(Input::PreviousCommand | Input::OutputCommand(0)) => inputs.previous_command,
            Self::Input(Input::OutputDuty(index)) => inputs.others[*index - 1].previous_duty,
            Self::Input(Input::OutputCommand(index)) => inputs.others[*index - 1].previous_command,
            Self::Constant(value) => *value,
            _ => self.tree(inputs),
        }
    }

    fn tree(&self, inputs: Inputs<'_, T>) -> T {
        match self {
            Self::Neg(x) => -x.value(inputs),
            Self::Add(x, y) => x.value(inputs) + y.value(inputs),
            Self::Sub(x, y) => x.value(inputs) - y.value(inputs),
            Self::Scale(k, x) => *k * x.value(inputs),
            Self::Input(_) | Self::Constant(_) => self.value(inputs),
        }
    }
}

/// A feature with its constants rounded to the format.
#[derive(Debug, Clone)]
pub(crate) struct Feature<T> {
    source: Source<T>,
    pub filters: Vec<Filter<T>>,
    /// `None` if the contract says exactly 1.
    scale: Option<T>,
    /// `None` if the contract says exactly 0.
    offset: Option<T>,
    clip: Option<Range<T>>,
}

impl<T: Real> Feature<T> {
    /// `period` in seconds; `start` is the first free word of the filter memory.
    pub fn new(feature: &policy::Feature, period: f64, start: usize) -> Self {
        // words are given out in the order of section 1: by feature, then by filter
        let mut next = start;
        let filters = feature
            .filters
            .iter()
            .map(|spec| {
                let filter = Filter::new(*spec, period, next);
                next += filter.words();
                filter
            })
            .collect();
        Self {
            source: Source::new(&feature.source),
            filters,
            // an offset of 0 is left out and not added: it would make +0 of -0, which the generated code keeps
            scale: (feature.scale != 1.0).then(|| T::nearest(feature.scale)),
            offset: (feature.offset != 0.0).then(|| T::nearest(feature.offset)),
            clip: feature.clip.map(Range::nearest),
        }
    }

    /// Number of filter memory words.
    pub fn words(&self) -> usize {
        self.filters.iter().map(Filter::words).sum()
    }

    /// Source and filters: fills `trace.source` and `trace.filtered`.
    pub fn filter(&self, inputs: Inputs<'_, T>, memory: &[T], primed: bool, trace: &mut FeatureTrace<T>) {
        let mut x = self.source.value(inputs);
        trace.source = x;
        for (filter, y) in self.filters.iter().zip(&mut trace.filtered) {
            x = filter.output(memory, primed, x);
            *y = x;
        }
    }

    /// Scale, offset, clip: fills `trace.unclipped`, `trace.clipped` and `trace.observation`.
    pub fn observe(&self, trace: &mut FeatureTrace<T>) {
        let mut o = trace.filter_output();
        if let Some(scale) = self.scale {
            o = o * scale;
        }
        if let Some(offset) = self.offset {
            o = o + offset;
        }
        trace.unclipped = o;
        trace.clipped = self.clip.is_some_and(|clip| clip.clamps(o));
        trace.observation = self.clip.map_or(o, |clip| clip.clamp(o));
    }

    /// Moves the filter memories on by the step that `trace` describes.
    pub fn push(&self, memory: &mut [T], primed: bool, trace: &FeatureTrace<T>) {
        let mut x = trace.source;
        for (filter, &y) in self.filters.iter().zip(&trace.filtered) {
            filter.push(memory, primed, x, y);
            x = y;
        }
    }
}

#[cfg(test)]
mod tests {
    use policy::Interval;

    use super::*;

    fn feature(source: Expr, scale: f64, offset: f64, clip: Option<Interval>) -> Feature<f32> {
        let everything = Interval { low: -1e30, high: 1e30 };
        Feature::new(
            &policy::Feature {
                name: "f".into(),
                source,
                source_text: String::new(),
                filters: vec![],
                scale,
                offset,
                clip,
                bound: everything,
            },
            1e-4,
            0,
        )
    }

    fn observe(feature: &Feature<f32>, signals: &[f32]) -> FeatureTrace<f32> {
        let mut trace = FeatureTrace::default();
        feature.filter(
            Inputs {
                signals,
                estimates: &[],
                previous_duty: 0.25,
                previous_command: 0.75,
                others: &[],
            },
            &[],
            false,
            &mut trace,
        );
        feature.observe(&mut trace);
        trace
    }

    fn signal(index: usize) -> Box<Expr> {
        Box::new(Expr::Input(Input::Signal(index)))
    }

    #[test]
    fn source_is_evaluated_as_the_tree_stands() {
        // (big + 1) - big loses the one, big - big + 1 does not
        let big = 33_554_432.0_f32;
        let one = || Box::new(Expr::Constant(1.0));
        let lost = Expr::Sub(Box::new(Expr::Add(signal(0), one())), signal(0));
        let kept = Expr::Add(Box::new(Expr::Sub(signal(0), signal(0))), one());
        assert_eq!(observe(&feature(lost, 1.0, 0.0, None), &[big]).source, 0.0);
        assert_eq!(observe(&feature(kept, 1.0, 0.0, None), &[big]).source, 1.0);
    }

    #[test]
    fn previous_duty_and_previous_command_are_told_apart() {
        let difference = Expr::Sub(
            Box::new(Expr::Input(Input::PreviousDuty)),
            Box::new(Expr::Input(Input::PreviousCommand)),
        );
        assert_eq!(observe(&feature(difference, 1.0, 0.0, None), &[]).source, -0.5);
    }

    #[test]
    fn a_reciprocal_is_rounded_once() {
        let source = Expr::Scale(1.0 / 1.5e-3, signal(0));
        assert_eq!(
            observe(&feature(source, 1.0, 0.0, None), &[3.0]).source,
            3.0 * 666.666_7_f32
        );
    }

    #[test]
    fn negative_zero_survives_unless_an_offset_is_added() {
        let neg = || Expr::Neg(signal(0));
        assert_eq!(
            observe(&feature(neg(), 1.0, 0.0, None), &[0.0]).observation.to_bits(),
            1 << 31
        );
        assert_eq!(
            observe(&feature(neg(), 2.0, 0.0, None), &[0.0]).observation.to_bits(),
            1 << 31
        );
        // the offset is not exactly 0 in the contract but rounds to +0: the addition stays
        assert_eq!(
            observe(&feature(neg(), 1.0, 1e-60, None), &[0.0]).observation.to_bits(),
            0
        );
    }

    #[test]
    fn scale_comes_before_offset_and_clip_last() {
        let clip = Some(Interval { low: -1.0, high: 4.0 });
        let f = feature(*signal(0), 2.0, -1.0, clip);
        let inside = observe(&f, &[2.5]);
        assert_eq!((inside.observation, inside.clipped), (4.0, false));
        let above = observe(&f, &[2.5_f32.next_up()]);
        assert_eq!((above.observation, above.clipped), (4.0, true));
        let below = observe(&f, &[-3.0]);
        assert_eq!((below.unclipped, below.observation, below.clipped), (-7.0, -1.0, true));
    }
}
