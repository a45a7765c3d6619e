//! How much of a residual the rounding of a counter could have made.

use wide::{Work, widest};

use super::responses::{Circuit, LANES};
use super::{FEW_LEVELS, levels, rounded};
use crate::basis::{Basis, dots, take_out};
use crate::causes::Cut;
use crate::fit::State;
use crate::parallel;
use crate::problem::{Problem, axpy, dot};

/// The averaged circuit may be off in the size of the response by as much. It knows no discontinuous conduction and no losses that
/// depend on the duty; tolerances of L and C add 20 %. A convention: it only orders what is then simulated.
const SHARES: [f64; 2] = [0.7, 1.3];
/// The same of a response that is simulated: it is off by its curvature alone. A convention, as above.
const SIMULATED_SHARES: [f64; 2] = [0.9, 1.1];
/// Levels of the duty whose responses are simulated, with all that the model has: each costs a simulation of the records, and beyond that many
/// the averaged circuit does, whose errors at so many levels cancel. A convention for time.
const SIMULATED_LEVELS: usize = 32;
/// Change of the duty that tells a response: as large as a half step of 250 counts.
const MOVED: f64 = 2e-3;

/// What is looked for, and where.
pub(super) struct Gains<'a> {
    residual: &'a [f64],
    basis: &'a Basis,
    /// What the causes that are there move, as directions.
    beside: Vec<Vec<f64>>,
    circuit: Circuit<'a>,
    cut: Cut,
    levels: Vec<f64>,
    /// Of each level, in the rows.
    shares: Vec<f64>,
    parts: Option<Parts>,
    /// By how much the response may be off in size.
    sizes: [f64; 2],
}

/// Small changes add up: what a rounding does is the sum of what it does at each level of the duty.
struct Parts {
    /// The response of each level along the residual.
    along: Vec<f64>,
    /// Its products with those of the others.
    products: Vec<Vec<f64>>,
}

impl<'a> Gains<'a> {
    /// `from` is where the other causes end, `beside` what each of their parameters moves.
    pub fn new(problem: &'a Problem, basis: &'a Basis, (from, beside): (&'a State, &[Vec<f64>]), cut: Cut) -> Self {
        let (levels, shares): (Vec<f64>, Vec<f64>) = levels(problem).into_iter().unzip();
        let is_simulated = levels.len() <= SIMULATED_LEVELS;
        let mut gains = Self {
            residual: &from.residual,
            basis,
            beside: orthonormal(beside),
            circuit: Circuit::new(problem, &from.model.plant, &levels),
            cut,
            shares,
            parts: None,
            sizes: if is_simulated { SIMULATED_SHARES } else { SHARES },
            levels,
        };
        gains.parts = (gains.levels.len() <= FEW_LEVELS).then(|| {
            let columns = parallel::map(&gains.levels, |level| match is_simulated {
                true => gains.projected(simulated(problem, from, *level)),
                false => gains.projected(gains.of_level(*level)),
            });
            let products = (columns.iter()).map(|a| columns.iter().map(|b| dot(a, b)).collect::<Vec<f64>>());
            Parts {
                along: columns.iter().map(|column| dot(column, gains.residual)).collect(),
                products: products.collect(),
            }
        });
        gains
    }

    /// The duties of the records, each once.
    pub fn levels(&self) -> &[f64] {
        &self.levels
    }

    /// By how much chi-square falls with counters of so many counts, at most [`LANES`] of them.
    pub fn of(&self, counts: &[f64]) -> Vec<f64> {
        let Some(parts) = &self.parts else {
            let mut moved = vec![[0.0; LANES]; self.levels.len()];
            for (lane, counts) in counts.iter().enumerate() {
                let moves = moved.iter_mut().zip(self.moves(*counts));
                moves.for_each(|(moved, by)| moved[lane] = by);
            }
            let columns = self.circuit.responses(&moved);
            let (along, length) = widest(Along { gains: self, columns });
            let each = along.into_iter().zip(length).take(counts.len());
            return each.map(|(along, length)| self.worth(along, length)).collect();
        };
        let of_one = |counts: &f64| {
            let by: Vec<f64> = self.moves(*counts).collect();
            let square = parts
                .products
                .iter()
                .zip(&by)
                .map(|(row, by_row)| by_row * dot(row, &by));
            self.worth(dot(&parts.along, &by), square.sum())
        };
        counts.iter().map(of_one).collect()
    }

    /// By how much chi-square rises if each level is moved by so much more, none of them beside others: nothing where there are too many levels.
    pub fn rises(&self, by: &[f64]) -> Option<f64> {
        let parts = self.parts.as_ref()?;
        let square = parts.products.iter().zip(by).map(|(row, own)| own * dot(row, by));
        Some(square.sum::<f64>() - 2.0 * dot(&parts.along, by))
    }

    /// By how much a counter moves each level: what all duties are moved by alike the edges of the gate take over, and better than this
    /// circuit knows it.
    fn moves(&self, counts: f64) -> impl Iterator<Item = f64> {
        self.moves_of(counts, self.cut)
    }

    /// The same of a counter that rounds as `cut` says.
    pub fn moves_of(&self, counts: f64, cut: Cut) -> impl Iterator<Item = f64> {
        let by = move |duty: f64| rounded(duty, counts, cut) - duty;
        let each = self.levels.iter().zip(&self.shares);
        let mean = each.map(|(duty, share)| share * by(*duty)).sum::<f64>();
        self.levels.iter().map(move |duty| by(*duty) - mean)
    }

    fn worth(&self, along: f64, length: f64) -> f64 {
        let [least, most] = self.sizes;
        // a count that rounds no duty has no response at all
        let share = (along / length.max(1e-300)).clamp(least, most);
        // by how much chi-square falls if that share of the response is taken away
        2.0 * share * along - share * share * length
    }

    fn of_level(&self, level: f64) -> Vec<f64> {
        let moved: Vec<[f64; 1]> = self
            .levels
            .iter()
            .map(|other| [f64::from(u8::from(*other == level))])
            .collect();
        self.circuit.responses(&moved).into_iter().flatten().collect()
    }

    /// What of a response nothing else takes over.
    fn projected(&self, mut column: Vec<f64>) -> Vec<f64> {
        for (value, left) in column.iter_mut().zip(self.residual) {
            // where nothing counts
            if *left == 0.0 {
                *value = 0.0;
            }
        }
        self.basis.project(&mut column);
        out_of(&mut column, &self.beside);
        column
    }
}

/// [`Gains::projected`] of responses side by side, along the residual and along themselves.
struct Along<'a> {
    gains: &'a Gains<'a>,
    columns: Vec<[f64; LANES]>,
}

