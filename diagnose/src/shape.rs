//! What a residual looks like that no cause explains.

mod swing;

use crate::capture::left;
use crate::fit::State;
use crate::flicker;
use crate::ideal::{self, Ideal};
use crate::level::ACCURACY;
use crate::noise::{self, BLOCK, channel};
use crate::problem::Problem;
use crate::record::{CHANNEL_NAMES, CHANNEL_UNITS, Record};
use crate::small;
use crate::spectrum::{Line, strongest_line_of};
use crate::words::si;
pub(crate) use swing::{is_kicked, is_missing_elsewhere};

/// Structure is seen where block means scatter this much more than white noise of the same size would let them: twice as much,
/// however many blocks there are. Real noise is never quite white; a convention.
const SLOW: f64 = 1.0;
/// Standard deviations of that scatter which noise may reach. Sums of squares have long tails: a record of 25 blocks
/// passes 5 once in 1e4, and some ten channels are looked at.
const SIGMAS: f64 = 5.0;
/// A line is named if it holds this share of a channel's residual power. The strongest line in 250 rows of white noise holds
/// about 4 %. It only words what is left.
const LINE: f64 = 0.15;

/// Structure left in one channel.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Structure {
    /// Record.
    pub record: String,
    /// Channel.
    pub channel: &'static str,
    /// Mean square over that of the noise.
    pub mean_square: f64,
    /// Mean square of block means over that of white noise.
    pub slow: f64,
    /// Correlation of neighbouring rows.
    pub correlation: f64,
    /// In words: a line, a step, a drift, a burst, or what it follows: the duty, the load, neither.
    pub shape: String,
}

/// All channels in which a state leaves structure. What the model as given, `null`, leaves tells how much the accuracy of a
/// simulator may leave.
#[must_use]
pub fn structures(problem: &Problem, null: &State, state: &State, inflation: f64) -> Vec<Structure> {
    let mut found = left::structures(problem, null, state);
    let rows = problem.records.iter().enumerate();
    for (index, record) in rows.filter(|(_, record)| record.capture.is_none()) {
        let disorder = small::disorder(problem, state, index);
        if disorder.is_some() {
            found.extend(disorder);
            continue;
        }
        for (n, name) in CHANNEL_NAMES.iter().enumerate() {
            let values = channel(problem, &state.residual, index, n);
            let left = noise::left(&values);
            let before = noise::left(&channel(problem, &null.residual, index, n));
            if left.blocks < 5 {
                found.extend(small::structure(problem, index, n, &values, before.square));
            }
            // fewer block means tell no scatter
            if left.blocks < 5 {
                continue;
            }
            // chi-square of n blocks has the variance 2 n; the bound, so that correlated noise hides no structure
            let scatter = (2.0 / left.blocks as f64).sqrt() * inflation.sqrt().min(1.5);
            // a coarse converter leaves patterns that are none of the plant's
            let written = record.lattice[n].max(record.resolution[n]);
            let step = written.max(flicker::digit(&record.measured[n]));
            let coarse = step > 1.5 * problem.sigma[n] && left.square.sqrt() * problem.sigma[n] < step;
            // a simulator that is off by ACCURACY leaves that share of what was there, in squares
            let slow = left.slow > 1.0 + SLOW.max(SIGMAS * scatter) + ACCURACY * ACCURACY * before.slow;
            // fast structure: white, but 1.6 times as large as the noise that second differences showed
            let wild = left.square > 2.5 + ACCURACY * ACCURACY * before.square;
            if (slow || wild) && !coarse {
                found.push(Structure {
                    record: record.name.clone(),
                    channel: name,
                    mean_square: left.square,
                    slow: left.slow,
                    correlation: left.lag1,
                    shape: shape(problem, state, (index, n), &values, slow),
                });
            }
        }
    }
    found
}

