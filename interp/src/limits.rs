//! Slew limit, soft start, duty limits (contract section 9).

use crate::real::{Range, Real};
use crate::status;

/// Limits with their constants rounded to the format.
#[derive(Debug, Clone)]
pub(crate) struct Limits<T> {
    /// Rounded inwards.
    duty: Range<T>,
    /// Largest change per step, rounded down.
    slew: Option<T>,
    pub soft_start: Option<SoftStart<T>>,
}

/// The rising cap of a soft start.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SoftStart<T> {
    pub from: T,
    increment: T,
}

/// The duty after each limiter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Limited<T> {
    pub slewed: T,
    pub soft_started: T,
    pub limited: T,
    pub status: u32,
}

impl<T: Real> Limits<T> {
    pub fn new(limits: &policy::Limits) -> Self {
        Self {
            duty: Range::inwards(limits.duty),
            // down, so that rounding never lets the duty move farther than the contract says
            slew: limits.slew.map(T::down),
            soft_start: limits.soft_start.map(|soft| SoftStart {
                from: T::nearest(soft.from),
                increment: T::nearest((limits.duty.high - soft.from) / f64::from(soft.steps)),
            }),
        }
    }

    /// `soft_cap` is `None` without a soft start.
    pub fn apply(&self, mapped: T, previous_command: T, soft_cap: Option<T>) -> Limited<T> {
        // in this order, so that the duty limits have the last word: what slew and soft start leave is still clamped
        let mut bits = 0;
        let mut t = mapped;
        if let Some(slew) = self.slew {
            let reach = Range {
                lo: previous_command - slew,
                hi: previous_command + slew,
            };
            bits |= if reach.clamps(t) { status::SLEW_LIMITED } else { 0 };
            t = reach.clamp(t);
        }
        let slewed = t;
        if let Some(cap) = soft_cap
            // from above alone: a soft start holds a duty down and never raises one
            && t > cap
        {
            bits |= status::SOFT_START;
            t = cap;
        }
        let soft_started = t;
        bits |= if self.duty.clamps(t) { status::LIMITED } else { 0 };
        Limited {
            slewed,
            soft_started,
            limited: self.duty.clamp(t),
            status: bits,
        }
    }

    /// Whether a duty may leave the controller; false for NaN.
    pub fn contains(&self, duty: T) -> bool {
        self.duty.contains(duty)
    }

    /// The cap for the next step (section 10).
    pub fn next_cap(&self, soft: SoftStart<T>, cap: T, usable: bool) -> T {
        // so many rounded increments need not end at the limit, so the rise is cut off there
        let risen = cap + soft.increment;
        if !usable {
            soft.from
        } else if risen < self.duty.hi {
            risen
        } else {
            self.duty.hi
        }
    }
}

#[cfg(test)]
mod tests {
    use policy::Interval;

    use super::*;

    fn limits(slew: Option<f64>, soft_start: Option<policy::SoftStart>) -> Limits<f32> {
        Limits::new(&policy::Limits {
            duty: Interval { low: 0.1, high: 0.9 },
            slew,
            soft_start,
            initial_duty: 0.5,
        })
    }

    #[test]
    fn duty_limits_are_rounded_inwards() {
        let l = limits(None, None);
        // binary32 puts 0.9_f32 below 0.9 and 0.1_f32 above 0.1: both are the inner neighbours
        assert_eq!(l.apply(1.0, 0.5, None).limited, 0.9);
        assert_eq!(l.apply(0.0, 0.5, None).limited, 0.1);
        assert!(f64::from(l.duty.lo) >= 0.1 && f64::from(l.duty.hi) <= 0.9);
        // the fact that a table rounds past its limit: 0.05 + 8 * 0.10625 in binary32 is above 0.9
        let past = 0.05_f32 + 8.0 * 0.10625_f32;
        assert!(f64::from(past) > 0.9);
        assert_eq!(
            l.apply(past, 0.5, None),
            Limited {
                slewed: past,
                soft_started: past,
                limited: 0.9,
                status: status::LIMITED
            }
        );
        assert_eq!(l.apply(0.9, 0.5, None).status, 0);
    }

    #[test]
    fn slew_limits_both_directions_around_the_previous_command() {
        let l = limits(Some(0.125), None);
        assert_eq!(l.apply(0.875, 0.5, None).limited, 0.625);
        assert_eq!(l.apply(0.25, 0.5, None).limited, 0.375);
        assert_eq!(l.apply(0.875, 0.5, None).status, status::SLEW_LIMITED);
        assert_eq!(l.apply(0.625, 0.5, None).status, 0);
    }

    #[test]
    fn slew_step_is_rounded_down() {
        // 0.1_f32 is above 0.1
        assert_eq!(limits(Some(0.1), None).slew, Some(0.1_f32.next_down()));
    }

    #[test]
    fn limits_come_after_the_slew_and_have_the_last_word() {
        let l = limits(Some(0.125), None);
        // after a fallback at 0 the slew allows 0.125, after one at -1 (not possible) the limit still holds
        let t = l.apply(0.875, 0.0, None);
        assert_eq!((t.limited, t.status), (0.125, status::SLEW_LIMITED));
        let u = l.apply(0.0, 0.125, None);
        assert_eq!((u.slewed, u.limited, u.status), (0.0, 0.1, status::LIMITED));
        let v = l.apply(0.5, -1.0, None);
        assert_eq!(
            (v.slewed, v.limited, v.status),
            (-0.875, 0.1, status::SLEW_LIMITED | status::LIMITED)
        );
    }

    #[test]
    fn soft_start_caps_from_above_only() {
        let soft = policy::SoftStart { from: 0.25, steps: 4 };
        let l = limits(None, Some(soft));
        let t = l.apply(0.5, 0.5, Some(0.25));
        assert_eq!(
            (t.slewed, t.soft_started, t.limited, t.status),
            (0.5, 0.25, 0.25, status::SOFT_START)
        );
        assert_eq!(l.apply(0.25, 0.5, Some(0.25)).status, 0);
        assert_eq!(l.apply(0.125, 0.5, Some(0.25)).limited, 0.125);
    }

    #[test]
    fn soft_cap_rises_to_the_duty_limit_and_falls_back_to_its_start() {
        let l = limits(None, Some(policy::SoftStart { from: 0.25, steps: 4 }));
        let Some(soft) = l.soft_start else { panic!("soft start") };
        // (0.9 - 0.25)/4 = 0.1625
        let mut cap = soft.from;
        let mut caps = vec![];
        for _ in 0..6 {
            cap = l.next_cap(soft, cap, true);
            caps.push(cap);
        }
        let k = 0.1625_f32;
        let by_hand = [0.25 + k, 0.25 + k + k, 0.25 + k + k + k];
        assert_eq!(caps[..3], by_hand);
        assert!(caps[3..].iter().all(|&c| c <= 0.9) && caps[5] == 0.9);
        assert_eq!(l.next_cap(soft, 0.7, false), 0.25);
    }
}
