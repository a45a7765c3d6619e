//! Drives the plant by a record: its duties, set loads and sampling instants.
//!
//! ```text
//! PWM periods       | duty[n], load[n]          | duty[n+1], load[n+1]      |
//! sampling instants |       ^ row n             |       ^ row n+1           |    phase + late / t_sw
//! ```
//!
//! A row is a PWM period. Samples that come whole periods later are moved by rows; the rest is the plant's phase.

use std::borrow::Cow;
use std::sync::Arc;

use measured::{DutyIs, Sampled};
use plant::{Carrier, Load, Pace, Parameters, Plant, Rectifier, Signals};

use crate::record::{CHANNELS, Record, Segment, V_IN};
use crate::resistors::{self, Resistor};

/// Duties before a segment that the plant is given at least: more than it can delay. A rate looks back farther.
// eight that wait and the one in force
const HISTORY: usize = 9;
/// Time constant that stands for the mean over a settled point, periods: it lets through less than 0.2 % of a
/// ripple at the switching frequency.
const AVERAGED: f64 = 100.0;
/// Periods after which a settled point is taken as it is. Models that are tried may have none: an inductor that keeps a twentieth of its
/// inductance above a current that the ripple crosses jumps between two states.
// the slowest point of the plant's own tests takes 9 steps of Newton, of 16 periods each with all its parts, and 56 where one is in vain; this is 35 of those
const MOST_PERIODS: u32 = 2_000;
/// Steps of the integrator in a settled point after which it is taken as it is, ...
// those periods of a circuit of 30 steps a period, which few pass; an inductor that loses most of its inductance within its ripple asks for 600, and 26 points
// of it took 25 s of a core
const MOST_STEPS: f64 = 60_000.0;
/// ... but not before so many periods: twice what the slowest point of the plant's own tests takes.
const LEAST_PERIODS: f64 = 300.0;
/// Two instants closer than this share of a period are one: 0.1 ps at 10 kHz, far above the rounding of sums of periods.
const SAME: f64 = 1e-9;

/// Output voltage and inductor current at the first row of a segment, and what a load of constant power that lags draws there beyond its power.
pub type Start = [f64; 3];

/// What is estimated of one record beside every fit.
#[derive(Debug, Clone, Copy)]
pub struct Begin<'a> {
    /// The state at the start of each segment.
    pub states: &'a [Start],
    /// How much later than the record says each of its free load steps was, periods.
    pub late: &'a [f64],
    /// How far each of its free levels of the load is off, standard deviations.
    pub levels: &'a [f64],
    /// Duty that the gate's edges add.
    pub trim: f64,
}

/// What is simulated.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    /// The converter.
    pub plant: Parameters,
    /// How much later than stamped the samples were taken, s; negative for earlier.
    pub late: f64,
    /// Keys of the plant file whose numbers are certain: no cause changes them.
    pub certain: Arc<[String]>,
    /// The resistors of the load, where the records have several.
    pub resistors: Vec<Resistor>,
    /// `v_in` is measured in front of what the source has, and not at the converter's input.
    pub v_in_in_front: bool,
}

impl Model {
    /// The model as the file says.
    #[must_use]
    pub fn new(plant: &Parameters) -> Self {
        Model {
            plant: plant.clone(),
            late: 0.0,
            resistors: Vec::new(),
            certain: Arc::default(),
            v_in_in_front: false,
        }
    }

    /// The same with these keys of the plant file for certain.
    #[must_use]
    pub fn knowing(self, certain: &[String]) -> Self {
        Model {
            certain: certain.into(),
            ..self
        }
    }

