//! When the current of a diode ends, in each lane.

use crate::lane::{LANES, Lane, Mask, mask};
use crate::plain::Number;

/// `full::crossing`, lane by lane: the length of a step at whose end nothing is left of a current.
pub(super) struct Search {
    /// Of the step that is to be taken.
    pub length: Lane,
    step: Lane,
    pub crossed: Mask,
    /// Lanes that the walk would compute in another way.
    pub lost: Mask,
    /// Lanes still in search; none before it is known which have crossed.
    active: Option<Mask>,
    low: [Lane; 2],
    high: [Lane; 2],
    turns: u32,
}

impl Search {
    #[inline(always)]
    pub fn new(step: Lane) -> Self {
        let none = [0; LANES];
        Search {
            length: step,
            step,
            crossed: none,
            lost: none,
            active: None,
            low: [Lane::of(0.0); 2],
            high: [step; 2],
            turns: 0,
        }
    }

    /// Takes in what is left at the start of the step and at its end. Over, the step of this length was the last; else another one is asked.
    #[inline(always)]
    pub fn is_over(&mut self, takes: &Mask, [first, left]: [Lane; 2], only: &Lane) -> bool {
        let Some(mut active) = self.active else {
            let crossed = mask(|n| (takes[n] == 1) & (only.0[n] != 0.0) & (left.0[n] <= 0.0));
            if crossed == [0; LANES] {
                return true;
            }
            // a winding that carries the core's current alone has none to begin with
            self.lost = mask(|n| (crossed[n] == 1) & (first.0[n] <= 0.0));
            (self.low, self.high) = ([Lane::of(0.0), first], [self.step, left]);
            self.crossed = crossed;
            self.guess(crossed);
            return false;
        };
        if active == [0; LANES] {
            return true;
        }
        let turned = mask(|n| left.0[n] * self.high[1].0[n] < 0.0);
        let halved = [self.low[0], self.low[1] * Lane::of(0.5)];
        for at in [0, 1] {
            self.low[at] = self.high[at].or(&turned, halved[at]).or(&active, self.low[at]);
        }
        self.high = [self.length.or(&active, self.high[0]), left.or(&active, self.high[1])];
        for (active, left) in active.iter_mut().zip(&left.0) {
            *active &= u64::from(left.abs() >= 1e-13);
        }
        self.guess(active);
        false
    }

    /// The next length; of lanes that have found theirs, that one.
    #[inline(always)]
    fn guess(&mut self, mut active: Mask) {
        let (low, high) = (self.low, self.high);
        let guess = low[0] + (high[0] - low[0]) * low[1] / (low[1] - high[1]);
        for (n, active) in active.iter_mut().enumerate() {
            let (from, to, at) = (low[0].0[n], high[0].0[n], guess.0[n]);
            let inside = (at > from.min(to)) & (at < from.max(to)) & ((to - from).abs() >= 1e-15 * self.step.0[n]);
            // as often as `full::crossing`
            *active &= u64::from(inside & (self.turns < 40));
        }
        self.turns += 1;
        self.length = guess.or(&active, high[0]).or(&self.crossed, self.step);
        self.active = Some(active);
    }
}
