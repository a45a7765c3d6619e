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
