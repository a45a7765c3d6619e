//! All periods of a capture laid over each other: means in bins of one period, with the noise that the periods show.
use crate::exact::Exact;

/// Most bins: the ripple of a second-order filter has no more to say, and each costs a look of the plant.
const MOST_BINS: usize = 200;
/// Parts of a period whose errors count as independent. What a simulator gets wrong in a waveform is smooth, and two hundred bins of it
/// say no more than this many.
// a convention: parabola and triangle of a ripple are told apart by a handful of values
pub const INDEPENDENT: f64 = 20.0;
/// What a simulator may get wrong in a ripple, as a share of its size: edges, ringing, nonlinear parts.
const SIMULATED: f64 = 0.01;
/// The same where the current rests: inductor and capacitance of the switch node ring with a tenth of the ripple, at a board in ngspice
/// with 1 nF there, and the current begins anywhere in the ring. No plant of ideal switches does.
const RINGING: f64 = 0.1;

/// Part of the largest current below which it rests, and part of the period for which it has to.
const RESTS: f64 = 0.05;
const RESTING: f64 = 0.1;

/// Part of the bins that single samples may leave empty.
const HOLES: f64 = 0.02;

/// Mean values of one channel over the period.
#[derive(Debug, Clone, PartialEq)]
pub struct Fold {
    /// Mean value in each bin less the mean of the period.
    pub value: Vec<f64>,
    /// Standard deviation of each.
    pub sd: Vec<f64>,
    /// Mean over whole periods.
    pub mean: f64,
    /// Its standard deviation by the noise alone.
    pub mean_sd: f64,
    /// Standard deviation of the noise of a sample.
    pub noise: f64,
    /// Step of the converter, 0 if none shows.
    pub step: f64,
    /// Highest less lowest sample: at least that much was the range of the channel.
    pub span: f64,
}

/// Bins of one period, the same for all channels.
#[derive(Debug, Clone, PartialEq)]
pub struct Bins {
    /// Mean phase of the samples in each, fractions of the period from its origin, ascending.
    pub at: Vec<f64>,
    /// Bin of each sample; nothing behind the last whole period.
    of: Vec<Option<usize>>,
    /// Whole periods.
    pub periods: f64,
    /// s
    pub period: f64,
    /// Where phase 0 is, s.
    origin: f64,
}

impl Bins {
    /// Of samples at `time`, evenly spaced by `step`, for periods that begin at `origin`.
    pub fn new(time: &[f64], step: f64, period: f64, origin: f64) -> Self {
        let first = time.first().copied().unwrap_or(0.0);
        let span = time.last().copied().unwrap_or(0.0) - first + step;
        // the hundredth is for the rounding of times
        let periods = (span / period + 0.01).floor();
        let count = ((period / step).round() as usize).clamp(1, MOST_BINS);
        let phase = |t: f64| ((t - origin) / period).rem_euclid(1.0);
        let bin = |t: f64| ((phase(t) * count as f64) as usize).min(count - 1);
        let of: Vec<Option<usize>> = time
            .iter()
            .map(|t| (*t - first < periods * period - 0.5 * step).then(|| bin(*t)))
            .collect();
        let (mut sum, mut number) = (vec![0.0; count], vec![0.0; count]);
        for (t, bin) in time.iter().zip(&of) {
            if let Some(bin) = bin {
                sum[*bin] += phase(*t);
                number[*bin] += 1.0;
            }
        }
        // samples and bins may miss each other by a rounding: an empty bin is left out
        let mut place = vec![None; count];
        let mut at = Vec::new();
        for bin in 0..count {
            if number[bin] > 0.0 {
                place[bin] = Some(at.len());
                at.push(sum[bin] / number[bin]);
            }
        }
        let of = of.into_iter().map(|bin| bin.and_then(|bin| place[bin])).collect();
        Bins {
            at,
            of,
            periods,
            period,
            origin,
        }
    }

    /// Phase of an instant, fraction of the period from its origin.
    pub fn phase(&self, t: f64) -> f64 {
        ((t - self.origin) / self.period).rem_euclid(1.0)
    }

    /// Bin of each sample.
    pub fn places(&self) -> &[Option<usize>] {
        &self.of
    }

