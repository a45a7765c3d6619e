//! Load steps of an electronic load, whose current runs from one level to the next at a slope.
//!
//! ```text
//! sample   ○      ○      ○      ○
//! load    ─────────────╱────────────     level, slope, level
//! column   1.0    1.0    1.4    2.0      one row lies in the slope
//! ```
//! Such a step takes a row or two to a reader of the table, and is one step all the same.

use plant::Load;

/// Most rows that lie in a slope: a longer one is a ramp, which a step at one instant does not stand for.
const MOST_INSIDE: usize = 2;

/// A load step in a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct LoadStep {
    /// First row whose load is not the old one.
    pub first: usize,
    /// First row whose load is the new one; the rows before it, from `first` on, lie in the slope.
    pub last: usize,
}

impl LoadStep {
    /// Row of the one step that stands for it: the middle of the slope, whose rows are sampled at `phase` of their periods.
    pub fn row(self, phase: f64) -> usize {
        let inside = (self.last - self.first) as f64;
        if inside == 0.0 {
            return self.first;
        }
        let middle = self.first as f64 + phase + 0.5 * (inside - 1.0);
        (middle.round() as usize).clamp(self.first, self.last)
    }
}

/// All changes of a load; those row by row in one direction, few enough for a slope, are one.
pub(crate) fn load_steps(load: &[Load]) -> Vec<LoadStep> {
    let changes: Vec<usize> = (1..load.len()).filter(|n| load[*n] != load[*n - 1]).collect();
    let mut list = Vec::new();
    for run in changes.chunk_by(|a, b| a + 1 == *b) {
        let (Some(first), Some(last)) = (run.first().copied(), run.last().copied()) else {
            continue;
        };
        match last - first <= MOST_INSIDE && is_slope(&load[first - 1..=last]) {
            true => list.push(LoadStep { first, last }),
            false => list.extend(run.iter().map(|row| LoadStep {
                first: *row,
                last: *row,
            })),
        }
    }
    list
}

/// Whether nothing of a load turns back.
fn is_slope(load: &[Load]) -> bool {
    let parts: [fn(&Load) -> f64; 3] = [|load| load.conductance, |load| load.current, |load| load.power];
    parts.into_iter().all(|part| {
        let rise = |pair: &[Load]| part(&pair[1]) - part(&pair[0]);
        load.windows(2).all(|pair| rise(pair) >= 0.0) || load.windows(2).all(|pair| rise(pair) <= 0.0)
    })
}

#[cfg(test)]
mod tests {
    use plant::Load;

    use super::{LoadStep, load_steps};

    fn of(currents: &[f64]) -> Vec<LoadStep> {
        let load: Vec<Load> = currents.iter().map(|current| Load::current(*current)).collect();
        load_steps(&load)
    }

    #[test]
    fn a_level_a_slope_and_a_level_are_one_step() {
        assert_eq!(of(&[1.0, 1.0, 1.4, 2.0, 2.0]), [LoadStep { first: 2, last: 3 }]);
        assert_eq!(of(&[2.0, 1.7, 1.2, 1.0, 1.0]), [LoadStep { first: 1, last: 3 }]);
    }

    #[test]
    fn a_pulse_a_ramp_and_steps_apart_are_no_slope() {
        let each = |rows: &[usize]| {
            let step = |row: &usize| LoadStep {
                first: *row,
                last: *row,
            };
            rows.iter().map(step).collect::<Vec<_>>()
        };
        assert_eq!(of(&[1.0, 1.0, 2.0, 1.0, 1.0]), each(&[2, 3]));
        assert_eq!(of(&[1.0, 1.2, 1.4, 1.6, 1.8, 2.0]), each(&[1, 2, 3, 4, 5]));
        assert_eq!(of(&[1.0, 1.4, 1.4, 2.0]), each(&[1, 3]));
    }

    #[test]
    fn the_step_stands_in_the_middle_of_the_slope() {
        let one = LoadStep { first: 7, last: 8 };
        assert_eq!([one.row(0.0), one.row(0.9)], [7, 8]);
        assert_eq!(LoadStep { first: 7, last: 9 }.row(0.4), 8);
        assert_eq!(LoadStep { first: 7, last: 7 }.row(0.9), 7);
    }
}
