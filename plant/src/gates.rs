//! When the switches conduct: from a duty to intervals within the PWM period, with delays that reach into the next one.
//!
//! ```text
//!                    command falls     command rises
//! command  ‾‾‾‾‾‾‾‾‾‾‾‾|_________________|‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾
//! upper    ‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾|_____________________|‾‾‾‾‾‾‾‾‾‾‾‾‾‾   down off later, up dead + on later
//! lower    ___________________|‾‾‾‾‾‾‾‾‾‾‾‾‾|__________________   up dead + on later, down off later
//! ```
//!
//! A `Train` delays one gate. Of the lower gate it holds the times at which that gate is *off*, so that both gates
//! follow the same pulse. Invariant: no delay reaches a whole period (`check`), so a train owes the next period one
//! pulse at most.

use serde::{Deserialize, Serialize};

use crate::effects::{dead_time, switch_delay};
use crate::parameters::{Carrier, Parameters, Rectifier};

/// Start and end in seconds from the period's start; empty when the end is not after the start.
type Span = (f64, f64);
const EMPTY: Span = (0.0, 0.0);

/// How long after the command a gate follows.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct GateTiming {
    t_sw: f64,
    carrier: Carrier,
    synchronous: bool,
    /// Delay of the rising and falling edge of the upper gate.
    upper: (f64, f64),
    /// Delay of the lower gate's falling edge (commanded when the upper is to rise) and of its rising edge.
    lower: (f64, f64),
}

impl GateTiming {
    pub fn new(p: &Parameters) -> Self {
        let (on, off) = switch_delay::edges(p);
        let dead = dead_time::hold_back(p);
        GateTiming {
            t_sw: p.t_sw(),
            carrier: p.pwm.carrier,
            synchronous: p.converter.rectifier == Rectifier::Synchronous,
            upper: (dead + on, off),
            lower: (off, dead + on),
        }
    }

    /// Whether a steady `duty` has the switch on just before the instant at `phase` of the period.
    pub fn is_on_before(&self, duty: f64, phase: f64) -> bool {
        let (start, end) = self.pulse(duty);
        // what is true just before the start of a period belongs to the end of the one before
        let t = if phase > 0.0 { phase * self.t_sw } else { self.t_sw };
        start < t && t <= end
    }

    /// When the upper gate rises and falls at a steady `duty`, s from the period's start.
    pub fn edges(&self, duty: f64) -> [f64; 2] {
        let (start, end) = self.pulse(duty);
        [start + self.upper.0, end + self.upper.1]
    }

    /// The pulse the modulator commands, s.
    fn pulse(&self, duty: f64) -> Span {
        let (t, on) = (self.t_sw, duty * self.t_sw);
        match self.carrier {
            _ if duty >= 1.0 => (0.0, t),
            Carrier::Trailing => (0.0, on),
            Carrier::Leading => (t - on, t),
            Carrier::Centre => (0.5 * (t - on), 0.5 * (t + on)),
        }
    }
}

/// What conducts, as far as the gates decide it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub(crate) enum Gate {
    Main,
    Second,
    #[default]
    Neither,
}

/// A gate that is high in at most two intervals of the period, and what it owes the next.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
struct Train {
    spans: [Span; 2],
    /// The last pulse as seen from the next period, without its falling delay.
    owed: Span,
    /// The command was high up to the period's end.
    high_at_end: bool,
}

impl Train {
    fn next(&mut self, pulse: Span, delay: (f64, f64), t_sw: f64) {
        let (start, end) = pulse;
        let (mut old, mut new) = (self.owed, EMPTY);
        if end > start {
            // a command that stays high over the period's end has no edge there: its rising delay must not begin anew
            let goes_on = self.high_at_end && start <= 0.0;
            new = (
                if goes_on { self.owed.0.max(0.0) } else { start + delay.0 },
                end + delay.1,
            );
            if goes_on {
                old = EMPTY;
            }
        }
        self.high_at_end = end > start && end >= t_sw;
        // a late falling edge that meets the next pulse is no edge at the gate
        let overlap = old.1 > old.0 && new.1 > new.0 && new.0 <= old.1;
        if overlap {
            new = (new.0.min(old.0), new.1.max(old.1));
            old = EMPTY;
        }
        // a pulse shorter than its rising delay ends before it starts: it is lost and owes nothing
        self.owed = match new.1 > t_sw && new.1 > new.0 {
            true => ((new.0 - t_sw).max(0.0), new.1 - t_sw),
            false => EMPTY,
        };
        let clip = |s: Span| {
            if s.1 > s.0 && s.0 < t_sw {
                (s.0, s.1.min(t_sw))
            } else {
                EMPTY
            }
        };
        self.spans = [clip(old), clip(new)];
    }

