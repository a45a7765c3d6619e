//! Which steps of a duty counter could have made a residual: the response to the rounding of the duty, by the averaged
//! circuit linearised around each row, for thousands of steps.

mod alike;
mod gains;
mod pieces;
mod responses;

use plant::Parameters;

pub(crate) use self::alike::{Alike, alike};
use self::gains::Gains;
use self::pieces::Piece;
use self::responses::LANES;
use crate::basis::Basis;
use crate::causes::Cut;
use crate::fit::State;
use crate::parallel;
use crate::problem::{Problem, dot};
use crate::record::Record;

/// Counts per period that are looked at. Below 8 counts no controller regulates; half a step of 1000 is 5e-4, the accuracy of a model of ideal
/// edges ([`crate::problem::duty_accuracy`]).
const FEWEST: f64 = 8.0;
const MOST: f64 = 1000.0;
/// A step of the duty this many times as large as what the edges of a gate are taken for does what they cannot.
const BESIDE_EDGES: f64 = 4.0;
/// Steps of the integration in a period: 1/140 of the period of the paper's filter with 150 uF. The semi-implicit method of Euler
/// neither damps nor drives the swing.
const FINE: usize = 4;

/// Counts per period (whole or not) whose rounding looks most like what `from` leaves: ends and middles of the `count` best pieces.
///
/// `from` is where the other causes end: a filter that rings at another frequency than that of the model as given answers to a rounding as
/// that filter does. The causes there follow along `beside`, what each parameter moves.
pub(crate) fn likely(
    problem: &Problem,
    basis: &Basis,
    (from, beside): (&State, &[Vec<f64>]),
    (cut, count): (Cut, usize),
) -> Vec<f64> {
    let residual = &from.residual;
    // a step that is hardly more than what edges of the gate do anyway: at a few levels these are the offsets that it would imitate
    let finest = match are_told(problem, dot(residual, residual) - problem.count() as f64) {
        true => MOST,
        false => (BESIDE_EDGES * problem.duty_accuracy()).recip().clamp(FEWEST, MOST),
    };
    let gains = Gains::new(problem, basis, (from, beside), cut);
    let pieces = match gains.levels().len() <= FEW_LEVELS {
        true => pieces::all(gains.levels(), [FEWEST, finest], cut),
        false => pieces::apart(gains.levels(), [FEWEST, finest], cut),
    };
    let tried: Vec<(usize, f64)> = pieces
        .iter()
        .enumerate()
        .flat_map(|(n, piece)| piece.within().map(move |counts| (n, counts)))
        .filter(|(_, counts)| !goes_along(gains.levels(), *counts))
        .collect();
    let groups: Vec<&[(usize, f64)]> = tried.chunks(LANES).collect();
    let all = parallel::map(&groups, |group| {
        gains.of(&group.iter().map(|(_, counts)| *counts).collect::<Vec<_>>())
    });
    let mut best: Vec<(f64, f64)> = pieces.iter().map(|piece| (f64::NEG_INFINITY, piece.low)).collect();
    for ((piece, counts), gain) in tried.iter().zip(all.into_iter().flatten()) {
        // of equal ones the last
        if gain.total_cmp(&best[*piece].0).is_ge() {
            best[*piece] = (gain, *counts);
        }
    }
    let mut ranked: Vec<((f64, f64), Piece)> = best.into_iter().zip(pieces).collect();
    // equal gains in the order of the counts, so that the same records give the same starts
    ranked.sort_by(|(a, one), (b, other)| b.0.total_cmp(&a.0).then(one.low.total_cmp(&other.low)));
    let kept = ranked
        .iter()
        .filter(|((gain, _), _)| *gain > f64::NEG_INFINITY)
        .take(count);
    kept.flat_map(|((_, best), piece)| piece.tried(*best)).collect()
}

/// Records with more levels of the duty than these are followed for each number of counts: beyond it, the products of their responses cost
/// as much.
const FEW_LEVELS: usize = 64;

/// Counters that are looked at and that round the duties of a record differently, to the nearest whole power of ten.
const COUNTERS: f64 = 1e4;
/// What a counter that is none has to leave, in chi-square, to be told from one that is: four times what counts as a cause.
const LEFT_BY_CHANCE: f64 = 64.0;

/// Whether the duties of the records tell a counter from offsets that another cause makes at each of them, of an error of `excess` in chi-square
/// above the noise. A few levels one of so many counters rounds nearly as one likes: of any offsets at L levels the best of M directions leaves
/// the share M^(-2/(L-1)) in squares, a hundredth for five levels and an eighth for ten.
fn are_told(problem: &Problem, excess: f64) -> bool {
    // settled points are one for each level, and their candidates are told by the size of what they leave (`small`)
    if problem.records.iter().all(|record| record.settled) {
        return true;
    }
    let levels = levels(problem).len() as f64;
    levels > 1.0 && excess * libm::pow(COUNTERS, -2.0 / (levels - 1.0)) > LEFT_BY_CHANCE
}

