//! The edges of a signal with two levels, and the period in which they repeat, to a fraction of the time between samples.
//!
//! ```text
//! level    ‾‾‾‾|_________|‾‾‾‾‾‾‾‾|_________|‾‾‾      a crossing lies between two samples: a bracket
//! samples  ^  ^  ^  ^  ^  ^  ^  ^  ^  ^  ^  ^
//! ```
//! Edge number k of a kind lies at `t0 + k T`. Each bracket bounds `t0` for a given `T`, and where period and sampling do not divide
//! each other their intersection is far narrower than the time between samples.

/// Levels are left behind at these shares of the way to the other one: noise and ringing of a fifth make no edge.
const HIGH: f64 = 0.7;
const LOW: f64 = 0.3;
/// A signal of two levels lies near one of them in nine tenths of its samples, and its levels are apart by this many times its scatter
/// at either of them. A triangle is not.
const NEAR: f64 = 0.25;
const NEAR_SHARE: f64 = 0.8;
/// How far from the first estimate the period is sought: edges that scatter more than this share have no period.
const AROUND: f64 = 0.02;

/// Crossings of one direction: the samples' times before and behind each, s.
pub type Brackets = Vec<[f64; 2]>;

/// The edges of one signal.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Edges {
    /// Upward.
    pub rising: Brackets,
    /// Downward.
    pub falling: Brackets,
}

/// Where edges repeat.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct At {
    /// One of them, s.
    pub time: f64,
    /// Its standard deviation, s.
    pub sd: f64,
}

/// The two levels of a signal, if it has two.
pub fn levels(values: &[f64]) -> Option<[f64; 2]> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let at = |share: f64| sorted.get((share * (sorted.len() as f64 - 1.0)) as usize).copied();
    let middle = 0.5 * (at(0.01)? + at(0.99)?);
    let split = sorted.partition_point(|v| *v < middle);
    let (below, above) = sorted.split_at(split);
    let (low, high) = (*below.get(below.len() / 2)?, *above.get(above.len() / 2)?);
    let near = |v: &&f64| (**v - low).abs().min((**v - high).abs()) < NEAR * (high - low);
    let count = sorted.iter().filter(near).count() as f64;
    (high > low && count > NEAR_SHARE * sorted.len() as f64).then_some([low, high])
}

/// Around its extremes, as a share of what they are apart, a signal is at a level.
const AT_LEVEL: f64 = 0.12;
/// A plateau between them must hold this share of the samples to be one.
// edges hold less: a tenth of a period of ten samples
const PLATEAU_SHARE: f64 = 0.1;

/// Edges of a switch node: two levels in continuous conduction. Where the current rests the node swings to the output voltage, and
/// then rises from there.
pub fn of_node(time: &[f64], values: &[f64]) -> Option<Edges> {
    of_three(time, values).or_else(|| {
        let edges = Edges::of(time, values, levels(values)?);
        Some(wide(&edges.rising, &edges.falling))
    })
}

/// Edges of a node that swings between its levels for a while.
fn of_three(time: &[f64], values: &[f64]) -> Option<Edges> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let at = |share: f64| sorted.get((share * (sorted.len() as f64 - 1.0)) as usize).copied();
    let (least, most) = (at(0.02)?, at(0.98)?);
    let near = AT_LEVEL * (most - least);
    let middle = |from: f64, to: f64, share: f64| {
        let inside: Vec<f64> = sorted.iter().copied().filter(|v| (from..=to).contains(v)).collect();
        let is_enough = inside.len() as f64 > share * sorted.len() as f64;
        inside.get(inside.len() / 2).copied().filter(|_| is_enough)
    };
    let low = middle(f64::NEG_INFINITY, least + near, 0.0)?;
    let high = middle(most - near, f64::INFINITY, 0.0)?;
    let plateau = middle(least + near, most - near, PLATEAU_SHARE)?;
    let rising = Edges::of(time, values, [plateau, high]).rising;
    let falling = Edges::of(time, values, [low, high]).falling;
    (high > low).then(|| wide(&rising, &falling))
}

/// The wide pulses alone: a node that rings up to the source has narrow ones.
fn wide(rising: &Brackets, falling: &Brackets) -> Edges {
    let pulse = |off: &[f64; 2]| {
        let on = rising.iter().rfind(|on| on[1] <= off[0])?;
        Some((*on, *off, middle(off) - middle(on)))
    };
    let pulses: Vec<_> = falling.iter().filter_map(pulse).collect();
    let widest = pulses.iter().map(|pulse| pulse.2).fold(0.0, f64::max);
    let kept = || pulses.iter().filter(|pulse| pulse.2 > 0.5 * widest);
    Edges {
        rising: kept().map(|pulse| pulse.0).collect(),
        falling: kept().map(|pulse| pulse.1).collect(),
    }
}

