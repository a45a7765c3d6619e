//! Sets of states by splitting boxes: the bound over all states, the share that is decided, the map of a slice.
//!
//! ```text
//!  state_bounds  split the worst box again and again       every state lies in a leaf: the largest bound holds
//!  shares        a random point walks down the halves      is it in a box with one proven action?
//!  maps          cells of a plane, split while undecided   paint what is proven, look at a point of the rest
//! ```
//!
//! In: a certifier, a domain. Out: bounds and shares. The one invariant: where a box is cut depends on the box alone, never
//! on the point that asks, so all points walk down one tree, and proven boxes are a set whose volume can be estimated. Several
//! outputs share the boxes and each pass over the network.

use std::collections::BinaryHeap;

use policy::Interval;
use serde::Serialize;

use crate::measured::{Measured, QValues};
use crate::{Bound, Cell, Certifier, Domain, Memory};

/// Bound over all states, tightened by splitting.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StateBound {
    /// Proven for every state.
    pub bound: Bound,
    /// Boxes that were propagated.
    pub boxes: usize,
}

/// Share of a set of states that lies in boxes with one proven action.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Share {
    /// States drawn uniformly from the box of coordinates.
    pub samples: usize,
    /// Those in a proven box.
    pub proven: usize,
    /// 95 % confidence interval of the share (Wilson), 0..1.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// A plane through the states: two coordinates vary, the others stand still.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Slice {
    /// Which states.
    pub memory: Memory,
    /// Coordinate along x, and its range.
    pub x: (usize, Interval),
    /// Coordinate along y, and its range.
    pub y: (usize, Interval),
    /// Value of each coordinate; those of x and y are not used.
    pub at: Vec<f64>,
}

/// A slice in cells.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Map {
    /// What is shown.
    pub slice: Slice,
    /// Finest cells along x.
    pub columns: usize,
    /// Finest cells along y.
    pub rows: usize,
    /// Action proven for the whole finest cell, in real arithmetic and in the format; row of the lowest y first.
    #[serde(skip)]
    pub actions: Vec<Option<usize>>,
    /// Share of the area with a proven action, 0..1.
    pub proven_share: f64,
    /// Points at which the action was seen to change, coordinates x and y.
    #[serde(skip)]
    pub changes: Vec<(f64, f64)>,
    /// At the centre of each box that was not split further.
    pub measured: Measured,
    /// Boxes that were propagated.
    pub boxes: usize,
}

/// Largest number of cells of a map along an axis before splitting.
// conventions: with the halvings 384 by 256 finest cells, each some two pixels of the picture
const COARSE: (usize, usize) = (48, 32);
/// Halvings of a map's cell along each axis.
const SPLITS: usize = 3;

/// A box that waits for splitting, the worst first.
struct Waiting {
    /// How bad it is: the largest bound, of several outputs each in units of that over the whole domain.
    worst: f64,
    bounds: Vec<Bound>,
    cell: Cell,
}

impl Ord for Waiting {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        // a heap needs an order of all numbers, and `partial_cmp` has none for one that is no number
        self.worst.total_cmp(&other.worst)
    }
}

impl PartialOrd for Waiting {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Waiting {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Waiting {}

impl Certifier {
    /// Bound over all states of a domain for each output; the worst box is split until `boxes` were propagated.
    #[must_use]
    pub fn state_bounds(&self, domain: &Domain, boxes: usize) -> Vec<StateBound> {
        let whole = self.bounds_over(domain, &domain.whole());
        // Q values and duties have no unit in common: which box is worst is asked in shares of what is to be lowered
        let units: Vec<f64> = match whole.as_slice() {
            [_] => vec![1.0],
            all => all.iter().map(|bound| bound.largest.max(f64::MIN_POSITIVE)).collect(),
        };
        let wait = |cell: Cell| {
            let bounds = self.bounds_over(domain, &cell);
            let shares = bounds.iter().zip(&units).map(|(bound, unit)| bound.largest / unit);
            Waiting {
                worst: shares.fold(0.0, f64::max),
                bounds,
                cell,
            }
        };
        // alone in the heap: how bad it is does not matter
        let mut waiting = BinaryHeap::from([Waiting {
            worst: 0.0,
            bounds: whole.clone(),
            cell: domain.whole(),
        }]);
        let mut count = 1;
        // the worst first: the bound of the whole is the largest of the leaves, so no other split can lower it
        while count + 2 <= boxes {
            let Some(worst) = waiting.pop() else { break };
            let (lower, upper, _) = domain.halves(&worst.cell);
            waiting.push(wait(lower));
            waiting.push(wait(upper));
            count += 2;
        }
        let mut all: Vec<Vec<f64>> = whole.iter().map(|bound| vec![0.0; bound.per_action.len()]).collect();
        // the leaves cover the domain, so the largest of their bounds holds everywhere
        for leaf in &waiting {
            for (largest, bound) in all.iter_mut().zip(&leaf.bounds) {
                for (largest, bound) in largest.iter_mut().zip(&bound.per_action) {
                    *largest = largest.max(*bound);
                }
            }
        }
        let of = |per_action| StateBound {
            bound: Bound::of(per_action),
            boxes: count,
        };
        all.into_iter().map(of).collect()
    }

