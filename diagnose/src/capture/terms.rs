//! A capture as residuals over their standard deviations: the plant's own steady state beside the folded samples.
//!
//! ```text
//! for each channel   bins    (y - (1 + g) w(phase + shift) - c) / sd      g, c: gain and offset of the probe
//!                    gain    g / GAIN
//!                    mean    (mean y - mean w) / sd                        sd: accuracy of an oscilloscope
//! switch node        width, on level, off level
//! shift              / its sd, where the switch node holds it
//! ```
//! Gain, offset and shift are estimated within each residual (variable projection), so no fit knows of them.

use plant::{Carrier, Load, Parameters, Plant, Rectifier, Sensor, Waveform};

use super::fold::bin_mean;
use super::{Capture, GAIN, Origin};
use crate::drive::{Model, sensors};
use crate::exact::Exact;
use crate::record::CHANNELS;

/// Looks in a period of the plant: a ripple's parabola is off by 1e-5 of itself between them.
const LOOKS: usize = 200;
/// Shifts that are tried over the period where nothing holds it, and over what the switch node leaves.
const FREE: usize = 64;
const HELD: usize = 9;
/// The edge of a switch node takes some ten nanoseconds, and channels of an instrument differ by as much, s.
const SKEW: f64 = 10e-9;
/// Part of a period around each edge where a bin is not compared: ringing and what probes pick up.
pub(crate) const EDGE: f64 = 0.03;
/// On-time of a node whose edges slope, s: half levels are off by a tenth of an edge of 50 ns.
const SLOPE: f64 = 5e-9;
/// A model that is no plant explains nothing.
const NO_PLANT: f64 = 1e6;

/// What the plant shows in one period.
pub struct Shown {
    /// Instants from the switch-on, fractions of the period, ascending from 0.
    at: Vec<f64>,
    /// Values of each channel there.
    values: [Vec<f64>; CHANNELS],
    /// When the switch node rises after the command of the upper switch, fraction of the period.
    rise: f64,
    /// How long the node stays high, fraction of the period.
    on: f64,
    /// The current rests for a part of the period.
    discontinuous: bool,
}

/// What is driven: duty, load and what the source of this record is over the model's.
#[derive(Debug, Clone, Copy)]
pub struct Drive {
    /// Duty, 1.
    pub duty: f64,
    /// Load.
    pub load: Load,
    /// Source voltage over the model's.
    pub v_in_ratio: f64,
    /// The duty is that of the switch: no delay comes behind it.
    pub applied: bool,
    /// Duty that the gate's edges add.
    pub trim: f64,
}

/// The plant as an oscilloscope sees it: sensors of the controller have no part in it.
fn seen(plant: &Parameters, drive: &Drive) -> Parameters {
    let mut p = plant.clone();
    for sensor in sensors(&mut p) {
        *sensor = Sensor::default();
    }
    p.converter.v_in *= drive.v_in_ratio;
    p.source.ripple = 0.0;
    // where the on-interval lies in the period no steady state knows
    (p.pwm.carrier, p.pwm.sampling_phase) = (Carrier::Trailing, 0.0);
    if drive.applied {
        (p.pwm.duty_lsb, p.pwm.min_on_time) = (0.0, 0.0);
        (p.switch.dead_time, p.switch.turn_on_delay, p.switch.turn_off_delay) = (0.0, 0.0, 0.0);
        p.switch.node_capacitance = 0.0;
    } else {
        p.switch.turn_off_delay += drive.trim.max(0.0) * p.t_sw();
        p.switch.turn_on_delay += (-drive.trim).max(0.0) * p.t_sw();
    }
    p
}

/// One period of the model; nothing if the model is no plant.
pub fn shown(model: &Model, drive: &Drive) -> Option<Shown> {
    shown_by(&model.plant, drive)
}

