//! Measurements in, sanitised signals out (contract section 2).

use std::fmt;
use toml_input::{Faults, Message};

use crate::real::{Range, Real};

/// One measured value as it arrives at the controller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Sample {
    /// Value in the unit of the signal, a binary32 number.
    Physical(f32),
    /// Value in the unit of the signal, a binary64 number: as it arrives in `f64`, rounded to nearest elsewhere.
    Wide(f64),
    /// ADC code of a signal with gain and offset.
    Code(i32),
}

/// What was wrong with the arguments of a call. Values are never wrong: those are sanitised.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InputError {
    /// One sample per signal is needed.
    SampleCount {
        /// Number of signals of the policy.
        expected: usize,
        /// Number of samples given.
        found: usize,
    },
    /// The signal is measured by an ADC, the sample is a physical value.
    CodeExpected {
        /// Index of the signal.
        signal: usize,
    },
    /// The signal arrives in its unit, the sample is an ADC code.
    PhysicalExpected {
        /// Index of the signal.
        signal: usize,
    },
    /// One command per output is needed.
    CommandCount {
        /// Number of outputs of the policy.
        expected: usize,
        /// Number of commands given.
        found: usize,
    },
    /// The observation must have one value per feature.
    ObservationLength {
        /// Number of features of the policy.
        expected: usize,
        /// Number of values given.
        found: usize,
    },
}

impl fmt::Display for InputError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::SampleCount { expected, found } => {
                write!(f, "expected {expected} samples, one per signal, found {found}")
            }
            Self::CodeExpected { signal } => write!(f, "signal {signal}: expected an ADC code, found a physical value"),
            Self::PhysicalExpected { signal } => {
                write!(f, "signal {signal}: expected a physical value, found an ADC code")
            }
            Self::CommandCount { expected, found } => {
                write!(f, "expected {expected} commands, one per output, found {found}")
            }
            Self::ObservationLength { expected, found } => {
                write!(f, "expected an observation of {expected} values, found {found}")
            }
        }
    }
}

impl std::error::Error for InputError {}

impl From<InputError> for Faults {
    fn from(error: InputError) -> Self {
        Message::new(error.to_string()).into()
    }
}

/// A signal with its constants rounded to the format.
#[derive(Debug, Clone)]
pub(crate) struct Signal<T> {
    adc: Option<(T, T)>,
    range: Range<T>,
}

impl<T: Real> Signal<T> {
    pub fn new(signal: &policy::Signal) -> Self {
        Self {
            adc: signal.adc.map(|adc| (T::nearest(adc.gain), T::nearest(adc.offset))),
            // inwards: no sample beyond the contract's range passes because an end was rounded outwards
            range: Range::inwards(signal.range),
        }
    }

    /// Value of the plausible range nearest to 0: the held sample after `reset`.
    pub fn nearest_to_zero(&self) -> T {
        if self.range.lo > T::ZERO {
            self.range.lo
        } else if self.range.hi < T::ZERO {
            self.range.hi
        } else {
            T::ZERO
        }
    }

    /// The sample as a number in the unit of the signal, plausible or not.
    pub fn physical(&self, index: usize, sample: Sample) -> Result<T, InputError> {
        match (self.adc, sample) {
            (None, Sample::Physical(x)) => Ok(T::widen(x)),
            (None, Sample::Wide(x)) => Ok(T::nearest(x)),
            // added even if it is 0, as in the contract: that makes +0 of -0, and left out it would be another bit
            (Some((gain, offset)), Sample::Code(n)) => Ok(gain * T::from_code(n) + offset),
            (None, Sample::Code(_)) => Err(InputError::PhysicalExpected { signal: index }),
            (Some(_), Sample::Physical(_) | Sample::Wide(_)) => Err(InputError::CodeExpected { signal: index }),
        }
    }

    pub fn plausible(&self, x: T) -> bool {
        self.range.contains(x)
    }
}

#[cfg(test)]
mod tests {
    use policy::{Adc, Interval};

    use super::*;

    fn signal(low: f64, high: f64, adc: Option<Adc>) -> Signal<f32> {
        Signal::new(&policy::Signal {
            name: "v".into(),
            unit: "V".into(),
            range: Interval { low, high },
            adc,
        })
    }

    #[test]
    fn nan_and_infinities_are_not_plausible() {
        let v = signal(-1e30, 1e30, None);
        for x in [
            f32::NAN,
            -f32::NAN,
            f32::INFINITY,
            f32::NEG_INFINITY,
            f32::from_bits(0x7f80_0001),
        ] {
            assert!(!v.plausible(x));
        }
    }

    #[test]
    fn range_is_rounded_inwards() {
        // 0.1_f32 is above 0.1 and stays inside [0.1, 0.9]; 0.9_f32 is below 0.9 and stays inside as well
        let v = signal(0.1, 0.9, None);
        assert!(v.plausible(0.1) && v.plausible(0.9));
        // seen from the other side both fall out
        let w = signal(0.9, 1.1, None);
        assert!(!w.plausible(0.9) && !w.plausible(1.1) && w.plausible(1.0));
    }

    #[test]
    fn held_sample_after_reset_is_the_plausible_value_nearest_to_zero() {
        assert_eq!(signal(-1.0, 1.0, None).nearest_to_zero().to_bits(), 0);
        assert_eq!(signal(-1.0, -0.0, None).nearest_to_zero().to_bits(), 0);
        assert_eq!(signal(-0.0, 1.0, None).nearest_to_zero().to_bits(), 0);
        assert_eq!(signal(0.1, 1.0, None).nearest_to_zero(), 0.1);
        assert_eq!(signal(-2.0, -0.1, None).nearest_to_zero(), -0.1);
    }

    #[test]
    fn adc_code_is_rounded_then_scaled_then_shifted() {
        let v = signal(
            -1e12,
            1e12,
            Some(Adc {
                gain: 0.1,
                offset: -3.0,
                bits: None,
            }),
        );
        // 2^24 + 1 is not a binary32 number: fl(n) = 2^24
        let scaled = 0.1_f32 * 16_777_216.0_f32;
        assert_eq!(v.physical(0, Sample::Code(16_777_217)), Ok(scaled - 3.0));
        assert_eq!(v.physical(0, Sample::Code(30)), Ok(0.1_f32 * 30.0 - 3.0));
    }

    #[test]
    fn adc_offset_zero_is_added_too() {
        let v = signal(
            -1.0,
            1.0,
            Some(Adc {
                gain: -0.5,
                offset: 0.0,
                bits: None,
            }),
        );
        // -0.5 * 0 = -0, and -0 + 0 = +0
        assert_eq!(v.physical(0, Sample::Code(0)).map(f32::to_bits), Ok(0));
    }

    #[test]
    fn the_kind_of_sample_must_fit_the_signal() {
        let physical = signal(0.0, 1.0, None);
        let adc = signal(
            0.0,
            1.0,
            Some(Adc {
                gain: 1.0,
                offset: 0.0,
                bits: None,
            }),
        );
        assert_eq!(
            physical.physical(2, Sample::Code(0)),
            Err(InputError::PhysicalExpected { signal: 2 })
        );
        assert_eq!(
            adc.physical(3, Sample::Physical(0.0)),
            Err(InputError::CodeExpected { signal: 3 })
        );
    }
}
