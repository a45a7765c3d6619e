//! Faults of a bench that are no causes of a model, seen before any fit: rows beside each other that are not of one period, two channels
//! exchanged, a probe set to another ratio, the duty of the other switch, another kind of converter, records at another source, a held-out
//! record that is a training record again.
//!
//! Each other way of reading a record is simulated once with the model as it is. A reading that leaves a small part of the error
//! is named. Nobody is kept from the diagnosis where a cause may look like it, as a delay looks like a shift. What no cause of the list does,
//! and what leaves noise alone in every record, needs no search: the fault is the answer.

use plant::Topology;

use crate::drive::Model;
use crate::fit::State;
use crate::ideal;
use crate::median::median;
use crate::noise;
use crate::parallel;
use crate::problem::Problem;
use crate::record::{CHANNEL_NAMES, CHANNELS, QUANTITIES, Record};
use crate::supply;

/// Farthest shift that is tried, rows.
const FARTHEST: isize = 4;
/// A reading is named if it leaves this share of chi-square (nearly half of the error), ...
const LEFT: f64 = 0.2;
/// ... where the record as it is leaves this mean square over the noise: below it there is nothing to mend.
const WRONG: f64 = 4.0;
/// Ratios of probes and shunts that are set wrong. The list of causes ends at half and at one and a half.
const PROBES: [f64; 4] = [2.0, 10.0, 0.5, 0.1];

/// Another way to read a record.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Reading {
    /// What was measured belongs so many rows earlier.
    Shifted(isize),
    /// Two channels the other way round.
    Exchanged(usize, usize),
    /// A channel shows so many times what there is.
    Probe(usize, f64),
    /// The duty is that of the other switch.
    OtherSwitch,
    /// The record is of another kind of converter.
    Kind(Topology),
    /// The source gave so many times the voltage of the plant file.
    Source(f64),
    /// The load drew so many times what was set.
    Load(f64),
}

/// A record that is better read in another way.
#[derive(Debug, Clone, PartialEq)]
pub struct Misread {
    /// What it looks like, and what mends it.
    pub words: String,
    /// Place of the record.
    record: usize,
    reading: Reading,
    /// Nothing but noise is left in this reading.
    is_clean: bool,
    /// No cause of the list does the same.
    is_no_cause: bool,
}

impl Misread {
    /// Rows by which the samples belong to later rows than theirs; nothing if they do not.
    fn ahead(&self) -> Option<f64> {
        match self.reading {
            Reading::Shifted(by) if by < 0 => Some(-by as f64),
            _ => None,
        }
    }

    /// Whether it is nothing but what the instrument of channel `n` may do by itself: another source does to the voltage what a gain does.
    #[must_use]
    pub fn may_be_an_instrument(&self, n: usize) -> bool {
        match self.reading {
            Reading::Source(_) => n == 0,
            Reading::Probe(channel, _) => channel == n,
            _ => false,
        }
    }

    /// Whether a cause says the same.
    pub(crate) fn is_said_by(&self, cause: &str) -> bool {
        matches!(self.reading, Reading::Source(_)) && cause == "v_in_wrong"
    }

    /// Whether a cause that explains the records speaks against it: the record cannot be both.
    #[must_use]
    pub fn is_refuted_by_a_cause(&self) -> bool {
        self.is_no_cause && !self.is_clean
    }
}

impl Reading {
    fn of(self, record: &Record) -> Record {
        let mut record = record.clone();
        match self {
            Reading::Probe(n, times) => record.measured[n].iter_mut().for_each(|value| *value /= times),
            Reading::OtherSwitch => record.duty.iter_mut().for_each(|duty| *duty = 1.0 - *duty),
            Reading::Kind(_) => {}
            Reading::Source(times) => record.v_in_ratio *= times,
            Reading::Load(times) => {
                for load in &mut record.load {
                    (load.conductance, load.current, load.power) =
                        (load.conductance * times, load.current * times, load.power * times);
                }
            }
            Reading::Shifted(by) => {
                for values in &mut record.measured {
                    let old = std::mem::take(values);
                    let at = |row: usize| row.checked_add_signed(by).and_then(|from| old.get(from).copied());
                    *values = (0..old.len()).map(|row| at(row).unwrap_or(f64::NAN)).collect();
                }
            }
            Reading::Exchanged(a, b) => record.measured.swap(a, b),
        }
        record
    }