impl Edges {
    /// The edges of a signal between two levels.
    pub fn of(time: &[f64], values: &[f64], [low, high]: [f64; 2]) -> Self {
        let (up, down, middle) = (low + HIGH * (high - low), low + LOW * (high - low), 0.5 * (low + high));
        let mut edges = Edges::default();
        let mut state: Option<bool> = None;
        // the last sample on the side that is left
        let mut last = 0;
        for (n, v) in values.iter().enumerate() {
            let is_high = *v > middle;
            let next = match state {
                Some(true) if *v < down => Some(false),
                Some(false) if *v > up => Some(true),
                None if *v > up => Some(true),
                None if *v < down => Some(false),
                same => same,
            };
            if let (Some(was), Some(is)) = (state, next)
                && was != is
            {
                // the first sample beyond the middle since the side was left
                let first = (last + 1..=n).find(|m| (values[*m] > middle) == is).unwrap_or(n);
                let bracket = [time[first - 1], time[first]];
                if is {
                    edges.rising.push(bracket)
                } else {
                    edges.falling.push(bracket)
                }
            }
            state = next;
            if Some(is_high) == state {
                last = n;
            }
        }
        edges
    }

    /// Mean time between edges of one direction, s.
    pub fn rough_period(&self) -> Option<f64> {
        let spans = [&self.rising, &self.falling].map(|list| match (list.first(), list.last()) {
            (Some(a), Some(b)) if list.len() > 1 => Some((middle(b) - middle(a)) / (list.len() - 1) as f64),
            _ => None,
        });
        spans.into_iter().flatten().reduce(|a, b| if a < b { a } else { b })
    }
}

fn middle(bracket: &[f64; 2]) -> f64 {
    0.5 * (bracket[0] + bracket[1])
}

/// Number of each edge, counted in periods from the middle one: an error of the period moves that least.
fn numbers(list: &[[f64; 2]], period: f64) -> Vec<f64> {
    let from = list.get(list.len() / 2).map_or(0.0, middle);
    list.iter().map(|b| ((middle(b) - from) / period).round()).collect()
}

/// Bounds that all brackets of a list leave for its middle edge; crossed where they contradict each other.
fn bounds(list: &[[f64; 2]], counts: &[f64], period: f64) -> [f64; 2] {
    let pairs = || list.iter().zip(counts);
    [
        pairs()
            .map(|(b, k)| b[0] - k * period)
            .fold(f64::NEG_INFINITY, f64::max),
        pairs().map(|(b, k)| b[1] - k * period).fold(f64::INFINITY, f64::min),
    ]
}

/// The period that lists of edges share, near `rough`, and one instant of each list; nothing for a list without edges.
pub fn repeated(lists: &[&Brackets], rough: f64) -> (f64, Vec<Option<At>>) {
    let counted: Vec<(&Brackets, Vec<f64>)> = lists.iter().map(|list| (*list, numbers(list, rough))).collect();
    let slack = |period: f64| {
        let of = |(list, counts): &(&Brackets, Vec<f64>)| {
            let [low, high] = bounds(list, counts, period);
            high - low
        };
        let used = counted.iter().filter(|(list, _)| list.len() > 1);
        used.map(of).fold(f64::INFINITY, f64::min)
    };
    // the least of lines in the period: one maximum
    let (mut low, mut high) = (rough * (1.0 - AROUND), rough * (1.0 + AROUND));
    for _ in 0..80 {
        let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        if slack(a) < slack(b) {
            low = a;
        } else {
            high = b;
        }
    }
    let within = 0.5 * (low + high);
    if slack(within) <= 0.0 {
        // edges that jitter by more than a sample: least squares
        let period = regressed(&counted).unwrap_or(rough);
        let at = counted.iter().map(|(list, counts)| scattered(list, counts, period));
        return (period, at.collect());
    }
    let periods: Vec<f64> = match slack(within).is_finite() {
        true => {
            let (least, most) = (
                end(&slack, within, -AROUND * rough),
                end(&slack, within, AROUND * rough),
            );
            (0..TRIED)
                .map(|n| least + (most - least) * (n as f64 + 0.5) / TRIED as f64)
                .collect()
        }
        // one edge of each kind: the period is not theirs to tell
        false => vec![rough],
    };
    averaged(&counted, &periods)
}

/// Periods that are averaged over.
const TRIED: usize = 41;

/// How far a period may go to one side before brackets contradict each other.
fn end(slack: &impl Fn(f64) -> f64, from: f64, reach: f64) -> f64 {
    let (mut inside, mut outside) = (from, from + reach);
    for _ in 0..60 {
        let middle = 0.5 * (inside + outside);
        if slack(middle) > 0.0 {
            inside = middle;
        } else {
            outside = middle;
        }
    }
    inside
}

