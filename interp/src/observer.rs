//! Models of the converter that run beside it (contract section 2b).

use policy::{Circuit, Estimate, InputVoltage, OnTime};

use crate::real::{Range, Real};

/// An observer with its constants rounded to the format and its place in the memory.
#[derive(Debug, Clone)]
pub(crate) struct Observer<T> {
    /// First word in the memory of the controller.
    start: usize,
    /// Index of the output whose command drives it.
    pub output: usize,
    delayed: bool,
    topology: Circuit,
    carrier: OnTime,
    /// The output's share of the current per volt at the duty that holds the voltage, and the clamp of the surplus.
    hold: Option<(T, Range<T>)>,
    /// Inductor current per ampere of load at the start.
    start_by_load: T,
    source: Source<T>,
    output_voltage: usize,
    load_current: usize,
    /// T/L.
    by_current: T,
    /// T/C.
    by_voltage: T,
    /// Corrections per volt, of the estimates in their order.
    gains: [T; 3],
    /// Clamps of the estimates.
    ranges: [Range<T>; 3],
}

#[derive(Debug, Clone, Copy)]
enum Source<T> {
    Constant(T),
    Signal(usize),
}

/// What a prediction rests on beside the estimates.
#[derive(Clone, Copy)]
struct Drive<T> {
    duty: T,
    load_current: T,
    input_voltage: T,
}

/// What the step knows when its observers run.
#[derive(Clone, Copy)]
pub(crate) struct Measured<'a, T> {
    pub signals: &'a [T],
    pub valid: &'a [bool],
    pub primed: bool,
    /// Of the output that drives the observer.
    pub previous_command: T,
}

impl<T: Real> Observer<T> {
    /// `period` in seconds; `start` is the first free word of the memory.
    pub fn new(observer: &policy::Observer, period: f64, start: usize) -> Self {
        let gains = observer.gains;
        Self {
            start,
            output: observer.output,
            delayed: observer.compute_delay == 1,
            topology: observer.topology,
            carrier: observer.carrier,
            hold: observer
                .hold
                .map(|hold| (T::nearest(hold.share), Range::nearest(hold.range))),
            start_by_load: T::nearest(observer.hold.map_or(1.0, |hold| hold.start)),
            source: match observer.input_voltage {
                InputVoltage::Constant(volts) => Source::Constant(T::nearest(volts)),
                InputVoltage::Signal(index) => Source::Signal(index),
            },
            output_voltage: observer.output_voltage,
            load_current: observer.load_current,
            // quotients in binary64, rounded once: a division in the format would round differently
            by_current: T::nearest(period / observer.inductance),
            by_voltage: T::nearest(period / observer.capacitance),
            gains: [gains.current, gains.voltage, gains.bias].map(T::nearest),
            ranges: Estimate::STATE.map(|estimate| Range::nearest(observer.range(estimate))),
        }
    }

    /// The estimates of this step: current, voltage, bias, and the surplus, which is 0 without a voltage to hold.
    pub fn estimates(&self, measured: Measured<'_, T>, memory: &[T]) -> [T; 4] {
        let word = |index: usize| memory[self.start + index];
        let kept = [word(0), word(1), word(2)];
        let now = Drive {
            duty: measured.previous_command,
            load_current: measured.signals[self.load_current],
            input_voltage: match self.source {
                Source::Constant(volts) => volts,
                Source::Signal(index) => measured.signals[index],
            },
        };
        let unprimed = [
            self.ranges[0].clamp(now.load_current * self.start_by_load),
            measured.signals[self.output_voltage],
            T::ZERO,
        ];
        let known = |x: [T; 3]| if measured.primed { x } else { unprimed };
        if self.delayed {
            let corrected = self.corrected(known(kept), measured);
            return self.with_surplus(self.predicted(corrected, now), now);
        }
        // the command of the step before acts from its measurement to this one, with what was measured then
        let before = Drive {
            load_current: word(3),
            input_voltage: match self.source {
                Source::Constant(volts) => volts,
                Source::Signal(_) => word(4),
            },
            ..now
        };
        self.with_surplus(self.corrected(known(self.predicted(kept, before)), measured), now)
    }

    /// Moves the memory on by a step with these estimates.
    pub fn push(&self, memory: &mut [T], signals: &[T], estimates: [T; 4]) {
        let kept = match self.source {
            _ if self.delayed => [None, None],
            Source::Constant(_) => [Some(signals[self.load_current]), None],
            Source::Signal(index) => [Some(signals[self.load_current]), Some(signals[index])],
        };
        let [i, v, b, _] = estimates;
        let words = [i, v, b].into_iter().chain(kept.into_iter().flatten());
        for (word, x) in memory[self.start..].iter_mut().zip(words) {
            *word = x;
        }
    }

    fn corrected(&self, x: [T; 3], measured: Measured<'_, T>) -> [T; 3] {
        // a held sample says nothing of this instant
        let error = match measured.valid[self.output_voltage] {
            true => measured.signals[self.output_voltage] - x[1],
            false => T::ZERO,
        };
        [0, 1, 2].map(|each| self.ranges[each].clamp(x[each] + self.gains[each] * error))
    }

    fn predicted(&self, x: [T; 3], drive: Drive<T>) -> [T; 3] {
        match self.topology {
            Circuit::Buck => self.buck(x, drive),
            Circuit::Boost | Circuit::BuckBoost => self.switched_output(x, drive),
        }
    }

    fn buck(&self, [i, v, b]: [T; 3], drive: Drive<T>) -> [T; 3] {
        let half = T::nearest(0.5);
        let (d, u) = (drive.duty, drive.input_voltage);
        let moment = match self.carrier {
            OnTime::Trailing => d - d * d * half,
            OnTime::Centre => d * half,
        };
        let mut mean = u * moment - v * half;
        mean = mean + b * half;
        let mean = self.ranges[0].clamp(i + mean * self.by_current);
        let next = self.ranges[1].clamp(v + (mean - drive.load_current) * self.by_voltage);
        let mut sum = u * d - (v + next) * half;
        sum = sum + b;
        [self.ranges[0].clamp(i + sum * self.by_current), next, b]
    }

    /// A boost or a buck-boost: the output receives the current while the switch is off.
    fn switched_output(&self, [i, v, b]: [T; 3], drive: Drive<T>) -> [T; 3] {
        let half = T::nearest(0.5);
        let (d, u) = (drive.duty, drive.input_voltage);
        let off = T::nearest(1.0) - d;
        let across = |v: T| {
            let forward = match self.topology {
                Circuit::BuckBoost => u * d,
                _ => u,
            };
            forward - off * v + b
        };
        let mut mean = across(v) * half;
        if self.carrier == OnTime::Trailing {
            mean = mean + u * d * half;
        }
        let mean = self.ranges[0].clamp(i + mean * self.by_current);
        let next = self.ranges[1].clamp(v + (off * mean - drive.load_current) * self.by_voltage);
        let sum = across((v + next) * half);
        [self.ranges[0].clamp(i + sum * self.by_current), next, b]
    }

    fn with_surplus(&self, [i, v, b]: [T; 3], now: Drive<T>) -> [T; 4] {
        let Some((per_volt, range)) = self.hold else {
            return [i, v, b, T::ZERO];
        };
        let u = now.input_voltage;
        let share = (u + b) * per_volt;
        let mut mean = i;
        if self.carrier == OnTime::Trailing {
            mean = mean + u * (T::nearest(1.0) - share) * T::nearest(0.5) * self.by_current;
        }
        [i, v, b, range.clamp(share * mean - now.load_current)]
    }
}
