//! Records of a data logger: rows so many switching periods apart that only settled values can be compared.
//!
//! ```text
//! duty ──────┐
//!            └───────────────────────────
//! v    ──────┐                 ╷
//!            ╰╮╭─╮╭─────────────────────
//!      ┈┈┈┈┈┈ │  left out ┈┈┈┈ │ settled points ┈┈
//! ```
//! Nobody knows when between two rows a step was, and the filter swings between rows. So the rows behind a step are left
//! out until the filter rests, and the others become settled points: duty and load of all points of a stretch are one.

use plant::{Load, Parameters};
use toml_input::{Faults, Message};

use super::channels::{CHANNELS, FEWEST_SETTLED, QUANTITIES};
use super::raw::Raw;
use super::rows::Lines;
use crate::ideal::Ideal;
use crate::noise;

/// Rows further apart than this share of the filter's period do not show how it swings. A controller that holds its duty
/// that long could not damp the filter either: such rows are a logger's. A convention.
const RESOLVED: f64 = 1.0 / 8.0;
/// Most periods between rows: 10 ms at 50 kHz. A thousand are more likely a time in other units.
const MOST_PERIODS: f64 = 500.0;
/// Time constants after which the filter rests: e^-7 of a step is a thousandth, as little as meters show.
const RESTS: f64 = 7.0;
/// Slowest decay that is waited for, as a share of the filter's angular frequency: real windings and capacitors
/// damp at least as much (a loaded filter with a quality of 10). Only a model without losses has less.
const LEAST_DAMPING: f64 = 0.05;
/// Least share of the inductor's current that an output receives: beyond a duty of nine tenths no boost works.
const LEAST_GIVEN: f64 = 0.1;
/// Rows left out behind a step at least: a mean over the row of the step holds both sides, and a logger's own filter one more.
const LEAST_LEFT_OUT: usize = 2;
/// A change between rows is a step beyond this many times the usual one: five standard deviations of noise.
const STEP: f64 = 7.5;
/// Changes below these are none: of the duty, and of the load as a share of the largest current. Points are means, which a
/// change so small in a stretch moves by as little. Conventions.
const STILL_DUTY: f64 = 2e-3;
const STILL_LOAD: f64 = 0.01;
/// Points of a stretch: enough that structure in time shows among them, few enough that each is a mean of many rows.
/// A convention.
const POINTS: usize = 8;

/// Rows of one duty and one load.
struct Stretch {
    rows: std::ops::Range<usize>,
    duty: f64,
    load: Load,
}

/// Whether rows `periods` switching periods apart are those of a logger, for a converter of `parameters` at a duty.
pub fn is_logged(periods: f64, parameters: &Parameters, duty: f64) -> bool {
    let resolved = RESOLVED * std::f64::consts::TAU / (angular(parameters, duty) * parameters.t_sw());
    (1.5f64.max(resolved)..=MOST_PERIODS).contains(&periods)
}

/// Angular frequency of the filter, rad/s: where the output gets a share of the inductor's current, by that share slower (Erickson and Maksimovic,
/// table 8.2).
fn angular(parameters: &Parameters, duty: f64) -> f64 {
    let converter = &parameters.converter;
    let give = converter.topology.give(duty).max(LEAST_GIVEN);
    give / (converter.inductance * converter.capacitance).sqrt()
}

/// How long the filter needs until it rests under a load, s.
fn settling(parameters: &Parameters, load: &Load, (v, duty): (f64, f64)) -> f64 {
    let p = parameters;
    let r = p.inductor.dcr + 0.5 * (p.switch.r_ds_on + p.switch.r_d);
    let g = load.conductance - load.power / (v * v).max(1e-12);
    let (omega, half) = (
        angular(p, duty),
        0.5 * (g / p.converter.capacitance + r / p.converter.inductance),
    );
    let below = half * half - omega * omega * (1.0 + r * g);
    let slowest = if below > 0.0 { half - below.sqrt() } else { half };
    RESTS / slowest.max(LEAST_DAMPING * omega)
}

