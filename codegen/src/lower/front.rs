//! Contract sections 2 to 5: sanitise, sources, filters, observation.
//!
//! ```text
//!  sample ─► within its range? ─► Select: sample or held ─► source ─► filters ─► scale, offset, clip ─► observation
//!                │                                             │                        │
//!                └─ And ─► all valid                           └─► pushes of `commit`   └─ Or ─► clipped
//! ```
//!
//! In: the features of a policy. Out: one straight-line block, its signals, observation and flags, and what `commit` pushes.
//! The one invariant: every operation is one rounding of the contract, in its order, and none of them depends on a flag, so
//! the number of executed instructions does not depend on the measurement.

use policy::{Estimate, Expr, Factor, Feature, Filter, Head, Input, Policy, Scalar, Still};

use crate::program::{Block, Front, Literal, Op, Push, ValueId};

/// Lowers the front half of a step; also gives the number of filter memory words.
pub fn lower(policy: &Policy) -> (Front, usize) {
    let mut builder = Builder {
        scalar: policy.numeric_format.scalar(),
        block: Block::default(),
        signals: Vec::new(),
        estimates: Vec::new(),
        pushes: Vec::new(),
        words: 0,
    };
    let (valid, all_valid) = builder.sanitise(policy);
    for (index, observer) in policy.observers.iter().enumerate() {
        // what nothing reads is left out: compilers would warn of it
        let is_read = policy.reads(Input::Estimate(index, Estimate::Surplus));
        let hold = observer.hold.filter(|_| is_read);
        let estimates = builder.observer(observer, hold, policy.sample_period, &valid);
        builder.estimates.push(estimates);
    }
    let mut clipped = Vec::new();
    let mut observation = Vec::new();
    let mut filtered = Vec::new();
    for feature in &policy.features {
        let (value, outside) = builder.feature(feature, policy.sample_period, &mut filtered);
        observation.push(value);
        clipped.extend(outside);
    }
    let law = builder.law(&policy.head, &filtered);
    let block = &mut builder.block;
    // differences of bits are gathered as words: one flag for all features, not one each
    let clipped = clipped.into_iter().reduce(|all, one| block.value(Op::Or(all, one)));
    let clipped = clipped.map(|differences| block.value(Op::NotZero(differences)));
    let front = Front {
        block: builder.block,
        signals: builder.signals,
        all_valid,
        clipped,
        base: law.base,
        factors: law.factors,
        still: law.still,
        observation,
        pushes: builder.pushes,
    };
    (front, builder.words)
}

/// What a law of control says before the network does.
#[derive(Default)]
struct Law {
    base: Option<ValueId>,
    still: Option<ValueId>,
    factors: Vec<ValueId>,
}

pub(super) struct Builder {
    scalar: Scalar,
    pub(super) block: Block,
    pub(super) signals: Vec<ValueId>,
    /// Of each observer.
    estimates: Vec<[ValueId; 4]>,
    pub(super) pushes: Vec<Push>,
    words: usize,
}

impl Builder {
    /// Fills `signals`; returns the flags that each is valid, and that all are.
    fn sanitise(&mut self, policy: &Policy) -> (Vec<ValueId>, ValueId) {
        let (scalar, block) = (self.scalar, &mut self.block);
        let mut flags = Vec::new();
        for (index, signal) in policy.signals.iter().enumerate() {
            let x = match signal.adc {
                None => block.value(Op::Measured(index)),
                Some(adc) => {
                    let code = block.value(Op::Code(index));
                    let gain = block.constant(Literal::nearest(scalar, adc.gain));
                    let offset = block.constant(Literal::nearest(scalar, adc.offset));
                    let scaled = block.value(Op::Mul(gain, code));
                    block.value(Op::Add(scaled, offset))
                }
            };
            let (low, high) = Literal::inward(scalar, signal.range);
            let (low, high) = (block.constant(low), block.constant(high));
            let valid = block.value(Op::Within { x, low, high });
            let held = block.value(Op::Held(index));
            // the step goes on with the held sample, usable or not: the same instructions for every measurement
            self.signals.push(block.value(Op::Select {
                flag: valid,
                then: x,
                otherwise: held,
            }));
            flags.push(valid);
        }
        let all = flags.iter().copied().reduce(|all, one| block.value(Op::And(all, one)));
        // a policy has at least one signal; without any, nothing could be invalid
        (flags, all.unwrap_or_default())
    }

