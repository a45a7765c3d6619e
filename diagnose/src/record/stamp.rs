//! The sampling instant in the period, read off times that may have been written with few digits.
//!
//! A time of whole microseconds is up to half of one off: at 300 kHz 15 % of a period, and a current sampled elsewhere on its ripple.
//! Over many rows the roundings differ, and leave only a narrow stretch for the instant.

use super::raw::Raw;

/// What the rows and the model say of time.
#[derive(Debug, Clone, Copy)]
pub struct Clock {
    /// Usual time between rows, s.
    pub step: f64,
    /// Switching period of the model, s.
    pub t_sw: f64,
    /// Sampling instant of the model, as a fraction of the period.
    pub phase: f64,
}

/// Roundings that move by less than this share of a digit are none: the period is a whole number of digits.
const MOVED: f64 = 0.2;
/// Instants nearer to each other are one, as fractions of a period.
// half of what two clocks of a bench differ by; a current on its ripple moves by a thousandth of it
const SAME: f64 = 1e-3;
/// A digit that is a larger share of the period is worth a word.
const COARSE: f64 = 0.01;

impl Raw<'_> {
    /// The sampling instant in the period by the times; where they are rounded, the model's if it lies within what the rounding leaves.
    pub fn stamped(&mut self, time: &[f64], clock: Clock) -> f64 {
        let Clock { step, t_sw, phase } = clock;
        let first = time.first().copied().unwrap_or(0.0) / t_sw;
        let digit = self.resolution("t") / t_sw;
        // faster rows are thinned to the instant that is asked for
        let is_read = step > 0.75 * t_sw && digit > SAME;
        let off = time.iter().map(|t| (t / t_sw - first) - (t / t_sw - first).round());
        let (low, high) = off.fold((0.0_f64, 0.0_f64), |(low, high), off| (low.min(off), high.max(off)));
        // further apart than rounding puts them: they jitter
        if !is_read || high - low > 1.01 * digit {
            return whole(first);
        }
        let steps = report::quantity(digit * t_sw, "s", 3);
        let away = |from: f64| (from - phase + 0.5).rem_euclid(1.0) - 0.5;
        if high - low < MOVED * digit {
            let apart = away(first).abs();
            if digit > COARSE && apart > SAME && apart < digit {
                self.repairs.push(format!(
                    "times are written in steps of {steps}: they say a sampling phase of {:.3}, which is taken; the model has \
                     {phase}, and neither can be told from the other: `phase` in a map file says it",
                    whole(first)
                ));
            }
            return whole(first);
        }
        // rounded times are up to half a digit off to either side, cut ones up to a digit too early
        let (least, most) = (first + high - 0.5 * digit, first + low + digit);
        let is_model = away(least) <= SAME && away(most) >= -SAME && most - least < 0.5;
        let found = if is_model {
            phase
        } else {
            whole(first + 0.5 * (low + high))
        };
        if away(first).abs() > SAME || !is_model {
            let taken = match is_model {
                true => format!("the model's {phase} fits all of them and is taken"),
                false => format!("all together {found:.3}, which is taken; the model has {phase}"),
            };
            self.repairs.push(format!(
                "times are written in steps of {steps}: the first says a sampling phase of {:.3}, {taken}; `phase` in a map file says \
                 another",
                whole(first)
            ));
        }
        found
    }

    /// Columns that count rows and leap: rows were lost of which the times may not tell.
    pub fn note_leaps(&mut self) {
        let mut notes = Vec::new();
        for index in &self.located.unused {
            let Some(column) = self.sheet.columns().get(*index) else {
                continue;
            };
            let pairs: Vec<f64> = column.values.windows(2).map(|pair| pair[1] - pair[0]).collect();
            let leaps: Vec<usize> = (0..pairs.len()).filter(|n| pairs[*n] > 1.0).collect();
            let is_count = pairs.iter().all(|step| *step >= 1.0 && step.fract() == 0.0) && !pairs.is_empty();
            // a counter of periods in a record of every second one leaps in each row
            if !is_count || leaps.is_empty() || leaps.len() as f64 > MOST_LEAPS * pairs.len() as f64 {
                continue;
            }
            let lost: f64 = leaps.iter().map(|n| pairs[*n] - 1.0).sum();
            let line = leaps.first().map_or(0, |n| self.sheet.line(n + 1));
            let (count, s) = (leaps.len(), if leaps.len() == 1 { "" } else { "s" });
            notes.push(format!(
                "`{}` counts rows and leaps in {count} place{s}, first in line {line}: {lost} rows were lost. Where the times go on evenly \
                 there, they are wrong",
                column.name
            ));
        }
        self.repairs.extend(notes);
    }
}

/// Share of the rows in which a counter may leap.
// a convention: of a counter that leaps more often nobody knows what it counts
const MOST_LEAPS: f64 = 0.1;

/// The fraction of a period, where what few digits leave of a whole one is none.
fn whole(periods: f64) -> f64 {
    let fraction = periods.rem_euclid(1.0);
    if (1e-3..=1.0 - 1e-3).contains(&fraction) {
        fraction
    } else {
        0.0
    }
}
