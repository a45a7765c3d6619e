//! Contract section 2b: models of the converter that run beside it.
//!
//! ```text
//!  delay 1:  memory ─► correct ─► predict with the command under way ─► estimates, memory
//!  delay 0:  memory ─► predict with the last command ─► correct ─► estimates, memory
//! ```
//!
//! In: the observers of a policy. Out: values of the block in front of the features, and what `commit` pushes. The one
//! invariant: both orders need `previous_command` of one output alone, so no observer waits for the network.

use policy::{Circuit, Estimate, Hold, InputVoltage, Observer, OnTime};

use super::front::Builder;
use crate::program::{Op, Push, ValueId};

/// What a prediction rests on beside the estimates.
#[derive(Clone, Copy)]
struct Drive {
    duty: ValueId,
    load_current: ValueId,
    input_voltage: ValueId,
}

impl Builder {
    /// The estimates of an observer, among them its surplus at `hold`, or 0; `valid` holds the flags of the signals.
    pub fn observer(
        &mut self,
        observer: &Observer,
        hold: Option<Hold>,
        period: f64,
        valid: &[ValueId],
    ) -> [ValueId; 4] {
        let first = self.reserve(observer.words());
        let kept = [0, 1, 2].map(|word| self.block.value(Op::Memory(first + word)));
        let now = Drive {
            duty: self.block.value(Op::PreviousCommand(observer.output)),
            load_current: self.signals[observer.load_current],
            input_voltage: self.input_voltage(observer, None),
        };
        let estimates = if observer.compute_delay == 1 {
            let known = self.known(observer, kept);
            let corrected = self.corrected(observer, known, valid);
            self.predicted(observer, corrected, now, period)
        } else {
            let before = Drive {
                load_current: self.block.value(Op::Memory(first + 3)),
                input_voltage: self.input_voltage(observer, Some(first + 4)),
                ..now
            };
            let predicted = self.predicted(observer, kept, before, period);
            let known = self.known(observer, predicted);
            self.corrected(observer, known, valid)
        };
        let kept = observer
            .remembered()
            .map(|index| self.signals[index])
            .collect::<Vec<_>>();
        for (word, value) in estimates.into_iter().chain(kept).enumerate() {
            self.pushes.push(Push {
                word: first + word,
                length: 1,
                value,
            });
        }
        let [i, v, b] = estimates;
        let surplus = match hold {
            None => self.constant(0.0),
            Some(hold) => self.surplus(observer, hold, [i, b], now, period),
        };
        [i, v, b, surplus]
    }

    /// Of this step, or of the one before from a word of the memory.
    fn input_voltage(&mut self, observer: &Observer, before: Option<usize>) -> ValueId {
        match (observer.input_voltage, before) {
            (InputVoltage::Constant(volts), _) => self.constant(volts),
            (InputVoltage::Signal(index), None) => self.signals[index],
            (InputVoltage::Signal(_), Some(word)) => self.block.value(Op::Memory(word)),
        }
    }

    /// The same, or where an observer begins before the first good measurement.
    fn known(&mut self, observer: &Observer, x: [ValueId; 3]) -> [ValueId; 3] {
        let load_current = self.signals[observer.load_current];
        let load_current = match observer.hold {
            None => load_current,
            Some(hold) => self.scaled(load_current, hold.start),
        };
        let start = [
            self.clamped(observer, Estimate::Current, load_current),
            self.signals[observer.output_voltage],
            self.constant(0.0),
        ];
        let flag = self.block.value(Op::Primed);
        [0, 1, 2].map(|each| {
            self.block.value(Op::Select {
                flag,
                then: x[each],
                otherwise: start[each],
            })
        })
    }

    fn corrected(&mut self, observer: &Observer, x: [ValueId; 3], valid: &[ValueId]) -> [ValueId; 3] {
        let measured = self.signals[observer.output_voltage];
        let difference = self.block.value(Op::Sub(measured, x[1]));
        let zero = self.constant(0.0);
        // a held sample says nothing of this instant
        let error = self.block.value(Op::Select {
            flag: valid[observer.output_voltage],
            then: difference,
            otherwise: zero,
        });
        let gains = [observer.gains.current, observer.gains.voltage, observer.gains.bias];
        [0, 1, 2].map(|each| {
            let step = self.scaled(error, gains[each]);
            let sum = self.block.value(Op::Add(x[each], step));
            self.clamped(observer, Estimate::ALL[each], sum)
        })
    }

    fn predicted(&mut self, observer: &Observer, x: [ValueId; 3], drive: Drive, period: f64) -> [ValueId; 3] {
        match observer.topology {
            Circuit::Buck => self.buck(observer, x, drive, period),
            Circuit::Boost | Circuit::BuckBoost => self.switched_output(observer, x, drive, period),
        }
    }