fn shape(problem: &Problem, state: &State, (index, n): (usize, usize), values: &[f64], is_slow: bool) -> String {
    let record = &problem.records[index];
    let total: f64 = values.iter().map(|v| v * v).sum();
    let count = values.iter().filter(|v| **v != 0.0).count() as f64;
    // what noise alone would not have left
    let excess = (total - count).max(f64::MIN_POSITIVE);
    if let Some((row, share)) = burst(values, total) {
        let t = record.time[row];
        let step = match is_stepped(record, row) {
            true => ", where the duty or the load steps",
            false => "",
        };
        return format!(
            "a burst around t = {t:.4} s ({:.0} % of the power){step}",
            100.0 * share
        );
    }
    let place = place(problem, state, (index, n), (values, excess));
    let of_line = |line: &Line| 0.5 * count * (line.amplitude / problem.sigma[n]).powi(2) / excess;
    let (course, words) = followed(problem, (index, n), values);
    let line = strongest_line_of(problem, &state.residual, (index, n)).filter(|line| {
        let turns = line.frequency * record.rows() as f64 * problem.bases.t_sw;
        // of a turn that nobody sees the end of it is not known that it comes again
        let more = if turns < TURNS { MORE } else { 0.0 };
        line.share > LINE && turns > 1.0 && (!is_slow || of_line(line) > course + more)
    });
    if let Some(line) = line {
        let of_line = of_line(&line);
        let place = place.filter(|_| of_line < OF_EXCESS);
        if of_line < OF_EXCESS && place.is_none() {
            // what trembles has a strongest frequency as well
            return format!(
                "a trembling that is strongest about {:.0} Hz ({:.0} % of the power there)",
                line.frequency,
                100.0 * line.share
            );
        }
        return format!(
            "a line at {:.0} Hz of {:.3} ({:.0} % of the power){}",
            line.frequency,
            line.amplitude,
            100.0 * line.share,
            place.map_or(String::new(), |place| format!(", {place}"))
        );
    }
    match place {
        Some(place) => place,
        None if is_slow => words,
        None => "fast, without a line that stands out: a trembling from row to row".to_owned(),
    }
}

/// Where what is left lies, if it lies at places in time or in a band.
fn place(
    problem: &Problem,
    state: &State,
    (index, n): (usize, usize),
    (values, excess): (&[f64], f64),
) -> Option<String> {
    let record = &problem.records[index];
    behind_steps(problem, record, values, excess)
        .or_else(|| kicks(record, values, excess))
        .or_else(|| swing::words(problem, state, (index, n), (values, excess)))
}

/// Turns of a line that a record has to hold: of fewer any bend of a course is one, and a line has to explain so much more than the course.
const TURNS: f64 = 2.0;
const MORE: f64 = 0.1;
/// A line is all that is to be said if it holds this share of what noise does not: of two things the larger.
const OF_EXCESS: f64 = 0.5;
/// What is left lies behind the steps if the rows there hold this share of it, ...
const BEHIND: f64 = 0.75;
/// ... and so many times the share that they would hold if it lay everywhere.
const MORE_THERE: f64 = 1.5;
/// Periods of the filter behind a step in which it swings: e^-3 of a swing of usual damping is left.
const SWINGS: f64 = 1.5;

/// Whether duty or load change shortly before a row.
fn is_stepped(record: &Record, row: usize) -> bool {
    let from = row.saturating_sub(2 * BLOCK).max(1);
    (from..(row + BLOCK).min(record.rows())).any(|row| !record.is_same_point(row, row - 1))
}

/// What is left behind steps of duty and load alone, and behind which of them.
fn behind_steps(problem: &Problem, record: &Record, values: &[f64], excess: f64) -> Option<String> {
    let many = (SWINGS * Ideal::at(&problem.base.plant, 1.0).swing()) as usize + 2;
    let changes = |of: &dyn Fn(usize) -> bool| -> Vec<usize> { (1..record.rows()).filter(|row| of(*row)).collect() };
    let duty = changes(&|row| record.duty[row] != record.duty[row - 1]);
    let load = changes(&|row| record.load[row] != record.load[row - 1]);
    let held = |steps: &[usize]| {
        let mut near = vec![false; values.len()];
        for step in steps {
            let end = (step + many).min(near.len());
            near[*step..end].fill(true);
        }
        let rows = values.iter().zip(&near).filter(|(v, near)| **v != 0.0 && **near);
        let (sum, count) = rows.fold((0.0, 0.0), |(sum, count), (v, _)| (sum + v * v - 1.0, count + 1.0));
        (sum / excess, count / values.len().max(1) as f64)
    };
    let is_there = |steps: &[usize]| {
        let (share, rows) = held(steps);
        !steps.is_empty() && share > BEHIND && share > MORE_THERE * rows
    };
    // the one that explains it alone says more than both
    let which = match (is_there(&load), is_there(&duty)) {
        (true, false) => "load",
        (false, true) => "duty",
        (true, true) if held(&load).1 <= held(&duty).1 => "load",
        (true, true) => "duty",
        (false, false) => {
            let both = [duty.clone(), load.clone()].concat();
            return is_there(&both)
                .then(|| "a swing behind the steps of duty and load, gone where both stand still".to_owned());
        }
    };
    Some(format!(
        "a swing behind the steps of the {which}, gone where it stands still"
    ))
}