/// The duties of all records, each once, and which share of the rows has it.
fn levels(problem: &Problem) -> Vec<(f64, f64)> {
    let all = problem.records.iter().flat_map(|record| &record.duty);
    let mut duties: Vec<f64> = all.copied().collect();
    duties.sort_by(f64::total_cmp);
    let row = 1.0 / duties.len().max(1) as f64;
    let mut levels: Vec<(f64, f64)> = Vec::new();
    for duty in duties {
        match levels.last_mut() {
            // exact: duties of a table that are one are so to the bit
            Some((level, share)) if *level == duty => *share += row,
            _ => levels.push((duty, row)),
        }
    }
    levels
}

/// Levels for each tooth of a sawtooth over the duties, from which on it is a bend: with six a parabola and a jump take most of a tooth.
const OF_A_TOOTH: f64 = 6.0;
/// Levels from which on that is said: errors of five bits at .3, .4 and .5 lie on a line as well.
const FEWEST_LEVELS: usize = 8;

/// Whether the rounding errors go along with the duty over the `levels`: a counter of nearly as many counts as the duties are written in beats with
/// them, and its error is a slow sawtooth. That is a bend, which any loss might leave, and no sign of a counter.
fn goes_along(levels: &[f64], counts: f64) -> bool {
    let is_slow = |teeth: f64| OF_A_TOOTH * teeth < levels.len() as f64;
    levels.len() >= FEWEST_LEVELS && teeth(levels, counts).is_some_and(is_slow)
}

/// Teeth of the beat of a counter with the decimals in which the `levels` are written, if they are written in few and it has as many counts or more.
fn teeth(levels: &[f64], counts: f64) -> Option<f64> {
    let is_whole = |unit: f64| {
        (levels.iter()).all(|duty| (duty * unit - libm::round(duty * unit)).abs() < WHOLE * unit * duty.max(WHOLE))
    };
    let unit = (1..=DECIMALS)
        .map(|digits| 10f64.powi(digits))
        .find(|unit| is_whole(*unit))?;
    let of_unit = counts / unit;
    let beat = (of_unit - libm::round(of_unit)).abs();
    let ends = levels
        .iter()
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], duty| {
            [low.min(*duty), high.max(*duty)]
        });
    (libm::round(of_unit) >= 1.0).then_some(beat * (ends[1] - ends[0]) * unit)
}

/// Most decimals of a duty that a table is written with by plan.
const DECIMALS: i32 = 4;

/// Whether the rounding to so many counts is a bend over the duties of the records.
pub(crate) fn is_bend(problem: &Problem, counts: f64) -> bool {
    let levels: Vec<f64> = levels(problem).into_iter().map(|(duty, _)| duty).collect();
    goes_along(&levels, counts)
}

/// A share of a count by which a duty in decimals may miss a whole one.
const WHOLE: f64 = 1e-6;

/// A duty as a counter rounds it.
fn rounded(duty: f64, counts: f64, cut: Cut) -> f64 {
    (counted(duty, counts, cut) / counts).min(1.0)
}

/// Counts of a duty; as the plant rounds, half up.
fn counted(duty: f64, counts: f64, cut: Cut) -> f64 {
    libm::floor(duty * counts + up(cut))
}

/// What is added before the rest is cut off, counts.
fn up(cut: Cut) -> f64 {
    match cut {
        Cut::Nearest => 0.5,
        // a duty of whole counts, written in decimals, is those
        Cut::Below => WHOLE,
    }
}

/// Change of the duty that tells what it does to a settled voltage.
const NUDGE: f64 = 1e-4;

/// What a settled point's voltage and inductor current change by for each 1 of its duty, without losses and in continuous conduction.
fn settled((problem, p): (&Problem, &Parameters), (record, row): (&Record, usize)) -> [f64; 2] {
    let (topology, duty) = (p.converter.topology, record.duty[row].min(1.0 - 2.0 * NUDGE));
    let v_in = p.converter.v_in * record.v_in_ratio;
    let rest = |duty: f64| {
        let v = topology.voltage(v_in, duty);
        let load = &record.load[row];
        // around the voltage at hand: a constant power draws less where that rises
        let drawn = load.conductance * v - load.power * (v - problem.bases.v) / (problem.bases.v * problem.bases.v);
        [v, drawn / topology.give(duty).max(GIVE)]
    };
    let ([v, i], [v_up, i_up]) = (rest(duty), rest(duty + NUDGE));
    [(v_up - v) / NUDGE, (i_up - i) / NUDGE]
}

