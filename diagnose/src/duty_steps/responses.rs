//! What moves of the duty do to the signals, by the averaged circuit linearised around each row: several sets of moves side by side.

use plant::{Parameters, Topology};
use wide::{Work, widest};

use super::{FINE, GIVE};
use crate::ideal;
use crate::problem::Problem;
use crate::record::{CHANNELS, Record};

/// Sets of moves side by side: what the widest vectors of processors hold.
pub(super) const LANES: usize = 8;

/// A row as the circuit sees it.
#[derive(Debug, Clone, Copy)]
struct Row {
    /// Which of the levels its duty is.
    level: usize,
    /// Voltage at the inductor for each 1 of duty, V.
    push: f64,
    /// What the output receives of the inductor's current.
    give: f64,
    /// Current that the output receives less for each 1 of duty, A.
    kept: f64,
    /// Conductance of the load to small changes, S.
    conductance: f64,
}

/// The records as the circuit sees them.
pub(super) struct Circuit<'a> {
    problem: &'a Problem,
    plant: &'a Parameters,
    /// Of each record.
    rows: Vec<Vec<Row>>,
}

impl<'a> Circuit<'a> {
    /// For moves of these levels of the duty, in rising order.
    pub fn new(problem: &'a Problem, plant: &'a Parameters, levels: &[f64]) -> Self {
        let of = |record: &Record| {
            (0..record.rows())
                .map(|row| Row::new(problem, plant, levels, (record, row)))
                .collect()
        };
        let rows = problem.records.iter().map(of).collect();
        Self { problem, plant, rows }
    }

    /// Change of the signals over their noise when the duties of each level are moved by so much, for `N` sets of moves.
    pub fn responses<const N: usize>(&self, moved: &[[f64; N]]) -> Vec<[f64; N]> {
        widest(Responses { circuit: self, moved })
    }
}

impl Row {
    fn new(problem: &Problem, p: &Parameters, levels: &[f64], (record, row): (&Record, usize)) -> Self {
        let (duty, load) = (record.duty[row], &record.load[row]);
        let topology = p.converter.topology;
        let v_in = p.converter.v_in * record.v_in_ratio;
        let v = problem.bases.v;
        // what the output receives of the inductor's current, and how much less of it while the duty is longer
        let give = topology.give(duty);
        let kept = match topology {
            Topology::Buck => 0.0,
            Topology::Boost | Topology::BuckBoost => ideal::drawn(load, v) / give.max(GIVE),
        };
        Self {
            level: levels.partition_point(|level| *level < duty),
            push: topology.span(v_in, v),
            give,
            kept,
            // to small changes a constant power is a negative conductance
            conductance: load.conductance - load.power / (v * v),
        }
    }
}

struct Responses<'a, 'b, const N: usize> {
    circuit: &'a Circuit<'a>,
    moved: &'b [[f64; N]],
}

impl<const N: usize> Work for Responses<'_, '_, N> {
    type Output = Vec<[f64; N]>;

    // a lane is one index into several arrays
    #[allow(clippy::needless_range_loop)]
    #[inline(always)]
    fn run(self) -> Vec<[f64; N]> {
        let Circuit { problem, plant, rows } = self.circuit;
        let mut out = vec![[0.0; N]; problem.len()];
        let r = plant.inductor.dcr + 0.5 * (plant.switch.r_ds_on + plant.switch.r_d);
        let converter = &plant.converter;
        for ((record, rows), offset) in problem.records.iter().zip(rows).zip(&problem.offsets) {
            let shares = [1.0 - record.phase, record.phase];
            let steps = shares.map(|share| share * problem.bases.t_sw / FINE as f64);
            for segment in record.segments.iter().filter(|_| !record.settled) {
                let (mut v, mut i) = ([0.0; N], [0.0; N]);
                for at in segment.clone() {
                    let place = offset + at * CHANNELS;
                    for n in 0..N {
                        out[place][n] = v[n] / problem.sigma[0];
                        out[place + 1][n] = i[n] / problem.sigma[1];
                    }
                    // sampled inside a PWM period, the way to the next sample belongs to two of them
                    let next = (at + 1).min(rows.len() - 1);
                    for (row, h) in [at, next].into_iter().zip(steps).filter(|(_, h)| *h > 0.0) {
                        let Row {
                            level,
                            push,
                            give,
                            kept,
                            conductance,
                        } = rows[row];
                        let moved = &self.moved[level];
                        let (by_l, by_c) = (h / converter.inductance, h / converter.capacitance);
                        for _ in 0..FINE {
                            for n in 0..N {
                                i[n] += by_l * (push * moved[n] - give * v[n] - r * i[n]);
                                v[n] += by_c * (give * i[n] - kept * moved[n] - conductance * v[n]);
                            }
                        }
                    }
                }
            }
            if record.settled {
                for (at, row) in rows.iter().enumerate() {
                    let [v, i] = super::settled((problem, plant), (record, at));
                    let place = offset + at * CHANNELS;
                    for n in 0..N {
                        let moved = self.moved[row.level][n];
                        out[place][n] = v * moved / problem.sigma[0];
                        out[place + 1][n] = i * moved / problem.sigma[1];
                    }
                }
            }
        }
        out
    }
}
