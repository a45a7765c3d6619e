//! Rows of a channel that are measured and not compared, because the load stepped there.

use std::ops::Range;

use crate::drive::FREE_APART;
use crate::flicker;
use crate::noise::Outlier;
use crate::problem::Problem;
use crate::record::{CHANNEL_NAMES, CHANNELS, Record};

/// Rows behind a load step that tell when between two samples it was: as many as have to lie between two steps that are free.
pub(crate) const TELLING: usize = 2 * FREE_APART;

/// The last rows of stretches that end right behind a load step: a step inside of a period kicks the filter, and so few rows do not tell when it was.
pub(crate) fn ends(record: &Record) -> Vec<Range<usize>> {
    if record.settled || !record.dense {
        return Vec::new();
    }
    let steps = flicker::steps(&record.load);
    let mut before = 0;
    let mut list = Vec::new();
    for step in steps {
        let is_alone = step.first >= before + TELLING;
        before = step.last;
        let stretch = record
            .segments
            .iter()
            .find(|s| s.start < step.first && step.first < s.end);
        let end = stretch.map_or(0, |stretch| stretch.end);
        if is_alone && step.last < end && end < step.last + TELLING {
            list.push(step.first - 1..end);
        }
    }
    list
}

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
    let of = |(index, record): (usize, &Record)| {
        let ends = ends(record);
        let channels = (0..CHANNELS).filter_map(|n| {
            let (all, left) = count(problem, index, n);
            let at_ends = ends.iter().flat_map(Clone::clone);
            let at_ends = at_ends.filter(|row| record.measured[n].get(*row).is_some_and(|value| value.is_finite()));
            let left = left.saturating_sub(at_ends.count());
            let spikes = outliers
                .iter()
                .filter(|one| (one.record, one.channel) == (index, n))
                .count();
            let left = left.saturating_sub(spikes);
            (left > 0 && problem.sigma[n].is_finite()).then(|| format!("{left} of {all} rows of {}", CHANNEL_NAMES[n]))
        });
        let list: Vec<String> = channels.collect();
        let at_ends: usize = ends.iter().map(ExactSizeIterator::len).sum();
        let behind = (at_ends > 0).then(|| {
            format!(
                "{}: {at_ends} rows at its end are left out: the load steps there, and so few rows do not tell when between two samples",
                record.name
            )
        });
        let at_once = (!list.is_empty()).then(|| {
            format!(
                "{}: {} are left out: the load steps at the very instant of these samples, and whether they were taken before or behind it the record does not say",
                record.name,
                list.join(" and ")
            )
        });
        at_once.into_iter().chain(behind)
    };
    problem.records.iter().enumerate().flat_map(of).collect()
}
