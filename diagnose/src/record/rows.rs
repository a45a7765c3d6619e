//! From a table to the rows that are simulated; what is held over rows that are missing, and where a new stretch begins.

use measured::{ColumnMap, Sampled};
use plant::{Load, Parameters};
use toml_input::{Faults, Message};

use super::channels::{CHANNELS, FEWEST, FEWEST_SETTLED, QUANTITIES, Segment};
use super::levels::{self, Level};
use super::logged;
use super::raw::Raw;
use super::stamp::Clock;

/// Rows as the plant can be driven by them.
pub struct Lines {
    pub time: Vec<f64>,
    pub phase: f64,
    pub duty: Vec<f64>,
    pub load: Vec<Load>,
    pub measured: [Vec<f64>; CHANNELS],
    pub settled: bool,
    pub repeated: bool,
    pub scatter: [f64; CHANNELS],
    /// Noise of the meter whose current is the load, A; nothing if the load was set, or is taken as it was measured.
    pub metered: Option<f64>,
    /// Levels of such a load.
    pub levels: Vec<Level>,
    pub sampled: Option<Sampled>,
    pub dense: bool,
    pub segments: Vec<Segment>,
}

impl Lines {
    /// Nothing yet, of settled points.
    pub fn empty(phase: f64) -> Self {
        Lines {
            time: Vec::new(),
            phase,
            duty: Vec::new(),
            load: Vec::new(),
            measured: Default::default(),
            settled: true,
            repeated: false,
            scatter: [f64::NAN; CHANNELS],
            metered: None,
            levels: Vec::new(),
            sampled: None,
            dense: true,
            segments: Vec::new(),
        }
    }

    /// Each row is simulated by itself.
    pub fn of_points(mut self) -> Self {
        self.segments = (0..self.duty.len()).map(|n| n..n + 1).collect();
        self
    }
}

impl Raw<'_> {
    /// The rows to simulate: settled points, a row each period, or what a logger's rows allow.
    pub fn lines(&mut self, map: &ColumnMap, parameters: &Parameters) -> Result<Lines, Faults> {
        if self.is_settled(map.settled)? {
            return self.points(map);
        }
        let (step, t_sw) = (self.row_step()?, parameters.t_sw());
        let phase = parameters.pwm.sampling_phase;
        let clock = Clock { step, t_sw, phase };
        // who says `settled = false` wants the rows simulated as they are
        if map.settled != Some(false) && logged::is_logged(step / t_sw, parameters, self.usual_duty()) {
            let time = self.values("t").unwrap_or_default();
            let stamped = self.stamped(&time, clock);
            let sampled = map.sampled.or(map.phase.map(|_| Sampled::Instant));
            let lines = self.logged(parameters, step, map.phase.unwrap_or(stamped))?;
            return Ok(Lines { sampled, ..lines });
        }
        if map.sampled.is_some() {
            let note = "`sampled` of the column map is not used: rows are simulated at their instants";
            self.repairs.push(note.to_owned());
        }
        let (rows, phase) = self.align(clock, map.phase)?;
        self.enough(&rows, FEWEST)?;
        self.note_leaps();
        let mut lines = self.picked(&rows, phase)?;
        self.take_levels(&mut lines, &rows);
        Ok(Lines {
            time: (0..rows.len()).map(|n| self.start + n as f64 * t_sw).collect(),
            segments: segments(&rows, &lines.duty, &lines.load),
            // between rows of each period and of every second one
            dense: step < 1.5 * t_sw,
            settled: false,
            ..lines
        })
    }

    /// The duty that the rows have in the middle; a half where none is read.
    fn usual_duty(&self) -> f64 {
        let duty = self.values("duty").unwrap_or_default();
        super::suspicion::typical(&duty).unwrap_or(0.5)
    }

    /// Each row of the table as a settled point.
    fn points(&mut self, map: &ColumnMap) -> Result<Lines, Faults> {
        let rows: Vec<Option<usize>> = (0..self.rows()).map(Some).collect();
        self.enough(&rows, FEWEST_SETTLED)?;
        let lines = Lines {
            time: (0..rows.len()).map(|n| n as f64).collect(),
            sampled: map.sampled.or(Some(Sampled::Mean)),
            ..self.picked(&rows, map.phase.unwrap_or(0.5))?
        };
        Ok(lines.of_points())
    }

    /// The quantities of the rows that are used.
    fn picked(&self, rows: &[Option<usize>], phase: f64) -> Result<Lines, Faults> {
        Ok(Lines {
            duty: held(self.pick("duty", rows).unwrap_or_default()),
            load: held_loads(rows, &self.loads()?),
            measured: QUANTITIES.map(|name| self.pick(name, rows).unwrap_or_default()),
            ..Lines::empty(phase)
        })
    }

    /// Where only a meter knows the load, the load without the noise of the meter.
    fn take_levels(&mut self, lines: &mut Lines, rows: &[Option<usize>]) {
        if !self.is_load_measured() {
            return;
        }
        let (Some(i_out), v_out) = (self.pick("i_out", rows), self.pick("v_out", rows)) else {
            return;
        };
        let digit = self.lattice("i_out").max(self.resolution("i_out"));
        match levels::find(&i_out, &v_out.unwrap_or_default(), digit, lines.phase) {
            Some(found) => {
                self.repairs.push(found.words);
                (lines.load, lines.metered, lines.levels) = (found.load, Some(found.noise), found.levels);
            }
            None => {
                // nothing of its noise is taken away, and it is the load all the same
                lines.metered = Some(0.0);
                self.repairs.push(
                "i_out is taken for the load as it was measured, noise and all: it is neither levels nor straight lines with white \
                 noise. A column i_load or r_load of what was set drives the model better"
                    .to_owned(),
            );
            }
        }
    }

    fn enough(&self, rows: &[Option<usize>], fewest: usize) -> Result<(), Faults> {
        let used = rows.iter().flatten().count();
        if used >= fewest {
            return Ok(());
        }
        let message = Message::new("too few rows").found(match self.rows() > used {
            true => format!("{used} switching periods in {} rows", self.rows()),
            false => used.to_string(),
        });
        let message = message.expected(format!("{fewest} or more"));
        let hint = "a capture has 8 rows a period or more; means of a settled point are one row of a table without `t`";
        let of_points = fewest == FEWEST_SETTLED;
        Err(self
            .sheet
            .fault(if of_points { message } else { message.hint(hint) })
            .into())
    }
}

