//! Sets of states by splitting boxes: the bound over all states, the share that is decided, the map of a slice.
//!
//! ```text
//!  state_bound  split the worst box again and again       every state lies in a leaf: the largest bound holds
//!  share        a random point walks down the halves      is it in a box with one proven action?
//!  map          cells of a plane, split while undecided   paint what is proven, look at a point of the rest
//! ```
//!
//! In: a certifier, a domain. Out: bounds and shares. The one invariant: where a box is cut depends on the box alone, never
//! on the point that asks, so all points walk down one tree, and proven boxes are a set whose volume can be estimated.

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
    bound: Bound,
    cell: Cell,
}

impl Ord for Waiting {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        // a heap needs an order of all numbers, and `partial_cmp` has none for one that is no number
        self.bound.largest.total_cmp(&other.bound.largest)
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
    /// Bound over all states of a domain; the worst box is split until `boxes` were propagated.
    #[must_use]
    pub fn state_bound(&self, domain: &Domain, boxes: usize) -> StateBound {
        let wait = |cell: Cell| Waiting {
            bound: self.bound_over(domain, &cell),
            cell,
        };
        let mut waiting = BinaryHeap::from([wait(domain.whole())]);
        let mut count = 1;
        // the worst first: the bound of the whole is the largest of the leaves, so no other split can lower it
        while count + 2 <= boxes {
            let Some(worst) = waiting.pop() else { break };
            let (lower, upper, _) = domain.halves(&worst.cell);
            waiting.push(wait(lower));
            waiting.push(wait(upper));
            count += 2;
        }
        let mut per_action: Vec<f64> = Vec::new();
        // the leaves cover the domain, so the largest of their bounds holds everywhere
        for leaf in &waiting {
            per_action.resize(leaf.bound.per_action.len(), 0.0);
            for (largest, bound) in per_action.iter_mut().zip(&leaf.bound.per_action) {
                *largest = largest.max(*bound);
            }
        }
        StateBound {
            bound: Bound::of(per_action),
            boxes: count,
        }
    }

    /// Estimates the share of a domain that is covered by proven boxes: each of the states, drawn uniformly
    /// ([`Domain::draw`]), follows the tree of halved boxes to a proven one, `depth` halvings at most.
    #[must_use]
    pub fn share(&self, domain: &Domain, points: &[Vec<f64>], depth: usize) -> Share {
        let proven = points
            .iter()
            .filter(|point| self.is_in_proven_box(domain, point, depth));
        Share::of(proven.count(), points.len())
    }

    fn is_in_proven_box(&self, domain: &Domain, point: &[f64], depth: usize) -> bool {
        let mut cell = domain.whole();
        for halvings in 1..=depth {
            let (lower, upper, along) = domain.halves(&cell);
            cell = match (point.get(along), lower.get(along)) {
                (Some(x), Some(range)) if *x > range.high => upper,
                _ => lower,
            };
            // large boxes are hardly ever proven
            let is_looked_at = halvings % 4 == 0 || halvings == depth;
            if is_looked_at && self.decided(domain, &cell).is_some() {
                return true;
            }
        }
        false
    }

    /// Share of boxes around observations, `radius` times the width of each feature's bound to both sides, that have one
    /// proven action.
    #[must_use]
    pub fn share_around<'a>(&self, observations: impl IntoIterator<Item = &'a [f32]>, radius: f64) -> Share {
        let (mut samples, mut proven) = (0, 0);
        let whole = self.observations.whole();
        for observation in observations {
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
            samples += 1;
            proven += usize::from(self.decided(&self.observations, &cell).is_some());
        }
        Share::of(proven, samples)
    }

    /// Splits a slice into boxes with one proven action, as far as that goes, and looks at a point of each box.
    #[must_use]
    pub fn map(&self, domain: &Domain, slice: &Slice, q_values: &QValues<'_>) -> Map {
        let fine = 1 << SPLITS;
        let (columns, rows) = (COARSE.0 * fine, COARSE.1 * fine);
        let mut painter = Painter {
            certifier: self,
            domain,
            q_values,
            map: Map {
                slice: slice.clone(),
                columns,
                rows,
                actions: vec![None; columns * rows],
                proven_share: 0.0,
                changes: Vec::new(),
                measured: Measured::default(),
                boxes: 0,
            },
        };
        for row in (0..rows).step_by(fine) {
            for column in (0..columns).step_by(fine) {
                painter.paint(column, row, fine);
            }
        }
        let mut map = painter.map;
        let proven = map.actions.iter().filter(|action| action.is_some()).count();
        map.proven_share = proven as f64 / map.actions.len() as f64;
        map
    }
}

struct Painter<'a> {
    certifier: &'a Certifier,
    domain: &'a Domain,
    q_values: &'a QValues<'a>,
    map: Map,
}

impl Painter<'_> {
    /// A square of finest cells.
    fn paint(&mut self, column: usize, row: usize, size: usize) {
        let x = part(self.map.slice.x.1, column, size, self.map.columns);
        let y = part(self.map.slice.y.1, row, size, self.map.rows);
        let slice = &self.map.slice;
        let mut cell: Cell = slice
            .at
            .iter()
            .map(|&value| Interval {
                low: value,
                high: value,
            })
            .collect();
        cell[slice.x.0] = x;
        cell[slice.y.0] = y;
        self.map.boxes += 1;
        let action = self.certifier.decided(self.domain, &cell);
        // a proven square is not split: what holds for the whole holds for its parts
        if action.is_none() && size > 1 {
            let half = size / 2;
            for (right, up) in [(0, 0), (half, 0), (0, half), (half, half)] {
                self.paint(column + right, row + up, half);
            }
            return;
        }
        for row in row..row + size {
            self.map.actions[row * self.map.columns + column..][..size].fill(action);
        }
        let point: Vec<f64> = cell.iter().map(|range| 0.5 * (range.low + range.high)).collect();
        let observation = self.domain.observation(&point);
        if self.certifier.add(&mut self.map.measured, &observation, self.q_values) {
            self.map.changes.push((0.5 * (x.low + x.high), 0.5 * (y.low + y.high)));
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
