//! Signals that reach the end of their instrument's range.

use super::channels::FEWEST;
use crate::flicker::digit;
use crate::noise::scatter;

/// Rows at one extreme value: chance puts two or three of a noisy signal there.
const ROWS: usize = 6;
/// Of which so many follow each other.
const RUN: usize = 4;
/// A signal that moves by less than this many times its noise has no range to leave.
const MOVES: f64 = 8.0;

/// Chance below which a run of one value is none where the step is as coarse as the noise. A convention, since it takes both this ...
const CHANCE: f64 = 1e-3;
/// ... and a run so many times as long as the longest one of any other value: a signal that rests does so at other levels as well.
const LONGER: usize = 3;

/// The extreme value at which a signal is cut off, and how many rows are there. `step` is that of its numbers: where it is as coarse as the
/// noise, equal values are the rule, and only runs that no noise leaves count.
pub fn at(values: &[f64], step: f64) -> Option<(f64, usize)> {
    let known: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    let noise = scatter(&known, |_| true);
    let (low, high) = known
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
    if known.len() < FEWEST || noise.is_nan() || high - low < MOVES * noise {
        return None;
    }
    // one that goes between a few digits has its middle at an end
    if digit(&known) > 0.0 {
        return None;
    }
    [high, low].into_iter().find_map(|end| {
        let is_end: Vec<bool> = known.iter().map(|v| *v == end).collect();
        let count = is_end.iter().filter(|end| **end).count();
        let run = is_end.split(|end| !end).map(<[bool]>::len).max().unwrap_or(0);
        let is_cut = noise >= 2.0 * step || is_no_rest(&known, (end, run), step);
        (count >= ROWS && run >= RUN && is_cut).then_some((end, count))
    })
}

/// Whether a signal on `step`s as coarse as its noise would have left its `end` within the longest `run` of rows there.
fn is_no_rest(known: &[f64], (end, run): (f64, usize), step: f64) -> bool {
    let all = scatter(known, |three| !three.contains(&end));
    // rounding is noise of its own
    let noise = (all * all - step * step / 12.0).max(0.0).sqrt();
    // in the middle of a step noise is least seen
    let stays = libm::erf(0.5 * step / (noise * 2f64.sqrt()));
    let others = known.chunk_by(|a, b| a == b).filter(|run| run[0] != end);
    let longest = others.map(<[f64]>::len).max().unwrap_or(0);
    noise > 0.0 && stays.powf(run as f64) < CHANCE && run > LONGER * longest
}

#[cfg(test)]
mod tests {
    use super::at;

    /// A swing of `steps` of an ADC with the noise of that share of a step, cut off at an upper end.
    fn swing(steps: f64, noise: f64, end: f64) -> Vec<f64> {
        let mut state = 7_u64;
        let mut random = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f64 / (1_u64 << 24) as f64
        };
        let mut values = Vec::new();
        for row in 0..400 {
            // plateaus and ways between them, as behind steps of a duty
            let (part, within) = (row / 50, f64::from(row % 50));
            let level = |part: i32| steps * (0.5 + 0.5 * f64::from((part * 37) % 8 - 4) / 4.0);
            let way = libm::exp(-within / 4.0);
            let normal = (0..12).map(|_| random()).sum::<f64>() - 6.0;
            let v = level(part) + way * (level(part - 1) - level(part)) + noise * normal;
            values.push(v.round().min(end) * 0.02);
        }
        values
    }

    #[test]
    fn a_signal_on_the_steps_of_an_adc_is_seen_to_be_cut_off() {
        for noise in [0.6, 0.8, 1.2, 1.8] {
            assert_eq!(
                at(&swing(100.0, noise, 60.0), 0.02).map(|(end, _)| end),
                Some(1.2),
                "{noise}"
            );
            assert_eq!(at(&swing(100.0, noise, f64::INFINITY), 0.02), None, "{noise}");
        }
        // a plateau without noise is as flat as one that is cut off
        assert_eq!(at(&swing(100.0, 0.05, f64::INFINITY), 0.02), None);
    }
}