/// Least share of the current that an output receives: a duty of nearly 1 would make the current of a boost large without bound.
const GIVE: f64 = 0.05;

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;
    use std::path::Path;

    use measured::{ColumnMap, Sheet};
    use plant::Parameters;

    use super::responses::Circuit;
    use super::{Cut, dot, goes_along, levels, likely, rounded};
    use crate::drive::Model;
    use crate::fit::State;
    use crate::problem::Problem;
    use crate::record::Record;

    #[test]
    fn a_counter_that_beats_with_the_decimals_of_the_duties_is_a_bend() {
        let duties = [
            280, 295, 303, 310, 323, 329, 348, 364, 373, 374, 376, 378, 380, 389, 402, 408, 422, 427, 435, 438, 439,
            442, 445, 448, 451, 465, 476, 504, 507,
        ]
        .map(|duty| f64::from(duty) / 1000.0);
        for counts in [996.0, 999.008, 1000.0, 1002.5, 1990.0] {
            assert!(goes_along(&duties, counts), "{counts}");
        }
        // those that a table tells: a few bits, and a number that has nothing to do with the decimals
        for counts in [33.0, 64.0, 128.0, 250.0, 256.0, 470.0, 720.0] {
            assert!(!goes_along(&duties, counts), "{counts}");
        }
        assert!(!goes_along(&[0.3, 0.4, 0.5], 32.0));
    }

    /// Three levels of the duty, 80 rows.
    fn problem(model: &Parameters) -> Problem {
        let mut text = "t,d,v_o,i_load\n".to_owned();
        for n in 0..80 {
            let duty = [0.5, 0.437, 0.561][n / 30];
            let _ = writeln!(
                text,
                "{:.5},{duty},{:.2},5",
                n as f64 * 1e-4,
                200.0 * duty + 0.1 * (n % 3) as f64
            );
        }
        let sheet = Sheet::parse(Path::new("run.csv"), text.into(), &Record::file_options()).unwrap();
        let record = Record::read(&sheet, &ColumnMap::default(), model).unwrap();
        Problem::new(vec![record], Model::new(model))
    }

    #[test]
    fn a_rounding_is_the_sum_of_what_it_does_at_each_level() {
        let model = Parameters::paper_table();
        let problem = problem(&model);
        let levels = levels(&problem);
        let duties: Vec<f64> = levels.iter().map(|(duty, _)| *duty).collect();
        assert_eq!(duties, [0.437, 0.5, 0.561]);
        assert!((levels.iter().map(|(_, share)| share).sum::<f64>() - 1.0).abs() < 1e-12);
        let circuit = Circuit::new(&problem, &model, &duties);
        let by = |duty: f64| rounded(duty, 33.3, Cut::Nearest) - duty;
        let all = |moved: &dyn Fn(f64) -> f64| {
            duties
                .iter()
                .map(|duty| [moved(*duty), -moved(*duty)])
                .collect::<Vec<_>>()
        };
        let whole = circuit.responses(&all(&by));
        assert!(whole.iter().all(|[a, b]| *a == -*b), "sets side by side do not mix");
        let whole: Vec<f64> = whole.iter().map(|[one, _]| *one).collect();
        let mut sum = vec![0.0; whole.len()];
        for level in duties.iter().copied() {
            let unit = circuit.responses(&all(&|duty| f64::from(u8::from(duty == level))));
            let by = by(level);
            sum.iter_mut().zip(unit).for_each(|(sum, [unit, _])| *sum += by * unit);
        }
        let most = whole.iter().fold(0.0f64, |most, value| most.max(value.abs()));
        assert!(most > 0.01 && whole.iter().zip(&sum).all(|(a, b)| (a - b).abs() < 1e-9 * most));
    }

    #[test]
    fn a_rounding_is_sought_in_the_filter_that_other_causes_have_made() {
        let model = Parameters::paper_table();
        let problem = problem(&model);
        let mut real = model.clone();
        real.converter.capacitance *= 0.4;
        // what a modulator of 37 counts does to the same simulation
        let mut counted = real.clone();
        counted.pwm.duty_lsb = 1.0 / 37.0;
        let [plain, counted] =
            [&real, &counted].map(|plant| problem.residual(&Model::new(plant), &problem.first_starts(&problem.base)));
        let residual: Vec<f64> = plain
            .iter()
            .zip(&counted)
            .map(|(plain, counted)| plain - counted)
            .collect();
        let counts_of = |plant: &Parameters| {
            let from = State {
                model: Model::new(plant),
                starts: problem.first_starts(&problem.base),
                chi2: dot(&residual, &residual),
                residual: residual.clone(),
                rows: 0,
            };
            let basis = problem.basis(&from.model, &from.starts, &from.residual);
            likely(&problem, &basis, (&from, &[]), (Cut::Nearest, 1))
        };
        let found = counts_of(&real);
        assert!(found.iter().any(|counts| (counts - 37.0).abs() < 0.3), "{found:?}");
    }
}
