//! A load out of the noisy current that its meter showed.
//!
//! ```text
//! i_out   ·.··.·.·                    the meter: noise, steps of its converter
//!         ────────┐·.·..·.·.··.·      the load: levels of a current, a resistor or a power, or lines of a current
//!                 └────────────
//! ```
//! A simulation that is driven row by row by the meter is driven by its noise: 50 mA make the paper's filter swing by more than
//! the voltage's own noise. So the rows are cut into stretches of one level each. A cut is a change point of least squares; what is
//! left must be white, or else the load is no such thing and stays as it was measured.

use std::ops::Range;

use plant::Load;

use crate::flicker;
use crate::noise;
use crate::slopes::load_steps;

use super::beside_resistor;

/// Logarithms of the number of rows that a cut must gain in chi-square. The largest of n squares of white noise is about 2 ln n,
/// and passes 4 ln n once in n records.
const PER_CUT: f64 = 4.0;
/// The noise is read off n rows to 1.6 / sqrt n of itself (a median of second differences): twice that may be missing.
const NOISE_UNSURE: f64 = 3.2;
/// Rows of a level at least, on average: shorter ones are no levels but a signal. A convention.
const ROWS_PER_LEVEL: usize = 10;
/// What is left is white within as many standard deviations of its correlation, its mean square and the scatter of its
/// block means: of four forms with three figures each one is wrongly refused in a thousand records.
const WHITE: f64 = 4.0;
/// Real noise is not quite normal, and its size is read off second differences: allowed beside the above. A convention.
const UNSURE: f64 = 0.25;
/// A later form must be better by this: nine, as for a tie of causes.
const CLEARLY: f64 = 9.0;
/// A step of this many times the noise is seen in the row in which it happens; a smaller one may lie a row beside.
const SURE_STEP: f64 = 4.0;

/// What a meter may have shown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Form {
    Current,
    Resistor,
    Power,
    Line,
}

/// The simplest first.
const FORMS: [Form; 4] = [Form::Current, Form::Resistor, Form::Power, Form::Line];

impl Form {
    fn words(self) -> &'static str {
        match self {
            Form::Current => "load current",
            Form::Resistor => "resistor",
            Form::Power => "constant power",
            Form::Line => "load current",
        }
    }

    fn regressors(self, place: f64, v: f64) -> [f64; 2] {
        match self {
            Form::Current => [1.0, 0.0],
            Form::Resistor => [v, 0.0],
            Form::Power => [v.recip(), 0.0],
            Form::Line => [1.0, place],
        }
    }

    fn load(self, place: f64, [a, b]: [f64; 2]) -> Load {
        match self {
            Form::Current => Load::current(a),
            Form::Resistor => Load {
                conductance: a,
                ..Load::default()
            },
            Form::Power => Load {
                power: a,
                ..Load::default()
            },
            Form::Line => Load::current(a + b * place),
        }
    }

    fn parameters(self) -> f64 {
        if self == Form::Line { 2.0 } else { 1.0 }
    }
}

/// Fewer rows than these between two changes are no level, but lie in the slope from one to the next.
const FEWEST_ROWS: usize = 4;

/// A level of a load that its meter shows, and how unsure it is.
#[derive(Debug, Clone, PartialEq)]
pub struct Level {
    /// Rows that have it.
    pub rows: Range<usize>,
    /// Which number of the load it is.
    pub part: Part,
    /// Standard deviation, in the unit of that number.
    pub sd: f64,
}

/// A number of a load.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// A current, A.
    Current,
    /// A conductance, S.
    Conductance,
    /// A power, W.
    Power,
}

impl Level {
    /// Adds `by` standard deviations to its rows.
    pub fn shift(&self, load: &mut [Load], by: f64) {
        for load in load.get_mut(self.rows.clone()).into_iter().flatten() {
            let number = match self.part {
                Part::Current => &mut load.current,
                Part::Conductance => &mut load.conductance,
                Part::Power => &mut load.power,
            };
            *number += by * self.sd;
        }
    }
}

/// A load that was found.
#[derive(Debug)]
pub struct Levels {
    /// For each row.
    pub load: Vec<Load>,
    /// Its levels, each as unsure as the meter's noise makes it.
    pub levels: Vec<Level>,
    /// Noise of the meter, A.
    pub noise: f64,
    /// What to say of it.
    pub words: String,
}

