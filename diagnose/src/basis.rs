//! What initial states, instants of load steps, unsure levels of a load and the edges of the gate can explain of a signal: an orthonormal
//! basis, to project it out and to move the estimates.

use plant::Rectifier;

use crate::drive::{FREE_APART, Model};
use crate::parallel;
use crate::problem::{Problem, Starts, axpy, dot};
use crate::record::{CHANNELS, Record, Segment};

/// Change of the initial voltage (in units of the output voltage) and current (of the current) for a sensitivity: small against
/// where the circuit bends, and far above rounding.
const NUDGE: f64 = 1e-3;
/// Change of the instant of a load step for a sensitivity, periods: a fifth of the paper's sensor filter, whose output bends there.
const NUDGE_STEP: f64 = 0.02;
/// Farthest from where the record has it that a load step is looked for, periods: a column of the load may hold that of the
/// period's start, of its end, or of the row.
pub const FARTHEST: f64 = 1.0;
/// A direction shorter than this is not seen.
// in standard deviations, of which a nudge makes one and more: what is left this short is rounding
const UNSEEN: f64 = 1e-6;
/// Nor is one of which the others leave less than this share: a nudge bends by as much ([`NUDGE`]). Where the current rests in every
/// period, initial voltage and current are one charge, and what tells them apart is 2e-4 of it; a step along that would run to
/// thousands of amperes, and take down with it all that is estimated beside it.
const APART: f64 = 1e-3;

/// An orthonormal basis of what initial states and free load steps can explain, for each segment.
#[derive(Debug, Clone)]
pub struct Basis {
    spans: Vec<Span>,
    /// What acts across segments, in this order, each without what stands before it.
    across: Vec<Across>,
    /// Least current that a segment may begin with, A: no diode carries one backwards, and from below 0 no step leads back.
    least: f64,
}

/// An unknown that acts across segments.
#[derive(Debug, Clone)]
struct Across {
    unknown: Unknown,
    /// Sensitivity, as it is.
    raw: Vec<f64>,
    /// Without what segments and the unknowns before it explain.
    own: Vec<f64>,
}

/// Which one.
#[derive(Debug, Clone, Copy)]
enum Unknown {
    /// A free level of a record's load, standard deviations.
    Level(usize, usize),
    /// The trim of the edges.
    Trim,
}

/// One segment: columns over `from..to`, and the triangle that leads from them back to the estimates.
#[derive(Debug, Clone)]
struct Span {
    record: usize,
    segment: usize,
    from: usize,
    to: usize,
    /// Voltage, current, what a lagging load draws, then the instants of the free steps `steps`.
    q: Vec<Vec<f64>>,
    /// `r[column][row]` up to the diagonal; 0 where a direction is not seen.
    r: Vec<Vec<f64>>,
    /// Places of the free steps among those of the record.
    steps: Vec<usize>,
}

/// Free steps of a segment, as places among those of the record.
fn steps_in(record: &Record, segment: &Segment) -> Vec<usize> {
    let steps = record.free_steps.iter().enumerate();
    let inside = steps.filter(|(_, row)| segment.start + FREE_APART <= **row && **row < segment.end);
    inside.map(|(place, _)| place).collect()
}

impl Problem {
    /// What initial states can explain, around `starts`; `residual` is that of the model there.
    #[must_use]
    pub fn basis(&self, model: &Model, starts: &Starts, residual: &[f64]) -> Basis {
        let states: [Vec<f64>; 3] = std::array::from_fn(|state| {
            let step = NUDGE * [self.bases.v, self.bases.i, self.bases.i][state];
            let mut moved = starts.clone();
            if state == DRAWN && !self.may_be_drawing(model) {
                return vec![0.0; residual.len()];
            }
            for (record, of_record) in self.records.iter().zip(&mut moved.states) {
                // a record begins at rest, or where its table begins to say what was drawn
                let is_moved = |segment: &Segment| state != DRAWN || segment.start > 0;
                let begins = record.segments.iter().zip(of_record);
                begins
                    .filter(|(segment, _)| is_moved(segment))
                    .for_each(|(_, start)| start[state] += step);
            }
            let after = self.residual(model, &moved);
            residual
                .iter()
                .zip(&after)
                .map(|(before, after)| (before - after) / step)
                .collect()
        });
        let mut spans = self.spans();
        let most = spans.iter().map(|span| span.steps.len()).max().unwrap_or(0);
        // the first step of all segments is moved at once, then the second: nothing leads from one segment to the next
        let numbers: Vec<usize> = (0..most).collect();
        let instants = parallel::map(&numbers, |n| self.moved_steps(model, starts, residual, &spans, *n));
        for span in &mut spans {
            let of_steps = instants.iter().take(span.steps.len());
            for column in states.iter().chain(of_steps) {
                span.add(column[span.from..span.to].to_vec());
            }
        }
        let mut basis = Basis {
            spans,
            across: Vec::new(),
            least: match model.plant.converter.rectifier {
                Rectifier::Diode => 0.0,
                Rectifier::Synchronous => f64::NEG_INFINITY,
            },
        };
        for (unknown, raw) in self.moved_levels(model, starts, residual) {
            basis.add(unknown, raw);
        }
        if !self.trim_held {
            let mut moved = starts.clone();
            let accuracy = self.duty_accuracy();
            moved.trim += accuracy;
            let after = self.residual(model, &moved);
            let raw: Vec<f64> = residual.iter().zip(&after).map(|(a, b)| (a - b) / accuracy).collect();
            basis.add(Unknown::Trim, raw);
        }
        basis
    }

