//! A commanded duty waits whole periods beyond the next start of a PWM period (compute delay).

use serde::{Deserialize, Serialize};

use crate::entry::{Effect, Field, Parameter, Way};

/// Longest delay, periods.
pub const LONGEST: usize = 8;

/// Catalogue entry.
pub const EFFECT: Effect = Effect {
    name: "duty_delay",
    meaning: "whole periods a commanded duty waits",
    needs: Way::Step,
    parameters: &[Parameter {
        key: "pwm.duty_delay",
        unit: "1",
        meaning: "whole periods a commanded duty waits beyond the next start of a PWM period",
        allowed: (0.0, LONGEST as f64),
        // sampled, computed and updated within a period, or a period for each of the last two
        typical: (0.0, 2.0),
        neutral: 0.0,
        switches_on: true,
        field: Field::Whole(
            |p| u64::from(p.pwm.duty_delay),
            // what does not fit is out of range, too, and `check` refuses it
            |p, value| p.pwm.duty_delay = u32::try_from(value).unwrap_or(u32::MAX),
        ),
    }],
};

/// The duties that wait, the next one first.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Queue([f64; LONGEST]);

impl Queue {
    pub fn filled(duty: f64) -> Self {
        Queue([duty; LONGEST])
    }

    /// Takes the duty commanded `delay` periods ago.
    #[inline(always)]
    pub fn pass(&mut self, duty: f64, delay: u32) -> f64 {
        let last = match (delay as usize).min(LONGEST) {
            0 => return duty,
            n => n - 1,
        };
        let next = self.0[0];
        self.0.copy_within(1..=last, 0);
        self.0[last] = duty;
        next
    }
}
