//! Where the initial states of a fit begin: what was measured in the first rows of each segment, as a model's sensors show it.

use measured::DutyIs;
use plant::Sensor;

use super::{Problem, Starts, dot};
use crate::drive::{Model, Start};
use crate::fit::State;
use crate::ideal::{self, Ideal};
use crate::record::{CHANNELS, Record};

/// What a record leaves more of chi-square than before where a step has gone wrong in it: the trim, which acts in all records, moves it by less.
// a convention: what decides a tie
const WORSE: f64 = 9.0;

impl Problem {
    /// States to begin with: what was measured in the first rows, as the sensors of `model` show it.
    #[must_use]
    pub fn first_starts(&self, model: &Model) -> Starts {
        let of = |record: &Record| {
            record
                .segments
                .iter()
                .map(|segment| self.guess(record, segment.start, model))
                .collect()
        };
        Starts {
            states: self.records.iter().map(of).collect(),
            late: self
                .records
                .iter()
                .map(|record| vec![0.0; record.free_steps.len()])
                .collect(),
            levels: self
                .records
                .iter()
                .map(|record| vec![0.0; record.free_levels.len()])
                .collect(),
            trim: 0.0,
        }
    }

    /// Whether one of the records has a mean square of more than this.
    pub(crate) fn leaves_more(&self, residual: &[f64], most: f64) -> bool {
        (0..self.records.len()).any(|index| {
            let values = self.values_of(residual, index);
            let count = values.iter().filter(|value| **value != 0.0).count();
            dot(values, values) > most * count as f64
        })
    }

    /// The state whose every record begins as in the one of the two, of one model, that is nearer to it, and what it took in rows.
    pub(crate) fn nearer_of_each(&self, one: State, other: &State) -> (State, u64) {
        let is_nearer = |index: &usize| self.squares_of(other, *index) < self.squares_of(&one, *index);
        let nearer: Vec<usize> = (0..self.records.len()).filter(is_nearer).collect();
        if nearer.is_empty() {
            return (one, 0);
        }
        let mut starts = one.starts.clone();
        for index in nearer {
            starts.states[index].clone_from(&other.starts.states[index]);
            starts.late[index].clone_from(&other.starts.late[index]);
        }
        if starts == other.starts {
            let nearest = if other.chi2 < one.chi2 { other.clone() } else { one };
            return (nearest, 0);
        }
        let mixed = State::at(self, &one.model, starts);
        let rows = mixed.rows;
        (if mixed.chi2 < one.chi2 { mixed } else { one }, rows)
    }

    /// Whether some record is farther from a state than from another.
    pub(crate) fn is_worse_in_some(&self, state: &State, than: &State) -> bool {
        (0..self.records.len()).any(|index| self.squares_of(state, index) > self.squares_of(than, index) + WORSE)
    }

    fn squares_of(&self, state: &State, index: usize) -> f64 {
        let values = self.values_of(&state.residual, index);
        dot(values, values)
    }

    /// What a residual has of the rows of a record.
    fn values_of<'r>(&self, residual: &'r [f64], index: usize) -> &'r [f64] {
        let from = self.offsets[index];
        &residual[from..from + self.records[index].rows() * CHANNELS]
    }

    fn guess(&self, record: &Record, row: usize, model: &Model) -> Start {
        let p = &model.plant;
        let near = |channel: usize, sensor: &Sensor| {
            let (gain, offset) = match record.is_true[channel] {
                true => (1.0, 0.0),
                false => (sensor.gain, sensor.offset),
            };
            let values = record.measured[channel].iter().skip(row).take(3).copied();
            // a fit may try a gain of 0
            let mut shown = values.map(|shown| (shown - offset) / gain);
            shown.find(|value| value.is_finite())
        };
        let (ideal, duty) = (Ideal::of(record, p), record.duty[row]);
        let v = near(0, &p.sensors.v_out).unwrap_or_else(|| ideal.volts(duty));
        let drawn = ideal.inductor(ideal::drawn(&record.load[row], v), duty);
        let i = near(1, &p.sensors.i_l)
            .map(|shown| shown + behind_sensor(record, row, (drawn, v), model))
            .unwrap_or_else(|| {
                let mean = near(2, &p.sensors.i_out).map_or(drawn, |measured| ideal.inductor(measured, duty));
                // at an edge a whole half of the ripple beside the mean: from a current that rests no step leads to one that does not
                ideal
                    .triangle(mean, v, duty)
                    .at(p.pwm.carrier, record.phase + model.late / p.t_sw())
            });
        // without bound where no steady state is
        let finite = |value: f64| if value.is_finite() { value } else { 0.0 };
        [finite(v.max(0.0)), finite(if record.settled { drawn } else { i }), 0.0]
    }
}