    /// Whether a load of constant power that lags may be on its way where a segment begins: behind lost rows nobody knows what it drew last.
    fn may_be_drawing(&self, model: &Model) -> bool {
        let has_gaps = |record: &Record| !record.settled && record.segments.iter().any(|segment| segment.start > 0);
        let has_power = |record: &Record| record.load.iter().any(|load| load.power > 0.0);
        model.plant.load.cpl_time_constant > 0.0
            && (self.records.iter()).any(|record| has_gaps(record) && has_power(record))
    }

    /// Sensitivity to each free level of a load, a standard deviation.
    fn moved_levels(&self, model: &Model, starts: &Starts, residual: &[f64]) -> Vec<(Unknown, Vec<f64>)> {
        let most = starts.levels.iter().map(Vec::len).max().unwrap_or(0);
        let numbers: Vec<usize> = (0..most).collect();
        // the first level of all records is moved at once, then the second: nothing leads from one record to the next
        let columns = parallel::map(&numbers, |n| {
            let mut moved = starts.clone();
            for levels in &mut moved.levels {
                levels.iter_mut().skip(*n).take(1).for_each(|by| *by += 1.0);
            }
            let after = self.residual(model, &moved);
            let of = |record: usize| {
                let mut raw = vec![0.0; residual.len()];
                let rows = self.offsets[record]..self.offsets[record] + self.records[record].rows() * CHANNELS;
                for place in rows.chain([self.level(record, *n)]) {
                    raw[place] = residual[place] - after[place];
                }
                (Unknown::Level(record, *n), raw)
            };
            let records = (0..self.records.len()).filter(|record| starts.levels[*record].len() > *n);
            records.map(of).collect::<Vec<_>>()
        });
        columns.into_iter().flatten().collect()
    }

    /// All segments, without columns as yet. Settled points have no initial state.
    fn spans(&self) -> Vec<Span> {
        let mut spans = Vec::new();
        for (record, one) in self.records.iter().enumerate().filter(|(_, one)| !one.settled) {
            for (segment, rows) in one.segments.iter().enumerate() {
                spans.push(Span {
                    record,
                    segment,
                    from: self.offsets[record] + rows.start * CHANNELS,
                    to: self.offsets[record] + rows.end * CHANNELS,
                    q: Vec::new(),
                    r: Vec::new(),
                    steps: steps_in(one, rows),
                });
            }
        }
        spans
    }

    /// Sensitivity to the instant of the `n`th free step of each segment, a period.
    fn moved_steps(&self, model: &Model, starts: &Starts, residual: &[f64], spans: &[Span], n: usize) -> Vec<f64> {
        let mut moved = starts.clone();
        let mut signs = vec![0.0; residual.len()];
        for span in spans {
            let Some(place) = span.steps.get(n) else { continue };
            let late = &mut moved.late[span.record][*place];
            // what a load sensor shows leaps where the step passes a sample: the step is moved within its side
            let instant = self.records[span.record].phase + model.late / self.bases.t_sw;
            let side = if (*late - instant).rem_euclid(1.0) > 0.5 {
                -1.0
            } else {
                1.0
            };
            *late += side * NUDGE_STEP;
            signs[span.from..span.to].fill(side / NUDGE_STEP);
        }
        let after = self.residual(model, &moved);
        let both = residual.iter().zip(&after).zip(&signs);
        both.map(|((before, after), sign)| (before - after) * sign).collect()
    }
}

/// What is moved.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Moving {
    /// All that is free.
    All,
    /// All but the initial currents. Where the current stops in every period the first one is forgotten after it: what is left is a
    /// charge, as its square, and tells nothing that the initial voltage does not. A line along both leads far away.
    AllButCurrents,
}

impl Moving {
    /// In the order in which they are tried.
    pub const EACH: [Moving; 2] = [Moving::All, Moving::AllButCurrents];
}

/// Places of the initial current and of what a lagging load draws among the columns of a span.
const CURRENT: usize = 1;
const DRAWN: usize = 2;

impl Span {
    /// Takes a column in: what the others before it do not hold, at length 1.
    fn add(&mut self, mut column: Vec<f64>) {
        let mut r = Vec::with_capacity(self.q.len() + 1);
        let least = UNSEEN.max(APART * dot(&column, &column).sqrt());
        for q in &self.q {
            let share = dot(q, &column);
            axpy(&mut column, -share, q);
            r.push(share);
        }
        r.push(normalise(&mut column, least));
        self.q.push(column);
        self.r.push(r);
    }

