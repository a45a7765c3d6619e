//! Whether the carrier of the plant file is the bench's: where in the period the switch is on decides where on its ripple the inductor
//! current is sampled.
//!
//! ```text
//! trailing  ▔▔▔▔▔╲____     on first: a sample at the start of the period lies in the valley
//! centre    __▔▔▔▔▔___     in the middle: it lies at the mean
//! leading   ____╱▔▔▔▔▔     last: it lies at the peak
//! ```
//! A file with another carrier puts the current off by up to half its ripple and no further, in a way that goes with the duty. No number on
//! the list of causes does that, but an offset, a gain and another instant together come near, and would be named in its place. So the
//! carriers are compared before any search, in the current alone: what else the model has wrong hardly moves the mean of a current that a
//! load draws, and what winding, inductance and capacitance do to it is taken out at first order on both sides. The other carrier has no
//! free number; what stands against it has one to three.

use std::collections::BTreeMap;

use plant::Carrier;

use crate::basis::Basis;
use crate::drive::Model;
use crate::findings::{Evidence, Named, Value};
use crate::fit::State;
use crate::level::THRESHOLD;
use crate::noise::{self, channel};
use crate::normal::{Normal, solve};
use crate::parallel;
use crate::problem::{Problem, dot};
use crate::search::TIE;

/// The name of the cause.
pub const ID: &str = "carrier";
/// Its key in the plant, under which it is shown as a word.
const KEY: &str = "pwm.carrier";
/// The channel of the inductor current.
const CURRENT: usize = 1;

/// The current is looked at where its mean square over the noise is this large: below it there is nothing to mend.
const WRONG: f64 = 4.0;
/// Another carrier leaves at most this share of chi-square in the current, nearly half of the error: of a wrong one hardly anything is
/// left, as long as not much else is wrong in the current.
const LEFT: f64 = 0.2;
/// Change of the circuit's numbers for a sensitivity, a share: a tenth of their tolerances, within which the current follows in a line.
const NUDGE: f64 = 0.02;
/// Instants of the own carrier that are tried to either side, and how far apart, periods: the ripple is a line between two edges, and
/// half a step is a sixteenth of the steepest.
const SHIFTS: i32 = 8;
const APART: f64 = 1.0 / 16.0;

/// What the current says of the carrier.
#[derive(Debug, Clone, PartialEq)]
pub enum Timing {
    /// It is another one: as a cause, and in words.
    Other(Named, Carrier, String),
    /// It could be another one, or an instrument: in words.
    Perhaps(String),
}

/// Chi-square of the current, the circuit following: as it is, with an offset of its sensor, with a gain, and with both.
struct Score {
    raw: f64,
    offset: f64,
    gain: f64,
    both: f64,
}

/// Looks at the carrier of the model at which `null` ends; nothing if there is nothing to mend, or the carrier mends nothing.
#[must_use]
pub fn of(problem: &Problem, null: &State) -> Option<Timing> {
    let is_looked_at = |n: &usize| !problem.records[*n].settled && problem.records[*n].capture.is_none();
    let records: Vec<usize> = (0..problem.records.len()).filter(is_looked_at).collect();
    let left: Vec<f64> = records
        .iter()
        .flat_map(|n| channel(problem, &null.residual, *n, CURRENT))
        .collect();
    let count = left.iter().filter(|left| **left != 0.0).count();
    if count == 0 || dot(&left, &left) < WRONG * count as f64 {
        return None;
    }
    let basis = problem.basis(&null.model, &null.starts, &null.residual);
    let look = Look {
        problem,
        records: &records,
        circuit: circuit(problem, null, &basis),
    };
    let own = look.score(null);
    let (carrier, state) = best_carrier(&look, null, &basis)?;
    let other = look.score(&state);
    if other.raw > LEFT * own.raw {
        return None;
    }
    let shifts: Vec<i32> = (-SHIFTS..=SHIFTS).filter(|n| *n != 0).collect();
    let shifted = parallel::map(&shifts, |n| {
        let mut model = null.model.clone();
        model.late += f64::from(*n) * APART * problem.bases.t_sw;
        look.score(&State::settle(problem, &model, &null.starts, Some(&basis)))
    });
    let least = |of: fn(&Score) -> f64| shifted.iter().map(of).fold(f64::INFINITY, f64::min);
    let inflation = noise::inflation(problem, &state.residual);
    let single = own.raw.min(own.offset).min(own.gain).min(least(|score| score.raw));
    let several = own.both.min(least(|score| score.both));
    let words = |carrier: Carrier| choice(carrier as usize);
    let (own_word, word) = (words(null.model.plant.pwm.carrier), words(carrier));
    let left = 100.0 * (other.raw / own.raw).sqrt();
    // one more number has to be worth a cause; where one alone does as well nobody can tell
    if other.raw + TIE * inflation < single && other.raw < several + THRESHOLD * inflation {
        let said = format!(
            "the inductor current is off as if the carrier of the bench were `{word}` and not `{own_word}`: with it {left:.0} % of that error are \
             left. `carrier = \"{word}\"` is taken; if it is right, write it under [pwm] of the plant file"
        );
        return Some(Timing::Other(
            named(null, carrier, (own.raw - other.raw) / inflation),
            carrier,
            said,
        ));
    }
    (other.raw < single + TIE * inflation).then(|| {
        Timing::Perhaps(format!(
            "with `carrier = \"{word}\"` under [pwm] of the plant file {left:.0} % of the error of the inductor current would be left, and an \
             offset, a gain or another sampling instant does as well at these duties: is `{own_word}` the carrier of the bench?"
        ))
    })
}