    fn words(self, record: &Record, model: &Model) -> String {
        let name = &record.name;
        match self {
            Reading::Shifted(by) => {
                let rows = if by.abs() == 1 { "row" } else { "rows" };
                let (late, way) = if by > 0 { ("late", "up") } else { ("early", "down") };
                let by = by.abs();
                format!(
                    "{name}: what was measured looks shifted by {by} {rows} against duty and load, {late}: if a trigger or a buffer of the \
                     logger did it, move the measured columns {by} {rows} {way} in the file"
                )
            }
            Reading::Exchanged(a, b) => {
                let [own, other] = [a, b].map(|n| &record.headers[n]);
                format!(
                    "{name}: the columns {own} and {other} look exchanged; if so: --map {}={other},{}={own}",
                    QUANTITIES[a], QUANTITIES[b]
                )
            }
            Reading::Probe(n, times) => {
                let channel = CHANNEL_NAMES[n];
                format!(
                    "{name}: {channel} looks as if it showed {times} times what there is: a probe or shunt of another ratio? if so: {} times its \
                     column, by a map",
                    times.recip()
                )
            }
            Reading::OtherSwitch => format!(
                "{name}: the duty looks like that of the lower switch, 1 - d; if so, turn it by a map file: scale = -1.0, offset = 1.0 for the duty \
                 under [columns]"
            ),
            Reading::Source(times) => format!(
                "{name}: looks like a source of about {}, {:+.0} % beside the plant file's: was the supply set so? then v_in under [converter] is to \
                 be this; if not, v_out may be off by a gain",
                crate::words::si(model.plant.converter.v_in * record.v_in_ratio * times, "V"),
                100.0 * (times - 1.0)
            ),
            Reading::Load(times) => format!(
                "{name}: looks as if the load drew {times:.3} times what is set: another resistor, another setting? then correct r_load, i_load or \
                 p_load by a map; if not, the meter of the current may be off by a gain"
            ),
            Reading::Kind(kind) => format!(
                "{name}: the record looks like that of a {0}, and the model is of another kind; if so: topology = \"{0}\" under [converter] of the \
                 plant file",
                kind.word()
            ),
        }
    }

    /// Whether the list of causes has nothing that does the same to this record.
    fn is_no_cause(self, record: &Record) -> bool {
        match self {
            Reading::Shifted(_) | Reading::Exchanged(..) | Reading::Source(_) | Reading::Load(_) => false,
            Reading::Probe(..) | Reading::Kind(_) => true,
            // a duty that stands still is another by 1 - 2 d, which a source voltage or an offset may be as well; one that moves goes the
            // other way
            Reading::OtherSwitch => {
                let (low, high) =
                    (record.duty.iter()).fold((1.0f64, 0.0f64), |(low, high), d| (low.min(*d), high.max(*d)));
                high - low >= (1.0 - 2.0 * median(record.duty.iter().copied())).abs()
            }
        }
    }

    /// The model for this reading.
    fn model(self, model: &Model) -> Model {
        let mut model = model.clone();
        if let Reading::Kind(kind) = self {
            model.plant.converter.topology = kind;
        }
        model
    }
}

/// What the training records look like in another reading; `null` is the model as it is.
pub fn readings(problem: &Problem, null: &State) -> Vec<Misread> {
    let all: Vec<usize> = (0..problem.records.len())
        .filter(|n| problem.records[*n].capture.is_none())
        .collect();
    parallel::map(&all, |index| best_reading(problem, null, *index))
        .into_iter()
        .flatten()
        .collect()
}

/// The fault that answers for all records: each is misread in the same way, and nothing but noise is left in that reading.
pub fn answer(problem: &Problem, misread: &[Misread]) -> Option<String> {
    let first = misread.first()?;
    let same = |one: &Misread| one.is_clean && one.is_no_cause && one.reading == first.reading;
    (misread.len() == problem.records.len() && misread.iter().all(same)).then(|| first.words.clone())
}

/// A delay this near to whole periods, in periods, is one of whole rows.
// the step that counts as one for a sampling instant
const WHOLE: f64 = 0.02;

/// Whether a sampling instant that was found, periods late, is nothing but rows: all records show what their converter does whole rows later and
/// nothing else, and no instrument does that. What is older than its row an instrument may have held back.
pub fn is_rows_ahead(problem: &Problem, misread: &[Misread], late: f64) -> bool {
    let all = misread.len() == problem.records.len() && !misread.is_empty();
    let is_it = |one: &Misread| one.is_clean && one.ahead().is_some_and(|rows| (late - rows).abs() < WHOLE);
    all && misread.iter().all(is_it)
}