    /// The same for a record whose duty column shows what the switch did.
    fn without_chain(&self, direct: bool) -> Self {
        let mut model = self.clone();
        for sensor in sensors(&mut model.plant).into_iter().filter(|_| direct) {
            (sensor.low_pass, sensor.delay) = (0.0, 0.0);
        }
        let p = &mut model.plant;
        // what stands between command and switch is in the column already
        (p.pwm.duty_delay, p.pwm.duty_lsb, p.pwm.min_on_time) = (0, 0.0, 0.0);
        (p.switch.dead_time, p.switch.turn_on_delay, p.switch.turn_off_delay) = (0.0, 0.0, 0.0);
        p.switch.node_capacitance = 0.0;
        model.late = 0.0;
        model
    }
}

/// What the sensors show at each row, from the given states at the start of each segment; NaN outside of segments and
/// where the model is no plant.
#[must_use]
pub fn simulate(model: &Model, record: &Record, begin: &Begin<'_>) -> Vec<[f64; CHANNELS]> {
    simulate_counted(model, record, begin).0
}

/// Steps of the plant in a fit.
// their error is a thousandth of a record's noise and less, and they take a half to three quarters of the time
pub(crate) const PACE: Pace = Pace::Coarse;

/// What a simulation took time for.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Ran {
    /// The rows of a course, and the periods in which settled points were sought.
    pub periods: u64,
    /// Steps of the plant's integrator in them.
    pub steps: u64,
}

/// [`simulate`], and what it took.
#[must_use]
pub(crate) fn simulate_counted(model: &Model, record: &Record, begin: &Begin<'_>) -> (Vec<[f64; CHANNELS]>, Ran) {
    let mut ran = Ran::default();
    let mut shown = vec![[f64::NAN; CHANNELS]; record.rows()];
    let stripped;
    let (model, trim) = match record.duty_is {
        DutyIs::Applied | DutyIs::Direct => {
            stripped = model.without_chain(record.duty_is == DutyIs::Direct);
            // the edges of the gate stand between command and switch as well
            (&stripped, 0.0)
        }
        _ => (model, begin.trim),
    };
    let mut p = model.plant.clone();
    p.converter.v_in *= record.v_in_ratio;
    for (sensor, is_true) in sensors(&mut p).into_iter().zip(record.is_true) {
        // the record has its own; a model that rounds or scatters predicts nothing better
        (sensor.noise, sensor.lsb) = (0.0, 0.0);
        if is_true {
            *sensor = plant::Sensor::default();
        }
    }
    let longer = trimmed(&mut p, trim);
    let (mut whole, mut phase) = sampled(record, model.late / p.t_sw());
    if phase.abs() < SAME {
        phase = 0.0;
    }
    if record.settled && record.sampled == Some(Sampled::Instant) {
        (p.source.ripple, whole) = (0.0, 0.0);
    } else if record.settled {
        // what is noted of a settled point is a mean over many periods
        for sensor in sensors(&mut p) {
            (sensor.low_pass, sensor.delay) = (AVERAGED * model.plant.t_sw(), 0.0);
        }
        p.source.ripple = 0.0;
        (phase, whole) = (0.0, 0.0);
    }
    p.pwm.sampling_phase = phase;
    let driver = Driver {
        record,
        load: shifted_load(record, begin.levels, &model.resistors, &p.sensors.v_out),
        whole: whole as isize,
        phase,
        steps: record
            .free_steps
            .iter()
            .copied()
            .zip(begin.late.iter().copied())
            .collect(),
    };
    // without constant power its lag is a state that stands still at 0, and beside it the circuit cannot be taken in its two states alone
    if driver.load.iter().all(|load| load.power == 0.0) {
        p.load.cpl_time_constant = 0.0;
    }
    for (segment, start) in record.segments.iter().zip(begin.states) {
        if p.source.ripple > 0.0 {
            // the plant's time starts at 0 with each segment, the line's phase does not
            let turns = model.plant.source.ripple_phase
                + p.source.ripple_frequency * (record.time[segment.start] + record.clock);
            p.source.ripple_phase = turns - turns.floor();
        }
        // a fit may try numbers that are no converter: NaN costs it that step, and not the diagnosis
        let Ok(plant) = Plant::new(&p) else {
            return (shown, ran);
        };
        let mut plant = plant.at_pace(PACE);
        plant.lengthen(longer);
        match record.settled {
            true if driver.repeats(segment.start) => shown[segment.start] = shown[segment.start - 1],
            true => ran.periods += driver.settle(&mut plant, segment.start, start, &mut shown),
            false => ran.periods += driver.run(&mut plant, segment, start, &mut shown),
        }
        ran.steps += plant.steps_taken();
        if model.v_in_in_front {
            show_source(&p, segment, phase, &mut shown);
        }
    }
    (shown, ran)
}