    fn buck(&mut self, observer: &Observer, [i, v, b]: [ValueId; 3], drive: Drive, period: f64) -> [ValueId; 3] {
        let (d, u) = (drive.duty, drive.input_voltage);
        let (by_current, by_voltage) = (period / observer.inductance, period / observer.capacitance);
        let moment = match observer.carrier {
            OnTime::Trailing => {
                let square = self.block.value(Op::Mul(d, d));
                let late = self.scaled(square, 0.5);
                self.block.value(Op::Sub(d, late))
            }
            OnTime::Centre => self.scaled(d, 0.5),
        };
        let on = self.block.value(Op::Mul(u, moment));
        let half = self.scaled(v, 0.5);
        let driven = self.block.value(Op::Sub(on, half));
        let half = self.scaled(b, 0.5);
        let driven = self.block.value(Op::Add(driven, half));
        let step = self.scaled(driven, by_current);
        let mean = self.block.value(Op::Add(i, step));
        let mean = self.clamped(observer, Estimate::Current, mean);
        let surplus = self.block.value(Op::Sub(mean, drive.load_current));
        let step = self.scaled(surplus, by_voltage);
        let next = self.block.value(Op::Add(v, step));
        let next = self.clamped(observer, Estimate::Voltage, next);
        let on = self.block.value(Op::Mul(u, d));
        let both = self.block.value(Op::Add(v, next));
        let half = self.scaled(both, 0.5);
        let driven = self.block.value(Op::Sub(on, half));
        let driven = self.block.value(Op::Add(driven, b));
        let step = self.scaled(driven, by_current);
        let end = self.block.value(Op::Add(i, step));
        [self.clamped(observer, Estimate::Current, end), next, b]
    }

    /// A boost or a buck-boost: the output receives the current while the switch is off.
    fn switched_output(
        &mut self,
        observer: &Observer,
        [i, v, b]: [ValueId; 3],
        drive: Drive,
        period: f64,
    ) -> [ValueId; 3] {
        let (d, u) = (drive.duty, drive.input_voltage);
        let (by_current, by_voltage) = (period / observer.inductance, period / observer.capacitance);
        let one = self.constant(1.0);
        let off = self.block.value(Op::Sub(one, d));
        let forward = match observer.topology {
            Circuit::BuckBoost => self.block.value(Op::Mul(u, d)),
            _ => u,
        };
        let driven = self.across(forward, off, v, b);
        let mut mean = self.scaled(driven, 0.5);
        if observer.carrier == OnTime::Trailing {
            let on = self.block.value(Op::Mul(u, d));
            let half = self.scaled(on, 0.5);
            mean = self.block.value(Op::Add(mean, half));
        }
        let step = self.scaled(mean, by_current);
        let mean = self.block.value(Op::Add(i, step));
        let mean = self.clamped(observer, Estimate::Current, mean);
        let received = self.block.value(Op::Mul(off, mean));
        let surplus = self.block.value(Op::Sub(received, drive.load_current));
        let step = self.scaled(surplus, by_voltage);
        let next = self.block.value(Op::Add(v, step));
        let next = self.clamped(observer, Estimate::Voltage, next);
        let both = self.block.value(Op::Add(v, next));
        let middle = self.scaled(both, 0.5);
        let driven = self.across(forward, off, middle, b);
        let step = self.scaled(driven, by_current);
        let end = self.block.value(Op::Add(i, step));
        [self.clamped(observer, Estimate::Current, end), next, b]
    }

    /// The mean voltage at the inductor of a boost or a buck-boost at the output voltage v.
    fn across(&mut self, forward: ValueId, off: ValueId, v: ValueId, b: ValueId) -> ValueId {
        let against = self.block.value(Op::Mul(off, v));
        let driven = self.block.value(Op::Sub(forward, against));
        self.block.value(Op::Add(driven, b))
    }

    /// What would charge the capacitor at the duty that holds the voltage.
    fn surplus(&mut self, observer: &Observer, hold: Hold, [i, b]: [ValueId; 2], now: Drive, period: f64) -> ValueId {
        let u = now.input_voltage;
        let driven = self.block.value(Op::Add(u, b));
        let share = self.scaled(driven, hold.share);
        let mean = match observer.carrier {
            OnTime::Centre => i,
            OnTime::Trailing => {
                let one = self.constant(1.0);
                let duty = self.block.value(Op::Sub(one, share));
                let on = self.block.value(Op::Mul(u, duty));
                let half = self.scaled(on, 0.5);
                let step = self.scaled(half, period / observer.inductance);
                self.block.value(Op::Add(i, step))
            }
        };
        let received = self.block.value(Op::Mul(share, mean));
        let surplus = self.block.value(Op::Sub(received, now.load_current));
        self.clamped(observer, Estimate::Surplus, surplus)
    }

    fn clamped(&mut self, observer: &Observer, estimate: Estimate, x: ValueId) -> ValueId {
        let range = observer.range(estimate);
        let (low, high) = (self.constant(range.low), self.constant(range.high));
        self.block.value(Op::Clamp { x, low, high })
    }
}
