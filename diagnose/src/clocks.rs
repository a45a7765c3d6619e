//! When each record began on the clock of the mains.
//!
//! ```text
//! first record     ╱╲╱╲╱╲╱        phase of the line at its time 0
//! second record    ╲╱╲╱╲╱╲        another one: nobody triggers on the mains
//! ```
//! A line on the source goes on between two records, and each begins somewhere in it. So the phase is that of the first record, and every other record
//! has a clock that says when it began. In the training records these are read off what the model as given leaves; in a held-out record, which a
//! line that was found foretells but for its beginning, they are what fits.

use std::f64::consts::TAU;

use crate::drive::Model;
use crate::fit::{Fit, Fitter, State};
use crate::noise::channel;
use crate::problem::{Problem, Starts};
use crate::record::Record;
use crate::search::Searcher;
use crate::spectrum::{Wave, waves};
use crate::words::si;

/// Share of a channel's squares that lines of one frequency hold before anything is read off them: as of a line that is told, [`crate::shape`].
const LINE: f64 = 0.15;
/// A clock of its own has to be worth this in chi-square: five standard deviations, since the one of many that fits best is taken.
const WORTH: f64 = 25.0;
/// Lines of one phase hold this share of what lines of their own phases hold in an output: two equal ones that are d turns apart hold
/// cos^2(pi d) together, and .95 is .07 turns. What else is left of the output bent two of one phase apart by .015 in a blind case. A convention above that.
const OF_THE_OUTPUT: f64 = 0.95;
/// Channels that show a line of the source best, and the share of it that lines of one phase hold: its own voltage shows little else.
const SHOWN_BY: [(usize, f64); 2] = [(3, 1.0), (0, OF_THE_OUTPUT)];
/// Distance of the places beside that of a sine where the lowest is sought, turns: sines of three places a third of a turn apart missed it by .009 in a record
/// of less than two turns, whose initial state takes up a part of each. A convention a few times that.
const BESIDE: f64 = 0.05;

fn is_over_time(record: &Record) -> bool {
    !record.settled && record.capture.is_none()
}

/// Sets the clocks of records of which `state` leaves lines of one frequency in phases of their own; whether any was set.
pub fn align(problem: &mut Problem, state: &State) -> bool {
    let indices: Vec<usize> = (0..problem.records.len())
        .filter(|n| is_over_time(&problem.records[*n]))
        .collect();
    // a channel that shows one line in one phase has the last word
    let found = SHOWN_BY.iter().find_map(|by| common(problem, state, &indices, *by));
    let Some((frequency, each)) = found.filter(|(_, each)| !each.is_empty()) else {
        return false;
    };
    let [first, others @ ..] = &each[..] else { return false };
    for (index, wave) in others {
        let turns = wave.phase() - first.1.phase();
        problem.records[*index].clock = (turns - turns.round()) / frequency;
    }
    true
}

/// The line on the source, as a cause.
const CAUSE: &str = "input_ripple";
/// Rounds of clocks and line, each from the other, at most. In records of 1.3 turns each left half of what it began with.
const ROUNDS: usize = 8;

/// The problem with the clocks that fit a line on the source which explains most alone, and the single causes there, where that is a better fit. What
/// the model as given leaves, off which they were read, tells them to some hundredths of a turn.
pub(crate) fn refined(search: &Searcher<'_>, singles: &[Fit]) -> Option<(Problem, Vec<Fit>)> {
    let fitter = &search.fitter;
    let of_line = |fit: &Fit| fitter.candidates[fit.causes[0]].cause.id == CAUSE;
    let place = (0..singles.len()).min_by(|a, b| singles[*a].state.chi2.total_cmp(&singles[*b].state.chi2))?;
    let leads = &singles[place];
    let gain = fitter.null.chi2 - leads.state.chi2;
    if !of_line(leads) || gain < 0.5 * fitter.null.chi2 || fitter.null.model.plant.source.ripple > 0.0 {
        return None;
    }
    let mut found: Option<(Problem, Fit)> = None;
    for _ in 0..ROUNDS {
        let (known, fit) = match &found {
            Some((problem, fit)) => (problem, fit),
            None => (fitter.problem, leads),
        };
        let mut problem = known.clone();
        if !tune(&mut problem, &fit.state.model, fit.state.starts.trim, 1) {
            break;
        }
        let there = Fitter {
            problem: &problem,
            ..*fitter
        };
        let next = there.from(&fit.causes, &fit.values, &fit.state);
        if next.state.chi2 > fit.state.chi2 - WORTH {
            break;
        }
        found = Some((problem, next));
    }
    let (problem, fit) = found?;
    let there = Fitter {
        problem: &problem,
        ..*fitter
    };
    let mut singles = singles.to_vec();
    for single in singles.iter_mut().filter(|single| of_line(single)) {
        let next = there.from(&single.causes, &single.values, &single.state);
        *single = next;
    }
    singles[place] = fit;
    Some((problem, singles))
}