fn shown_by(plant: &Parameters, drive: &Drive) -> Option<Shown> {
    let p = seen(plant, drive);
    let mut plant = Plant::new(&p).ok()?;
    plant.reset_at(drive.duty * p.converter.v_in, 0.0, &drive.load);
    let even = (0..LOOKS).map(|n| n as f64 / LOOKS as f64);
    // edges are corners: the line between two looks must not cut them
    let mut rough = plant.clone();
    let [on, off] = rough.waveform(drive.duty, &drive.load, &[]).edges;
    let mut looks: Vec<f64> = even.chain([on.rem_euclid(1.0), off.rem_euclid(1.0)]).collect();
    looks.sort_by(f64::total_cmp);
    let wave: Waveform = rough.waveform(drive.duty, &drive.load, &looks);
    let mut order: Vec<usize> = (0..looks.len()).collect();
    let at = |n: usize| (looks[n] - on + 1e-12).rem_euclid(1.0);
    order.sort_by(|a, b| at(*a).total_cmp(&at(*b)));
    let pick = |of: fn(&plant::Signals) -> f64| order.iter().map(|n| of(&wave.shown[*n])).collect::<Vec<f64>>();
    let values = [pick(|s| s.v_out), pick(|s| s.i_l), pick(|s| s.i_out), pick(|s| s.v_in)];
    values.iter().flatten().all(|v| v.is_finite()).then(|| Shown {
        at: order.iter().map(|n| at(*n)).collect(),
        values,
        rise: on,
        on: off - on,
        discontinuous: wave.discontinuous,
    })
}

/// From the command of the upper switch to the rise of the switch node, and from its end to the fall, s, by a plant.
#[must_use]
pub fn delays(plant: &Parameters, drive: &Drive) -> Option<[f64; 2]> {
    let shown = shown_by(plant, drive)?;
    Some([shown.rise, shown.rise + shown.on - drive.duty].map(|delay| delay * plant.t_sw()))
}

impl Shown {
    /// A channel at a phase from the switch-on.
    pub fn value(&self, channel: usize, phase: f64) -> f64 {
        let (at, values) = (&self.at, &self.values[channel]);
        let phase = phase.rem_euclid(1.0);
        let next = at.partition_point(|x| *x <= phase);
        let (a, b) = match next {
            0 => (at.len() - 1, 0),
            n if n == at.len() => (n - 1, 0),
            n => (n - 1, n),
        };
        let width = (at[b] - at[a]).rem_euclid(1.0);
        let share = if width > 0.0 {
            (phase - at[a]).rem_euclid(1.0) / width
        } else {
            0.0
        };
        values[a] + share * (values[b] - values[a])
    }

    /// Mean of a channel over the period.
    fn mean(&self, channel: usize) -> f64 {
        bin_mean(&self.at, &self.values[channel])
    }

    /// Mean of a channel from one phase to another.
    fn within(&self, channel: usize, from: f64, to: f64) -> f64 {
        const POINTS: usize = 9;
        let at = |n: usize| from + (to - from) * (n as f64 + 0.5) / POINTS as f64;
        (0..POINTS).map(|n| self.value(channel, at(n))).sum::<f64>() / POINTS as f64
    }
}

/// Gain and offset of a probe at one shift, and what they leave.
struct Wave {
    left: Vec<f64>,
    gain: f64,
    cost: f64,
}

/// The channels whose shape over the period is compared: a source and a load current have none that the model would know.
pub(crate) const SHAPED: [usize; 2] = [0, 1];

impl Capture {
    /// Whether a bin of the folds counts: edges of the switch are no part of the model.
    pub(crate) fn is_quiet(&self, phase: f64) -> bool {
        let Some(node) = self.node.as_ref().filter(|_| self.origin == Origin::Node) else {
            return true;
        };
        let off = node.pulse.width.time / self.period;
        [0.0, off].iter().all(|edge| {
            let apart = (phase - edge + 0.5).rem_euclid(1.0) - 0.5;
            // the ringing comes behind the edge
            !(-0.3 * EDGE..EDGE).contains(&apart)
        })
    }

    /// How many residuals a capture has.
    #[must_use]
    pub fn terms(&self) -> usize {
        let shaped = SHAPED.iter().filter(|n| self.folds[**n].is_some()).count();
        shaped * (self.bins.at.len() + 1) + CHANNELS + 4
    }

    /// The residuals of a channel's bins, as a range of those of the capture.
    #[must_use]
    pub fn bins_of(&self, channel: usize) -> Option<std::ops::Range<usize>> {
        let has = |n: &usize| self.folds[*n].is_some();
        let place = SHAPED.iter().filter(|n| has(n)).position(|n| *n == channel)?;
        let start = place * (self.bins.at.len() + 1);
        Some(start..start + self.bins.at.len())
    }