/// Shows the source's own voltage, which stands still but for a ripple that no filter of a sensor keeps off, in the place of the converter's input.
fn show_source(p: &Parameters, segment: &Segment, phase: f64, shown: &mut [[f64; CHANNELS]]) {
    let sensor = &p.sensors.v_in;
    for (n, row) in shown[segment.start..segment.end].iter_mut().enumerate() {
        let since = (n as f64 + phase) * p.t_sw();
        row[V_IN] = sensor.gain * p.source_voltage(since) + sensor.offset;
    }
}

/// Whole periods by which the samples of a record are late, and the phase of the period in which they lie, when they are taken `late` periods later
/// than the record says.
fn sampled(record: &Record, late: f64) -> (f64, f64) {
    let instant = record.phase + late;
    let whole = (instant + SAME).floor();
    (whole, instant - whole)
}

/// Rows of a segment in which a sensor shows what no model tells, since nobody knows what was before a record and what came behind it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Unseen {
    /// For each channel rows at the segment's begin: what a delayed sensor shows there is older.
    begin: [usize; CHANNELS],
    /// Rows at the record's begin, and at its end, whose samples lie in periods that have no row.
    beyond: [usize; 2],
}

impl Unseen {
    /// Of a model and a record.
    pub fn of(model: &Model, record: &Record) -> Self {
        let p = &model.plant;
        if record.settled || record.duty_is == DutyIs::Direct {
            return Self {
                begin: [0; CHANNELS],
                beyond: [0; 2],
            };
        }
        let all = &p.sensors;
        let mut channels = [&all.v_out, &all.i_l, &all.i_out, &all.v_in]
            .into_iter()
            .zip(record.is_true);
        let late = if record.duty_is == DutyIs::Applied {
            0.0
        } else {
            model.late
        };
        let whole = sampled(record, late / p.t_sw()).0 as isize;
        Self {
            begin: std::array::from_fn(|_| match channels.next() {
                Some((sensor, false)) if sensor.delay > 0.0 => 1 + (sensor.delay / p.t_sw()) as usize,
                _ => 0,
            }),
            beyond: [(-whole).max(0).unsigned_abs(), whole.max(0).unsigned_abs()],
        }
    }

    /// Whether a row of a segment is one for a channel.
    pub fn holds(&self, record: &Record, segment: &Segment, row: usize, channel: usize) -> bool {
        let [before, behind] = self.beyond;
        row < segment.start + self.begin[channel] || row < before || row + behind >= record.rows()
    }
}

/// Whether late edges would make of a trim what no line through its origin describes: where a synchronous leg's current is negative a late
/// edge does nothing or the opposite, and where the on-interval lies in the middle of the period a late edge of either kind moves it
/// the same way. A fit that takes tangents ends far off there.
#[must_use]
pub fn is_even(p: &Parameters) -> bool {
    p.converter.rectifier == Rectifier::Synchronous || p.pwm.carrier == Carrier::Centre
}

/// Puts a trim into a converter as late edges, which add or take duty whatever the commanded one is; a delay cannot be negative, hence two.
/// The share by which its pulses are to be longer instead, where [`is_even`].
fn trimmed(p: &mut Parameters, trim: f64) -> f64 {
    if is_even(p) {
        return trim;
    }
    p.switch.turn_off_delay += trim.max(0.0) * p.t_sw();
    p.switch.turn_on_delay += (-trim).max(0.0) * p.t_sw();
    0.0
}

