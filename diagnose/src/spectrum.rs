//! Lines in a residual.

use std::f64::consts::TAU;
use std::ops::Range;

use crate::median::median;
use crate::noise::channel;
use crate::parallel;
use crate::problem::Problem;

/// Frequencies looked at, as shares of the sampling frequency: 20 Hz, below which a record of 25 ms holds half a turn, to 2 kHz at
/// 10 kHz, above which the filter lets nothing of the source through.
const LOWEST: f64 = 2e-3;
const HIGHEST: f64 = 0.2;

/// A sine of time 0 at the record's zero time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// Frequency, Hz.
    pub frequency: f64,
    /// Amplitude in the channel's unit.
    pub amplitude: f64,
    /// Phase, turns.
    pub phase: f64,
    /// Share of the channel's residual power.
    pub share: f64,
}

/// The strongest line of one channel over all records; nothing if the channel was not measured.
#[must_use]
pub fn strongest_line(problem: &Problem, residual: &[f64], n: usize) -> Option<Line> {
    strongest_in(problem, residual, n, 0..problem.records.len())
}

/// The strongest line of one channel of a record: what an instrument picks up has a phase of its own in each.
#[must_use]
pub fn strongest_line_of(problem: &Problem, residual: &[f64], (index, n): (usize, usize)) -> Option<Line> {
    strongest_in(problem, residual, n, index..index + 1)
}

fn strongest_in(problem: &Problem, residual: &[f64], n: usize, of: Range<usize>) -> Option<Line> {
    let mut samples = Vec::new();
    let (mut longest, t_sw) = (0.0f64, problem.bases.t_sw);
    let records = problem.records.iter().enumerate();
    for (index, record) in records.filter(|(index, r)| !r.settled && of.contains(index)) {
        let values = channel(problem, residual, index, n);
        samples.extend(
            values
                .iter()
                .zip(&record.time)
                .filter(|(v, _)| **v != 0.0)
                .map(|(v, t)| (*t + record.clock, *v)),
        );
        longest = longest.max(record.rows() as f64 * t_sw);
    }
    // the strongest line of white noise holds 2 ln(n / 2) / n of its power: 13 % here, and `shape::LINE` is 15 %
    if samples.len() < 50 {
        return None;
    }
    let mean = samples.iter().map(|(_, v)| v).sum::<f64>() / samples.len() as f64;
    let power: f64 = samples.iter().map(|(_, v)| (v - mean) * (v - mean)).sum();
    // a quarter of a turn over the longest record: between two frequencies a line loses at most 3 % of its amplitude
    let step = 0.25 / longest;
    let count = ((HIGHEST - LOWEST) / t_sw / step) as usize;
    let mut best: Option<(f64, f64, f64, f64)> = None;
    for k in 0..=count {
        let frequency = LOWEST / t_sw + k as f64 * step;
        let (mut sine, mut cosine) = (0.0, 0.0);
        for (t, v) in &samples {
            // sums, not a Fourier transform: rows are missing, and records have times of their own. From the crate
            // libm, whose bits are the same on every machine
            let (s, c) = (libm::sin(TAU * frequency * t), libm::cos(TAU * frequency * t));
            sine += (v - mean) * s;
            cosine += (v - mean) * c;
        }
        let strength = sine * sine + cosine * cosine;
        if best.is_none_or(|best| strength > best.0) {
            best = Some((strength, frequency, sine, cosine));
        }
    }
    let (strength, frequency, sine, cosine) = best?;
    let n_samples = samples.len() as f64;
    Some(Line {
        frequency,
        amplitude: 2.0 * strength.sqrt() / n_samples * problem.sigma[n],
        phase: libm::atan2(cosine, sine) / TAU,
        // of few turns a sine and a cosine are not at right angles
        share: (2.0 * strength / n_samples / power.max(1e-300)).min(1.0),
    })
}

/// A sine in some samples beside their mean, by least squares: the sums of sine and cosine with each other and with the samples. Of few turns the two are
/// not at right angles, and neither is their mean.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Wave {
    ss: f64,
    sc: f64,
    cc: f64,
    sv: f64,
    cv: f64,
}