impl Raw<'_> {
    /// The settled points of a record whose rows are `step` apart.
    ///
    /// # Errors
    /// If duty and load never stand still for long enough.
    pub fn logged(&mut self, parameters: &Parameters, step: f64, phase: f64) -> Result<Lines, Faults> {
        let loads = self.loads()?;
        let duty = super::rows::held(self.values("duty").unwrap_or_default());
        let v = Ideal::at(parameters, 1.0).volts(super::suspicion::typical(&duty).unwrap_or(0.5));
        let stretches = self.stretches(&duty, &loads, v, step);
        let columns: [Option<Vec<f64>>; CHANNELS] = QUANTITIES.map(|name| self.measured(name));
        let mut lines = Lines::empty(phase);
        let mut rests: [Vec<f64>; CHANNELS] = Default::default();
        let (mut points, mut used, mut settled) = (0, 0, 0);
        let (mut longest, mut least) = (0usize, f64::INFINITY);
        for stretch in &stretches {
            let wait = settling(parameters, &stretch.load, (v, stretch.duty));
            let out = ((wait / step).ceil() as usize).max(LEAST_LEFT_OUT);
            (longest, least) = (longest.max(stretch.rows.len()), least.min(out as f64 * step));
            let rows = (stretch.rows.start + out).min(stretch.rows.end)..stretch.rows.end;
            if rows.is_empty() {
                continue;
            }
            (used, settled) = (used + rows.len(), settled + 1);
            points += self.add_points(&mut lines, &columns, stretch, &rows);
            for (rest, column) in rests.iter_mut().zip(&columns) {
                rest.extend(
                    column
                        .as_deref()
                        .and_then(|values| values.get(rows.clone()))
                        .unwrap_or_default(),
                );
                // no difference reaches over the end of a stretch
                rest.push(f64::NAN);
            }
        }
        let apart = format!("{:.0} switching periods apart", step / parameters.t_sw());
        if points < FEWEST_SETTLED {
            let message = Message::new("duty and load do not stand still long enough for rows so far apart")
                .found(format!(
                    "rows {apart}, at most {:.3e} s without a step",
                    longest as f64 * step
                ))
                .expected(format!("more than {least:.3e} s, in which the filter comes to rest"))
                .hint("record a row each switching period; if each row is a settled point as it is: --settled");
            return Err(self.sheet.fault(message).into());
        }
        self.repairs.push(format!(
            "rows are {apart}, too far to show a transient: {points} settled points taken, means in {settled} stretches of \
             constant duty and load; {} of {} rows left out behind steps. Inductance, capacitance and delays leave no trace \
             in such a record: a row each period shows them",
            self.rows() - used,
            self.rows()
        ));
        lines.repeated = true;
        lines.scatter = rests.map(|rest| noise::scatter(&rest, |triple| triple.iter().all(|v| v.is_finite())));
        Ok(lines.of_points())
    }

    /// Runs of rows between steps of duty and load and gaps in time.
    fn stretches(&self, duty: &[f64], loads: &[Load], v: f64, step: f64) -> Vec<Stretch> {
        let time = self.values("t").unwrap_or_default();
        let part = |of: fn(&Load, f64) -> f64| loads.iter().map(|load| of(load, v)).collect::<Vec<f64>>();
        let drawn = [
            part(|load, v| load.conductance * v),
            part(|load, _| load.current),
            part(|load, v| load.power / v.max(1e-9)),
        ];
        let most = drawn.iter().flatten().fold(0.0f64, |most, i| most.max(i.abs()));
        let mut set = vec![Input::new(duty.to_vec(), STILL_DUTY)];
        set.extend(drawn.map(|values| Input::new(values, STILL_LOAD * most)));
        let breaks = |n: usize| {
            let gap = time.get(n).zip(time.get(n - 1)).is_none_or(|(b, a)| b - a > 1.5 * step);
            gap || set.iter().any(|input| input.steps(n))
        };
        let mut list = Vec::new();
        let mut start = 0;
        for n in 1..=duty.len() {
            if n < duty.len() && !breaks(n) {
                continue;
            }
            let rows = start..n;
            start = n;
            if set.iter().all(|input| input.is_still(&rows)) {
                let mean = |values: Vec<f64>| values.iter().sum::<f64>() / rows.len() as f64;
                let of = |part: fn(&Load) -> f64| {
                    mean(loads.get(rows.clone()).unwrap_or_default().iter().map(part).collect())
                };
                list.push(Stretch {
                    duty: mean(duty.get(rows.clone()).unwrap_or_default().to_vec()),
                    load: Load {
                        conductance: of(|load| load.conductance),
                        current: of(|load| load.current),
                        power: of(|load| load.power),
                    },
                    rows,
                });
            }
        }
        list
    }

    /// Adds the settled rows of a stretch as means of equal parts; how many.
    fn add_points(
        &self,
        lines: &mut Lines,
        columns: &[Option<Vec<f64>>; CHANNELS],
        stretch: &Stretch,
        rows: &std::ops::Range<usize>,
    ) -> usize {
        let count = rows.len().min(POINTS);
        let time = self.values("t").unwrap_or_default();
        for point in 0..count {
            let part = rows.start + point * rows.len() / count..rows.start + (point + 1) * rows.len() / count;
            let mean = |values: &[f64]| {
                let known = values
                    .get(part.clone())
                    .unwrap_or_default()
                    .iter()
                    .filter(|v| v.is_finite());
                let (sum, n) = known.fold((0.0, 0), |(sum, n), v| (sum + v, n + 1));
                if n > 0 { sum / f64::from(n) } else { f64::NAN }
            };
            lines.time.push(mean(&time));
            lines.duty.push(stretch.duty);
            lines.load.push(stretch.load);
            for (channel, column) in lines.measured.iter_mut().zip(columns) {
                channel.push(column.as_deref().map_or(f64::NAN, mean));
            }
        }
        count
    }
}