    /// Observation and, with a clip, what it changed; adds the value behind the filters.
    fn feature(
        &mut self,
        feature: &Feature,
        sample_period: f64,
        filtered: &mut Vec<ValueId>,
    ) -> (ValueId, Option<ValueId>) {
        let mut value = self.expression(&feature.source);
        for filter in &feature.filters {
            value = self.filter(*filter, value, sample_period);
        }
        filtered.push(value);
        let (scalar, block) = (self.scalar, &mut self.block);
        if feature.scale != 1.0 {
            let scale = block.constant(Literal::nearest(scalar, feature.scale));
            value = block.value(Op::Mul(value, scale));
        }
        // not added if it is 0: that would make +0 of -0
        if feature.offset != 0.0 {
            let offset = block.constant(Literal::nearest(scalar, feature.offset));
            value = block.value(Op::Add(value, offset));
        }
        match feature.clip {
            None => (value, None),
            Some(clip) => {
                let low = block.constant(Literal::nearest(scalar, clip.low));
                let high = block.constant(Literal::nearest(scalar, clip.high));
                let clamped = block.value(Op::Clamp { x: value, low, high });
                (clamped, Some(block.value(Op::Difference(value, clamped))))
            }
        }
    }

    /// Law and dead zone of a residual head (section 8) or of a gain schedule (section 7c); `filtered` are the features behind
    /// their filters.
    fn law(&mut self, head: &Head, filtered: &[ValueId]) -> Law {
        match head {
            // several outputs have no law
            Head::Choice(_) | Head::Continuous(_) | Head::Several(_) => Law::default(),
            Head::Residual(head) => {
                let x = self.expression(&head.base.tree);
                let (low, high) = Literal::inward(self.scalar, head.limits);
                let (low, high) = (self.block.constant(low), self.block.constant(high));
                Law {
                    base: Some(self.block.value(Op::Clamp { x, low, high })),
                    still: self.still(&head.dead_zone),
                    factors: Vec::new(),
                }
            }
            Head::Schedule(head) => {
                let base = self.expression(&head.base.tree);
                let factors = head.gains.iter().filter_map(|gain| match &gain.factor {
                    Factor::Source(source) => Some(self.expression(&source.tree)),
                    Factor::Feature(index) => filtered.get(*index).copied(),
                    Factor::One => None,
                });
                let factors = factors.collect();
                Law {
                    base: Some(base),
                    still: self.still(&head.dead_zone),
                    factors,
                }
            }
        }
    }

    fn still(&mut self, zone: &[Still]) -> Option<ValueId> {
        let still = zone.iter().map(|still| {
            let x = self.expression(&still.source.tree);
            let (low, high) = (self.constant(-still.within), self.constant(still.within));
            self.block.value(Op::Within { x, low, high })
        });
        let still: Vec<ValueId> = still.collect();
        still.into_iter().reduce(|all, one| self.block.value(Op::And(all, one)))
    }

    fn expression(&mut self, expression: &Expr) -> ValueId {
        let op = match expression {
            Expr::Input(Input::Signal(index)) => return self.signals[*index],
            Expr::Input(Input::Estimate(index, estimate)) => return self.estimates[*index][*estimate as usize],
            Expr::Input(Input::PreviousDuty) => Op::PreviousDuty(0),
            Expr::Input(Input::PreviousCommand) => Op::PreviousCommand(0),
            Expr::Input(Input::OutputDuty(index)) => Op::PreviousDuty(*index),
            Expr::Input(Input::OutputCommand(index)) => Op::PreviousCommand(*index),
            Expr::Constant(value) => Op::Constant(Literal::nearest(self.scalar, *value)),
            Expr::Neg(x) => Op::Neg(self.expression(x)),
            Expr::Add(x, y) => Op::Add(self.expression(x), self.expression(y)),
            Expr::Sub(x, y) => Op::Sub(self.expression(x), self.expression(y)),
            Expr::Scale(by, x) => {
                let x = self.expression(x);
                Op::Mul(x, self.constant(*by))
            }
        };
        self.block.value(op)
    }