/// How far the inductor current is above what a model's sensor shows of it in a row at which it delivers `mean` at `volts`: a slow one is behind, and
/// a delayed one shows another place of the ripple.
fn behind_sensor(record: &Record, row: usize, (mean, volts): (f64, f64), model: &Model) -> f64 {
    let (p, duty) = (&model.plant, record.duty[row]);
    if record.is_true[1] || record.duty_is == DutyIs::Direct || record.settled {
        return 0.0;
    }
    let (sensor, carrier) = (&p.sensors.i_l, p.pwm.carrier);
    let triangle = Ideal::of(record, p).triangle(mean, volts, duty);
    let now = record.phase + model.late / p.t_sw();
    let seen = now - sensor.delay / p.t_sw();
    triangle.at(carrier, now) - triangle.at(carrier, seen)
        + triangle.above_shown(carrier, seen, sensor.low_pass / p.t_sw())
}

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;
    use std::path::Path;

    use measured::{ColumnMap, Sheet};
    use plant::Parameters;

    use super::super::Problem;
    use crate::drive::Model;
    use crate::fit::State;
    use crate::record::Record;

    /// Two records at rest, of 100 V and 5 A; the current of one fit begins at 0 in the first of them, that of the other in the second.
    #[test]
    fn each_record_begins_as_in_the_nearer_of_two_fits() {
        let plant = Parameters::paper_table();
        let record = |name: &str| {
            let mut text = "t,d,v_o,i_l,i_load\n".to_owned();
            for n in 0..60 {
                let noise = f64::from(n * 7 % 5) - 2.0;
                let _ = writeln!(
                    text,
                    "{:.5},0.5,{:.3},{:.3},5",
                    f64::from(n) * 1e-4,
                    100.0 + 0.01 * noise,
                    5.0 + 0.01 * noise
                );
            }
            let sheet = Sheet::parse(Path::new(name), text.into(), &Record::file_options()).unwrap();
            Record::read(&sheet, &ColumnMap::default(), &plant).unwrap()
        };
        let model = Model::new(&plant);
        let mut problem = Problem::new(vec![record("first.csv"), record("second.csv")], model.clone());
        problem.sigma = [0.1, 0.1, f64::INFINITY, f64::INFINITY];
        let begun = problem.first_starts(&model);
        let without_current = |index: usize| {
            let mut starts = begun.clone();
            starts.states[index][0][1] = 0.0;
            State::at(&problem, &model, starts)
        };
        let [one, other] = [without_current(0), without_current(1)];
        let both = State::at(&problem, &model, begun);
        assert!(both.chi2 < 0.5 * one.chi2 && both.chi2 < 0.5 * other.chi2);
        let bound = 0.5 * (both.chi2 + one.chi2) / problem.count() as f64;
        assert!(problem.leaves_more(&one.residual, bound) && !problem.leaves_more(&both.residual, bound));
        for (mine, its) in [(one.clone(), &other), (other.clone(), &one)] {
            assert_eq!(problem.nearer_of_each(mine, its).0.starts.states, both.starts.states);
        }
        // nothing is better in another fit of the same
        assert_eq!(problem.nearer_of_each(both.clone(), &one).0.chi2, both.chi2);
    }
}