    /// One channel folded. Samples that are no number count nowhere; a bin without any has what lies on the line between its neighbours,
    /// and a standard deviation that is infinite.
    pub fn fold(&self, values: &[f64]) -> Fold {
        let count = self.at.len();
        let (mut sum, mut square, mut number) = (vec![0.0; count], vec![0.0; count], vec![0.0; count]);
        let used = || {
            let all = values.iter().zip(&self.of);
            all.filter_map(|(v, bin)| Some((*v, (*bin)?)))
                .filter(|(v, _)| v.is_finite())
        };
        for (v, bin) in used() {
            sum[bin] += v;
            number[bin] += 1.0;
        }
        let all: f64 = number.iter().sum::<f64>().max(1.0);
        let mut value: Vec<f64> = sum.iter().zip(&number).map(|(s, n)| s / n).collect();
        for (v, bin) in used() {
            square[bin] += (v - value[bin]).powi(2);
        }
        let free = all - number.iter().filter(|n| **n > 0.0).count() as f64;
        let kept: Vec<f64> = values
            .iter()
            .zip(&self.of)
            .filter(|(_, bin)| bin.is_some())
            .map(|(v, _)| *v)
            .collect();
        let noise = match self.periods >= 2.0 && free > 0.0 {
            true => (square.iter().sum::<f64>() / free).sqrt(),
            // one period has nothing to be compared with: what second differences show
            false => crate::noise::scatter(&kept, |t| t.iter().all(|v| v.is_finite())),
        };
        let noise = if noise.is_finite() { noise } else { 0.0 };
        let step = quantum(&kept);
        let mean = bin_mean(&self.at, &value);
        value.iter_mut().for_each(|v| *v -= mean);
        let known: Vec<(f64, f64)> = self
            .at
            .iter()
            .copied()
            .zip(value.iter().copied())
            .filter(|(_, v)| v.is_finite())
            .collect();
        for (at, v) in self.at.iter().zip(&mut value).filter(|(_, v)| !v.is_finite()) {
            *v = between(&known, *at);
        }
        let finite = || value.iter().copied().filter(|v| v.is_finite());
        let ripple = finite().fold(0.0, f64::max) - finite().fold(0.0, f64::min);
        // noise of half a step and more dithers; with less, the rounding of a bin is the same in each period
        let rounding = if noise < 0.5 * step { step / 12f64.sqrt() } else { 0.0 };
        let floor = SIMULATED * ripple * (count as f64 / INDEPENDENT).max(1.0).sqrt();
        let sd = number
            .iter()
            .map(|n: &f64| match *n > 0.0 {
                true => (noise / n.sqrt()).hypotenuse(rounding).hypotenuse(floor).max(1e-12),
                false => f64::INFINITY,
            })
            .collect();
        let (low, high) = kept
            .iter()
            .filter(|v| v.is_finite())
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
        Fold {
            value,
            sd,
            mean,
            mean_sd: (noise / all.sqrt()).hypotenuse(rounding),
            noise,
            step,
            span: (high - low).max(0.0),
        }
    }
}

impl Fold {
    /// With what a ringing node does to the channel.
    pub fn ringing(mut self) -> Self {
        let floor = RINGING * self.ripple() * (self.value.len() as f64 / INDEPENDENT).max(1.0).sqrt();
        self.sd.iter_mut().for_each(|sd| *sd = sd.hypotenuse(floor));
        self
    }

    /// Whether a current with these values rests for a part of the period.
    pub fn rests(&self, periods: f64) -> bool {
        let values = || self.value.iter().map(|v| v + self.mean).filter(|v| v.is_finite());
        let most = values().fold(0.0, f64::max);
        let noise = 3.0 * self.noise / periods.max(1.0).sqrt();
        let resting = values().filter(|v| v.abs() < (RESTS * most).max(noise)).count() as f64;
        resting > RESTING * self.value.len() as f64
    }

    /// Value less the mean at a phase, on the line between the bins at `at`.
    pub fn value_at(&self, at: &[f64], phase: f64) -> f64 {
        let next = at.partition_point(|x| *x <= phase);
        let [a, b] = match (at.len(), next) {
            (0, _) => return f64::NAN,
            (n, 0) => [n - 1, 0],
            (n, next) if next == n => [n - 1, 0],
            (_, next) => [next - 1, next],
        };
        on_line((at[a], self.value[a]), (at[b], self.value[b]), phase)
    }

