//! Everything that is said about a policy in a numeric format.

use policy::{Continuous, Digests, Interval, NumericFormat, Policy, Schedule};
use serde::{Serialize, Serializer};

use crate::cover::{Map, Share, Slice, StateBound};
use crate::measured::{Measured, QValues};
use crate::{AffineCopy, Bound, Certifier, Coordinate, Domain, Memory};

/// How much is looked at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Effort {
    /// Boxes into which the states are split for the bound.
    pub boxes: usize,
    /// States drawn for the shares.
    pub samples: usize,
    /// Largest number of halvings on the way to a proven box.
    pub depth: usize,
}

impl Default for Effort {
    fn default() -> Self {
        Self {
            // conventions; 1000 samples leave the share an interval of about 6 points at most
            // the bound of examples/buck12 in binary32: 0.69 whole, 0.159 with 200 boxes, 0.119 with 1000, 0.1145 with
            // 2000, 0.1130 with 4000
            boxes: 2000,
            samples: 1000,
            // of its four coordinates: of 300 states 148 are proven by 16 halvings, 255 by 24, 290 by 32, 296 by 48,
            // 299 by 56 and no more by 96
            depth: 48,
        }
    }
}

/// Half widths of the boxes around golden observations, relative to the width of the features' bounds.
// conventions, a decade apart
const RADII: [f64; 3] = [1e-2, 1e-3, 1e-4];

/// A policy's numeric format against real arithmetic. `docs/reference/certificate.md` defines every entry.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Certificate {
    /// Name of the policy.
    pub name: String,
    /// Format that was bounded.
    pub numeric_format: NumericFormat,
    /// Digests of the policy.
    pub digests: Digests,
    /// Axes of the set of states.
    pub coordinates: Vec<Coordinate>,
    /// Features that say nothing new.
    pub copies: Vec<AffineCopy>,
    /// What is said of each output; in JSON that of a contract with one stands beside the other entries.
    #[serde(flatten, serialize_with = "said")]
    pub statements: Vec<Statement>,
}

/// What is said of one output.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Statement {
    /// Its name; `None` where there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub output: Option<String>,
    /// Proven for every observation of the clamped box, features independent of each other.
    pub box_bound: Bound,
    /// Proven for every state.
    pub state_bound: StateBound,
    /// Where the command is a number: all bounds are of the duty then, and nothing is said of actions.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub continuous: Option<Continuous>,
    /// The same of a law whose gains the network gives; seen errors are with the largest factors of the gains.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub schedule: Option<Schedule>,
    /// Share of the states in proven boxes, estimated; `None` of a head without a choice.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub proven_share: Option<Share>,
    /// At the states drawn for the share.
    pub measured: Measured,
    /// Around and at the golden observations, if the policy has them.
    pub golden: Option<Golden>,
    /// A slice of the states; `None` with fewer than two coordinates.
    pub map: Option<Map>,
}

/// One statement as it is, several as a list.
fn said<S: Serializer>(statements: &[Statement], serializer: S) -> Result<S::Ok, S::Error> {
    #[derive(Serialize)]
    struct Several<'a> {
        outputs: &'a [Statement],
    }
    match statements {
        [one] => one.serialize(serializer),
        outputs => Several { outputs }.serialize(serializer),
    }
}

/// What holds at and around golden observations.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Golden {
    /// At the observations.
    pub measured: Measured,
    /// Share of boxes around them that have one proven action.
    pub neighbourhoods: Vec<Neighbourhood>,
}

/// Boxes of one size around observations.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Neighbourhood {
    /// Half width, relative to the width of each feature's bound.
    pub radius: f64,
    /// Proven ones.
    pub share: Share,
}

impl Statement {
    /// Distance between the least and the largest duty, where all bounds are of the duty.
    #[must_use]
    pub fn duty_span(&self) -> Option<f64> {
        let of_law = |head: &Schedule| head.limits.high - head.limits.low;
        let of_actor = self.continuous.as_ref().map(Continuous::span);
        of_actor.or_else(|| self.schedule.as_ref().map(of_law))
    }

    /// `of left` of the output `left`, behind a space; nothing where there is one output.
    #[cfg(feature = "page")]
    pub(crate) fn of(&self) -> String {
        let name = self.output.as_ref();
        name.map_or(String::new(), |name| format!(" of {name}"))
    }
}

