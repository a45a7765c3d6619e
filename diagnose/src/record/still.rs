//! How a record's voltage goes with its duty where both stand still: the direction that levels alone do not tell.

use super::Record;
use crate::ideal::Ideal;

/// Rows that a duty and a load stand still before the voltage is read, in periods of the filter: e^-3 of a swing of usual damping is left.
const RESTED: f64 = 1.0;
/// Rows of which the mean is taken at the end of a stretch, at least: fewer lie on a swing.
const FEWEST: usize = 5;
/// Duties nearer to each other than this are one: noise and losses tilt a line through them. A convention.
const MOVES: f64 = 0.03;

/// Means of a voltage that stands still lie this many times as far apart as it moves about them: what drops it now and then, as lost pulses do, puts
/// means of some tens of rows in any order. Means of rows that move as one differ by this once in two hundred pairs.
const STANDS: f64 = 4.0;

/// Slopes of the voltage over what an ideal converter gives; 1 for one without losses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slopes {
    /// With the duty as it is.
    pub own: f64,
    /// With that of the other switch.
    pub other: f64,
}

/// The slopes of a record; nothing if its duty hardly moves, or its voltage never stands still.
pub fn slopes(record: &Record, ideal: &Ideal) -> Option<Slopes> {
    let tails = tails(record, ideal);
    let at = |(row, tail): &(usize, Vec<f64>)| (record.duty[*row], mean(tail));
    let points: Vec<(f64, f64)> = tails.iter().map(at).collect();
    let volts: Vec<f64> = points.iter().map(|(_, volts)| *volts).collect();
    let within = tails.iter().map(|(_, tail)| square(tail)).sum::<f64>() / tails.len() as f64;
    if within.sqrt() * STANDS > span(&volts) {
        return None;
    }
    let duties: Vec<f64> = points.iter().map(|(d, _)| *d).collect();
    if points.is_empty() || span(&duties) < MOVES {
        return None;
    }
    let over = |volts: &dyn Fn(f64) -> f64| {
        let count = points.len() as f64;
        let (x_mean, v_mean) = points.iter().fold((0.0, 0.0), |(x, v), (d, volt)| {
            (x + volts(*d) / count, v + volt / count)
        });
        let (cross, own) = points.iter().fold((0.0, 0.0), |(cross, own), (d, v)| {
            let x = volts(*d) - x_mean;
            (cross + x * (v - v_mean), own + x * x)
        });
        cross / own
    };
    let slopes = Slopes {
        own: over(&|d| ideal.volts(d)),
        other: over(&|d| ideal.volts(1.0 - d)),
    };
    (slopes.own.is_finite() && slopes.other.is_finite()).then_some(slopes)
}

/// Rows and voltages of settled points, and of the ends of stretches in which duty and load stand still.
pub fn points(record: &Record, ideal: &Ideal) -> Vec<(usize, f64)> {
    let tails = tails(record, ideal).into_iter();
    tails.map(|(row, tail)| (row, mean(&tail))).collect()
}

/// Their rows with the voltages of each: one of a settled point, and those at the end of a stretch.
fn tails(record: &Record, ideal: &Ideal) -> Vec<(usize, Vec<f64>)> {
    let volts = &record.measured[0];
    if record.settled {
        let points = volts.iter().copied().enumerate().filter(|(_, v)| v.is_finite());
        return points.map(|(row, v)| (row, vec![v])).collect();
    }
    let rested = (RESTED * ideal.swing()) as usize;
    let mut tails = Vec::new();
    let mut start = 0;
    for row in 1..=record.rows() {
        if row < record.rows() && record.is_same_point(row, start) {
            continue;
        }
        let tail = volts[(start + rested).min(row)..row].iter().copied();
        let tail: Vec<f64> = tail.filter(|v| v.is_finite()).collect();
        if tail.len() >= FEWEST {
            tails.push((start, tail));
        }
        start = row;
    }
    tails
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Mean square about the mean.
fn square(values: &[f64]) -> f64 {
    let mean = mean(values);
    values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64
}

fn span(values: &[f64]) -> f64 {
    let (low, high) = values
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
            (low.min(*v), high.max(*v))
        });
    high - low
}

#[cfg(test)]
mod tests {
    use super::*;
    use plant::{Load, Parameters};

    fn record(volts: impl Fn(f64) -> f64) -> Record {
        record_of(|_, d| volts(d))
    }

    fn record_of(volts: impl Fn(usize, f64) -> f64) -> Record {
        let parameters = Parameters::paper_table();
        let duty: Vec<f64> = (0..400).map(|row| 0.4 + 0.05 * f64::from(row / 100)).collect();
        let text: String = (duty.iter().enumerate())
            .map(|(row, d)| format!("{},{d},{},20\n", row as f64 * 1e-4, volts(row, *d)))
            .collect();
        let sheet = measured::Sheet::parse(
            std::path::Path::new("run.csv"),
            format!("t,duty,v_out,r_load\n{text}").into(),
            &Record::file_options(),
        );
        let map = measured::ColumnMap::parse("duty=duty*1").unwrap();
        let record = Record::read(&sheet.unwrap(), &map, &parameters).unwrap();
        assert_eq!(
            record.load[0],
            Load {
                conductance: 0.05,
                ..Load::default()
            }
        );
        record
    }

    #[test]
    fn a_voltage_that_falls_with_the_duty_has_the_other_slope() {
        let ideal = Ideal::at(&Parameters::paper_table(), 1.0);
        let rises = slopes(&record(|d| 0.96 * ideal.volts(d) - 1.0), &ideal).unwrap();
        let falls = slopes(&record(|d| 0.96 * ideal.volts(1.0 - d) - 1.0), &ideal).unwrap();
        assert!(
            (rises.own - 0.96).abs() < 1e-3 && (rises.other + 0.96).abs() < 1e-3,
            "{rises:?}"
        );
        assert!(
            (falls.own + 0.96).abs() < 1e-3 && (falls.other - 0.96).abs() < 1e-3,
            "{falls:?}"
        );
        // pulses are lost: the voltage drops now and then, most at the highest duty by chance
        let drops = |d: f64| ideal.volts(d) - if d > 0.5 { 0.25 } else { 0.0 } * ideal.v_in;
        let lost = record_of(|row, d| match row % 20 {
            0..12 => drops(d),
            _ => ideal.volts(d),
        });
        assert_eq!(slopes(&lost, &ideal), None);
        // a voltage that does not move at all is no measurement
        let rests = slopes(&record(|d| 50.0 + 1e-4 * d), &ideal).unwrap();
        assert!(rests.own.abs() < 1e-5 && rests.other.abs() < 1e-5, "{rests:?}");
    }
}