impl Work for Along<'_> {
    type Output = ([f64; LANES], [f64; LANES]);

    #[inline(always)]
    fn run(mut self) -> Self::Output {
        let columns = &mut self.columns;
        for (row, left) in columns.iter_mut().zip(self.gains.residual) {
            if *left == 0.0 {
                *row = [0.0; LANES];
            }
        }
        self.gains.basis.project_beside(columns);
        for direction in &self.gains.beside {
            let shares = dots(direction, columns);
            take_out(columns, shares, direction);
        }
        let mut length = [0.0; LANES];
        for row in columns.iter() {
            for (sum, x) in length.iter_mut().zip(row) {
                *sum += x * x;
            }
        }
        (dots(self.gains.residual, columns), length)
    }
}

/// Change of the signals over their noise, for each 1 of duty, where the duties of one `level` are moved.
fn simulated(problem: &Problem, from: &State, level: f64) -> Vec<f64> {
    let mut model = from.model.clone();
    // a step that the model has already would hide the change
    model.plant.pwm.duty_lsb = 0.0;
    let by = if level + MOVED < 1.0 { MOVED } else { -MOVED };
    let moved = |by: f64| {
        let mut moved = problem.clone();
        let duties = moved.records.iter_mut().flat_map(|record| &mut record.duty);
        duties.filter(|duty| **duty == level).for_each(|duty| *duty += by);
        moved.residual(&model, &from.starts)
    };
    let [there, back] = [moved(0.5 * by), moved(-0.5 * by)];
    there
        .iter()
        .zip(&back)
        .map(|(there, back)| (back - there) / by)
        .collect()
}

/// Directions of length 1, each at right angles to those before it; what lies in these but for rounding is left out.
fn orthonormal(columns: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let mut known: Vec<Vec<f64>> = Vec::new();
    for column in columns {
        let mut one = column.clone();
        out_of(&mut one, &known);
        let length = dot(&one, &one).sqrt();
        if length > NEW * dot(column, column).sqrt() {
            one.iter_mut().for_each(|value| *value /= length);
            known.push(one);
        }
    }
    known
}

/// Of a direction at most this share of the length may be in those before it, or it is rounding.
const NEW: f64 = 1e-5;

/// Leaves of `column` what is at right angles to all of `known`.
fn out_of(column: &mut [f64], known: &[Vec<f64>]) {
    for one in known {
        let share = dot(one, column);
        axpy(column, -share, one);
    }
}
