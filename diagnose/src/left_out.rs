//! Rows of a channel that are measured and not compared, because the load stepped there.

use crate::noise::Outlier;
use crate::problem::Problem;
use crate::record::{CHANNEL_NAMES, CHANNELS};

/// Measured rows of a channel, and how many of them are left out.
#[must_use]
pub fn count(problem: &Problem, record: usize, channel: usize) -> (usize, usize) {
    let values = problem.records[record].measured[channel].iter();
    let pairs = values.zip(&problem.masked[record][channel]);
    pairs
        .filter(|(value, _)| value.is_finite())
        .fold((0, 0), |(all, left), (_, masked)| {
            (all + 1, left + usize::from(*masked))
        })
}

/// What is said of each record; `outliers` are told of by themselves.
#[must_use]
pub fn notes(problem: &Problem, outliers: &[Outlier]) -> Vec<String> {
    let of = |(index, record): (usize, &crate::record::Record)| {
        let channels = (0..CHANNELS).filter_map(|n| {
            let (all, left) = count(problem, index, n);
            let spikes = outliers
                .iter()
                .filter(|one| (one.record, one.channel) == (index, n))
                .count();
            let left = left.saturating_sub(spikes);
            (left > 0 && problem.sigma[n].is_finite()).then(|| format!("{left} of {all} rows of {}", CHANNEL_NAMES[n]))
        });
        let list: Vec<String> = channels.collect();
        (!list.is_empty()).then(|| {
            format!(
                "{}: {} are left out: the load steps at the very instant of these samples, and whether they were taken before or behind it the record does not say",
                record.name,
                list.join(" and ")
            )
        })
    };
    problem.records.iter().enumerate().filter_map(of).collect()
}