/// The other carrier that leaves least of the current, and where the model then ends.
fn best_carrier(look: &Look<'_>, null: &State, basis: &Basis) -> Option<(Carrier, State)> {
    let own = null.model.plant.pwm.carrier;
    let others: Vec<Carrier> = [Carrier::Trailing, Carrier::Leading, Carrier::Centre]
        .into_iter()
        .filter(|carrier| *carrier != own)
        .collect();
    let tried = parallel::map(&others, |carrier| {
        let model = with(&null.model, *carrier);
        let state = State::settle(look.problem, &model, &null.starts, Some(basis));
        (look.score(&state).raw, state)
    });
    let tried = others.into_iter().zip(tried);
    let best = tried.min_by(|a, b| a.1.0.total_cmp(&b.1.0))?;
    Some((best.0, best.1.1))
}

/// The model with another carrier.
#[must_use]
pub fn with(model: &Model, carrier: Carrier) -> Model {
    let mut model = model.clone();
    model.plant.pwm.carrier = carrier;
    model
}

/// What the numbers of the circuit do to all signals, without what initial states explain.
fn circuit(problem: &Problem, null: &State, basis: &Basis) -> Vec<Vec<f64>> {
    let converter = &null.model.plant.converter;
    let (l, c) = (converter.inductance, converter.capacitance);
    let by = NUDGE * problem.bases.v / problem.bases.i;
    let moves: [&(dyn Fn(&mut Model) + Sync); 3] = [
        &|model| model.plant.inductor.dcr += by,
        &|model| model.plant.converter.inductance = l * (1.0 + NUDGE),
        &|model| model.plant.converter.capacitance = c * (1.0 + NUDGE),
    ];
    parallel::map(&moves, |change| {
        let mut model = null.model.clone();
        change(&mut model);
        let after = problem.residual(&model, &null.starts);
        let mut column: Vec<f64> = null.residual.iter().zip(&after).map(|(a, b)| a - b).collect();
        basis.project(&mut column);
        column
    })
}

/// Where is looked.
struct Look<'a> {
    problem: &'a Problem,
    records: &'a [usize],
    circuit: Vec<Vec<f64>>,
}

impl Look<'_> {
    fn score(&self, state: &State) -> Score {
        let (mut left, mut shown) = (Vec::new(), Vec::new());
        let mut circuit = vec![Vec::new(); self.circuit.len()];
        for index in self.records {
            let record = &self.problem.records[*index];
            let columns: Vec<Vec<f64>> = (self.circuit.iter())
                .map(|column| channel(self.problem, column, *index, CURRENT))
                .collect();
            let residual = channel(self.problem, &state.residual, *index, CURRENT);
            for (row, value) in residual.into_iter().enumerate().filter(|(_, value)| *value != 0.0) {
                left.push(value);
                shown.push(record.measured[CURRENT][row] / self.problem.sigma[CURRENT] - value);
                for (all, column) in circuit.iter_mut().zip(&columns) {
                    all.push(column[row]);
                }
            }
        }
        let raw = dot(&left, &left);
        let ones = vec![1.0; left.len()];
        let with = |more: &[&Vec<f64>]| {
            let columns: Vec<Vec<f64>> = circuit.iter().chain(more.iter().copied()).cloned().collect();
            let normal = Normal::new(&columns, &left);
            let right: Vec<f64> = columns.iter().map(|column| dot(column, &left)).collect();
            raw - dot(&solve(normal.matrix(), &right), &right)
        };
        Score {
            raw: with(&[]),
            offset: with(&[&ones]),
            gain: with(&[&shown]),
            both: with(&[&ones, &shown]),
        }
    }
}

fn named(null: &State, carrier: Carrier, delta_chi2: f64) -> Named {
    let value = Value {
        value: carrier as usize as f64,
        low: carrier as usize as f64,
        high: carrier as usize as f64,
        unit: "1",
        model: null.model.plant.pwm.carrier as usize as f64,
    };
    Named {
        id: ID,
        words: "carrier of the modulator",
        parameters: BTreeMap::from([(ID, value)]),
        evidence: Evidence {
            delta_chi2,
            threshold: THRESHOLD,
        },
        rivals: Vec::new(),
        rival_values: Vec::new(),
    }
}

fn choice(number: usize) -> &'static str {
    let words = plant::parameter(KEY).map_or(&[][..], |parameter| parameter.choices());
    words.get(number).copied().unwrap_or_default()
}

/// The word for a value of a cause that has words for its values.
#[must_use]
pub fn word(id: &str, value: f64) -> Option<&'static str> {
    (id == ID).then(|| choice(value as usize))
}
