//! Whether every intermediate value of an observer stays in the format (contract section 2b).

use super::{Bounded, Box32, Inputs, Overflow};
use crate::model::{Circuit, Estimate, Hold, InputVoltage, Observer, OnTime};
use crate::rounding::nearest_f32;

/// Half of a number, as the contract writes it.
const HALF: f64 = 0.5;

/// What a prediction rests on.
struct Ranges {
    current: Box32,
    voltage: Box32,
    bias: Box32,
    source: Box32,
    load: Box32,
    duty: Box32,
    /// T/L and T/C.
    by_current: f64,
    by_voltage: f64,
}

/// Bounds of the estimates are their clamps; this is about what stands before these.
///
/// # Errors
/// The magnitude of a value that could leave the format.
pub(crate) fn observer(observer: &Observer, inputs: &Inputs, period: f64) -> Result<(), Overflow> {
    let ranges = Estimate::STATE.map(|estimate| Box32::nearest(observer.range(estimate)));
    let signal = |index| inputs.signal(index).ok_or(Overflow(f64::INFINITY));
    let measured = signal(observer.output_voltage)?;
    let gains = [observer.gains.current, observer.gains.voltage, observer.gains.bias];
    let error = measured.sub(ranges[1])?;
    for (range, gain) in ranges.into_iter().zip(gains) {
        range.add(error.scale(gain)?)?;
    }
    let [current, voltage, bias] = ranges;
    let ranges = Ranges {
        current,
        voltage,
        bias,
        source: match observer.input_voltage {
            InputVoltage::Constant(volts) => Box32::point(nearest_f32(volts)),
            InputVoltage::Signal(index) => signal(index)?,
        },
        load: signal(observer.load_current)?,
        duty: inputs.command(observer.output)?,
        by_current: period / observer.inductance,
        by_voltage: period / observer.capacitance,
    };
    if !ranges.by_current.is_finite() || !ranges.by_voltage.is_finite() {
        return Err(Overflow(f64::INFINITY));
    }
    match observer.topology {
        Circuit::Buck => ranges.buck(observer.carrier),
        Circuit::Boost | Circuit::BuckBoost => ranges.switched_output(observer.topology, observer.carrier),
    }?;
    observer
        .hold
        .map_or(Ok(()), |hold| ranges.surplus(hold, observer.carrier))
}

impl Ranges {
    fn buck(&self, carrier: OnTime) -> Result<(), Overflow> {
        let duty = self.duty;
        let moment = match carrier {
            OnTime::Trailing => duty.sub(duty.times(duty)?.scale(HALF)?)?,
            OnTime::Centre => duty.scale(HALF)?,
        };
        let mut mean = self.source.times(moment)?.sub(self.voltage.scale(HALF)?)?;
        mean = mean.add(self.bias.scale(HALF)?)?;
        self.current.add(mean.scale(self.by_current)?)?;
        // behind its clamp the mean is a current
        let charge = self.current.sub(self.load)?;
        self.voltage.add(charge.scale(self.by_voltage)?)?;
        let drive: Bounded = self
            .source
            .times(duty)?
            .sub(self.voltage.add(self.voltage)?.scale(HALF)?)
            .and_then(|drive| drive.add(self.bias));
        self.current.add(drive?.scale(self.by_current)?)?;
        Ok(())
    }

    fn switched_output(&self, topology: Circuit, carrier: OnTime) -> Result<(), Overflow> {
        let rest = Box32::point(1.0).sub(self.duty)?;
        let on = self.source.times(self.duty)?;
        let forward = if topology == Circuit::Boost { self.source } else { on };
        // the mean of two voltages lies between them: their sum is asked for on its own
        self.voltage.add(self.voltage)?;
        let drive = forward.sub(rest.times(self.voltage)?)?.add(self.bias)?;
        let mut mean = drive.scale(HALF)?;
        if carrier == OnTime::Trailing {
            mean = mean.add(on.scale(HALF)?)?;
        }
        self.current.add(mean.scale(self.by_current)?)?;
        let charge = rest.times(self.current)?.sub(self.load)?;
        self.voltage.add(charge.scale(self.by_voltage)?)?;
        self.current.add(drive.scale(self.by_current)?)?;
        Ok(())
    }

