//! Settled points that no fit has seen, beside the model. Neighbouring rows of a table are not related, and few rows tell the noise poorly: what
//! counts is an error that no meter makes.

use crate::gain::{MUCH_WORSE, Pair};
use crate::ideal::Ideal;
use crate::noise;
use crate::record::{CHANNEL_NAMES, CHANNELS, LOAD_CURRENT};

/// Share of a channel's reading, both root mean squares, from which on an error is no meter's. A convention: meters and probes of a bench are
/// within a few per cent of what they say.
const GROSS: f64 = 0.1;
/// Fewest points that are told from one wrong row.
const FEWEST: usize = 3;
/// Points that the model as given gives, and the extended one misses by twice as much: in squares, over the noise or what was there. Of five points
/// noise alone is above it once in a thousand channels.
const SPOILT: f64 = 4.0;
/// Fewest points of which that is said.
const FEWEST_SPOILT: usize = 5;

/// The channels of each table whose points the causes take from the model, with words: what makes one table fit and another not is no part.
pub(crate) fn spoilt(pair: &Pair) -> Vec<(Vec<usize>, String)> {
    let tables = pair.problem.records.iter().enumerate();
    let found = tables.filter(|(_, record)| record.settled).filter_map(|(index, record)| {
        let of = |residual: &[f64], n: usize| noise::left(&noise::channel(&pair.problem, residual, index, n)).square;
        let ratio = |n: usize| of(&pair.after.residual, n) / of(&pair.before.residual, n).max(1.0);
        let shown = |n: usize| {
            let errors = noise::channel(&pair.problem, &pair.after.residual, index, n);
            errors.iter().filter(|error| **error != 0.0).count()
        };
        let spoilt: Vec<usize> = (0..CHANNELS)
            .filter(|n| shown(*n) >= FEWEST_SPOILT && ratio(*n) > SPOILT)
            .collect();
        let largest = spoilt.iter().map(|n| ratio(*n)).reduce(f64::max)?;
        let names: Vec<&str> = spoilt.iter().map(|n| CHANNEL_NAMES[*n]).collect();
        let words = format!(
            "{} of the held-out points {}: the error with these causes is {:.1} times as large as without: they do not hold there",
            names.join(", "),
            record.name,
            largest.sqrt()
        );
        Some((spoilt, words))
    });
    found.collect()
}

/// The channels of each table in which the model is beside its points by more than any meter is, with words.
pub(crate) fn far(pair: &Pair) -> Vec<(Vec<usize>, String)> {
    let ideal = Ideal::at(&pair.problem.base.plant, 1.0);
    let tables = pair.problem.records.iter().enumerate();
    let tables = tables.filter(|(_, record)| record.settled && !ideal.is_unstable_with(record));
    let found = tables.filter_map(|(index, record)| {
        let far: Vec<(usize, f64)> = (0..CHANNELS)
            // the current that is the load says nothing about the converter
            .filter(|n| *n != LOAD_CURRENT || record.metered.is_none())
            .filter_map(|n| Some((n, share(pair, index, n)?)))
            .filter(|(_, share)| *share > GROSS)
            .collect();
        let largest = far.iter().map(|(_, share)| *share).reduce(f64::max)?;
        let (channels, names): (Vec<usize>, Vec<&str>) = far.iter().map(|(n, _)| (*n, CHANNEL_NAMES[*n])).unzip();
        let (are, up_to) = match channels.len() {
            1 => ("is", ""),
            _ => ("are", "up to "),
        };
        let words = format!(
            "{} of the held-out points {} {are} {up_to}{:.0} % of the reading beside the model: the points do not belong to it, or not to these \
             settings",
            names.join(", "),
            record.name,
            100.0 * largest
        );
        Some((channels, words))
    });
    found.collect()
}

/// Root mean square error of a channel over that of its readings, where it is more than noise.
fn share(pair: &Pair, index: usize, n: usize) -> Option<f64> {
    let (sigma, record) = (pair.problem.sigma[n], &pair.problem.records[index]);
    let errors = noise::channel(&pair.problem, &pair.after.residual, index, n);
    let rows: Vec<usize> = (0..record.rows()).filter(|row| errors[*row] != 0.0).collect();
    if rows.len() < FEWEST || !sigma.is_finite() {
        return None;
    }
    let square =
        |value: &dyn Fn(usize) -> f64| rows.iter().map(|row| value(*row).powi(2)).sum::<f64>() / rows.len() as f64;
    let (error, reading) = (square(&|row| errors[row]), square(&|row| record.measured[n][row]));
    (error > MUCH_WORSE && reading > 0.0).then(|| sigma * (error / reading).sqrt())
}