    /// Whether parts of the period were not measured, single samples apart.
    pub fn has_holes(&self) -> bool {
        let count = self.sd.iter().filter(|sd| sd.is_infinite()).count();
        count as f64 > HOLES * self.sd.len() as f64
    }

    /// Highest less lowest of the mean period.
    pub fn ripple(&self) -> f64 {
        let finite = || self.value.iter().copied().filter(|v| v.is_finite());
        finite().fold(f64::NEG_INFINITY, f64::max) - finite().fold(f64::INFINITY, f64::min)
    }
}

/// The line between two points of a period, which closes round.
fn on_line(a: (f64, f64), b: (f64, f64), phase: f64) -> f64 {
    let width = (b.0 - a.0).rem_euclid(1.0);
    match width > 0.0 {
        true => a.1 + (b.1 - a.1) * (phase - a.0).rem_euclid(1.0) / width,
        false => a.1,
    }
}

/// The same between the neighbours of a phase.
fn between(known: &[(f64, f64)], phase: f64) -> f64 {
    let next = known.partition_point(|(at, _)| *at <= phase);
    let before = if next == 0 { known.last() } else { known.get(next - 1) };
    let after = known.get(next).or(known.first());
    match (before, after) {
        (Some(a), Some(b)) => on_line(*a, *b, phase),
        _ => f64::NAN,
    }
}

/// Mean over the period of a line through `value` at phases `at`, which closes round.
pub fn bin_mean(at: &[f64], value: &[f64]) -> f64 {
    let known: Vec<(f64, f64)> = at
        .iter()
        .copied()
        .zip(value.iter().copied())
        .filter(|(_, v)| v.is_finite())
        .collect();
    let (Some(first), Some(last)) = (known.first(), known.last()) else {
        return f64::NAN;
    };
    let pair = |a: &(f64, f64), b: &(f64, f64)| 0.5 * (a.1 + b.1) * (b.0 - a.0);
    known.windows(2).map(|w| pair(&w[0], &w[1])).sum::<f64>() + pair(last, &(first.0 + 1.0, first.1))
}

/// Distance of the values of a coarse converter; 0 where nearly every value is another. Instruments write them with the rounding of
/// their own arithmetic, so values within a thousandth of the distance are one.
pub(super) fn quantum(values: &[f64]) -> f64 {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let span = sorted.last().copied().unwrap_or(0.0) - sorted.first().copied().unwrap_or(0.0);
    let mut gaps: Vec<f64> = sorted
        .windows(2)
        .map(|w| w[1] - w[0])
        .filter(|gap| *gap > 1e-5 * span)
        .collect();
    gaps.sort_by(f64::total_cmp);
    // a converter of eight bits has 256 values; a third as many values as samples are no steps
    match gaps.len() * 3 < sorted.len() {
        true => gaps.get(gaps.len() / 4).copied().unwrap_or(0.0),
        false => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triangle_folds_to_itself_and_shows_its_noise() {
        let period = 10.03e-6;
        let time: Vec<f64> = (0..1000).map(|n| f64::from(n) * 1e-7).collect();
        let wave = |t: f64| ((t / period).rem_euclid(1.0) - 0.5).abs();
        // as white as it has to be: alternating by an irrational angle
        let values: Vec<f64> = time
            .iter()
            .enumerate()
            .map(|(n, t)| 3.0 + wave(*t) + 0.1 * (n as f64 * 2.4).sin())
            .collect();
        let bins = Bins::new(&time, 1e-7, period, 0.0);
        let fold = bins.fold(&values);
        assert_eq!((bins.periods, bins.at.len()), (9.0, 100));
        assert!((fold.mean - 3.25).abs() < 0.01, "{}", fold.mean);
        assert!((fold.noise / 0.0707 - 1.0).abs() < 0.1, "{}", fold.noise);
        for (at, v) in bins.at.iter().zip(&fold.value) {
            assert!((v - (wave(at * period) - 0.25)).abs() < 0.1);
        }
    }

    #[test]
    fn steps_of_a_converter_are_seen() {
        let values: Vec<f64> = (0..500).map(|n| (f64::from(n) * 0.37).sin()).collect();
        assert_eq!(quantum(&values), 0.0);
        let coarse: Vec<f64> = values.iter().map(|v| (v / 0.05).round() * 0.05 + 1e-9 * v).collect();
        assert!((quantum(&coarse) / 0.05 - 1.0).abs() < 1e-3);
    }
}