    fn surplus(&self, hold: Hold, carrier: OnTime) -> Result<(), Overflow> {
        self.load.scale(hold.start)?;
        let share = self.source.add(self.bias)?.scale(hold.share)?;
        let mut mean = self.current;
        if carrier == OnTime::Trailing {
            let on = self.source.times(Box32::point(1.0).sub(share)?)?;
            mean = mean.add(on.scale(HALF)?.scale(self.by_current)?)?;
        }
        share.times(mean)?.sub(self.load)?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::limits::MAX_MAGNITUDE;
    use crate::model::{Gains, Interval};

    const MAX: f64 = MAX_MAGNITUDE;

    fn between(low: f64, high: f64) -> Box32 {
        Box32::nearest(Interval { low, high })
    }

    fn point(value: f64) -> Box32 {
        between(value, value)
    }

    /// A source of 1 V, a duty of a half, and nothing else that is not 0.
    fn still() -> Ranges {
        Ranges {
            current: point(0.0),
            voltage: point(0.0),
            bias: point(0.0),
            source: point(1.0),
            load: point(0.0),
            duty: point(0.5),
            by_current: 0.0,
            by_voltage: 0.0,
        }
    }

    /// Whether it is refused, with this magnitude in units of the largest.
    #[track_caller]
    fn assert_refused(found: Result<(), Overflow>, expected: f64) {
        assert!(
            matches!(found, Err(Overflow(magnitude)) if (magnitude / (expected * MAX) - 1.0).abs() < 1e-6),
            "{found:?} {expected}"
        );
    }

    #[test]
    fn the_mean_voltage_and_that_of_the_whole_period_drive_the_current_of_a_buck() {
        // d - d^2/2 from -1/2 to 1, less a quarter: 0.75; the whole period from -1/2 to 1/2
        let moved = |carrier| {
            let ranges = Ranges {
                duty: between(0.0, 1.0),
                voltage: point(0.5),
                by_current: 1.5 * MAX,
                ..still()
            };
            ranges.buck(carrier)
        };
        assert_refused(moved(OnTime::Trailing), 1.125);
        // d/2 from 0 to 1/2, less a quarter
        assert!(moved(OnTime::Centre).is_ok());
        // the mean from 0 to 0.875, the whole period from 1/2 to 1
        let ranges = Ranges {
            duty: between(0.5, 1.0),
            by_current: 1.1 * MAX,
            ..still()
        };
        assert_refused(ranges.buck(OnTime::Trailing), 1.1);
        let ranges = Ranges {
            current: point(2.0),
            load: point(0.5),
            by_voltage: 0.8 * MAX,
            ..still()
        };
        assert_refused(ranges.buck(OnTime::Trailing), 1.2);
    }

    #[test]
    fn a_switched_output_meets_the_source_as_its_circuit_says() {
        use Circuit::{Boost, BuckBoost};
        let of = |circuit, carrier, voltage: f64, by_current: f64| {
            let ranges = Ranges {
                voltage: point(voltage),
                by_current: by_current * MAX,
                ..still()
            };
            ranges.switched_output(circuit, carrier)
        };
        // 1 V throughout, and half a volt while the switch is on
        assert_refused(of(Boost, OnTime::Centre, 0.0, 1.2), 1.2);
        assert!(of(BuckBoost, OnTime::Centre, 0.0, 1.2).is_ok());
        assert_refused(of(BuckBoost, OnTime::Centre, 0.0, 2.4), 1.2);
        // 1 - 0.9 in all; its half and half of the half volt is 0.3
        assert_refused(of(Boost, OnTime::Trailing, 1.8, 3.9), 1.17);
        assert!(of(Boost, OnTime::Centre, 1.8, 3.9).is_ok());
        // the output takes as much as the source gives: 1 - 0.5 * 2
        assert!(of(Boost, OnTime::Centre, 2.0, 3.9).is_ok());
        // the sum of two output voltages, however slowly they drive
        assert_refused(of(Boost, OnTime::Centre, 0.6 * MAX, 0.0), 1.2);
        // half of the current reaches the output
        let ranges = Ranges {
            current: point(4.0),
            load: point(0.5),
            by_voltage: 0.8 * MAX,
            ..still()
        };
        assert_refused(ranges.switched_output(Boost, OnTime::Centre), 1.2);
    }

    #[test]
    fn a_surplus_is_the_share_of_the_mean_current_less_the_load() {
        let of = |ranges: Ranges, share: f64, start: f64, carrier| {
            let hold = Hold {
                voltage: 1.0,
                share,
                start,
                range: Interval { low: -1.0, high: 1.0 },
            };
            ranges.surplus(hold, carrier)
        };
        let loaded = || Ranges {
            load: point(0.5),
            ..still()
        };
        assert_refused(of(loaded(), 0.5, 2.4 * MAX, OnTime::Centre), 1.2);
        let flowing = || Ranges {
            current: point(0.6 * MAX),
            ..still()
        };
        assert_refused(of(flowing(), 2.0, 1.0, OnTime::Centre), 1.2);
        assert!(of(flowing(), 0.5, 1.0, OnTime::Centre).is_ok());
        // a valley lies half of what the switch adds below the mean: 1 - share of the source, none of it or two volts
        let rising = || Ranges {
            by_current: 1.2 * MAX,
            ..still()
        };
        assert_refused(of(rising(), -1.0, 1.0, OnTime::Trailing), 1.2);
        assert!(of(rising(), -1.0, 1.0, OnTime::Centre).is_ok());
        let steep = || Ranges {
            by_current: 2.4 * MAX,
            ..still()
        };
        assert!(of(steep(), 1.0, 1.0, OnTime::Trailing).is_ok());
    }

    /// A buck with the duty 1/2 whose source is a number; periods of 4 s.
    fn judged(change: impl FnOnce(&mut Observer)) -> Result<(), Overflow> {
        let mut own = Observer {
            name: "plant".into(),
            topology: Circuit::Buck,
            carrier: OnTime::Centre,
            hold: None,
            inductance: 2.0,
            capacitance: 2.0,
            input_voltage: InputVoltage::Constant(1.0),
            output_voltage: 0,
            load_current: 1,
            compute_delay: 0,
            output: 0,
            gains: Gains {
                current: 0.0,
                voltage: 0.0,
                bias: 0.0,
            },
            current: Interval { low: -9.0, high: 9.0 },
            voltage: Interval { low: -1.0, high: 1.0 },
            bias: Interval { low: -8.0, high: 8.0 },
        };
        change(&mut own);
        let inputs = Inputs {
            signals: vec![between(-1.0, 1.0), point(0.0)],
            previous_duty: point(0.5),
            previous_command: point(0.5),
            outputs: Vec::new(),
            estimates: Vec::new(),
        };
        observer(&own, &inputs, 4.0)
    }

    #[test]
    fn the_error_of_the_voltage_is_corrected_in_each_state() {
        assert!(judged(|_| ()).is_ok());
        // measured and estimated voltage are 2 V apart at most, whatever current and bias are
        let gains = |gain: f64| Gains {
            current: gain,
            voltage: gain,
            bias: gain,
        };
        assert!(judged(|own| own.gains = gains(0.4 * MAX)).is_ok());
        assert_refused(judged(|own| own.gains.current = 0.6 * MAX), 1.2);
        assert_refused(judged(|own| own.gains.voltage = 0.6 * MAX), 1.2);
        assert_refused(judged(|own| own.gains.bias = 0.6 * MAX), 1.2);
        // the clamps are added behind the product: 0.4 MAX and twice 0.35 MAX
        assert_refused(
            judged(|own| {
                own.bias = Interval {
                    low: 0.0,
                    high: 0.4 * MAX,
                };
                own.gains.bias = 0.35 * MAX;
            }),
            1.1,
        );
    }

    #[test]
    fn a_period_over_inductance_and_capacitance_moves_current_and_voltage() {
        let source = |volts: f64| judged(|own| own.input_voltage = InputVoltage::Constant(volts * MAX));
        // half of the source drives, and 4 s over 2 H double it
        assert!(source(0.8).is_ok());
        assert_refused(source(1.2), 1.2);
        let current = |amperes: f64| {
            judged(|own| {
                own.current = Interval {
                    low: 0.0,
                    high: amperes * MAX,
                }
            })
        };
        assert!(current(0.4).is_ok());
        assert_refused(current(0.6), 1.2);
        for without in [
            |own: &mut Observer| own.inductance = 0.0,
            |own: &mut Observer| own.capacitance = 0.0,
        ] {
            assert!(matches!(judged(without), Err(Overflow(f64::INFINITY))));
        }
    }
}