impl Certificate {
    /// Bounds, shares and maps of a policy's outputs; `uniform` draws from 0..1.
    #[must_use]
    pub fn new(
        policy: &Policy,
        effort: Effort,
        slice: Option<&Slice>,
        q_values: &QValues<'_>,
        uniform: &mut dyn FnMut() -> f64,
    ) -> Self {
        let certifier = Certifier::new(policy);
        let domain = Domain::of(policy, Memory::Free);
        // the same states for the share and for what is seen, so that the two can be held against each other
        let points: Vec<Vec<f64>> = (0..effort.samples).map(|_| domain.draw(uniform)).collect();
        let observations: Vec<Vec<f32>> = points.iter().map(|point| domain.observation(point)).collect();
        let parts = &certifier.parts;
        let map = |slice: &Slice| certifier.maps(&Domain::of(policy, slice.memory), slice, q_values);
        let mut box_bounds = certifier.box_bounds().into_iter();
        let mut state_bounds = certifier.state_bounds(&domain, effort.boxes).into_iter();
        let mut shares = certifier.shares(&domain, &points, effort.depth).into_iter();
        let mut measured = certifier
            .measure(observations.iter().map(Vec::as_slice), q_values)
            .into_iter();
        let mut golden = golden(policy, &certifier, q_values).into_iter();
        let mut maps = slice.map(map).unwrap_or_default().into_iter();
        let statements = parts.iter().map_while(|part| {
            Some(Statement {
                output: part.name.clone(),
                box_bound: box_bounds.next()?,
                state_bound: state_bounds.next()?,
                continuous: part.head.continuous().copied(),
                schedule: part.head.schedule().cloned(),
                proven_share: shares.next()?,
                measured: measured.next()?,
                golden: golden.next(),
                map: maps.next().flatten(),
            })
        });
        Self {
            name: policy.name.clone(),
            numeric_format: policy.numeric_format,
            digests: policy.digests.clone(),
            coordinates: domain.coordinates().to_vec(),
            copies: domain.copies(),
            statements: statements.collect(),
        }
    }
}

/// One entry for each output; none without golden observations.
fn golden(policy: &Policy, certifier: &Certifier, q_values: &QValues<'_>) -> Vec<Golden> {
    let Some(golden) = &policy.golden else {
        return Vec::new();
    };
    let width = policy.features.len().max(1);
    let observations = || golden.observations.chunks_exact(width);
    let mut all: Vec<Golden> = certifier
        .measure(observations(), q_values)
        .into_iter()
        .map(|measured| Golden {
            measured,
            neighbourhoods: Vec::new(),
        })
        .collect();
    if certifier.parts.iter().any(|part| part.head.is_choice()) {
        for radius in RADII {
            for (golden, share) in all.iter_mut().zip(certifier.shares_around(observations(), radius)) {
                let near = share.map(|share| Neighbourhood { radius, share });
                golden.neighbourhoods.extend(near);
            }
        }
    }
    all
}

impl Certifier {
    /// The part of a slice in which an action of the real network changes, with a margin; the slice itself if it does not.
    #[must_use]
    pub fn zoomed(&self, domain: &Domain, slice: &Slice) -> Slice {
        let mut slice = slice.clone();
        // a coarse grid sees the region, finer ones its edges
        for _ in 0..3 {
            let Some((x, y)) = self.changing(domain, &slice) else {
                break;
            };
            slice.x.1 = x;
            slice.y.1 = y;
        }
        slice
    }

    fn changing(&self, domain: &Domain, slice: &Slice) -> Option<(Interval, Interval)> {
        // a convention, as is the tenth of margin below: fine enough to see a region, quick enough to ask three times
        const GRID: usize = 96;
        let at = |range: Interval, n: usize| range.low + (range.high - range.low) * (n as f64 / (GRID - 1) as f64);
        // the real network alone: no format may decide which region is looked at
        let actions = |column: usize, row: usize| {
            let mut point = slice.at.clone();
            point[slice.x.0] = at(slice.x.1, column);
            point[slice.y.0] = at(slice.y.1, row);
            self.real_actions(&domain.observation(&point))
        };
        let grid: Vec<Vec<usize>> = (0..GRID * GRID).map(|n| actions(n % GRID, n / GRID)).collect();
        let mut ends: Option<[usize; 4]> = None;
        for n in 0..GRID * GRID {
            let (column, row) = (n % GRID, n / GRID);
            // two neighbours of each point are enough: the other two have asked already
            let right = column + 1 < GRID && grid[n] != grid[n + 1];
            let up = row + 1 < GRID && grid[n] != grid[n + GRID];
            if right || up {
                let [left, last, bottom, top] = ends.unwrap_or([column, column, row, row]);
                ends = Some([left.min(column), last.max(column), bottom.min(row), top.max(row)]);
            }
        }
        let [left, last, bottom, top] = ends?;
        let widened = |range: Interval, low: usize, high: usize| {
            let margin = 1 + (high - low) / 10;
            Interval {
                low: at(range, low.saturating_sub(margin)),
                high: at(range, (high + 1 + margin).min(GRID - 1)),
            }
        };
        Some((widened(slice.x.1, left, last), widened(slice.y.1, bottom, top)))
    }
}
