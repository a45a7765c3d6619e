//! Whether the periods of a capture are like each other, as those of a steady state are.

use toml_input::Message;

use super::fold::{Bins, Fold};
use crate::record::{CHANNEL_NAMES, CHANNEL_UNITS};

/// Periods of a steady state have one mean: in standard deviations of the noise, ...
const MOVED: f64 = 5.0;
/// ... and as a share of the channel's ripple and mean, which a steady state may lose.
const MOVED_SHARE: f64 = 0.02;
const MOVED_RIPPLE: f64 = 0.2;
/// Periods of a fold of every second one: two of each kind tell what is noise.
const PAIRS: f64 = 4.0;
/// Difference of even and odd periods, over what noise makes of it ...
const ALTERNATES: f64 = 2.5;
/// ... and over the ripple: a simulator gets half as much wrong.
const ALTERNATES_RIPPLE: f64 = 0.05;
/// Part of the bins that are compared: spikes at an edge are caught by the samples of one period and missed by those of the next.
const SMOOTH: f64 = 0.9;

/// A capture is of a steady state.
///
/// # Errors
/// Means of periods that differ, even periods that differ from odd ones.
pub(super) fn check(channel: usize, values: &[f64], fold: &Fold, time: &[f64], bins: &Bins) -> Result<(), Message> {
    if bins.periods < 2.0 {
        return Ok(());
    }
    let first = time.first().copied().unwrap_or(0.0);
    let count = bins.periods as usize;
    let period = |t: f64| ((t - first) / bins.period).floor() as usize;
    let mut sums = vec![(0.0, 0.0); count];
    for (t, v) in time.iter().zip(values).filter(|(_, v)| v.is_finite()) {
        if let Some((sum, number)) = sums.get_mut(period(*t)) {
            *sum += v;
            *number += 1.0;
        }
    }
    let most = sums.iter().map(|(_, number)| *number).fold(0.0, f64::max);
    // periods of which most was left out have a mean of their own
    let means = sums.iter().enumerate().filter(|(_, (_, number))| *number > 0.5 * most);
    let means: Vec<(usize, f64)> = means.map(|(n, (sum, number))| (n, sum / number)).collect();
    let least = means.iter().min_by(|a, b| a.1.total_cmp(&b.1));
    let largest = means.iter().max_by(|a, b| a.1.total_cmp(&b.1));
    let (Some(least), Some(largest)) = (least, largest) else {
        return Ok(());
    };
    let sd = (2.0f64 / most).sqrt() * fold.noise;
    // periods that are no whole number of samples differ by one sample's share of the ripple
    let allowed = (MOVED * sd)
        .max(MOVED_SHARE * fold.mean.abs())
        .max(MOVED_RIPPLE * fold.ripple())
        .max(fold.step);
    let (name, said) = (CHANNEL_NAMES[channel], |v| {
        report::quantity(v, CHANNEL_UNITS[channel], 4)
    });
    let message = || {
        Message::new("the converter is not at rest in the capture")
            .expected("a steady state: each period like the others")
    };
    if largest.1 - least.1 > allowed {
        let [a, b] = if least.0 < largest.0 {
            [least, largest]
        } else {
            [largest, least]
        };
        let found = format!(
            "the mean of {name} is {} in period {} and {} in period {}",
            said(a.1),
            a.0 + 1,
            said(b.1),
            b.0 + 1
        );
        let hint = "a transient is a record with a row each period, 20 or more of them";
        return Err(message().found(found).hint(hint));
    }
    match alternation(values, fold, time, bins) {
        Some(size) => {
            let found = format!("{name} differs by {} between even and odd periods", said(size));
            let hint =
                "does the control oscillate at half the switching frequency, or does the modulator leave pulses out?";
            Err(message().found(found).hint(hint))
        }
        None => Ok(()),
    }
}

/// By how much even and odd periods differ, if it is more than noise makes.
fn alternation(values: &[f64], fold: &Fold, time: &[f64], bins: &Bins) -> Option<f64> {
    if bins.periods < PAIRS {
        return None;
    }
    let first = time.first()?;
    let count = bins.at.len();
    // what is left of the mean period: samples of one bin have other phases in other periods
    let left = time.iter().zip(values).zip(bins.places()).filter_map(|((t, v), bin)| {
        let is_odd = ((t - first) / bins.period).floor() as usize % 2;
        let left = v - fold.value_at(&bins.at, bins.phase(*t)) - fold.mean;
        Some((is_odd * count + (*bin)?, left)).filter(|(_, left)| left.is_finite())
    });
    let left: Vec<(usize, f64)> = left.collect();
    let (mut sum, mut number) = (vec![0.0; 2 * count], vec![0.0; 2 * count]);
    for (cell, v) in &left {
        sum[*cell] += v;
        number[*cell] += 1.0;
    }
    let mean = |cell: usize| sum[cell] / number[cell];
    let square: f64 = left.iter().map(|(cell, v)| (v - mean(*cell)).powi(2)).sum();
    let free = left.len() as f64 - number.iter().filter(|n| **n > 0.0).count() as f64;
    let noise = square / free.max(1.0);
    let both = (0..count).filter(|bin| number[*bin] > 0.0 && number[bin + count] > 0.0);
    let mut pairs: Vec<(f64, f64)> = both
        .map(|bin| {
            let expected = noise * (1.0 / number[bin] + 1.0 / number[bin + count]);
            ((mean(bin) - mean(bin + count)).powi(2), expected)
        })
        .collect();
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    pairs.truncate((SMOOTH * pairs.len() as f64).ceil() as usize);
    let many = pairs.len().max(1) as f64;
    let (found, expected) = pairs
        .iter()
        .fold((0.0, 0.0), |(a, b), pair| (a + pair.0 / many, b + pair.1 / many));
    let size = found.sqrt();
    let is_far = size > (ALTERNATES_RIPPLE * fold.ripple()).max(fold.step);
    (is_far && found > ALTERNATES * ALTERNATES * expected).then_some(size)
}
