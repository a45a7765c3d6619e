//! Where the initial states of a fit begin: what was measured in the first rows of each segment, as a model's sensors show it.

use measured::DutyIs;
use plant::Sensor;

use super::{Problem, Starts};
use crate::drive::{Model, Start};
use crate::ideal::{self, Ideal};
use crate::record::Record;

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
