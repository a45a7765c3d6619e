//! Samples before they are folded: what was not measured, or not as it was.

use super::fold::quantum;
use super::read::Samples;
use super::terms::SHAPED;
use crate::median::median;
use crate::noise::scatter;
use crate::record::CHANNELS;

const NAMES: [&str; CHANNELS] = ["v_out", "i_l", "i_out", "v_in"];
/// A sample this many times further from the median than all but a few is none of the signal.
// spikes of a probe at an edge are some dozens of ripples
const WILD: f64 = 100.0;
/// Part of the samples that tell how far from its median a signal goes.
const USUAL: f64 = 0.98;
/// What a ripple surely may have, over the source voltage and over the largest ripple of the current: below it no sample is wild.
const SURELY: f64 = 1e-3;
const SURELY_CURRENT: f64 = 1e-2;
/// Samples that never move are a setting or a dead channel, as in any record.
const FEWEST: usize = 20;
/// Samples at one extreme, how many of them in a row, ...
const ROWS: usize = 6;
const RUN: usize = 4;
/// ... and how many times more than lie within the next three steps: at the top of a parabola there are as many.
const CROWDED: usize = 2;
/// A signal that moves by less than this many times its step and its noise has no range to leave.
const MOVES: f64 = 8.0;
/// A current this near to 0, as a share of its largest, rests there.
const RESTS: f64 = 0.05;

/// Takes out of `samples` what is no measurement, says so, and tells which channels were cut off: these show no mean and no ripple.
pub(super) fn clean(samples: &mut Samples, ripple: f64, notes: &mut Vec<String>) -> [bool; CHANNELS] {
    let v_in = samples.v_in;
    let (voltage, current) = (SURELY * v_in, SURELY_CURRENT * ripple);
    let sizes = [voltage, current, current, voltage];
    for (n, channel) in samples.channels.iter_mut().enumerate() {
        keep(channel, NAMES[n], sizes[n], notes);
        let is_stuck = channel.as_ref().and_then(|values| stuck(values));
        if let Some(value) = is_stuck {
            notes.push(format!(
                "column {} is constant at {value}: not taken as measured",
                NAMES[n]
            ));
            *channel = None;
        }
    }
    // these are pulses, which at a small duty are as rare as wild samples
    keep(&mut samples.node, "v_sw", v_in, notes);
    keep(&mut samples.pin, "v_pwm", v_in, notes);
    keep(&mut samples.i_in, "i_in", ripple, notes);
    let mut cut = [false; CHANNELS];
    for n in SHAPED {
        let Some(values) = &mut samples.channels[n] else {
            continue;
        };
        while let Some((end, step)) = cut_at(values, n == 1) {
            let is_end = |v: &f64| (v - end).abs() <= 0.5 * step;
            let count = values.iter().filter(|v| is_end(v)).count();
            notes.push(format!(
                "{count} samples of {} lie at {end}, as if cut off at the edge of the screen: left out, and neither mean nor size of the \
                 ripple is used. Was the range too small?",
                NAMES[n]
            ));
            values.iter_mut().filter(|v| is_end(v)).for_each(|v| *v = f64::NAN);
            let was = std::mem::replace(&mut cut[n], true);
            // one at either end
            if was {
                break;
            }
        }
    }
    cut
}

/// Leaves wild samples out, and a channel without any others.
fn keep(channel: &mut Option<Vec<f64>>, name: &str, size: f64, notes: &mut Vec<String>) {
    let Some(values) = channel else { return };
    if values.iter().all(|v| !v.is_finite()) {
        notes.push(format!("column {name} is empty: not measured"));
        *channel = None;
        return;
    }
    let wild = leave_out_wild(values, size);
    if let Some(first) = wild.first() {
        let samples = if wild.len() == 1 { "sample" } else { "samples" };
        notes.push(format!(
            "{} {samples} of {name} far from all others, such as {first}: left out",
            wild.len()
        ));
    }
}

/// Takes the samples out that are none of the signal, and returns them. A signal may move by `size` times [`WILD`] at any rate.
pub(crate) fn leave_out_wild(values: &mut [f64], size: f64) -> Vec<f64> {
    let middle = median(values.iter().copied());
    let apart = values.iter().map(|v| (v - middle).abs());
    let mut apart: Vec<f64> = apart.filter(|v| v.is_finite()).collect();
    apart.sort_by(f64::total_cmp);
    let place = ((USUAL * apart.len() as f64).ceil() as usize).saturating_sub(1);
    let usual = apart.get(place).copied().unwrap_or(0.0).max(SURELY * middle.abs());
    let allowed = WILD * usual.max(size);
    let mut wild = Vec::new();
    for v in values.iter_mut().filter(|v| (**v - middle).abs() > allowed) {
        wild.push(std::mem::replace(v, f64::NAN));
    }
    wild
}

/// The one value of a channel.
fn stuck(values: &[f64]) -> Option<f64> {
    let mut finite = values.iter().copied().filter(|v| v.is_finite());
    let first = finite.next()?;
    let others: Vec<f64> = finite.collect();
    (others.len() + 1 >= FEWEST && others.iter().all(|v| *v == first)).then_some(first)
}

/// The extreme at which a signal is cut off, with its step.
fn cut_at(values: &[f64], is_current: bool) -> Option<(f64, f64)> {
    let known: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    let mut sorted = known.clone();
    sorted.sort_by(f64::total_cmp);
    let (low, high) = (*sorted.first()?, *sorted.last()?);
    let coarse = quantum(&known);
    let gaps = sorted
        .windows(2)
        .map(|w| w[1] - w[0])
        .filter(|gap| *gap > 1e-9 * (high - low));
    let step = if coarse > 0.0 {
        coarse
    } else {
        gaps.fold(f64::INFINITY, f64::min)
    };
    let noise = scatter(&known, |_| true);
    let moves = MOVES * coarse.max(if noise.is_finite() { noise } else { 0.0 });
    if known.len() < FEWEST || high - low <= moves {
        return None;
    }
    let most = high.abs().max(low.abs());
    [high, low].into_iter().find_map(|end| {
        let is_rest = is_current && end.abs() < RESTS * most;
        let is_end: Vec<bool> = known.iter().map(|v| (v - end).abs() <= 0.5 * step).collect();
        let count = is_end.iter().filter(|is_end| **is_end).count();
        let run = is_end.split(|is_end| !is_end).map(<[bool]>::len).max().unwrap_or(0);
        let beside = known.iter().filter(|v| (*v - end).abs() <= 3.5 * step).count() - count;
        (!is_rest && count >= ROWS && run >= RUN && count > CROWDED * beside).then_some((end, step))
    })
}

#[cfg(test)]
mod tests {
    use super::cut_at;

    #[test]
    fn a_rounded_parabola_is_not_cut_off_and_a_flat_top_is() {
        let parabola = |n: usize| {
            let phase = (n as f64 / 100.0).rem_euclid(1.0) - 0.5;
            4.0 * phase * phase
        };
        for step in [0.0, 0.01, 0.02] {
            for most in [f64::INFINITY, 0.9] {
                let rounded = |v: f64| if step > 0.0 { (v / step).round() * step } else { v };
                let values: Vec<f64> = (0..800).map(|n| rounded((1.0 - parabola(n)).min(most))).collect();
                assert_eq!(cut_at(&values, false).is_some(), most < 1.0, "{step} {most}");
            }
        }
    }
}