    /// Estimates the share of a domain that is covered by boxes in which an output has one proven action: each of the states, drawn
    /// uniformly ([`Domain::draw`]), follows the tree of halved boxes to a proven one, `depth` halvings at most. `None` of an
    /// output that makes no choice.
    #[must_use]
    pub fn shares(&self, domain: &Domain, points: &[Vec<f64>], depth: usize) -> Vec<Option<Share>> {
        self.shares_of(points.iter().map(|point| self.proven_at(domain, point, depth)))
    }

    /// Whether each output is decided in a box of the tree that holds the point.
    fn proven_at(&self, domain: &Domain, point: &[f64], depth: usize) -> Vec<bool> {
        let mut proven: Vec<bool> = vec![false; self.parts.len()];
        let mut cell = domain.whole();
        for halvings in 1..=depth {
            let (lower, upper, along) = domain.halves(&cell);
            cell = match (point.get(along), lower.get(along)) {
                (Some(x), Some(range)) if *x > range.high => upper,
                _ => lower,
            };
            // large boxes are hardly ever proven
            let is_looked_at = halvings % 4 == 0 || halvings == depth;
            if !is_looked_at {
                continue;
            }
            for (proven, decided) in proven.iter_mut().zip(self.decided(domain, &cell)) {
                *proven |= decided.is_some();
            }
            let mut both = proven.iter().zip(&self.parts);
            if both.all(|(proven, part)| *proven || !part.head.is_choice()) {
                break;
            }
        }
        proven
    }

    /// Share of boxes around observations, `radius` times the width of each feature's bound to both sides, in which an output has
    /// one proven action; `None` of an output that makes no choice.
    #[must_use]
    pub fn shares_around<'a>(
        &self,
        observations: impl IntoIterator<Item = &'a [f32]>,
        radius: f64,
    ) -> Vec<Option<Share>> {
        let whole = self.observations.whole();
        let around = |observation: &'a [f32]| {
            let cell: Cell = observation
                .iter()
                .zip(&whole)
                .map(|(o, bound)| {
                    let half = radius * (bound.high - bound.low);
                    // a trainer may have drawn it elsewhere; an integer network clamps it in the same way
                    let o = f64::from(*o).clamp(bound.low, bound.high);
                    Interval {
                        low: (o - half).max(bound.low),
                        high: (o + half).min(bound.high),
                    }
                })
                .collect();
            let decided = self.decided(&self.observations, &cell);
            decided.iter().map(Option::is_some).collect()
        };
        self.shares_of(observations.into_iter().map(around))
    }

    /// Counts, for each output, in how many of the places it is proven.
    fn shares_of(&self, places: impl Iterator<Item = Vec<bool>>) -> Vec<Option<Share>> {
        let (mut samples, mut counts) = (0, vec![0; self.parts.len()]);
        for place in places {
            samples += 1;
            for (count, proven) in counts.iter_mut().zip(place) {
                *count += usize::from(proven);
            }
        }
        let both = self.parts.iter().zip(counts);
        both.map(|(part, count)| part.head.is_choice().then(|| Share::of(count, samples)))
            .collect()
    }