/// Kicks are told from what lies everywhere if so small a share of the stretches ...
const FEW: f64 = 0.25;
/// ... holds this share of it.
const OF_KICKS: f64 = 0.7;

/// Single places, no step behind them, that hold most of what is left.
fn kicks(record: &Record, values: &[f64], excess: f64) -> Option<String> {
    let window = 2 * BLOCK;
    let sums = values
        .chunks(window)
        .map(|chunk| chunk.iter().filter(|v| **v != 0.0).map(|v| v * v - 1.0).sum::<f64>());
    let mut sums: Vec<(usize, f64)> = sums.enumerate().collect();
    let most = (FEW * sums.len() as f64) as usize;
    sums.sort_by(|a, b| b.1.total_cmp(&a.1));
    let held: f64 = sums.iter().take(most).map(|(_, sum)| sum).sum();
    let (mut found, mut sum) = (Vec::new(), 0.0);
    for (at, own) in &sums {
        if sum > OF_KICKS * held {
            break;
        }
        sum += own;
        found.push(at * window);
    }
    found.sort_unstable();
    let unstepped = found.iter().filter(|row| !is_stepped(record, **row + BLOCK)).count();
    (most > 0 && held > OF_KICKS * excess && 2 * unstepped > found.len()).then(|| {
        let places: Vec<String> = found.iter().take(3).map(|row| format!("{:.5} s", record.time[*row])).collect();
        format!(
            "kicks in {}, first around t = {}, where neither duty nor load steps: something acts there that is in no column, be it lost or doubled \
             pulses, bursts from outside, or a load or a source that moves",
            match found.len() {
                1 => "1 place".to_owned(),
                more => format!("{more} places"),
            },
            places.join(", ")
        )
    })
}

/// Correlation from which on one course follows another: a third of the one's square comes from the other.
const ALIKE: f64 = 0.6;
/// Shares of the square in which two courses are alike: the one that stands first in the list is taken. A convention.
const AS_WELL: f64 = 0.05;

/// What a slow residual goes along with, the one that explains most of its means; one step or none of these. And the share of the square of
/// the means that this explains.
fn followed(problem: &Problem, (index, n): (usize, usize), values: &[f64]) -> (f64, String) {
    let record = &problem.records[index];
    let load = record.load.iter().zip(&record.measured[0]);
    // where no voltage was measured the current that was set is all that is known
    let load: Vec<f64> = load
        .map(|(load, v)| match v.is_finite() {
            true => load.current + load.conductance * v + load.power / v.max(1e-3),
            false => load.current,
        })
        .collect();
    let row: Vec<f64> = (0..values.len()).map(|n| n as f64).collect();
    let current: Vec<f64> = record.measured[1]
        .iter()
        .map(|i| if i.is_finite() { *i } else { 0.0 })
        .collect();
    let rests: Vec<f64> = (0..record.rows())
        .map(|row| f64::from(u8::from(is_at_rest(problem, record, row))))
        .collect();
    let volts: Vec<f64> = record.measured[0]
        .iter()
        .map(|v| if v.is_finite() { *v } else { 0.0 })
        .collect();
    let courses: [(&[f64], &str); 6] = [
        (&rests, "slow, where the current rests in each period (DCM)"),
        (&load, "slow, following the load current"),
        (&record.duty, "slow, following the duty"),
        (&current, "slow, following the inductor current"),
        (&volts, "slow, following the output voltage"),
        (&row, "a drift over the record"),
    ];
    let all = courses.map(|(course, words)| (of_means(values, course), words));
    let (at, step, share) = largest_step(values);
    let most = all.iter().map(|(r, _)| r * r).fold(share, f64::max);
    if most < ALIKE * ALIKE {
        let [_, load, duty, _, _, time] = all.map(|(r, _)| r);
        let words = format!(
            "slow, following neither duty nor load nor time alone (correlations {duty:.2}, {load:.2}, {time:.2})"
        );
        return (most, words);
    }
    let words = match all.iter().find(|(r, _)| r * r > most - AS_WELL) {
        Some((r, words)) => format!("{words} (correlation {r:.2})"),
        None => format!(
            "a step of {} at t = {:.4} s",
            si(step * problem.sigma[n], CHANNEL_UNITS[n]),
            record.time[at]
        ),
    };
    (most, words)
}