impl Wave {
    /// Of samples (time, value) whose mean is 0.
    fn of(samples: &[(f64, f64)], frequency: f64) -> Self {
        let turned = samples.iter().map(|(t, v)| {
            let turn = TAU * frequency * t;
            (libm::sin(turn), libm::cos(turn), *v)
        });
        let (mut wave, mut means) = (Wave::default(), [0.0; 2]);
        for (s, c, v) in turned {
            wave.ss += s * s;
            wave.sc += s * c;
            wave.cc += c * c;
            wave.sv += s * v;
            wave.cv += c * v;
            means[0] += s;
            means[1] += c;
        }
        let count = samples.len().max(1) as f64;
        wave.ss -= means[0] * means[0] / count;
        wave.sc -= means[0] * means[1] / count;
        wave.cc -= means[1] * means[1] / count;
        wave
    }

    fn and(self, other: &Self) -> Self {
        Wave {
            ss: self.ss + other.ss,
            sc: self.sc + other.sc,
            cc: self.cc + other.cc,
            sv: self.sv + other.sv,
            cv: self.cv + other.cv,
        }
    }

    /// Factors of sine and cosine.
    fn factors(&self) -> [f64; 2] {
        let det = self.ss * self.cc - self.sc * self.sc;
        match det > 1e-6 * self.ss * self.cc {
            true => [
                (self.sv * self.cc - self.cv * self.sc) / det,
                (self.cv * self.ss - self.sv * self.sc) / det,
            ],
            // less than a turn
            false => [0.0; 2],
        }
    }

    /// Phase at time 0, turns.
    pub fn phase(&self) -> f64 {
        let [sine, cosine] = self.factors();
        libm::atan2(cosine, sine) / TAU
    }

    /// Squares that it holds.
    pub fn power(&self) -> f64 {
        let [sine, cosine] = self.factors();
        sine * self.sv + cosine * self.cv
    }
}

/// Lines of one frequency in several records.
pub(crate) struct Waves {
    /// Hz.
    pub frequency: f64,
    /// Of each record.
    pub each: Vec<Wave>,
    /// The most that lines of one phase hold, at any frequency.
    pub together: f64,
    /// All squares.
    pub power: f64,
}

/// Turns that each record has to hold: of half of one a slope and a mean take most.
const TURNS: f64 = 0.6;

/// The frequency at which lines of any phase hold most of the samples (time, value) of several records.
pub(crate) fn waves(records: &[Vec<(f64, f64)>], t_sw: f64) -> Option<Waves> {
    let centred = records.iter().map(|samples| {
        let mean = samples.iter().map(|(_, v)| v).sum::<f64>() / samples.len().max(1) as f64;
        samples.iter().map(|(t, v)| (*t, v - mean)).collect::<Vec<_>>()
    });
    let records: Vec<Vec<(f64, f64)>> = centred.collect();
    let span = |samples: &Vec<(f64, f64)>| match (samples.first(), samples.last()) {
        (Some((from, _)), Some((to, _))) => to - from,
        _ => 0.0,
    };
    let longest = records.iter().map(span).fold(0.0, f64::max);
    let shortest = records.iter().map(span).fold(f64::INFINITY, f64::min);
    if shortest <= 0.0 || !shortest.is_finite() {
        return None;
    }
    let at = |frequency: f64| {
        let each = records.iter().map(|samples| Wave::of(samples, frequency));
        each.collect::<Vec<Wave>>()
    };
    let alone = |each: &[Wave]| each.iter().map(Wave::power).sum::<f64>();
    let together = |each: &[Wave]| each.iter().fold(Wave::default(), Wave::and).power();
    // a quarter of a turn between two frequencies
    let (lowest, step) = ((LOWEST / t_sw).max(TURNS / shortest), 0.25 / longest);
    let count = ((HIGHEST / t_sw - lowest) / step).max(0.0) as usize;
    let grid = parallel::map(&(0..=count).collect::<Vec<_>>(), |k| {
        let frequency = lowest + *k as f64 * step;
        let each = at(frequency);
        (alone(&each), together(&each), frequency)
    });
    let best = grid.iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
    // between its neighbours: the phase at a record's beginning goes with the frequency
    let near = || (-NEARER..=NEARER).map(|k| best.2 + f64::from(k) * step / f64::from(NEARER));
    let of_grid = grid.iter().map(|(_, together, _)| *together).fold(0.0, f64::max);
    let frequency = near().max_by(|a, b| alone(&at(*a)).total_cmp(&alone(&at(*b))))?;
    Some(Waves {
        frequency,
        each: at(frequency),
        together: near().map(|frequency| together(&at(frequency))).fold(of_grid, f64::max),
        power: records.iter().flatten().map(|(_, v)| v * v).sum(),
    })
}