    /// Splits a slice into boxes with one proven action of each output, as far as that goes, and looks at a point of each box;
    /// `None` of an output that makes no choice.
    #[must_use]
    pub fn maps(&self, domain: &Domain, slice: &Slice, q_values: &QValues<'_>) -> Vec<Option<Map>> {
        let fine = 1 << SPLITS;
        let (columns, rows) = (COARSE.0 * fine, COARSE.1 * fine);
        let blank = || Map {
            slice: slice.clone(),
            columns,
            rows,
            actions: vec![None; columns * rows],
            proven_share: 0.0,
            changes: Vec::new(),
            measured: Measured::default(),
            boxes: 0,
        };
        let mut painter = Painter {
            certifier: self,
            domain,
            q_values,
            slice,
            size: (columns, rows),
            maps: self
                .parts
                .iter()
                .map(|part| part.head.is_choice().then(blank))
                .collect(),
        };
        let open: Vec<bool> = painter.maps.iter().map(Option::is_some).collect();
        for row in (0..rows).step_by(fine) {
            for column in (0..columns).step_by(fine) {
                painter.paint((column, row), fine, &open);
            }
        }
        let mut maps = painter.maps;
        for map in maps.iter_mut().flatten() {
            let proven = map.actions.iter().filter(|action| action.is_some()).count();
            map.proven_share = proven as f64 / map.actions.len() as f64;
        }
        maps
    }
}

struct Painter<'a> {
    certifier: &'a Certifier,
    domain: &'a Domain,
    q_values: &'a QValues<'a>,
    slice: &'a Slice,
    /// Finest columns and rows.
    size: (usize, usize),
    maps: Vec<Option<Map>>,
}

impl Painter<'_> {
    /// A square of finest cells, for the outputs that are not yet decided around it.
    fn paint(&mut self, (column, row): (usize, usize), size: usize, open: &[bool]) {
        let x = part(self.slice.x.1, column, size, self.size.0);
        let y = part(self.slice.y.1, row, size, self.size.1);
        let one = |&value: &f64| Interval {
            low: value,
            high: value,
        };
        let mut cell: Cell = self.slice.at.iter().map(one).collect();
        cell[self.slice.x.0] = x;
        cell[self.slice.y.0] = y;
        let decided = self.certifier.decided(self.domain, &cell);
        let point: Vec<f64> = cell.iter().map(|range| 0.5 * (range.low + range.high)).collect();
        let mut seen = None;
        let mut left = vec![false; open.len()];
        for (index, action) in decided.into_iter().enumerate().filter(|(index, _)| open[*index]) {
            let Some(map) = &mut self.maps[index] else { continue };
            map.boxes += 1;
            // a proven square is not split: what holds for the whole holds for its parts
            if action.is_none() && size > 1 {
                left[index] = true;
                continue;
            }
            for row in row..row + size {
                map.actions[row * map.columns + column..][..size].fill(action);
            }
            let seen = seen.get_or_insert_with(|| {
                let observation = self.domain.observation(&point);
                self.certifier.look(&observation, self.q_values)
            });
            let output = &self.certifier.parts[index];
            if map.measured.add(output, &seen.real, &seen.held[index]) {
                map.changes.push((0.5 * (x.low + x.high), 0.5 * (y.low + y.high)));
            }
        }
        if left.contains(&true) {
            let half = size / 2;
            for (right, up) in [(0, 0), (half, 0), (0, half), (half, half)] {
                self.paint((column + right, row + up), half, &left);
            }
        }
    }
}

/// The interval of `size` cells of `count` from the one at `index`.
fn part(range: Interval, index: usize, size: usize, count: usize) -> Interval {
    let at = |index: usize| range.low + (range.high - range.low) * (index as f64 / count as f64);
    Interval {
        low: at(index),
        // a product of a fraction may be rounded below the end, which belongs to the last cell
        high: if index + size == count {
            range.high
        } else {
            at(index + size)
        },
    }
}

impl Share {
    /// Wilson's interval at 95 %.
    fn of(proven: usize, samples: usize) -> Self {
        // the normal distribution has 2.5 % beyond it on each side; Wilson's, because the usual interval has no width
        // where all samples are proven, or none
        const Z: f64 = 1.959_964;
        let n = samples.max(1) as f64;
        let share = proven as f64 / n;
        let centre = (share + Z * Z / (2.0 * n)) / (1.0 + Z * Z / n);
        let half = Z / (1.0 + Z * Z / n) * (share * (1.0 - share) / n + Z * Z / (4.0 * n * n)).sqrt();
        Self {
            samples,
            proven,
            low: (centre - half).max(0.0),
            high: (centre + half).min(1.0),
        }
    }
}
