//! The exact mapping of a converter, as far as a formula goes: what a fitted one can be compared with.

use drm::formula::Losses;
use plant::Signals;
use policy::Interval;

use crate::controller::{Answer, Controller};
use crate::faults::Error;

/// A controller without a mapping whose duty is turned into that with which `real` has the voltage of `trained_on`.
pub(super) struct Ideal<'a> {
    pub inner: &'a mut dyn Controller,
    pub trained_on: Losses,
    pub real: Losses,
    pub limits: Interval,
}

impl Controller for Ideal<'_> {
    fn restart(&mut self) -> Result<(), Error> {
        self.inner.restart()
    }

    fn step(&mut self, measured: &Signals) -> Result<Answer, Error> {
        let answer = self.inner.step(measured)?;
        let i_out = measured.i_out;
        let v_out = self.trained_on.v_out(answer.duty, i_out);
        let duty = self.real.d_real(v_out / self.real.v_in, i_out);
        Ok(Answer {
            duty: duty.clamp(self.limits.low, self.limits.high),
            ..answer
        })
    }
}
