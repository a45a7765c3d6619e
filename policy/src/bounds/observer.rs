//! Whether every intermediate value of an observer stays in the format (contract section 2b).

use super::{Bounded, Box32, Inputs, Overflow};
use crate::model::{Estimate, InputVoltage, Observer};
use crate::rounding::nearest_f32;

/// Half of a number, as the contract writes it.
const HALF: f64 = 0.5;

/// Bounds of the estimates are their clamps; this is about what stands before these.
///
/// # Errors
/// The magnitude of a value that could leave the format.
pub(crate) fn observer(observer: &Observer, inputs: &Inputs, period: f64) -> Result<(), Overflow> {
    let ranges = Estimate::ALL.map(|estimate| Box32::nearest(observer.range(estimate)));
    let signal = |index| inputs.signal(index).ok_or(Overflow(f64::INFINITY));
    let measured = signal(observer.output_voltage)?;
    let source = match observer.input_voltage {
        InputVoltage::Constant(volts) => Box32::point(nearest_f32(volts)),
        InputVoltage::Signal(index) => signal(index)?,
    };
    let gains = [observer.gains.current, observer.gains.voltage, observer.gains.bias];
    let error = measured.sub(ranges[1])?;
    for (range, gain) in ranges.into_iter().zip(gains) {
        range.add(error.scale(gain)?)?;
    }
    let [current, voltage, bias] = ranges;
    let by_current = period / observer.inductance;
    let by_voltage = period / observer.capacitance;
    if !by_current.is_finite() || !by_voltage.is_finite() {
        return Err(Overflow(f64::INFINITY));
    }
    let duty = inputs.previous_command;
    let moment = duty.sub(duty.times(duty)?.scale(HALF)?)?;
    let mut mean = source.times(moment)?.sub(voltage.scale(HALF)?)?;
    mean = mean.add(bias.scale(HALF)?)?;
    current.add(mean.scale(by_current)?)?;
    // behind its clamp the mean is a current
    let charge = current.sub(signal(observer.load_current)?)?;
    voltage.add(charge.scale(by_voltage)?)?;
    let drive: Bounded = source
        .times(duty)?
        .sub(voltage.add(voltage)?.scale(HALF)?)
        .and_then(|drive| drive.add(bias));
    current.add(drive?.scale(by_current)?)?;
    Ok(())
}