/// What to say of the clocks of records beside a model with a line on its source.
pub fn notes<'a>(records: impl Iterator<Item = &'a Record> + 'a, model: &Model) -> impl Iterator<Item = String> + 'a {
    let (ripple, frequency) = (model.plant.source.ripple, model.plant.source.ripple_frequency);
    let said = records.filter(move |record| ripple > 0.0 && record.clock != 0.0);
    said.map(move |record| {
        format!(
            "{}: its line at {} begins {:+.2} turns beside that of the first record: each begins somewhere in it",
            record.name,
            si(frequency, "Hz"),
            record.clock * frequency
        )
    })
}

/// The frequency of the lines that a channel of all these records holds, and the line of each, none of them where they are of one phase; nothing where there
/// is no line.
fn common(
    problem: &Problem,
    state: &State,
    indices: &[usize],
    (n, of_one_phase): (usize, f64),
) -> Option<(f64, Vec<(usize, Wave)>)> {
    let of = |index: &usize| {
        let values = channel(problem, &state.residual, *index, n);
        let times = &problem.records[*index].time;
        let pairs = values.iter().zip(times).filter(|(value, _)| **value != 0.0);
        pairs.map(|(value, time)| (*time, *value)).collect::<Vec<_>>()
    };
    let samples: Vec<Vec<(f64, f64)>> = indices.iter().map(of).collect();
    let found = waves(&samples, problem.bases.t_sw)?;
    let alone: f64 = found.each.iter().map(Wave::power).sum();
    let together = found.together;
    let is_line = alone > LINE * found.power && found.each.iter().all(|wave| wave.power() > WORTH);
    if found.each.len() < 2 || !is_line {
        return None;
    }
    let gain = WORTH * (found.each.len() - 1) as f64;
    let are_apart = alone > together + gain && together < of_one_phase * alone;
    let each = if are_apart { found.each } else { Vec::new() };
    Some((found.frequency, indices.iter().copied().zip(each).collect()))
}

/// Sets the clocks of records from the `first` on for a model with a line on its source: chi-square goes with the phase
/// nearly as a sine, which three places tell, and as a parabola where it is lowest. Whether one was set.
pub fn tune(problem: &mut Problem, model: &Model, trim: f64, first: usize) -> bool {
    let frequency = model.plant.source.ripple_frequency;
    if model.plant.source.ripple <= 0.0 || frequency <= 0.0 {
        return false;
    }
    let mut is_set = false;
    for index in first..problem.records.len() {
        if !is_over_time(&problem.records[index]) {
            continue;
        }
        let chi2 = |turns: f64| {
            let mut alone = problem.clone();
            alone.records = vec![Record {
                clock: turns / frequency,
                ..problem.records[index].clone()
            }];
            (alone.offsets, alone.masked) = (vec![0], vec![problem.masked[index].clone()]);
            let starts = Starts {
                trim,
                ..alone.first_starts(model)
            };
            State::settle(&alone, model, &starts, None).chi2
        };
        let third = [0.0, 1.0 / 3.0, 2.0 / 3.0].map(|turns| (turns, chi2(turns)));
        let sum = |of: fn(f64) -> f64| third.iter().map(|(turns, chi2)| chi2 * of(TAU * turns)).sum::<f64>();
        // the lowest place of a + b cos + c sin lies half a turn from its highest
        let turns = libm::atan2(sum(libm::sin), sum(libm::cos)) / TAU + 0.5;
        let turns = lowest(turns, &chi2);
        let turns = turns - turns.round();
        let own = chi2(problem.records[index].clock * frequency);
        if chi2(turns) < own - WORTH {
            problem.records[index].clock = turns / frequency;
            is_set = true;
        }
    }
    is_set
}

/// The lowest place of a parabola through three around `turns`.
fn lowest(turns: f64, chi2: &dyn Fn(f64) -> f64) -> f64 {
    let [low, at, high] = [turns - BESIDE, turns, turns + BESIDE].map(chi2);
    let bend = low + high - 2.0 * at;
    match bend > 0.0 {
        true => turns + BESIDE * (0.5 * (low - high) / bend).clamp(-1.0, 1.0),
        false => turns,
    }
}