    /// The estimates' moves that explain most of `part`.
    fn moves(&self, part: &[f64], moving: Moving) -> Vec<f64> {
        let mut left: Vec<f64> = self.q.iter().map(|q| dot(q, part)).collect();
        for column in (0..left.len()).rev() {
            let r = &self.r[column];
            let moves = r[column] > 0.0 && (column != CURRENT || moving == Moving::All);
            left[column] = if moves { left[column] / r[column] } else { 0.0 };
            let by = left[column];
            for row in 0..column {
                left[row] -= r[row] * by;
            }
        }
        left
    }
}

/// [`dot`] of several columns side by side.
#[inline(always)]
pub fn dots<const N: usize>(a: &[f64], columns: &[[f64; N]]) -> [f64; N] {
    let mut sums = [0.0; N];
    for (a, row) in a.iter().zip(columns) {
        for (sum, x) in sums.iter_mut().zip(row) {
            *sum += a * x;
        }
    }
    sums
}

/// Takes `shares` of a direction out of columns side by side.
#[inline(always)]
pub fn take_out<const N: usize>(columns: &mut [[f64; N]], shares: [f64; N], direction: &[f64]) {
    for (row, a) in columns.iter_mut().zip(direction) {
        for (x, share) in row.iter_mut().zip(shares) {
            *x += -share * a;
        }
    }
}

impl Across {
    /// How far the unknown moves to explain most of `u`.
    fn share(&self, u: &[f64]) -> f64 {
        dot(&self.own, u) / dot(&self.own, &self.own)
    }
}

impl Basis {
    /// Standard deviation of the trim, all else following, 1; nothing where it is held.
    #[must_use]
    pub fn trim_sd(&self) -> Option<f64> {
        let trim = self
            .across
            .iter()
            .find(|across| matches!(across.unknown, Unknown::Trim))?;
        Some(1.0 / dot(&trim.own, &trim.own).sqrt())
    }

    /// Takes out of `u` what initial states explain.
    pub fn project(&self, u: &mut [f64]) {
        for span in &self.spans {
            let part = &mut u[span.from..span.to];
            for q in &span.q {
                let share = dot(q, part);
                axpy(part, -share, q);
            }
        }
        for across in &self.across {
            axpy(u, -across.share(u), &across.own);
        }
    }

    /// [`Basis::project`] of several columns side by side, with the bits of each alone.
    #[inline(always)]
    pub fn project_beside<const N: usize>(&self, u: &mut [[f64; N]]) {
        for span in &self.spans {
            let part = &mut u[span.from..span.to];
            for q in &span.q {
                let shares = dots(q, part);
                take_out(part, shares, q);
            }
        }
        for across in &self.across {
            let own = &across.own;
            let length = dot(own, own);
            let shares = dots(own, u).map(|along| along / length);
            take_out(u, shares, own);
        }
    }

    /// Takes in an unknown that acts across segments.
    fn add(&mut self, unknown: Unknown, raw: Vec<f64>) {
        let mut own = raw.clone();
        self.project(&mut own);
        // what is not seen beside the others stays where it is
        if dot(&own, &own) > UNSEEN * UNSEEN {
            self.across.push(Across { unknown, raw, own });
        }
    }

    /// Moves `starts` to where they explain most of `u`, a residual.
    pub fn absorb(&self, u: &[f64], starts: &mut Starts, moving: Moving) {
        let mut rest = Vec::new();
        // the last first: none of those before it holds a part of it
        for across in self.across.iter().rev() {
            if rest.is_empty() {
                rest = u.to_vec();
            }
            let step = across.share(&rest);
            axpy(&mut rest, -step, &across.raw);
            match across.unknown {
                Unknown::Level(record, place) => starts.levels[record][place] += step,
                Unknown::Trim => starts.trim += step,
            }
        }
        let u = if rest.is_empty() { u } else { &rest[..] };
        for span in &self.spans {
            let moves = span.moves(&u[span.from..span.to], moving);
            let start = &mut starts.states[span.record][span.segment];
            start[0] = (start[0] + moves[0]).max(0.0);
            start[1] = (start[1] + moves[1]).max(self.least);
            start[2] += moves[2];
            for (place, by) in span.steps.iter().zip(&moves[3..]) {
                let late = &mut starts.late[span.record][*place];
                *late = (*late + by).clamp(-FARTHEST, FARTHEST);
            }
        }
    }
}

/// Scales to length 1 and returns the length; a vector shorter than `least` becomes 0.
fn normalise(a: &mut [f64], least: f64) -> f64 {
    let length = dot(a, a).sqrt();
    let scale = if length > least { 1.0 / length } else { 0.0 };
    for value in a.iter_mut() {
        *value *= scale;
    }
    if length > least { length } else { 0.0 }
}