/// The load behind `i_out` (NaN where nothing was noted), which was sampled at `phase`; `digit` is the step of its numbers.
/// Nothing if it is none of the forms.
pub fn find(i_out: &[f64], v_out: &[f64], digit: f64, phase: f64) -> Option<Levels> {
    let known: Vec<usize> = (0..i_out.len()).filter(|n| i_out[*n].is_finite()).collect();
    let values: Vec<f64> = known.iter().map(|n| i_out[*n]).collect();
    // step / sqrt 12: the standard deviation of rounding
    let noise = noise::scatter(&values, |_| true)
        .max(flicker::noise(&values, digit))
        .max(digit / 12f64.sqrt());
    if noise.is_nan() || noise <= 0.0 {
        return None;
    }
    let plain = FORMS.into_iter().filter_map(|form| {
        let rows = Rows::new(form, &known, i_out, v_out, noise)?;
        let cuts = rows.cuts()?;
        Some((form, 0.0, rows, cuts))
    });
    let mixed = beside_resistor::find(&known, i_out, v_out, noise);
    let mixed = mixed.map(|(conductance, rows, cuts)| (Form::Current, conductance, rows, cuts));
    let mut best: Option<(f64, Form, f64, Rows, Vec<usize>)> = None;
    for (form, conductance, rows, cuts) in plain.chain(mixed) {
        if !rows.is_white(&cuts) {
            continue;
        }
        let more = if conductance > 0.0 { 1.0 } else { 0.0 };
        let numbers = form.parameters() * (cuts.len() + 1) as f64 + cuts.len() as f64 + more;
        let score = rows.cost_of(&cuts) + libm::log(known.len() as f64) * numbers;
        if best.as_ref().is_none_or(|(least, ..)| score < least - CLEARLY) {
            best = Some((score, form, conductance, rows, cuts));
        }
    }
    let (_, form, conductance, rows, cuts) = best?;
    let mut load = Vec::with_capacity(i_out.len());
    let mut levels = Vec::new();
    for (from, to) in rows.stretches(&cuts) {
        let fit = rows.fit(from, to);
        let end = if to == known.len() { i_out.len() } else { known[to] };
        levels.extend(rows.level(form, (from, to), load.len()..end));
        while load.len() < end {
            // a row's load is that of its period, whose middle a sample need not be
            let own = form.load(rows.place(load.len() as f64 + 0.5 - phase), fit);
            load.push(Load {
                conductance: own.conductance + conductance,
                ..own
            });
        }
    }
    let is_load = load.iter().all(|load| load.conductance >= 0.0 && load.power >= 0.0);
    is_load.then(|| Levels {
        words: rows.words((form, conductance), &cuts, &in_slopes(form, &load, &known)),
        load,
        levels,
        noise,
    })
}

/// Places among the `known` rows that lie in a slope from one level to the next; lines have slopes of their own.
fn in_slopes(form: Form, load: &[Load], known: &[usize]) -> Vec<usize> {
    let steps = load_steps(load).into_iter().filter(|_| form != Form::Line);
    let rows = steps.flat_map(|step| step.first..step.last);
    rows.filter_map(|row| known.binary_search(&row).ok()).collect()
}

/// Sums over the rows before each, of all products that least squares needs.
pub(super) struct Rows {
    regressors: Vec<[f64; 2]>,
    values: Vec<f64>,
    /// aa, ab, bb, ai, bi, ii.
    sums: Vec<[f64; 6]>,
    noise: f64,
    count: f64,
}

impl Rows {
    /// Nothing if a voltage is missing that the form needs.
    pub(super) fn new(form: Form, known: &[usize], i_out: &[f64], v_out: &[f64], noise: f64) -> Option<Self> {
        let count = i_out.len().max(1) as f64;
        let of = |n: &usize| {
            let v = v_out.get(*n).copied().unwrap_or(f64::NAN);
            form.regressors(*n as f64 / count, v)
        };
        let regressors: Vec<[f64; 2]> = known.iter().map(of).collect();
        if regressors.iter().flatten().any(|x| !x.is_finite()) {
            return None;
        }
        let values: Vec<f64> = known.iter().map(|n| i_out[*n]).collect();
        let mut sums = vec![[0.0; 6]];
        let mut sum = [0.0; 6];
        for ([a, b], i) in regressors.iter().zip(&values) {
            for (sum, term) in sum.iter_mut().zip([a * a, a * b, b * b, a * i, b * i, i * i]) {
                *sum += term;
            }
            sums.push(sum);
        }
        Some(Rows {
            regressors,
            values,
            sums,
            noise,
            count,
        })
    }