/// Whether the inductor current rests within the period of a row.
fn is_at_rest(problem: &Problem, record: &Record, row: usize) -> bool {
    let (ideal, duty) = (Ideal::of(record, &problem.base.plant), record.duty[row]);
    ideal.inductor(ideal::drawn(&record.load[row], ideal.volts(duty)), duty) < ideal.half(duty)
}

/// Twenty neighbouring rows that hold most of the power.
fn burst(values: &[f64], total: f64) -> Option<(usize, f64)> {
    let window = 2 * BLOCK;
    if values.len() < 8 * window {
        return None;
    }
    let sums = values.windows(window).map(|w| w.iter().map(|v| v * v).sum::<f64>());
    let (row, most) = sums.enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
    // "most of the power", as the words above say
    (most > 0.5 * total).then_some((row + BLOCK, most / total))
}

/// Where the mean before and after differ most, by how much, and the share of the square of the means that this makes.
fn largest_step(values: &[f64]) -> (usize, f64, f64) {
    let means: Vec<f64> = values
        .chunks(BLOCK)
        .map(|block| block.iter().sum::<f64>() / block.len() as f64)
        .collect();
    let n = means.len();
    let mean = means.iter().sum::<f64>() / n.max(1) as f64;
    let square: f64 = means.iter().map(|v| (v - mean) * (v - mean)).sum();
    let mut best = (0, 0.0, 0.0f64);
    let total: f64 = means.iter().sum();
    let mut before = 0.0;
    for at in 1..n {
        before += means[at - 1];
        let (a, b) = (at as f64, (n - at) as f64);
        let step = (total - before) / b - before / a;
        let weight = step * step * a * b / n as f64;
        if weight > best.2 {
            best = (at * BLOCK, step, weight);
        }
    }
    (
        best.0.min(values.len().saturating_sub(1)),
        best.1,
        best.2 / square.max(f64::MIN_POSITIVE),
    )
}

/// Correlation of block means, in which white noise weighs little.
fn of_means(a: &[f64], b: &[f64]) -> f64 {
    let means = |values: &[f64]| -> Vec<f64> {
        let mean = |block: &[f64]| block.iter().sum::<f64>() / block.len() as f64;
        values.chunks(BLOCK).map(mean).collect()
    };
    correlation(&means(a), &means(b))
}

/// Pearson's correlation.
#[must_use]
pub fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let n = a.len().min(b.len()).max(1) as f64;
    let (ma, mb) = (a.iter().sum::<f64>() / n, b.iter().sum::<f64>() / n);
    let (mut ab, mut aa, mut bb) = (0.0, 0.0, 0.0);
    for (x, y) in a.iter().zip(b) {
        ab += (x - ma) * (y - mb);
        aa += (x - ma) * (x - ma);
        bb += (y - mb) * (y - mb);
    }
    if aa > 0.0 && bb > 0.0 {
        ab / (aa * bb).sqrt()
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_noise_hides_no_common_course() {
        // a stair of four levels under noise of five times its height
        let stair: Vec<f64> = (0..4000).map(|n| f64::from(n / 1000)).collect();
        let mut state = 1_u32;
        let mut noise = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state >> 8) / f64::from(1 << 24) - 0.5
        };
        let noisy: Vec<f64> = stair.iter().map(|level| level + 5.0 * noise()).collect();
        let other: Vec<f64> = (0..4000).map(|_| noise()).collect();
        // the variance of the stair is 1.25, of the mean of ten noisy values 25/120: sqrt(1.25/1.46) = 0.93
        let correlation = of_means(&noisy, &stair);
        assert!((correlation - 0.93).abs() < 0.03, "{correlation}");
        assert!(of_means(&noisy, &other).abs() < 0.2);
    }
}
