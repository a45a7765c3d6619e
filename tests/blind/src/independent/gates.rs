//! From duties to the instants at which current may change its path.

use crate::independent::board::{Board, Carrier};
use crate::rng::Rng;

/// Conduction intervals of the two switches, s from the start of the run, in order.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Edges {
    pub main: Vec<(f64, f64)>,
    pub second: Vec<(f64, f64)>,
}

impl Edges {
    /// The same edges on a clock that starts `by` later.
    pub fn earlier(mut self, by: f64) -> Edges {
        for (on, off) in self.main.iter_mut().chain(&mut self.second) {
            *on -= by;
            *off -= by;
        }
        self
    }
}

/// The duties that reach the comparator: late, moved, rounded, trembling.
fn compared(board: &Board, duties: &[f64]) -> Vec<f64> {
    let g = &board.gates;
    let (amplitude, periods) = g.dither;
    (0..duties.len())
        .map(|k| {
            let mut duty = duties[k.saturating_sub(g.late)].clamp(0.0, 1.0);
            if duty > 0.0 && duty < 1.0 {
                duty += g.offset;
                if amplitude != 0.0 {
                    duty += amplitude * if (k as f64 / periods).fract() < 0.5 { 1.0 } else { -1.0 };
                }
            }
            if g.lsb > 0.0 {
                duty = libm::round(duty / g.lsb) * g.lsb;
            }
            duty.clamp(0.0, 1.0)
        })
        .collect()
}

/// Edges of a run of one duty a period; what trembles is drawn from `random`.
pub fn edges(board: &Board, duties: &[f64], random: &mut Rng) -> Edges {
    let (g, t_sw) = (&board.gates, board.t_sw());
    let mut pulses: Vec<(f64, f64)> = Vec::new();
    for (k, duty) in compared(board, duties).into_iter().enumerate() {
        let start = k as f64 * t_sw;
        if duty <= 0.0 || g.lost > 0.0 && random.chance(g.lost) {
            continue;
        }
        let (mut on, mut off) = match g.carrier {
            Carrier::Trailing => (start, start + duty * t_sw),
            Carrier::Leading => (start + (1.0 - duty) * t_sw, start + t_sw),
            Carrier::Centre => (start + 0.5 * (1.0 - duty) * t_sw, start + 0.5 * (1.0 + duty) * t_sw),
        };
        if g.jitter > 0.0 {
            on += g.jitter * random.normal();
            off += g.jitter * random.normal();
        }
        match pulses.last_mut() {
            // pulses that touch are one
            Some(last) if on <= last.1 + 1e-9 * t_sw => last.1 = off.max(last.1),
            _ => pulses.push((on, off)),
        }
    }
    let end = duties.len() as f64 * t_sw;
    let mut edges = Edges::default();
    let mut low = 0.0;
    for &(on, off) in &pulses {
        if board.stage.synchronous && on + g.fall > low {
            edges.second.push((low, on + g.fall));
        }
        if off + g.fall > on + g.dead + g.rise {
            edges.main.push((on + g.dead + g.rise, off + g.fall));
        }
        low = off + g.dead + g.rise;
    }
    if board.stage.synchronous && low < end {
        edges.second.push((low, end + t_sw));
    }
    edges
}

/// Where a walk stands in a list of intervals.
#[derive(Debug, Clone, Copy, Default)]
pub struct Cursor(usize);

impl Cursor {
    /// Whether an interval holds right after `t`, and when that changes.
    pub fn at(&mut self, intervals: &[(f64, f64)], t: f64) -> (bool, f64) {
        while intervals.get(self.0).is_some_and(|interval| interval.1 <= t) {
            self.0 += 1;
        }
        match intervals.get(self.0) {
            None => (false, f64::INFINITY),
            Some(&(on, off)) if on <= t => (true, off),
            Some(&(on, _)) => (false, on),
        }
    }
}