    fn place(&self, row: f64) -> f64 {
        row / self.count
    }

    fn sum(&self, from: usize, to: usize) -> [f64; 6] {
        std::array::from_fn(|n| self.sums[to][n] - self.sums[from][n])
    }

    fn fit(&self, from: usize, to: usize) -> [f64; 2] {
        let [aa, ab, bb, ai, bi, _] = self.sum(from, to);
        let det = aa * bb - ab * ab;
        // rounding of the sums: fewer than two places determine no line
        if det > 1e-10 * aa * bb {
            [(ai * bb - bi * ab) / det, (bi * aa - ai * ab) / det]
        } else {
            [if aa > 0.0 { ai / aa } else { 0.0 }, 0.0]
        }
    }

    /// A stretch as a level; a line has none.
    fn level(&self, form: Form, (from, to): (usize, usize), rows: Range<usize>) -> Option<Level> {
        let part = match form {
            Form::Current => Part::Current,
            Form::Resistor => Part::Conductance,
            Form::Power => Part::Power,
            Form::Line => return None,
        };
        let weight = self.sum(from, to)[0];
        (to - from >= FEWEST_ROWS && weight > 0.0).then(|| Level {
            rows,
            part,
            // of least squares with one regressor
            sd: self.noise / weight.sqrt(),
        })
    }

    /// Chi-square of a stretch.
    fn cost(&self, from: usize, to: usize) -> f64 {
        let [aa, ab, bb, ai, bi, ii] = self.sum(from, to);
        let [x, y] = self.fit(from, to);
        let square = ii - 2.0 * (x * ai + y * bi) + x * x * aa + 2.0 * x * y * ab + y * y * bb;
        square.max(0.0) / (self.noise * self.noise)
    }

    pub(super) fn stretches(&self, cuts: &[usize]) -> Vec<(usize, usize)> {
        let ends = cuts.iter().copied().chain([self.values.len()]);
        std::iter::once(0).chain(cuts.iter().copied()).zip(ends).collect()
    }

    fn cost_of(&self, cuts: &[usize]) -> f64 {
        self.stretches(cuts)
            .iter()
            .map(|(from, to)| self.cost(*from, *to))
            .sum()
    }

    /// The best cut of a stretch and what it gains.
    fn cut(&self, from: usize, to: usize) -> Option<(f64, usize)> {
        let whole = self.cost(from, to);
        let gain = |at: usize| (whole - self.cost(from, at) - self.cost(at, to), at);
        (from + 1..to).map(gain).max_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// Where the level changes; nothing if that is nearly everywhere.
    pub(super) fn cuts(&self) -> Option<Vec<usize>> {
        let n = self.values.len().max(2) as f64;
        let least = PER_CUT * libm::log(n) * (1.0 + NOISE_UNSURE / n.sqrt()).powi(2);
        let most = self.values.len() / ROWS_PER_LEVEL;
        let mut cuts = Vec::new();
        let mut open = vec![(0, self.values.len())];
        while let Some((from, to)) = open.pop() {
            let Some((_, at)) = self.cut(from, to).filter(|(gain, _)| *gain > least) else {
                continue;
            };
            cuts.push(at);
            open.extend([(from, at), (at, to)]);
            if cuts.len() > most {
                return None;
            }
        }
        cuts.sort_unstable();
        // the first cuts were sought while the others were missing
        for _ in 0..3 {
            let mut moved: Vec<usize> = Vec::with_capacity(cuts.len());
            for n in 0..cuts.len() {
                let from = moved.last().copied().unwrap_or(0);
                let to = cuts.get(n + 1).copied().unwrap_or(self.values.len());
                moved.extend(self.cut(from, to).filter(|(gain, _)| *gain > least).map(|(_, at)| at));
            }
            if moved == cuts {
                break;
            }
            cuts = moved;
        }
        Some(cuts)
    }

    /// Whether what is left is noise.
    fn is_white(&self, cuts: &[usize]) -> bool {
        let mut left = Vec::with_capacity(self.values.len());
        for (from, to) in self.stretches(cuts) {
            let [x, y] = self.fit(from, to);
            let rows = self.regressors[from..to].iter().zip(&self.values[from..to]);
            left.extend(rows.map(|([a, b], i)| (i - x * a - y * b) / self.noise));
        }
        let shown = noise::left(&left);
        let n = left.len() as f64;
        let scatter = |count: f64| UNSURE + WHITE * (2.0 / count.max(1.0)).sqrt();
        shown.lag1.abs() < 0.5 * UNSURE + WHITE / n.sqrt()
            && shown.square < 1.0 + scatter(n)
            && shown.slow < 1.0 + scatter(shown.blocks as f64)
    }

    /// What to say; `in_slopes` are places of rows that lie between two levels.
    fn words(&self, (form, conductance): (Form, f64), cuts: &[usize], in_slopes: &[usize]) -> String {
        let mut stretches = self.stretches(cuts);
        stretches.retain(|(from, _)| !in_slopes.contains(from));
        let count = stretches.len();
        let what = match (form, count) {
            (Form::Line, 1) => "1 straight line".to_owned(),
            (Form::Line, count) => format!("{count} straight lines"),
            (_, 1) => "1 stretch at rest".to_owned(),
            (_, count) => format!("{count} stretches at rest"),
        };
        let level = |(from, to): &(usize, usize)| self.values[*from..*to].iter().sum::<f64>() / (to - from) as f64;
        let beside = match conductance > 0.0 {
            true => format!(" beside a resistor of {}", crate::words::si(conductance.recip(), "ohm")),
            false => String::new(),
        };
        let small = stretches
            .windows(2)
            .filter(|pair| (level(&pair[0]) - level(&pair[1])).abs() < SURE_STEP * self.noise)
            .count();
        let unsure = match (form, small) {
            (Form::Line, _) | (_, 0) => String::new(),
            (_, small) => format!("; {small} of its steps are so small that the row is not sure"),
        };
        let between = match in_slopes.len() {
            0 => String::new(),
            1 => ", with 1 row in the slope between two,".to_owned(),
            rows => format!(", with {rows} rows in the slopes between them,"),
        };
        format!(
            "i_out is taken for a {}{beside} in {what}{between} without the noise of its meter ({}){unsure}",
            form.words(),
            crate::words::si(self.noise, "A")
        )
    }
}

#[cfg(test)]
mod tests {
    use super::find;