/// Places between two frequencies of a look: a sixteenth of a quarter of a turn over the record is a phase of 1.5 %.
const NEARER: i32 = 16;

/// Frequencies at which a filter may swing, as shares of the sampling frequency: below, a record holds few turns; above, two rows a turn
/// are left.
const SLOWEST: f64 = 1.0 / 120.0;
const FASTEST: f64 = 0.35;
/// A swing stands out of the median of its neighbours by this, in squares: the largest of 200 exponential numbers is eight times
/// their median. More only costs the look at a filter that is none.
const STANDS_OUT: f64 = 10.0;
/// Neighbours of a frequency are within this factor: several widths of a swing that fades within two turns.
const NEIGHBOUR: f64 = 1.7;
/// Two swings are apart by this share of their frequency.
const OTHER_SWING: f64 = 0.2;
/// Swings that are looked at: behind a filter of the input that of the output may be the stronger.
const MOST_SWINGS: usize = 2;

/// Frequencies in Hz at which a channel swings behind steps, the strongest first. Changes from row to row are looked at, in which the steps
/// themselves are single rows.
#[must_use]
pub fn swings(problem: &Problem, residual: &[f64], n: usize) -> Vec<f64> {
    let mut records = Vec::new();
    for (index, _) in problem
        .records
        .iter()
        .enumerate()
        .filter(|(_, r)| !r.settled && r.dense)
    {
        let values = channel(problem, residual, index, n);
        let pairs = values
            .windows(2)
            .enumerate()
            .filter(|(_, pair)| pair[0] != 0.0 && pair[1] != 0.0);
        records.push(
            pairs
                .map(|(row, pair)| (row as f64, pair[1] - pair[0]))
                .collect::<Vec<_>>(),
        );
    }
    let longest = records.iter().map(Vec::len).max().unwrap_or(0);
    if longest < 50 {
        return Vec::new();
    }
    let step = 0.5 / longest as f64;
    let count = ((FASTEST - SLOWEST) / step) as usize;
    let powers: Vec<(f64, f64)> = (0..=count)
        .map(|k| {
            let share = SLOWEST + k as f64 * step;
            let strength = records.iter().map(|samples| {
                let (mut sine, mut cosine) = (0.0, 0.0);
                for (row, v) in samples {
                    let (s, c) = libm::sincos(TAU * share * row);
                    sine += v * s;
                    cosine += v * c;
                }
                sine * sine + cosine * cosine
            });
            (share, strength.sum())
        })
        .collect();
    // of differences white noise and steps have different spectra, both smooth: a swing stands out of its neighbours
    let mut lines: Vec<(f64, f64)> = powers
        .iter()
        .map(|(share, power)| {
            let near = powers
                .iter()
                .filter(|other| (other.0 / share).max(share / other.0) < NEIGHBOUR);
            (*share, power / median(near.map(|other| other.1)).max(f64::MIN_POSITIVE))
        })
        .collect();
    lines.retain(|line| line.1 > STANDS_OUT);
    lines.sort_by(|a, b| b.1.total_cmp(&a.1));
    let mut found: Vec<f64> = Vec::new();
    for (share, _) in lines {
        let is_other = found.iter().all(|known| (share / known - 1.0).abs() > OTHER_SWING);
        if is_other && found.len() < MOST_SWINGS {
            found.push(share);
        }
    }
    found.iter().map(|share| share / problem.bases.t_sw).collect()
}