    fn is_high(&self, t: f64) -> bool {
        self.spans.iter().any(|&(start, end)| start <= t && t < end)
    }

    fn next_edge(&self, t: f64, so_far: f64) -> f64 {
        let mut next = so_far;
        for (start, end) in self.spans {
            if end > start {
                for edge in [start, end] {
                    if edge > t && edge < next {
                        next = edge;
                    }
                }
            }
        }
        next
    }
}

/// The gates in the PWM period that runs.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Gates {
    upper: Train,
    lower_off: Train,
}

impl Gates {
    /// Plans the next period.
    pub fn plan(&mut self, timing: &GateTiming, duty: f64) {
        let pulse = timing.pulse(duty);
        self.upper.next(pulse, timing.upper, timing.t_sw);
        if timing.synchronous {
            self.lower_off.next(pulse, timing.lower, timing.t_sw);
        }
    }

    /// Whether what came before says nothing of the next period.
    pub fn owe_nothing(&self) -> bool {
        [&self.upper, &self.lower_off]
            .iter()
            .all(|train| train.owed.1 <= train.owed.0 && !train.high_at_end)
    }

    /// The first edge after `t` and before `limit`, else `limit`.
    pub fn next_edge(&self, timing: &GateTiming, t: f64, limit: f64) -> f64 {
        let next = self.upper.next_edge(t, limit);
        match timing.synchronous {
            true => self.lower_off.next_edge(t, next),
            false => next,
        }
    }

    /// What conducts at `t`.
    pub fn at(&self, timing: &GateTiming, t: f64) -> Gate {
        // where delays let both gates be high the upper one counts: this circuit has no shoot-through
        if self.upper.is_high(t) {
            return Gate::Main;
        }
        match timing.synchronous && !self.lower_off.is_high(t) {
            true => Gate::Second,
            false => Gate::Neither,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn timing(carrier: Carrier, upper: (f64, f64)) -> GateTiming {
        GateTiming {
            t_sw: 1.0,
            carrier,
            synchronous: false,
            upper,
            lower: (0.0, 0.0),
        }
    }

    fn on_time(timing: &GateTiming, duties: &[f64]) -> Vec<f64> {
        let mut gates = Gates::default();
        let length = |(start, end): Span| end - start;
        let mut on = |&duty: &f64| {
            gates.plan(timing, duty);
            gates.upper.spans.iter().map(|&s| length(s)).sum::<f64>()
        };
        duties.iter().map(&mut on).collect()
    }

    #[test]
    fn every_carrier_has_the_same_on_time() {
        for carrier in [Carrier::Trailing, Carrier::Leading, Carrier::Centre] {
            for (duty, on) in [0.0, 0.25, 0.5, 1.0]
                .iter()
                .zip(on_time(&timing(carrier, (0.0, 0.0)), &[0.0, 0.25, 0.5, 1.0]))
            {
                assert!((on - duty).abs() < 1e-15, "{carrier:?} {duty} {on}");
            }
        }
    }

    #[test]
    fn a_late_falling_edge_reaches_into_the_next_period() {
        let on = on_time(&timing(Carrier::Leading, (0.0, 0.1)), &[0.5, 0.0]);
        assert!((on[0] - 0.5).abs() < 1e-15 && (on[1] - 0.1).abs() < 1e-15, "{on:?}");
    }

    #[test]
    fn full_duty_has_no_edges() {
        let on = on_time(&timing(Carrier::Trailing, (0.2, 0.1)), &[1.0, 1.0, 1.0]);
        assert!((on[0] - 0.8).abs() < 1e-15 && on[1] == 1.0 && on[2] == 1.0, "{on:?}");
    }

    #[test]
    fn a_pulse_shorter_than_its_delay_is_lost() {
        assert_eq!(on_time(&timing(Carrier::Trailing, (0.2, 0.0)), &[0.1, 0.1]), [0.0, 0.0]);
    }
}
