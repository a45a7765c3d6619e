//! Which steps of a duty counter could have made a residual: the response to the rounding of the duty, by the averaged
//! circuit linearised around each row, for thousands of steps.

mod pieces;

use plant::{Parameters, Topology};

use self::pieces::Piece;
use crate::basis::Basis;
use crate::causes::Cut;
use crate::fit::State;
use crate::ideal;
use crate::parallel;
use crate::problem::{Problem, axpy, dot};
use crate::record::{CHANNELS, Record};

/// Counts per period that are looked at. Below 8 counts no controller regulates; half a step of 1000 is 5e-4, the accuracy of a model of ideal
/// edges ([`crate::problem::duty_accuracy`]).
const FEWEST: f64 = 8.0;
const MOST: f64 = 1000.0;
/// The averaged circuit may be off in the size of the response by as much. It knows no discontinuous conduction and no losses that
/// depend on the duty; tolerances of L and C add 20 %. A convention: it only orders what is then simulated.
const SHARES: [f64; 2] = [0.7, 1.3];
/// The same of a response that is simulated: it is off by its curvature alone. A convention, as above.
const SIMULATED_SHARES: [f64; 2] = [0.9, 1.1];
/// Levels of the duty whose responses are simulated, with all that the model has: each costs a simulation of the records, and beyond that many
/// the averaged circuit does, whose errors at so many levels cancel. A convention for time.
const SIMULATED_LEVELS: usize = 32;
/// Change of the duty that tells a response: as large as a half step of 250 counts.
const MOVED: f64 = 2e-3;
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
    let (plant, residual) = (&from.model.plant, &from.residual);
    // a step that is hardly more than what edges of the gate do anyway: at a few levels these are the offsets that it would imitate
    let finest = match are_told(problem, dot(residual, residual) - problem.count() as f64) {
        true => MOST,
        false => (BESIDE_EDGES * problem.duty_accuracy()).recip().clamp(FEWEST, MOST),
    };
    let beside = orthonormal(beside);
    let projected = |mut column: Vec<f64>| {
        for (value, left) in column.iter_mut().zip(residual.iter()) {
            // where nothing counts
            if *left == 0.0 {
                *value = 0.0;
            }
        }
        basis.project(&mut column);
        take_out(&mut column, &beside);
        column
    };
    // what all duties are moved by alike the edges of the gate take over, and better than this circuit knows it
    let shares = levels(problem);
    let is_simulated = shares.len() <= SIMULATED_LEVELS;
    let parts = (shares.len() <= FEW_LEVELS).then(|| {
        // small changes add up: what a rounding does is the sum of what it does at each level of the duty
        let columns = parallel::map(&shares, |(level, _)| match is_simulated {
            true => projected(simulated(problem, from, *level)),
            false => projected(response(problem, plant, &|duty| f64::from(u8::from(duty == *level)))),
        });
        let products = (columns.iter()).map(|a| columns.iter().map(|b| dot(a, b)).collect::<Vec<f64>>());
        let along: Vec<f64> = columns.iter().map(|column| dot(column, residual)).collect();
        (along, products.collect::<Vec<_>>())
    });
    let [least_share, most_share] = match is_simulated {
        true => SIMULATED_SHARES,
        false => SHARES,
    };
    let levels_alone: Vec<f64> = shares.iter().map(|(level, _)| *level).collect();
    let pieces = match parts.is_some() {
        true => pieces::all(&levels_alone, [FEWEST, finest], cut),
        false => pieces::apart(&levels_alone, [FEWEST, finest], cut),
    };
    let gain = |counts: f64| {
        let by = |duty: f64| rounded(duty, counts, cut) - duty;
        let mean = shares.iter().map(|(duty, share)| share * by(*duty)).sum::<f64>();
        let moved = |duty: f64| by(duty) - mean;
        let (along, length) = match &parts {
            Some((along, products)) => {
                let by: Vec<f64> = shares.iter().map(|(level, _)| moved(*level)).collect();
                let square = products.iter().zip(&by).map(|(row, by_row)| by_row * dot(row, &by));
                (dot(along, &by), square.sum())
            }
            None => {
                let column = projected(response(problem, plant, &moved));
                (dot(&column, residual), dot(&column, &column))
            }
        };
        // a count that rounds no duty has no response at all
        let share = (along / length.max(1e-300)).clamp(least_share, most_share);
        // by how much chi-square falls if that share of the response is taken away
        2.0 * share * along - share * share * length
    };
    let best = parallel::map(&pieces, |piece| {
        let within = piece.within().map(|counts| (gain(counts), counts));
        within
            .max_by(|a, b| a.0.total_cmp(&b.0))
            .unwrap_or((f64::NEG_INFINITY, piece.low))
    });
    let mut ranked: Vec<((f64, f64), Piece)> = best.into_iter().zip(pieces).collect();
    // equal gains in the order of the counts, so that the same records give the same starts
    ranked.sort_by(|(a, one), (b, other)| b.0.total_cmp(&a.0).then(one.low.total_cmp(&other.low)));
    let kept = ranked.iter().take(count);
    kept.flat_map(|((_, best), piece)| piece.tried(*best)).collect()
}