    /// Residuals that are single numbers, with what they are.
    #[must_use]
    pub fn scalars(&self) -> Vec<(usize, &'static str)> {
        let first = self.terms() - CHANNELS - 4;
        let gains = SHAPED.iter().filter_map(|n| {
            let what = ["the ripple of v_out", "the ripple of i_l"][*n];
            Some((self.bins_of(*n)?.end, what))
        });
        let names = [
            "the mean of v_out",
            "the mean of i_l",
            "the mean of i_out",
            "the mean of v_in",
            "the on-time of the switch node",
            "the level of the switch node while the switch is on",
            "the level of the switch node while the switch is off",
            "the instant of the ripple beside the switch node",
        ];
        let rest = names.into_iter().enumerate().map(|(n, name)| (first + n, name));
        gains.chain(rest).collect()
    }

    /// The values that count among the residuals: for the mean square.
    #[must_use]
    pub fn counted(&self) -> usize {
        let quiet = self.bins.at.iter().filter(|at| self.is_quiet(**at)).count();
        let empty = |fold: &super::Fold| fold.sd.iter().filter(|sd| sd.is_infinite()).count();
        let shaped = SHAPED.iter().filter_map(|n| self.folds[*n].as_ref());
        shaped.map(|fold| quiet.saturating_sub(empty(fold))).sum::<usize>()
            + (0..CHANNELS).filter(|n| self.mean(*n).is_some()).count()
            + self.node.as_ref().map_or(0, |node| 2 + usize::from(node.off.is_some()))
    }

    /// Numbers of a model that a capture may hold beside settled rows: three of each shape, one of each mean and level.
    #[must_use]
    pub fn freedom(&self) -> usize {
        let shaped = SHAPED.iter().filter(|n| self.folds[**n].is_some()).count();
        3 * shaped + self.node.as_ref().map_or(0, |node| 2 + usize::from(node.off.is_some()))
    }

    /// What the model leaves of the capture, over its standard deviations.
    #[must_use]
    pub fn residual(&self, model: &Model, drive: &Drive) -> Vec<f64> {
        let Some(shown) = shown(model, drive) else {
            return vec![NO_PLANT; self.terms()];
        };
        let (shift, sd) = self.shift(&shown);
        let mut out = Vec::with_capacity(self.terms());
        for n in SHAPED {
            if let Some(wave) = self.wave(&shown, n, shift) {
                out.extend(wave.left);
                out.push(wave.gain / GAIN);
            }
        }
        for n in 0..CHANNELS {
            out.push(
                self.mean(n)
                    .map_or(0.0, |level| (level.value - shown.mean(n)) / level.sd),
            );
        }
        out.extend(self.node_terms(model, drive, &shown));
        out.push(if sd > 0.0 { shift / sd } else { 0.0 });
        out
    }

    fn node_terms(&self, model: &Model, drive: &Drive, shown: &Shown) -> [f64; 3] {
        let Some(node) = &self.node else { return [0.0; 3] };
        let (switch, period) = (&model.plant.switch, model.plant.t_sw());
        let width = node.pulse.width;
        // the duty is the node's own: its width says nothing
        let on_time = match drive.applied {
            true => 0.0,
            false => (width.time / self.period - shown.on) * period / width.sd.hypotenuse(SLOPE),
        };
        let i_on = shown.within(1, 0.25 * shown.on, 0.75 * shown.on);
        let on = shown.within(3, 0.25 * shown.on, 0.75 * shown.on) - switch.r_ds_on * i_on;
        let rest = 1.0 - shown.on;
        let i_off = shown.within(1, shown.on + 0.25 * rest, shown.on + 0.75 * rest);
        let off = match model.plant.converter.rectifier {
            Rectifier::Diode => -switch.v_f - switch.r_d * i_off,
            Rectifier::Synchronous => -switch.r_ds_on_low * i_off,
        };
        let left = |level: super::Level, simulated: f64| (level.value - simulated) / level.sd;
        let off = node
            .off
            .filter(|_| !shown.discontinuous)
            .map_or(0.0, |level| left(level, off));
        [on_time, left(node.on, on), off]
    }

