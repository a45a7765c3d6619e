//! Which slice of the states a map shows.

use policy::{Interval, Policy};

use crate::{Certifier, Domain, Memory, Slice};

impl Domain {
    /// The states that a map of a policy shows: settled ones, unless those have fewer than two coordinates.
    #[must_use]
    pub fn mapped(policy: &Policy) -> (Memory, Self) {
        let of = |memory| (memory, Self::of(policy, memory));
        let settled = of(Memory::Settled);
        match settled.1.coordinates().len() > 1 {
            true => settled,
            false => of(Memory::Free),
        }
    }

    /// Indices of the coordinates: those of the policy's signals in the order of the signals, then the others.
    #[must_use]
    pub fn signals_first(&self, policy: &Policy) -> Vec<usize> {
        let position = |name: &str| self.coordinates().iter().position(|c| c.name == name);
        let signals = policy.signals.iter();
        let mut order: Vec<usize> = signals.filter_map(|signal| position(&signal.name)).collect();
        let others = (0..self.coordinates().len()).filter(|index| !order.contains(index));
        let others: Vec<usize> = others.collect();
        order.extend(others);
        order
    }

    /// The middle of each coordinate's range, in its unit.
    #[must_use]
    pub fn middle(&self) -> Vec<f64> {
        let ranges = self.coordinates().iter().map(|coordinate| coordinate.range);
        ranges.map(|range| 0.5 * (range.low + range.high)).collect()
    }
}

impl Slice {
    /// The slice of the states with this memory through `at`, a value for each coordinate in its unit, along the coordinates `x`
    /// and `y`. An axis without a range shows where the real network's action changes. `None` if a coordinate is none, or
    /// `at` has not as many values as there are coordinates.
    #[must_use]
    pub fn through(
        policy: &Policy,
        memory: Memory,
        x: (usize, Option<Interval>),
        y: (usize, Option<Interval>),
        at: Vec<f64>,
    ) -> Option<Self> {
        let domain = Domain::of(policy, memory);
        let coordinates = domain.coordinates();
        let whole = |(index, given): (usize, Option<Interval>)| {
            let range = coordinates.get(index)?.range;
            Some((index, given.unwrap_or(range)))
        };
        let (whole_x, whole_y) = (whole(x)?, whole(y)?);
        if at.len() != coordinates.len() {
            return None;
        }
        let mut slice = Slice {
            memory,
            x: whole_x,
            y: whole_y,
            at,
        };
        let zoomed = Certifier::new(policy).zoomed(&domain, &slice);
        slice.x.1 = x.1.unwrap_or(zoomed.x.1);
        slice.y.1 = y.1.unwrap_or(zoomed.y.1);
        Some(slice)
    }
}