/// The shift that mends all records: the same whole rows in each, and nothing but noise left. A record in which a shift hardly shows need not
/// tell of it, but has to bear it.
pub fn all_shifted(problem: &Problem, null: &State, misread: &[Misread]) -> Option<String> {
    let first = misread.first()?;
    let is_it = |one: &Misread| one.is_clean && one.reading == first.reading;
    let bears_it = |index: usize| {
        let record = &problem.records[index];
        let is_told = misread.iter().any(|one| one.record == index);
        is_told || mean_square(problem, null, (index, record), Some(first.reading)) < WRONG
    };
    let is_shift = matches!(first.reading, Reading::Shifted(_));
    (is_shift && misread.iter().all(is_it) && (0..problem.records.len()).all(bears_it)).then(|| first.words.clone())
}

/// Rows of a record in which readings are compared first: more only cost time where these tell.
// some twenty readings of a record of thousands of rows take seconds
const ENOUGH: usize = 1500;

/// The first rows of a record.
fn first_rows(record: &Record) -> Record {
    let mut record = record.clone();
    record.segments.retain(|segment| segment.start + 4 < ENOUGH);
    for segment in &mut record.segments {
        segment.end = segment.end.min(ENOUGH);
    }
    record.free_steps.retain(|row| *row < ENOUGH);
    record.free_levels.retain(|level| level.rows.end <= ENOUGH);
    record
}

/// Mean square that one record leaves in a reading.
fn mean_square(problem: &Problem, null: &State, (index, record): (usize, &Record), reading: Option<Reading>) -> f64 {
    let mut alone = problem.clone();
    (alone.offsets, alone.masked) = (vec![0], vec![problem.masked[index].clone()]);
    alone.records = vec![reading.map_or_else(|| record.clone(), |reading| reading.of(record))];
    if let Some(Reading::Probe(n, times)) = reading {
        // the noise was seen through the same probe
        alone.sigma[n] /= times;
    }
    if let Some(Reading::Exchanged(a, b)) = reading {
        alone.sigma.swap(a, b);
    }
    let model = reading.map_or_else(|| null.model.clone(), |reading| reading.model(&null.model));
    let state = State::settle(&alone, &model, &alone.first_starts(&model), None);
    state.chi2 / alone.count().max(1) as f64
}

fn best_reading(problem: &Problem, null: &State, index: usize) -> Option<Misread> {
    let whole = &problem.records[index];
    let is_long = !whole.settled && whole.rows() > ENOUGH;
    let mut record = if is_long { first_rows(whole) } else { whole.clone() };
    let mut as_it_is = mean_square(problem, null, (index, &record), None);
    if as_it_is < WRONG && is_long {
        // what is wrong may begin later
        record = whole.clone();
        as_it_is = mean_square(problem, null, (index, whole), None);
    }
    if as_it_is < WRONG {
        return None;
    }
    let tried = tried(problem, null, index).into_iter();
    let found = tried.map(|reading| (mean_square(problem, null, (index, &record), Some(reading)), reading));
    let (mut left, reading) = found.min_by(|a, b| a.0.total_cmp(&b.0))?;
    let is_no_cause = reading.is_no_cause(whole);
    if is_long && is_no_cause && left < WRONG {
        left = left.max(mean_square(problem, null, (index, whole), Some(reading)));
    }
    (left < LEFT * as_it_is).then(|| Misread {
        words: reading.words(whole, &null.model),
        record: index,
        reading,
        is_clean: left < WRONG,
        is_no_cause,
    })
}

