//! From a controller's command to a PWM channel: [`PwmActuator`] over any driver with embedded-hal's `SetDutyCycle`.
//!
//! ```no_run
//! # use embedded_hal::pwm::SetDutyCycle;
//! # use example_embedded_hal::{PwmActuator, buck12::{Controller, Measurement}};
//! # fn interrupt<P: SetDutyCycle>(pwm: P, sample: Measurement) -> Result<(), P::Error> {
//! let mut controller = Controller::new();
//! let mut actuator = PwmActuator::new(pwm, 0.40..=0.60, 0.0)?;
//! // in the control interrupt
//! let command = controller.step(&sample);
//! actuator.apply(&command)?;
//! # Ok(()) }
//! ```
#![no_std]
#![forbid(unsafe_code)]

use core::ops::RangeInclusive;

use embedded_hal::pwm::SetDutyCycle;

policy_macro::include_policy!(pub "policy/policy.toml");

use buck12::{Command, status};

/// What an actuator has done with a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Applied {
    /// The commanded duty is set.
    Commanded,
    /// The safe duty is set instead.
    Safe,
}

/// A PWM channel under a controller. It sets the safe duty whenever a command cannot be trusted.
#[derive(Debug)]
pub struct PwmActuator<P> {
    pwm: P,
    limits: RangeInclusive<f32>,
    safe_duty: f32,
    faults: u32,
}

impl<P: SetDutyCycle> PwmActuator<P> {
    /// Takes the channel and sets the safe duty. `limits` are the duties (0..1) that the power stage stands: a policy's own
    /// limits lie inside. `safe_duty` is set on a fault and may lie outside of them; 0 leaves the switch open.
    ///
    /// # Errors
    /// The driver's.
    pub fn new(pwm: P, limits: RangeInclusive<f32>, safe_duty: f32) -> Result<Self, P::Error> {
        let mut actuator = Self {
            pwm,
            limits,
            safe_duty,
            faults: status::FALLBACK,
        };
        actuator.make_safe()?;
        Ok(actuator)
    }

    /// Bits of `status` that lead to the safe duty; at first [`status::FALLBACK`] alone (no usable measurement).
    /// `status::HELD`, for instance, would not bridge a single bad sample any more.
    #[must_use]
    pub fn with_faults(mut self, faults: u32) -> Self {
        self.faults = faults;
        self
    }

    /// Sets the commanded duty, rounded to the nearest tick (see [`ticks`]); or the safe duty if the status says fault or
    /// the duty lies outside of the limits or is no number.
    ///
    /// # Errors
    /// The driver's. The channel then has the duty it had before.
    pub fn apply(&mut self, command: &Command) -> Result<Applied, P::Error> {
        let Some(duty) = self.trusted(command) else {
            self.make_safe()?;
            return Ok(Applied::Safe);
        };
        self.pwm.set_duty_cycle(ticks(duty, self.pwm.max_duty_cycle()))?;
        Ok(Applied::Commanded)
    }

    /// As [`PwmActuator::apply`], for a driver that makes more of a fraction than ticks of the counter (dithering, a
    /// high-resolution timer): the duty as the nearest of 65,536 fractions. embedded-hal's own conversion to ticks, which a
    /// driver may keep, rounds down.
    ///
    /// # Errors
    /// As [`PwmActuator::apply`].
    pub fn apply_fraction(&mut self, command: &Command) -> Result<Applied, P::Error> {
        let Some(duty) = self.trusted(command) else {
            self.make_safe()?;
            return Ok(Applied::Safe);
        };
        self.pwm.set_duty_cycle_fraction(ticks(duty, u16::MAX), u16::MAX)?;
        Ok(Applied::Commanded)
    }

    /// Sets the safe duty; also for an over-current trip and at the end.
    ///
    /// # Errors
    /// The driver's.
    pub fn make_safe(&mut self) -> Result<(), P::Error> {
        self.pwm
            .set_duty_cycle(ticks(self.safe_duty, self.pwm.max_duty_cycle()))
    }

    fn trusted(&self, command: &Command) -> Option<f32> {
        // a comparison with NaN is false
        let trusted = command.status & self.faults == 0 && self.limits.contains(&command.duty);
        trusted.then_some(command.duty)
    }
}

/// The compare value nearest to `duty` (0..1) of `max`, a half upwards; the product is rounded to f32 first, which moves a
/// duty by less than a hundredth of a tick. Below 0 and no number: 0. Above 1: `max`.
#[must_use]
pub fn ticks(duty: f32, max: u16) -> u16 {
    // `as` cuts off and stays within u16
    let ticks = (duty * f32::from(max) + 0.5) as u16;
    ticks.min(max)
}

#[cfg(test)]
mod tests;