struct Driver<'a> {
    record: &'a Record,
    /// The load, unsure levels where they are now.
    load: Cow<'a, [Load]>,
    /// Periods by which the sampling instants lie later than the rows say.
    whole: isize,
    phase: f64,
    /// Row from which a free load step acts in the record, and how much later it was, periods.
    steps: Vec<(usize, f64)>,
}

/// The load between two samples: what is drawn first, what then, and the share of the time at which it changes.
struct Drawn<'a>(&'a Load, &'a Load, f64);

/// Rows by which a free load step is apart from changes of the load that are not free, and from the ends of its segment: it may
/// lie a period to either side, and the samples by another one.
pub(crate) const FREE_APART: usize = 4;

impl Driver<'_> {
    /// Row of the PWM period in which row `n` is sampled.
    fn period(&self, n: usize) -> usize {
        // a record has no duties beyond its ends: the first and the last go on
        n.saturating_add_signed(self.whole).min(self.record.rows() - 1)
    }

    /// Simulates a segment; the periods that it took.
    fn run(&self, plant: &mut Plant, segment: &Segment, start: &Start, shown: &mut [[f64; CHANNELS]]) -> u64 {
        let (duty, load) = (&self.record.duty, &self.load);
        let first = self.period(segment.start);
        // at the start of a period its own duty is still to be commanded
        let given = if self.phase > 0.0 { first + 1 } else { first };
        // before the record its first duty was held
        let mut history = vec![duty[0]; HISTORY.saturating_sub(given)];
        history.extend_from_slice(&duty[given.saturating_sub(plant.looks_back())..given]);
        plant.reset_within(start[0], start[1], &load[first], &history);
        // before the record its first duty and its first load were there for long
        let beside = plant.swing_beside(duty[first], &load[first]);
        let sample = plant.sample();
        plant.draws_more(start[2]);
        // a slow sensor begins where it was, not at the signal of this instant
        plant.shows(std::array::from_fn(|n| self.record.measured[n][segment.start]));
        shown[segment.start] = array(&sample.measured);
        for (n, place) in (segment.start + 1..).zip(&mut shown[segment.start + 1..segment.end]) {
            let now = self.period(n);
            let before = self.period(n - 1);
            // rows are PWM periods, and between two samples inside of them the next period starts at 1 - phase
            let given = if self.phase > 0.0 { duty[now] } else { duty[before] };
            let sample = match self.moved(n) {
                Some(Drawn(first, then, at)) => plant.step_with_change(given, first, then, at),
                None if self.phase > 0.0 => plant.step_with_change(given, &load[before], &load[now], 1.0 - self.phase),
                None => plant.step(given, &load[before]),
            };
            *place = array(&sample.measured);
        }
        segment.len() as u64 + u64::from(beside)
    }

    /// The load before the sample of row `n`, where a free step is near.
    fn moved(&self, n: usize) -> Option<Drawn<'_>> {
        let near = |step: &&(usize, f64)| self.period(n).abs_diff(step.0) < FREE_APART;
        let mut near = self.steps.iter().filter(near).peekable();
        let load = &self.load;
        // what is drawn before the first of them
        let mut drawn = load.get(near.peek()?.0.checked_sub(1)?)?;
        for (row, late) in near {
            let new = load.get(*row)?;
            // the sample of row n is taken at n + whole + phase, in periods of the record
            let since = *row as f64 + late - (self.whole as f64 + self.phase) - (n as f64 - 1.0);
            if since > 0.0 {
                return Some(Drawn(drawn, new, since));
            }
            drawn = new;
        }
        Some(Drawn(drawn, drawn, 1.0))
    }

    /// Whether a row is the settled point of the row before again, which need not be sought twice.
    fn repeats(&self, row: usize) -> bool {
        let record = self.record;
        record.repeated && row > 0 && record.is_same_point(row - 1, row)
    }

    /// The settled point of a row; the periods that it took.
    fn settle(&self, plant: &mut Plant, row: usize, start: &Start, shown: &mut [[f64; CHANNELS]]) -> u64 {
        let (duty, load) = (self.record.duty[row], &self.load[row]);
        plant.reset_within(start[0], start[1], load, &[duty; HISTORY]);
        let steps = plant::steps_per_period(plant.parameters(), PACE).max(1.0);
        let most = (MOST_STEPS / steps).max(LEAST_PERIODS) as u32;
        let found = plant.rest_within(duty, load, most.min(MOST_PERIODS));
        shown[row] = array(&found.sample.measured);
        u64::from(found.periods)
    }
}