    /// How much later than assumed the model's period lies, fractions, and the standard deviation that holds it there (0: nothing).
    fn shift(&self, shown: &Shown) -> (f64, f64) {
        let sd = match (&self.node, self.origin) {
            (Some(node), Origin::Node) => node.pulse.on.sd.hypotenuse(SKEW).hypotenuse(0.3 * self.step) / self.period,
            _ => 0.0,
        };
        let cost = |shift: f64| {
            let waves = SHAPED.iter().filter_map(|n| self.wave(shown, *n, shift));
            let held = if sd > 0.0 { shift / sd } else { 0.0 };
            waves.map(|wave| wave.cost).sum::<f64>() + held * held
        };
        let (first, step, count) = match sd > 0.0 {
            true => (-4.0 * sd, sd, HELD),
            false => (0.0, 1.0 / FREE as f64, FREE),
        };
        let tried = (0..count).map(|n| first + n as f64 * step);
        let best = tried.map(|s| (cost(s), s)).min_by(|a, b| a.0.total_cmp(&b.0));
        let best = best.map_or(0.0, |(_, shift)| shift);
        (golden(cost, best - step, best + step), sd)
    }

    /// One channel at a shift; nothing if it was not measured.
    fn wave(&self, shown: &Shown, channel: usize, shift: f64) -> Option<Wave> {
        let fold = self.folds[channel].as_ref()?;
        let (mut sums, mut rows) = ([0.0; 6], Vec::with_capacity(self.bins.at.len()));
        for ((at, y), sd) in self.bins.at.iter().zip(&fold.value).zip(&fold.sd) {
            let w = if self.is_quiet(*at) && y.is_finite() {
                1.0 / (sd * sd)
            } else {
                0.0
            };
            let m = shown.value(channel, at - shift);
            rows.push((*y, m, w));
            for (sum, v) in sums.iter_mut().zip([1.0, m, *y, m * m, m * y, y * y]) {
                if w > 0.0 {
                    *sum += w * v;
                }
            }
        }
        let [n, sm, sy, smm, smy, _] = sums;
        let n = n.max(1e-300);
        let (m_mean, y_mean) = (sm / n, sy / n);
        let (mm, my) = (smm - n * m_mean * m_mean, smy - n * m_mean * y_mean);
        // (y - m) = g m + c, with g held at 0 by the accuracy of a probe
        let gain = (my - mm) / (mm + 1.0 / (GAIN * GAIN));
        let left: Vec<f64> = rows
            .iter()
            .map(|(y, m, w)| match *w > 0.0 {
                true => (y - y_mean - (1.0 + gain) * (m - m_mean)) * w.sqrt(),
                false => 0.0,
            })
            .collect();
        let cost = left.iter().map(|r| r * r).sum::<f64>() + (gain / GAIN).powi(2);
        Some(Wave { left, gain, cost })
    }

    /// What the model would show in each bin, with the probe's gain, shift and mean as they fit: for a picture.
    #[must_use]
    pub fn drawn(&self, model: &Model, drive: &Drive, channel: usize) -> Option<Vec<f64>> {
        let shown = shown(model, drive)?;
        let (shift, _) = self.shift(&shown);
        let mean = shown.mean(channel);
        Some(
            self.bins
                .at
                .iter()
                .map(|at| shown.value(channel, at - shift) - mean)
                .collect(),
        )
    }
}

/// The minimum between two places.
fn golden(cost: impl Fn(f64) -> f64, mut a: f64, mut b: f64) -> f64 {
    const RATIO: f64 = 0.618_033_988_749_894_9;
    let (mut c, mut d) = (b - RATIO * (b - a), a + RATIO * (b - a));
    let (mut at_c, mut at_d) = (cost(c), cost(d));
    // 1e-8 of the first distance: sensitivities are differences of two such minima
    for _ in 0..38 {
        if at_c < at_d {
            (b, d, at_d) = (d, c, at_c);
            c = b - RATIO * (b - a);
            at_c = cost(c);
        } else {
            (a, c, at_c) = (c, d, at_d);
            d = a + RATIO * (b - a);
            at_d = cost(d);
        }
    }
    0.5 * (a + b)
}