/// Gaps are filled with the value before.
pub fn held(values: Vec<f64>) -> Vec<f64> {
    let mut last = values.iter().copied().find(|v| v.is_finite()).unwrap_or(0.0);
    let hold = |value: f64| {
        if value.is_finite() {
            last = value.clamp(0.0, 1.0);
        }
        last
    };
    values.into_iter().map(hold).collect()
}

pub fn held_loads(rows: &[Option<usize>], loads: &[Load]) -> Vec<Load> {
    let mut last = rows.iter().flatten().next().map_or(Load::default(), |row| loads[*row]);
    let hold = |row: &Option<usize>| {
        if let Some(row) = row {
            last = loads[*row];
        }
        last
    };
    rows.iter().map(hold).collect()
}

/// Rows of a slower rate change their duty or load in at most this share of them, if somebody stepped it by hand or by
/// a plan; a controller changes it in nearly all. A convention.
const RARE: f64 = 0.2;

/// Stretches without a long gap; a short one is bridged with the duty held (as in a record of a slower rate).
///
/// Where rows are further apart than a period, nobody knows when between two of them a step was: behind a step of
/// duty or load a new stretch begins, whose initial state is estimated.
pub fn segments(rows: &[Option<usize>], duty: &[f64], load: &[Load]) -> Vec<Segment> {
    let used: Vec<usize> = (0..rows.len()).filter(|n| rows[*n].is_some()).collect();
    let mut steps: Vec<usize> = used.windows(2).map(|n| n[1] - n[0]).collect();
    steps.sort_unstable();
    let usual = steps.get(steps.len() / 2).copied().unwrap_or(1);
    let of_duty = |pair: &[usize]| duty[pair[0]] != duty[pair[1]];
    let of_load = |pair: &[usize]| load[pair[0]] != load[pair[1]];
    // beside a controller that moves the duty at each row a load may be stepped all the same
    let [cuts_duty, cuts_load] = [&of_duty as &dyn Fn(&[usize]) -> bool, &of_load].map(|steps| {
        let stepped = used.windows(2).filter(|pair| steps(pair)).count();
        usual > 1 && (stepped as f64) < RARE * used.len() as f64
    });
    let cut = |pair: &[usize]| cuts_duty && of_duty(pair) || cuts_load && of_load(pair);
    let mut segments = Vec::new();
    let mut start = used.first().copied().unwrap_or(0);
    for pair in used.windows(2) {
        if pair[1] - pair[0] > usual || cut(pair) {
            segments.push(start..pair[0] + 1);
            start = pair[1];
        }
    }
    segments.push(start..used.last().map_or(0, |n| n + 1));
    // four rows say little more than the initial states that they cost
    segments.retain(|segment| segment.len() > 4);
    segments
}
