//! A table that is a capture: a few periods at the rate of an oscilloscope become one settled row that carries them.

use measured::{ColumnMap, DutyIs, Sampled};
use plant::{Load, Parameters, Topology};
use toml_input::{Faults, Message, Sink};

use super::channels::{CHANNELS, QUANTITIES};
use super::raw::Raw;
use super::rows::Lines;
use super::{Record, name_of, suspicion};
use crate::capture::{Capture, Samples, is_capture, leave_out_wild, plausible, read};
use crate::median::median;

/// Duty and load stand still in a steady state: a column may move by this share of what it holds, as loads are set and duties are written.
const STILL: f64 = 0.01;

/// Periods of a capture that are used: a steady state repeats itself, and noise is a seventh of that of one period.
const MOST_PERIODS: f64 = 50.0;

/// The rows of the periods that are used, of those that repeat a time the first.
fn kept(time: &[f64], t_sw: f64) -> Vec<usize> {
    let mut kept: Vec<usize> = (0..time.len()).collect();
    kept.dedup_by(|b, a| time[*b] == time[*a]);
    let end = time.first().copied().unwrap_or(0.0) + MOST_PERIODS * t_sw;
    kept.retain(|n| time[*n] < end);
    kept
}

impl Raw<'_> {
    /// The capture that this table is; nothing if it is another record.
    pub fn captured(&mut self, map: &ColumnMap, parameters: &Parameters) -> Result<Option<Record>, Faults> {
        let has = |name: &str| self.located.signal(name).and_then(measured::Signal::column).is_some();
        if map.settled == Some(true) || !has("t") {
            return Ok(None);
        }
        let step = self.row_step()?;
        let (time, t_sw) = (self.values("t").unwrap_or_default(), parameters.t_sw());
        let span = time.last().copied().unwrap_or(0.0) - time.first().copied().unwrap_or(0.0) + step;
        if map.settled == Some(false) || !is_capture(t_sw / step, span / t_sw) {
            return Ok(None);
        }
        self.needs_buck(parameters)?;
        let duty = self.still("duty")?;
        let load = self.still_load()?;
        let kept = kept(&time, t_sw);
        let pick = |values: Vec<f64>| kept.iter().map(|n| values[*n]).collect::<Vec<f64>>();
        let samples = Samples {
            step,
            channels: QUANTITIES.map(|name| self.measured(name).map(&pick)),
            pin: self.measured("v_pwm").map(&pick),
            node: self.measured("v_sw").map(&pick),
            i_in: self.measured("i_in").map(&pick),
            time: pick(time.clone()),
            duty,
            load,
            v_in: map.constant("v_in").unwrap_or(parameters.converter.v_in),
        };
        let unused = time.len() - samples.time.len();
        let found = read(samples, parameters).map_err(|message| self.sheet.fault(message))?;
        let mut repairs = self.repairs.clone();
        let count = time.len() - unused;
        let left_out = || format!("{unused} rows behind the first {MOST_PERIODS} periods are not used");
        repairs.extend((unused > 0).then(left_out));
        repairs.push(format!(
            "read as a capture: {count} rows over {:.0} whole periods of {}",
            found.capture.bins.periods,
            report::quantity(found.capture.period, "s", 5)
        ));
        repairs.extend(found.notes);
        let lines = Lines {
            time: vec![0.0],
            duty: vec![found.duty],
            load: vec![load],
            sampled: Some(Sampled::Mean),
            ..Lines::empty(0.5)
        }
        .of_points();
        let record = Record {
            name: name_of(self.sheet),
            time: lines.time,
            phase: lines.phase,
            duty: lines.duty,
            load: lines.load,
            headers: QUANTITIES.map(|name| self.source(name).header),
            measured: std::array::from_fn(|_| vec![f64::NAN]),
            lattice: [0.0; CHANNELS],
            resolution: [0.0; CHANNELS],
            v_in_ratio: map
                .constant("v_in")
                .map_or(1.0, |v_in| v_in / parameters.converter.v_in),
            duty_is: if found.applied { DutyIs::Applied } else { map.duty },
            is_true: [true; CHANNELS],
            settled: true,
            repeated: false,
            scatter: lines.scatter,
            clock: 0.0,
            metered: None,
            levels: Vec::new(),
            free_levels: Vec::new(),
            sampled: lines.sampled,
            dense: true,
            segments: lines.segments,
            free_steps: Vec::new(),
            capture: Some(Box::<Capture>::new(found.capture)),
            unread: self.unread.clone(),
            ends: [None; CHANNELS],
            repairs,
        };
        self.doubts(&record, parameters).propagate()?;
        Ok(Some(record))
    }

    /// What a capture is read off are formulas of the buck.
    fn needs_buck(&self, parameters: &Parameters) -> Result<(), Faults> {
        let topology = parameters.converter.topology;
        if topology == Topology::Buck {
            return Ok(());
        }
        let message = Message::new("captures are read of a buck alone")
            .found(format!("a model of a {}", topology.word()))
            .hint("a record of one row for each period, or of settled points, is diagnosed for every topology");
        Err(self.sheet.fault(message).into())
    }

    /// Sizes and signs of a capture that no bench has.
    fn doubts(&self, record: &Record, parameters: &Parameters) -> Sink {
        let Some(capture) = &record.capture else {
            return Sink::new();
        };
        // means of the channels in the place of measured points
        let means = Record {
            measured: std::array::from_fn(|n| vec![capture.mean(n).map_or(f64::NAN, |level| level.value)]),
            ..record.clone()
        };
        let sources = QUANTITIES.map(|name| self.source(name));
        let mut duty = self.source("duty");
        // no map of a column mends a duty that was read off edges
        duty.stated |= self.measured("duty").is_none();
        let mut odd = suspicion::of(&means, parameters, &sources, &duty);
        if odd.is_empty() {
            odd = plausible::of(&means, capture, parameters, &sources, &self.source("v_sw"));
        }
        odd.into_iter().map(|message| self.sheet.fault(message)).collect()
    }

    /// The one value of a quantity that stands still over a capture.
    fn still(&self, name: &'static str) -> Result<Option<f64>, Faults> {
        let Some(values) = self.values(name) else {
            return Ok(None);
        };
        let middle = median(values.iter().copied());
        let moved = values
            .iter()
            .position(|v| (v - middle).abs() > STILL * middle.abs().max(1e-9));
        match moved {
            None => Ok(Some(middle).filter(|v| v.is_finite())),
            Some(row) => {
                let message = Message::new(format!("`{}` changes within a capture", self.label(name)));
                let found = format!("{} beside {middle}", values[row]);
                let hint = "a capture is of one steady state; a few periods with a step in them are too short for a record over time";
                Err(self
                    .fault(
                        name,
                        row,
                        message.found(found).expected("one value throughout").hint(hint),
                    )
                    .into())
            }
        }
    }

    /// The one load of a capture; a measured current is taken with its mean.
    fn still_load(&self) -> Result<Load, Faults> {
        let is_measured = self.is_load_measured();
        let said = if is_measured {
            &["i_out"][..]
        } else {
            &["r_load", "i_load", "p_load"]
        };
        for name in said {
            if self
                .values(name)
                .is_some_and(|values| values.iter().all(|v| v.is_nan()))
            {
                let message = Message::new(format!("`{}` is empty, and it has to say the load", self.label(name)));
                let hint = format!("--map {name}=NUMBER says it for the whole capture");
                return Err(self
                    .sheet
                    .fault(message.expected("numbers in its column").hint(hint))
                    .into());
            }
        }
        if is_measured {
            let mut drawn = self.measured("i_out").unwrap_or_default();
            leave_out_wild(&mut drawn, 0.0);
            drawn.retain(|v| v.is_finite());
            return Ok(Load::current(drawn.iter().sum::<f64>() / drawn.len().max(1) as f64));
        }
        for name in said {
            self.still(name)?;
        }
        // a row without a load has that of the row before: the last has one
        Ok(self.loads()?.last().copied().unwrap_or_default())
    }
}