    /// Noise of standard deviation 1 that repeats no pattern shorter than the test.
    fn noise(n: usize) -> f64 {
        let mut state = (n as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        let uniform = |_| {
            state ^= state >> 31;
            state = state
                .wrapping_mul(0xBF58_476D_1CE4_E5B9)
                .wrapping_add(0x94D0_49BB_1331_11EB);
            (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        (0..12).map(uniform).sum()
    }

    fn stairs(count: usize, jump: f64) -> Vec<f64> {
        (0..count)
            .map(|n| if n < count / 3 { 5.0 } else { 5.0 + jump } + 0.05 * noise(n))
            .collect()
    }

    #[test]
    fn a_step_of_six_times_the_noise_is_found_in_its_row() {
        let found = find(&stairs(300, 0.3), &[100.0; 300], 1e-3, 0.5).unwrap();
        let steps: Vec<usize> = (1..300).filter(|n| found.load[*n] != found.load[n - 1]).collect();
        assert_eq!(steps, [100]);
        assert!((found.load[0].current - 5.0).abs() < 0.02 && (found.load[299].current - 5.3).abs() < 0.02);
        assert!(found.words.contains("2 stretches"), "{}", found.words);
    }

    #[test]
    fn white_noise_alone_is_one_level() {
        for first in 0..200 {
            let values: Vec<f64> = (0..200).map(|n| 5.0 + 0.05 * noise(1000 * first + n)).collect();
            if let Some(found) = find(&values, &[100.0; 200], 1e-3, 0.5) {
                assert!(
                    found.load.iter().all(|load| *load == found.load[0]),
                    "{first}: {}",
                    found.words
                );
            }
        }
    }

    #[test]
    fn a_current_that_swings_with_its_voltage_is_a_resistor() {
        let v: Vec<f64> = (0..300).map(|n| 100.0 + 20.0 * (n as f64 * 0.2).sin()).collect();
        let i: Vec<f64> = v.iter().enumerate().map(|(n, v)| v / 20.0 + 0.05 * noise(n)).collect();
        let found = find(&i, &v, 1e-3, 0.5).unwrap();
        assert!((found.load[7].conductance - 0.05).abs() < 1e-3 && found.load[7].current == 0.0);
        assert!(
            find(&i, &[], 1e-3, 0.5).is_none(),
            "without its voltage it is none of the forms"
        );
    }
}