/// The load of a record whose free levels are off by so many standard deviations, whose resistors are other than printed, and whose voltage is shown by
/// `voltmeter`. A conductance that was read off two meters is that of what they show: a current of `G (gain v + offset)` at the true voltage `v`.
fn shifted_load<'a>(
    record: &'a Record,
    levels: &[f64],
    resistors: &[Resistor],
    voltmeter: &plant::Sensor,
) -> Cow<'a, [Load]> {
    let are_off = resistors::are_off(resistors);
    let (gain, offset) = (voltmeter.gain, voltmeter.offset);
    let is_read_off = record.metered.is_some() && (gain, offset) != (1.0, 0.0);
    if levels.iter().all(|by| *by == 0.0) && !are_off && !is_read_off {
        return Cow::Borrowed(&record.load);
    }
    let mut load = record.load.clone();
    if are_off {
        resistors::apply(resistors, &mut load);
    }
    for (level, by) in record.free_levels.iter().zip(levels) {
        level.shift(&mut load, *by);
    }
    for load in load.iter_mut().filter(|load| is_read_off && load.conductance > 0.0) {
        load.current += offset * load.conductance;
        load.conductance *= gain;
    }
    Cow::Owned(load)
}

/// All sensors.
pub(crate) fn sensors(p: &mut Parameters) -> [&mut plant::Sensor; CHANNELS] {
    let all = &mut p.sensors;
    [&mut all.v_out, &mut all.i_l, &mut all.i_out, &mut all.v_in]
}

fn array(s: &Signals) -> [f64; CHANNELS] {
    [s.v_out, s.i_l, s.i_out, s.v_in]
}

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;
    use std::path::Path;

    use measured::{ColumnMap, DutyIs, Sheet};
    use plant::Parameters;

    use super::{Begin, Model, simulate};
    use crate::record::Record;

    #[test]
    fn edges_of_the_gate_are_in_an_applied_duty_already() {
        let model = Parameters::paper_table();
        let mut text = "t,d,v_o,i_load\n".to_owned();
        for n in 0..40 {
            let _ = writeln!(text, "{:.5},0.5,100.{n:02},5", f64::from(n) * 1e-4);
        }
        let sheet = Sheet::parse(Path::new("run.csv"), text.into(), &Record::file_options()).unwrap();
        let record = Record::read(&sheet, &ColumnMap::default(), &model).unwrap();
        let last = |duty_is: DutyIs, trim: f64| {
            let record = Record {
                duty_is,
                ..record.clone()
            };
            let begin = Begin {
                states: &[[100.0, 5.0, 0.0]],
                late: &[],
                levels: &[],
                trim,
            };
            simulate(&Model::new(&model), &record, &begin)[39][0]
        };
        // 1e-3 of duty is 0.2 V at rest
        let moved = |duty_is| last(duty_is, -1e-3) - last(duty_is, 0.0);
        assert!(moved(DutyIs::Commanded) < -0.05, "{}", moved(DutyIs::Commanded));
        assert_eq!([DutyIs::Applied, DutyIs::Direct].map(moved), [0.0, 0.0]);
    }
}