/// A duty or a part of the load, row by row.
struct Input {
    values: Vec<f64>,
    /// A change that is no step.
    still: f64,
}

impl Input {
    fn new(values: Vec<f64>, least: f64) -> Self {
        let changes = values.windows(2).map(|pair| (pair[1] - pair[0]).abs());
        let usual = crate::median::median(changes);
        let noise = if usual.is_finite() { STEP * usual } else { 0.0 };
        Input {
            values,
            still: least.max(noise),
        }
    }

    /// Whether it steps from the row before `n`.
    fn steps(&self, n: usize) -> bool {
        let pair = self.values.get(n).zip(self.values.get(n - 1));
        pair.is_none_or(|(b, a)| (b - a).abs() > self.still)
    }

    /// Whether it ends as it began: what creeps in small steps does not stand still either.
    fn is_still(&self, rows: &std::ops::Range<usize>) -> bool {
        let values = self.values.get(rows.clone()).unwrap_or_default();
        let third = values.len().div_ceil(3);
        let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len().max(1) as f64;
        let (first, last) = (values.get(..third), values.get(values.len() - third..));
        first
            .zip(last)
            .is_some_and(|(first, last)| (mean(last) - mean(first)).abs() <= self.still)
    }
}

#[cfg(test)]
mod tests {
    use plant::Parameters;

    use super::is_logged;

    /// 2 mH and 1.5 mF swing in 109 periods of 10 kHz as a buck; as a boost at a duty of three quarters in four times as many.
    #[test]
    fn a_boost_swings_slower_than_its_parts_by_the_share_that_its_output_gets() {
        let mut p = Parameters::paper_model();
        let is = |p: &Parameters, duty: f64| [12.0, 15.0, 50.0, 60.0].map(|periods| is_logged(periods, p, duty));
        assert_eq!(is(&p, 0.75), [false, true, true, true]);
        p.converter.topology = plant::Topology::Boost;
        assert_eq!(is(&p, 0.75), [false, false, false, true]);
        assert_eq!(is(&p, 0.0), [false, true, true, true]);
    }
}
