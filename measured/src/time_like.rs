//! Columns that look like time: a record over time whose time column has a strange name must not pass for settled points.
//!
//! Times of day in the cells count under any name. A name that means time counts if its column mostly rises. Any other
//! counts if the column rises as evenly as a clock and no used column rises throughout, as all do in a sweep of the duty.
//! A wrong alarm costs the user a flag, `--settled`; a miss costs him causes that are wrong.

use crate::quantity::split_unit;
use crate::sheet::{Cell, Column, Sheet};

/// Words of a name that mean time. A column of such a name that does not rise (`dead_time`) is not meant.
const WORDS: [&str; 12] = [
    "time", "stamp", "clock", "elapsed", "second", "date", "zeit", "uhr", "datum", "sekunde", "temps", "tiempo",
];
/// Names of columns that count rows: they rise evenly and are no time.
const COUNTS: [&str; 9] = ["", "#", "no", "nr", "id", "row", "index", "point", "points"];
/// Fewer rows are no record, however evenly a column rises.
// this and the share below are conventions; a share of 1 would miss records that were joined
const FEWEST: usize = 20;
/// Share of the steps that rise, for a name that means time: joined records fall back where one ends.
const RISING: f64 = 0.9;
/// Steps of a clock lie between these multiples of the middle one: a lost row is a double step, jitter is less.
const EVEN: std::ops::RangeInclusive<f64> = 0.5..=2.1;

/// The first of the `unused` columns that looks like time, and why; `used` are those that quantities were found in.
pub(crate) fn find(sheet: &Sheet, unused: &[usize], used: &[usize]) -> Option<(usize, String)> {
    let column = |index: &usize| &sheet.columns()[*index];
    let named = unused.iter().find(|index| sounds_like_time(column(index)));
    if let Some(index) = named {
        return Some((*index, "by its name".to_owned()));
    }
    // in a sweep everything rises evenly
    let sweep = used.iter().any(|index| is_monotonic(&column(index).values));
    let even = unused.iter().find(|index| !sweep && is_clock(column(index)));
    even.map(|index| (*index, "it rises evenly from row to row".to_owned()))
}

fn sounds_like_time(column: &Column) -> bool {
    let lower = split_unit(&column.name).0.to_lowercase();
    let named = lower == "t" || WORDS.iter().any(|word| lower.contains(word));
    let steps = column
        .values
        .windows(2)
        .filter(|pair| pair.iter().all(|value| value.is_finite()));
    let (rising, all) = steps.fold((0, 0), |(rising, all), pair| {
        (rising + usize::from(pair[1] > pair[0]), all + 1)
    });
    let words = column
        .words
        .iter()
        .filter(|(row, _)| is_time_of_day(column, *row))
        .count();
    // more than half: a single cell with a colon may be a comment
    let of_day = 2 * words > column.values.len();
    // one row cannot rise, and its name alone has to do
    of_day || named && (words > 0 || rising as f64 >= RISING * f64::from(all) && (all > 0 || column.values.len() < 2))
}

/// `12:30:00.1`, `2024-05-01 12:30:00`.
fn is_time_of_day(column: &Column, row: usize) -> bool {
    matches!(column.cell(row), Cell::Word(word) if {
        let digits = word.chars().filter(char::is_ascii_digit).count();
        word.contains(':') && 2 * digits > word.chars().count()
    })
}

fn is_monotonic(values: &[f64]) -> bool {
    // two rows are monotonic by accident
    let all = |order: fn(f64, f64) -> bool| values.len() > 2 && values.windows(2).all(|pair| order(pair[0], pair[1]));
    all(|a, b| a < b) || all(|a, b| a > b)
}

fn is_clock(column: &Column) -> bool {
    let mut steps: Vec<f64> = column.values.windows(2).map(|pair| pair[1] - pair[0]).collect();
    // `point` with steps of 1 counts rows; with other steps it measures something
    let counts = steps.iter().all(|step| *step == 1.0) && COUNTS.contains(&column.name.to_lowercase().as_str());
    if column.values.len() < FEWEST || counts || steps.iter().any(|step| step.is_nan() || *step <= 0.0) {
        return false;
    }
    steps.sort_by(f64::total_cmp);
    // the median and not the mean: a gap of an hour must not move it
    let middle = steps[steps.len() / 2];
    let even = steps.iter().filter(|step| EVEN.contains(&(*step / middle))).count();
    even as f64 >= RISING * steps.len() as f64
}
