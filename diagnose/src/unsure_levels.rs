//! Levels of a load that were read off a noisy meter.
//!
//! A mean over some rows of a meter is off by its noise over the root of their number. While the inductor conducts, a hundredth of an ampere moves
//! the voltage by less than anybody sees. Where the current rests in each period nothing but the load holds the voltage, and it runs away
//! by tenths of a volt. So such a level is an unknown of no interest, as an initial state is: estimated beside every fit, held by
//! what the meter showed, and projected out of the sensitivities of all causes. Where it shows nothing it stays as it was read.

use crate::drive::Model;
use crate::fit::State;
use crate::parallel;
use crate::problem::{Problem, dot};
use crate::record::{CHANNELS, LOAD_CURRENT};

/// A level is free where a standard deviation of it moves chi-square by as much as one number more does by chance.
const SHOWS: f64 = 1.0;

/// Frees the levels whose uncertainty shows in the records; whether there are any. `null` then has to be settled again.
pub(crate) fn free(problem: &mut Problem, model: &Model, null: &mut State) -> bool {
    let most = problem
        .records
        .iter()
        .map(|record| record.levels.len())
        .max()
        .unwrap_or(0);
    if most == 0 {
        return false;
    }
    let numbers: Vec<usize> = (0..most).collect();
    let moved = parallel::map(&numbers, |n| {
        let mut tried = problem.clone();
        for record in &mut tried.records {
            if let Some(level) = record.levels.get(*n) {
                level.shift(&mut record.load, 1.0);
            }
        }
        tried.residual(model, &null.starts)
    });
    let at_rest = problem.residual(model, &null.starts);
    let shows = |record: usize, n: usize| {
        let rows = problem.offsets[record]..problem.offsets[record] + problem.records[record].rows() * CHANNELS;
        let change: Vec<f64> = rows
            .filter(|place| (place - problem.offsets[record]) % CHANNELS != LOAD_CURRENT)
            .map(|place| moved[n][place] - at_rest[place])
            .collect();
        dot(&change, &change) > SHOWS
    };
    let free: Vec<Vec<_>> = (0..problem.records.len())
        .map(|record| {
            let levels = problem.records[record].levels.iter().enumerate();
            levels
                .filter(|(n, _)| shows(record, *n))
                .map(|(_, level)| level.clone())
                .collect()
        })
        .collect();
    for (record, levels) in problem.records.iter_mut().zip(free) {
        record.free_levels = levels;
    }
    null.starts.levels = problem.first_starts(&problem.base).levels;
    problem.records.iter().any(|record| !record.free_levels.is_empty())
}

/// What is said of the records whose levels were estimated.
pub(crate) fn note(problem: &mut Problem, state: &State) {
    for (record, levels) in problem.records.iter_mut().zip(&state.starts.levels) {
        let most = levels.iter().fold(0.0_f64, |most, by| most.max(by.abs()));
        if !levels.is_empty() {
            record.repairs.push(format!(
                "{} of its load {} so unsure for the noise of the meter that the voltage shows it: estimated beside the fit, up to {most:.1} \
                 standard deviations from the mean of the rows; nothing has to be done",
                match levels.len() {
                    1 => "1 level".to_owned(),
                    more => format!("{more} levels"),
                },
                if levels.len() == 1 { "is" } else { "are" },
            ));
        }
    }
}