    fn filter(&mut self, filter: Filter, x: ValueId, period: f64) -> ValueId {
        match filter {
            Filter::Delay { samples } => {
                let word = self.line(samples, x);
                self.recall(word, x)
            }
            Filter::BackwardDifference => {
                let word = self.line(1, x);
                let before = self.recall(word, x);
                let difference = self.block.value(Op::Sub(x, before));
                self.scaled(difference, 1.0 / period)
            }
            Filter::LowPass { time_constant } => {
                let word = self.reserve(1);
                let before = self.recall(word, x);
                let difference = self.block.value(Op::Sub(x, before));
                let step = self.scaled(difference, period / (time_constant + period));
                let y = self.block.value(Op::Add(before, step));
                self.pushes.push(Push {
                    word,
                    length: 1,
                    value: y,
                });
                y
            }
            Filter::FilteredDerivative { time_constant } => self.filtered_derivative(time_constant, x, period),
            Filter::MovingAverage { samples } => {
                let word = self.line(samples - 1, x);
                let primed = self.block.value(Op::Primed);
                // one operation, so that a line of 256 samples is a loop and not as many statements
                let sum = self.block.value(Op::LineSum {
                    word,
                    length: samples - 1,
                    newest: x,
                    primed,
                });
                self.scaled(sum, 1.0 / samples as f64)
            }
            Filter::Integrator {
                min,
                max,
                initial,
                leak,
            } => {
                let word = self.reserve(1);
                let start = self.constant(initial);
                let before = self.recall(word, start);
                let kept = match leak == 1.0 {
                    true => before,
                    false => self.scaled(before, leak),
                };
                let step = self.scaled(x, period);
                let sum = self.block.value(Op::Add(kept, step));
                let low = self.constant(min);
                let high = self.constant(max);
                let y = self.block.value(Op::Clamp { x: sum, low, high });
                self.pushes.push(Push {
                    word,
                    length: 1,
                    value: y,
                });
                y
            }
        }
    }

    fn filtered_derivative(&mut self, time_constant: f64, x: ValueId, period: f64) -> ValueId {
        let x_word = self.line(1, x);
        let y_word = self.reserve(1);
        let x_before = self.recall(x_word, x);
        let zero = self.constant(0.0);
        let y_before = self.recall(y_word, zero);
        let decayed = self.scaled(y_before, time_constant / (time_constant + period));
        let difference = self.block.value(Op::Sub(x, x_before));
        let step = self.scaled(difference, 1.0 / (time_constant + period));
        let y = self.block.value(Op::Add(decayed, step));
        self.pushes.push(Push {
            word: y_word,
            length: 1,
            value: y,
        });
        y
    }

    pub(super) fn constant(&mut self, value: f64) -> ValueId {
        self.block.constant(Literal::nearest(self.scalar, value))
    }

    pub(super) fn scaled(&mut self, x: ValueId, by: f64) -> ValueId {
        // quotients of constants are made here, in binary64: a division would be another rounding, and slow
        let by = self.constant(by);
        self.block.value(Op::Mul(x, by))
    }

    pub(super) fn reserve(&mut self, length: usize) -> usize {
        let word = self.words;
        self.words += length;
        word
    }

    /// A new line of memory to which `value` is appended in every step.
    fn line(&mut self, length: usize, value: ValueId) -> usize {
        let word = self.reserve(length);
        self.pushes.push(Push { word, length, value });
        word
    }

    /// Oldest word of a line, or `unprimed` before the first good measurement.
    fn recall(&mut self, word: usize, unprimed: ValueId) -> ValueId {
        // selected at each read, not filled in before the first step: `eval` changes nothing
        let primed = self.block.value(Op::Primed);
        let memory = self.block.value(Op::Memory(word));
        self.block.value(Op::Select {
            flag: primed,
            then: memory,
            otherwise: unprimed,
        })
    }
}