/// Readings of a record that are worth a simulation.
fn tried(problem: &Problem, null: &State, index: usize) -> Vec<Reading> {
    let record = &problem.records[index];
    let has = |n: usize| record.measured[n].iter().any(|v| v.is_finite());
    let shifts = (-FARTHEST..=FARTHEST).filter(|by| *by != 0).map(Reading::Shifted);
    let pairs = [(1, 2), (0, 3), (0, 1), (0, 2)]
        .into_iter()
        .filter(|(a, b)| has(*a) && has(*b));
    let in_time = shifts.chain(pairs.map(|(a, b)| Reading::Exchanged(a, b)));
    // points of a table have no neighbours in time
    let mut list: Vec<Reading> = in_time.filter(|_| !record.settled).collect();
    for n in (0..CHANNELS).filter(|n| has(*n)) {
        list.extend(
            (PROBES.into_iter())
                .map(|times| Reading::Probe(n, times))
                .filter(|reading| match reading {
                    // an output that a light load empties stays for a whole record where a wrong probe had it begin
                    Reading::Probe(0, _) => true,
                    Reading::Probe(n, times) => is_nearer(problem, null, index, (*n, *times)),
                    _ => false,
                }),
        );
    }
    // where no meter shows what the load draws, the inductor's current may be right and the load's column wrong
    if !has(2) && record.metered.is_none() {
        let loads = list.iter().filter_map(|reading| match reading {
            Reading::Probe(1, times) => Some(Reading::Load(*times)),
            _ => None,
        });
        list.extend(loads.collect::<Vec<_>>());
    }
    list.push(Reading::OtherSwitch);
    list.extend(supply::other(record, &null.model).map(Reading::Source));
    list.extend(other_load(record).map(Reading::Load));
    let own = null.model.plant.converter.topology;
    let kinds = [Topology::Buck, Topology::Boost, Topology::BuckBoost];
    list.extend(kinds.into_iter().filter(|kind| *kind != own).map(Reading::Kind));
    list
}

/// Whether a channel lies nearer to what the model shows if its probe has this ratio: initial states that follow a wrong probe for some rows
/// leave that as it is.
fn is_nearer(problem: &Problem, null: &State, index: usize, (n, times): (usize, f64)) -> bool {
    let left = noise::channel(problem, &null.residual, index, n);
    let rows = left.iter().zip(&problem.records[index].measured[n]);
    let errors = rows
        .filter(|(left, value)| **left != 0.0 && value.is_finite())
        .map(|(left, value)| {
            let shown = value / problem.sigma[n];
            (
                left * left,
                ((shown - times * (shown - left)) * (shown - times * (shown - left))),
            )
        });
    let (own, other) = errors.fold((0.0, 0.0), |(a, b), (own, other)| (a + own, b + other));
    other < own
}

/// A drawn current over the set one from which on the load is another: meters and resistors are off by some percent together.
const OTHER_LOAD: f64 = 0.06;

/// The measured load current over the one that was set, if the load is another.
fn other_load(record: &Record) -> Option<f64> {
    let rows = (0..record.rows()).filter(|_| record.metered.is_none());
    let times = median(rows.map(|row| {
        let set = ideal::drawn(&record.load[row], record.measured[0][row]);
        if set > 0.0 {
            record.measured[2][row] / set
        } else {
            f64::NAN
        }
    }));
    ((times - 1.0).abs() > OTHER_LOAD && times > 0.0).then_some(times)
}

/// Held-out records that are training records again: both names.
#[must_use]
pub fn repeated<'a>(train: &'a [Record], held: &'a [Record]) -> Vec<(&'a str, &'a str)> {
    let is_same = |a: &Record, b: &Record| {
        let alike = |a: &[f64], b: &[f64]| {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a == b || a.is_nan() && b.is_nan())
        };
        alike(&a.duty, &b.duty) && (0..CHANNELS).all(|n| alike(&a.measured[n], &b.measured[n]))
    };
    let of = |held: &'a Record| {
        let known = train.iter().find(|train| is_same(train, held))?;
        Some((held.name.as_str(), known.name.as_str()))
    };
    held.iter().filter_map(of).collect()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use measured::{ColumnMap, Sheet};
    use plant::Parameters;

    use super::Reading;
    use crate::drive::Model;
    use crate::record::Record;

    #[test]
    fn a_map_that_is_proposed_has_the_columns_of_the_file() {
        let rows: String = (0..30)
            .map(|n| format!("{:.4},0.5,{},5,20\n", n as f64 * 1e-4, 100 + n % 3))
            .collect();
        let text = format!("t,duty,Vout,I_load_meter,r_load\n{rows}");
        let sheet = Sheet::parse(Path::new("run.csv"), text.into(), &Record::file_options()).unwrap();
        let model = Parameters::paper_table();
        let map = ColumnMap::parse("v_out=Vout,i_out=I_load_meter").unwrap();
        let record = Record::read(&sheet, &map, &model).unwrap();
        let said = Reading::Exchanged(0, 2).words(&record, &Model::new(&model));
        assert!(said.ends_with("--map v_out=I_load_meter,i_out=Vout"), "{said}");
    }
}
