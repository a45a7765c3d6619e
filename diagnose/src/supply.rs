//! The source voltage that a record's voltages and duties show.

use crate::drive::Model;
use crate::ideal::{self, Ideal};
use crate::median::median;
use crate::problem::duty_accuracy;
use crate::record::Record;

/// Sources of two records that differ by this share were set so: losses differ by less, and so do supplies.
const OTHER_SOURCE: f64 = 0.06;
/// Smallest duty that a source voltage is read off.
// a convention: below it a millivolt of the output is 20 of the source
const LEAST_DUTY: f64 = 0.05;
/// The middle of what single rows show and the balance of all rows' volt-seconds tell one source if they differ by less: a regulator that turns the duty
/// against the voltage makes the rows lie, and a spike the balance. A convention, half of what tells two sources.
const SAME: f64 = 0.03;

/// How far a measured source voltage may lie from the one that the output shows: two meters of half a percent, and losses.
const AGREES: f64 = 0.03;

/// Supplies that are set wrong: one twice or half of what it should be is rather a probe of another ratio.
const SUPPLIES: std::ops::Range<f64> = 0.55..1.8;

/// The source voltage that a record shows over that of the plant file, if it is another; a measured one has to agree.
pub(crate) fn other(record: &Record, model: &Model) -> Option<f64> {
    let own = model.plant.converter.v_in * record.v_in_ratio;
    let times = shown(record, model)? / own;
    let measured = record.measured[3].iter().copied().filter(|v| v.is_finite());
    let measured: Vec<f64> = measured.collect();
    let agrees = measured.is_empty() || (median(measured) / own / times - 1.0).abs() < AGREES;
    (agrees && SUPPLIES.contains(&times) && (times - 1.0).abs() > OTHER_SOURCE).then_some(times)
}

/// Source voltage that a record's voltages and duties show, without the losses that all records share; nothing if the current may rest.
fn shown(record: &Record, model: &Model) -> Option<f64> {
    let p = &model.plant.converter;
    let ideal = Ideal::at(&model.plant, 1.0);
    // a trim of the edges moves the duty by as much: by a twentieth of it, less than another source is told by
    let least = (20.0 * duty_accuracy(p.f_sw)).max(LEAST_DUTY);
    let rows = (0..record.rows()).filter_map(|row| {
        let (v, d, load) = (record.measured[0][row], record.duty[row], &record.load[row]);
        let drawn = ideal::drawn(load, v);
        let losses = model.plant.inductor.dcr * ideal.inductor(drawn, d) + model.plant.switch.v_f * (1.0 - d);
        // at a duty of 1 a boost holds no voltage
        let is_told = v.is_finite() && ideal.never_rests(drawn, d) && (least..1.0 - least).contains(&d);
        is_told.then(|| (ideal.source(v, d, losses), ideal.source_share(d)))
    });
    let rows: Vec<(f64, f64)> = rows.collect();
    let middle = median(rows.iter().map(|(source, _)| *source));
    let (volts, shares) = (rows.iter()).fold((0.0, 0.0), |(volts, all), (source, share)| {
        (volts + source * share, all + share)
    });
    let over_all = volts / shares;
    let is_told = 2 * rows.len() > record.rows() && (over_all / middle - 1.0).abs() < SAME;
    is_told.then_some(middle).filter(|v| v.is_finite())
}

/// Records that seem to come from another source than the training records.
pub fn sources(train: &[Record], held: &[Record], model: &Model) -> Vec<String> {
    let source = |record: &Record| Some(shown(record, model)? / record.v_in_ratio);
    let usual = median(train.iter().filter_map(source));
    let odd = |record: &Record| {
        let ratio = source(record)? / usual;
        // a record that has its own source voltage needs no word
        ((ratio - 1.0).abs() > OTHER_SOURCE && record.v_in_ratio == 1.0).then(|| {
            let v_in = format!("{:.4}", model.plant.converter.v_in * ratio).trim_end_matches('0').trim_end_matches('.').to_owned();
            format!(
                "{0}: looks like a source of about {v_in} V, {1:+.0} % beside the training records'; if it was set so, say it in a map file: \
                 [records.{0}] constants = {{ v_in = {v_in} }}",
                record.name,
                100.0 * (ratio - 1.0)
            )
        })
    };
    train.iter().chain(held).filter_map(odd).collect()
}