/// Means over all periods and instants that the brackets allow, each as likely as any other.
fn averaged(counted: &[(&Brackets, Vec<f64>)], periods: &[f64]) -> (f64, Vec<Option<At>>) {
    let all = |period: f64| counted.iter().map(move |(list, counts)| bounds(list, counts, period));
    // the volume that is left for the instants
    let weights: Vec<f64> = periods
        .iter()
        .map(|period| {
            all(*period)
                .map(|[low, high]| high - low)
                .filter(|w| w.is_finite())
                .product()
        })
        .collect();
    let total: f64 = weights.iter().sum();
    let mean = |of: &dyn Fn(f64) -> f64| {
        let sum: f64 = periods
            .iter()
            .zip(&weights)
            .map(|(period, weight)| of(*period) * weight)
            .sum();
        sum / total
    };
    let at = |(list, counts): &(&Brackets, Vec<f64>)| {
        let centre = |period: f64| {
            let [low, high] = bounds(list, counts, period);
            0.5 * (low + high)
        };
        let time = mean(&centre);
        let square = |period: f64| {
            let [low, high] = bounds(list, counts, period);
            (high - low).powi(2) / 12.0 + (centre(period) - time).powi(2)
        };
        (!list.is_empty()).then(|| At {
            time,
            sd: mean(&square).sqrt(),
        })
    };
    (mean(&|period| period), counted.iter().map(at).collect())
}

/// The mean of edges that scatter.
fn scattered(list: &[[f64; 2]], counts: &[f64], period: f64) -> Option<At> {
    let n = list.len() as f64;
    let off = || list.iter().zip(counts).map(|(b, k)| middle(b) - k * period);
    let time = off().sum::<f64>() / n;
    let left = off().map(|t| (t - time).powi(2)).sum::<f64>() / n;
    (!list.is_empty()).then(|| At {
        time,
        sd: (left / n).sqrt(),
    })
}

/// The common slope of the edges over their numbers.
fn regressed(counted: &[(&Brackets, Vec<f64>)]) -> Option<f64> {
    let (mut up, mut down) = (0.0, 0.0);
    for (list, counts) in counted {
        let n = list.len().max(1) as f64;
        let (k_mean, t_mean) = (counts.iter().sum::<f64>() / n, list.iter().map(middle).sum::<f64>() / n);
        for (b, k) in list.iter().zip(counts) {
            up += (k - k_mean) * (middle(b) - t_mean);
            down += (k - k_mean).powi(2);
        }
    }
    (down > 0.0).then_some(up / down)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Five and ten periods of 10.03 us, sampled each 100 ns: edges are known to a fraction of a sample.
    #[test]
    fn edges_are_found_between_samples() {
        let (period, on, off) = (10.03e-6, 1.234e-6, 5.678e-6);
        for (count, allowed) in [(500, 15e-9), (1000, 8e-9)] {
            let time: Vec<f64> = (0..count).map(|n| f64::from(n) * 1e-7).collect();
            let value = |t: &f64| {
                let phase = (t - on).rem_euclid(period);
                let ripple = 0.05 * (t * 3.3e7).sin();
                if phase < off - on { 12.0 + ripple } else { -0.6 + ripple }
            };
            let values: Vec<f64> = time.iter().map(value).collect();
            let edges = Edges::of(&time, &values, levels(&values).unwrap());
            let rough = edges.rough_period().unwrap();
            let (found, at) = repeated(&[&edges.rising, &edges.falling], rough);
            assert!((found / period - 1.0).abs() < 1e-3, "{found}");
            for (at, truth) in at.iter().zip([on, off]) {
                let at = at.unwrap();
                let apart = (at.time - truth + 0.5 * period).rem_euclid(period) - 0.5 * period;
                assert!(apart.abs() < allowed, "{apart} with {}", at.sd);
                assert!(
                    at.sd < 1e-7 / 12f64.sqrt() && apart.abs() < 4.0 * at.sd + 2e-9,
                    "{apart} {}",
                    at.sd
                );
            }
        }
    }

    /// 24 V while on, -0.5 V while the current runs out, 14 V with a ring while it rests.
    #[test]
    fn a_node_whose_current_rests_rises_from_the_output_voltage() {
        let period = 10.03e-6;
        let time: Vec<f64> = (0..800).map(|n| f64::from(n) * 1e-7).collect();
        let value = |t: &f64| match (t / period).rem_euclid(1.0) {
            phase if phase < 0.4 => 24.0,
            phase if phase < 0.7 => -0.5,
            phase => 14.0 + 14.0 * (-(phase - 0.7) * 12.0).exp() * -((phase - 0.7) * 60.0).cos(),
        };
        let values: Vec<f64> = time.iter().map(value).collect();
        let edges = of_node(&time, &values).unwrap();
        let (found, at) = repeated(&[&edges.rising, &edges.falling], edges.rough_period().unwrap());
        assert!((found / period - 1.0).abs() < 1e-3);
        let width = (at[1].unwrap().time - at[0].unwrap().time).rem_euclid(found);
        assert!((width - 0.4 * period).abs() < 20e-9, "{width}");
    }

    #[test]
    fn a_triangle_and_a_flat_line_have_no_two_levels() {
        let triangle: Vec<f64> = (0..400).map(|n| (f64::from(n % 100) - 50.0).abs()).collect();
        assert_eq!(levels(&triangle), None);
        assert_eq!(levels(&[1.0; 50]), None);
    }
}