/// Change of the signals over their noise, for each 1 of duty, where the duties of one `level` are moved.
fn simulated(problem: &Problem, from: &State, level: f64) -> Vec<f64> {
    let mut model = from.model.clone();
    // a step that the model has already would hide the change
    model.plant.pwm.duty_lsb = 0.0;
    let by = if level + MOVED < 1.0 { MOVED } else { -MOVED };
    let moved = |by: f64| {
        let mut moved = problem.clone();
        let duties = moved.records.iter_mut().flat_map(|record| &mut record.duty);
        duties.filter(|duty| **duty == level).for_each(|duty| *duty += by);
        moved.residual(&model, &from.starts)
    };
    let [there, back] = [moved(0.5 * by), moved(-0.5 * by)];
    there
        .iter()
        .zip(&back)
        .map(|(there, back)| (back - there) / by)
        .collect()
}

/// Directions of length 1, each at right angles to those before it; what lies in these but for rounding is left out.
fn orthonormal(columns: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let mut known: Vec<Vec<f64>> = Vec::new();
    for column in columns {
        let mut one = column.clone();
        take_out(&mut one, &known);
        let length = dot(&one, &one).sqrt();
        if length > NEW * dot(column, column).sqrt() {
            one.iter_mut().for_each(|value| *value /= length);
            known.push(one);
        }
    }
    known
}

/// Of a direction at most this share of the length may be in those before it, or it is rounding.
const NEW: f64 = 1e-5;

/// Leaves of `column` what is at right angles to all of `known`.
fn take_out(column: &mut [f64], known: &[Vec<f64>]) {
    for one in known {
        let share = dot(one, column);
        axpy(column, -share, one);
    }
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

/// Change of the signals over their noise when each duty is `moved` by so much.
fn response(problem: &Problem, plant: &Parameters, moved: &(dyn Fn(f64) -> f64 + Sync)) -> Vec<f64> {
    let mut out = vec![0.0; problem.len()];
    for (record, offset) in problem.records.iter().zip(&problem.offsets) {
        if record.settled {
            for row in 0..record.rows() {
                let [v, i] = settled((problem, plant), (record, row), moved(record.duty[row]));
                out[offset + row * CHANNELS] = v / problem.sigma[0];
                out[offset + row * CHANNELS + 1] = i / problem.sigma[1];
            }
            continue;
        }
        for segment in &record.segments {
            let (mut v, mut i) = (0.0, 0.0);
            for row in segment.clone() {
                out[offset + row * CHANNELS] = v / problem.sigma[0];
                out[offset + row * CHANNELS + 1] = i / problem.sigma[1];
                let next = (row + 1).min(record.rows() - 1);
                // sampled inside a PWM period, the way to the next sample belongs to two of them
                for (row, share) in [(row, 1.0 - record.phase), (next, record.phase)] {
                    (v, i) = advanced((problem, plant), (record, row), moved(record.duty[row]), share, (v, i));
                }
            }
        }
    }
    out
}

/// Change of the duty that tells what it does to a settled voltage.
const NUDGE: f64 = 1e-4;

/// What a settled point's voltage and inductor current change by where its duty is `moved`, without losses and in continuous conduction.
fn settled((problem, p): (&Problem, &Parameters), (record, row): (&Record, usize), moved: f64) -> [f64; 2] {
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
    [(v_up - v) / NUDGE * moved, (i_up - i) / NUDGE * moved]
}

/// Least share of the current that an output receives: a duty of nearly 1 would make the current of a boost large without bound.
const GIVE: f64 = 0.05;

/// A share of the period of `row`.
fn advanced(
    (problem, p): (&Problem, &Parameters),
    (record, row): (&Record, usize),
    moved: f64,
    share: f64,
    (mut v, mut i): (f64, f64),
) -> (f64, f64) {
    let duty = record.duty[row];
    let topology = p.converter.topology;
    let v_in = p.converter.v_in * record.v_in_ratio;
    let pushed = topology.span(v_in, problem.bases.v) * moved;
    // what the output receives of the inductor's current, and how much less of it while the duty is longer
    let give = topology.give(duty);
    let kept = match topology {
        Topology::Buck => 0.0,
        Topology::Boost | Topology::BuckBoost => {
            ideal::drawn(&record.load[row], problem.bases.v) / give.max(GIVE) * moved
        }
    };
    let r = p.inductor.dcr + 0.5 * (p.switch.r_ds_on + p.switch.r_d);
    let load = &record.load[row];
    // to small changes a constant power is a negative conductance
    let g = load.conductance - load.power / (problem.bases.v * problem.bases.v);
    let h = share * problem.bases.t_sw / FINE as f64;
    for _ in 0..FINE {
        i += h / p.converter.inductance * (pushed - give * v - r * i);
        v += h / p.converter.capacitance * (give * i - kept - g * v);
    }
    (v, i)
}

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;
    use std::path::Path;

    use measured::{ColumnMap, Sheet};
    use plant::Parameters;

    use super::{Cut, dot, levels, likely, response, rounded};
    use crate::drive::Model;
    use crate::fit::State;
    use crate::problem::Problem;
    use crate::record::Record;

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
        let whole = response(&problem, &model, &|duty| rounded(duty, 33.3, Cut::Nearest) - duty);
        let mut sum = vec![0.0; whole.len()];
        for (level, _) in levels {
            let unit = response(&problem, &model, &|duty| f64::from(u8::from(duty == level)));
            let by = rounded(level, 33.3, Cut::Nearest) - level;
            sum.iter_mut().zip(unit).for_each(|(sum, unit)| *sum += by * unit);
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
