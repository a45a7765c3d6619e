//! From the nodes to numbers in a table: each channel has a probe, a filter, a delay and a converter of its own.

use std::f64::consts::PI;

use crate::independent::circuit::Nodes;
use crate::independent::simulate::Trace;
use crate::rng::Rng;

/// Measured signals, in the order of every table here.
pub const CHANNELS: [&str; 6] = ["v_out", "i_l", "i_out", "v_in", "v_sw", "i_in"];
pub const V_OUT: usize = 0;
pub const I_L: usize = 1;
pub const I_OUT: usize = 2;
pub const V_IN: usize = 3;
pub const V_SW: usize = 4;

/// One channel.
#[derive(Debug, Clone, PartialEq)]
pub struct Channel {
    pub recorded: bool,
    pub gain: f64,
    pub offset: f64,
    /// Time constant of its low-pass, s.
    pub low_pass: f64,
    /// Age of what it shows, s.
    pub delay: f64,
    pub noise: f64,
    pub lsb: f64,
    /// What no plant file states.
    pub odd: OddChannel,
}

/// Errors of a channel that no plant file states.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct OddChannel {
    /// Error at the reference value, growing with the cube of the signal.
    pub cubic: f64,
    /// Drift of the offset over a record.
    pub drift: f64,
    /// Amplitude, frequency and phase (turns) of what is picked up.
    pub pickup: (f64, f64, f64),
    /// Share of a step that creeps in slowly, and its time constant: a memory.
    pub creep: (f64, f64),
    /// The value at which `cubic` holds.
    pub reference: f64,
    /// Share of the span that a worn potentiometer or a sticky meter does not follow.
    pub backlash: f64,
}

impl Channel {
    pub fn ideal(noise: f64) -> Self {
        Self {
            recorded: true,
            gain: 1.0,
            offset: 0.0,
            low_pass: 0.0,
            delay: 0.0,
            noise,
            lsb: 0.0,
            odd: OddChannel::default(),
        }
    }

    /// Noise and rounding together, root mean square.
    pub fn floor(&self) -> f64 {
        (self.noise * self.noise + self.lsb * self.lsb / 12.0).sqrt()
    }
}

/// All channels, and the instant at which they sample.
#[derive(Debug, Clone, PartialEq)]
pub struct Instruments {
    pub channels: [Channel; 6],
    /// Share of the period at which a row is stamped.
    pub phase: f64,
    /// How much later than stamped it is taken, s.
    pub late: f64,
}

/// Picks a channel of the nodes.
pub fn pick(nodes: &Nodes, channel: usize) -> f64 {
    match channel {
        V_OUT => nodes.v_out,
        I_L => nodes.i_l,
        I_OUT => nodes.i_out,
        V_IN => nodes.v_in,
        V_SW => nodes.v_sw,
        _ => nodes.i_in,
    }
}

/// What a channel shows at `times` without noise and rounding.
pub fn shown(channel: &Channel, index: usize, trace: &Trace, times: &[f64], late: f64) -> Vec<f64> {
    let truth: Vec<f64> = trace.nodes.iter().map(|nodes| pick(nodes, index)).collect();
    let filtered = low_pass(&trace.t, truth, channel.low_pass);
    let mut at = 0;
    let span = times.last().copied().unwrap_or(1.0) - times.first().copied().unwrap_or(0.0);
    let mut values: Vec<f64> = times
        .iter()
        .map(|time| interpolate(&trace.t, &filtered, time + late - channel.delay, &mut at))
        .collect();
    let odd = &channel.odd;
    if odd.creep.0 != 0.0 {
        creep(times, &mut values, odd.creep);
    }
    if odd.backlash > 0.0 {
        stick(&mut values, odd.backlash);
    }
    for (value, time) in values.iter_mut().zip(times) {
        let share = (time - times[0]) / span.max(1e-12);
        if odd.cubic != 0.0 {
            *value += odd.cubic * (*value / odd.reference).powi(3);
        }
        if odd.pickup.0 != 0.0 {
            *value += odd.pickup.0 * libm::sin(2.0 * PI * (odd.pickup.1 * time + odd.pickup.2));
        }
        // settles like a warming reference
        *value += odd.drift * (1.0 - libm::exp(-3.0 * share));
        *value = channel.gain * *value + channel.offset;
    }
    values
}

/// Mean over whole periods that start at `starts`, as a meter shows it.
pub fn mean(channel: &Channel, index: usize, trace: &Trace, from: f64, to: f64) -> f64 {
    let mut sum = 0.0;
    for n in 1..trace.t.len() {
        let (a, b) = (trace.t[n - 1].max(from), trace.t[n].min(to));
        if b > a {
            sum += 0.5 * (b - a) * (pick(&trace.nodes[n - 1], index) + pick(&trace.nodes[n], index));
        }
    }
    let mut value = sum / (to - from);
    if channel.odd.cubic != 0.0 {
        value += channel.odd.cubic * (value / channel.odd.reference).powi(3);
    }
    channel.gain * value + channel.offset
}

/// Adds noise and rounds as the converter does.
pub fn digitise(channel: &Channel, values: &mut [f64], random: &mut Rng) {
    for value in values {
        *value += channel.noise * random.normal();
        if channel.lsb > 0.0 {
            *value = libm::round(*value / channel.lsb) * channel.lsb;
        }
    }
}

/// A first-order filter over uneven points; between two of them the signal is taken as straight.
fn low_pass(t: &[f64], mut x: Vec<f64>, tau: f64) -> Vec<f64> {
    if tau <= 0.0 || x.is_empty() {
        return x;
    }
    let mut y = x[0];
    let mut before = x[0];
    for n in 1..x.len() {
        let h = t[n] - t[n - 1];
        if h > 0.0 {
            let slope = (x[n] - before) / h;
            let lag = before - slope * tau;
            y = lag + slope * h + (y - lag) * libm::exp(-h / tau);
        }
        before = x[n];
        x[n] = y;
    }
    x
}

/// The value just before `time`; `at` remembers the place between calls of rising times.
fn interpolate(t: &[f64], x: &[f64], time: f64, at: &mut usize) -> f64 {
    let last = t.len() - 1;
    // the instants of a trace are sums of steps, and those of rows and edges are not: an ulp decided on which side of an edge a row lay
    let time = time - 1e-11 * t[last].abs();
    if time <= t[0] {
        return x[0];
    }
    if t[(*at).min(last)] >= time {
        *at = t.partition_point(|other| *other < time).saturating_sub(1);
    }
    while *at < last && t[*at + 1] < time {
        *at += 1;
    }
    if *at >= last {
        return x[last];
    }
    let (a, b) = (t[*at], t[*at + 1]);
    if b <= a {
        return x[*at];
    }
    x[*at] + (x[*at + 1] - x[*at]) * (time - a) / (b - a)
}

fn creep(times: &[f64], values: &mut [f64], (share, tau): (f64, f64)) {
    let mut slow = values.first().copied().unwrap_or(0.0);
    for n in 0..values.len() {
        let h = if n > 0 { times[n] - times[n - 1] } else { 0.0 };
        slow += (values[n] - slow) * (1.0 - libm::exp(-h / tau));
        values[n] += share * (slow - values[n]);
    }
}

/// Play: the shown value moves only once the true one has left a band around it.
fn stick(values: &mut [f64], share: f64) {
    let (low, high) = values
        .iter()
        .fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(*v), h.max(*v)));
    let half = 0.5 * share * (high - low);
    let mut shown = values.first().copied().unwrap_or(0.0);
    for value in values {
        shown = shown.clamp(*value - half, *value + half);
        *value = shown;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_through_the_low_pass_is_an_exponential() {
        let t: Vec<f64> = (0..=100).map(|n| f64::from(n) * 0.05).collect();
        let x: Vec<f64> = t.iter().map(|t| if *t > 0.0 { 1.0 } else { 0.0 }).collect();
        let y = low_pass(&t, x, 1.0);
        // the first interval is a ramp: as a step half an interval later
        assert!((y[100] - (1.0 - libm::exp(-(5.0 - 0.025)))).abs() < 1e-4, "{}", y[100]);
        assert!((y[20] - (1.0 - libm::exp(-(1.0 - 0.025)))).abs() < 1e-4, "{}", y[20]);
    }

    #[test]
    fn rows_are_read_just_before_an_edge() {
        let (t, x) = ([0.0, 1.0, 1.0, 2.0], [0.0, 1.0, 5.0, 6.0]);
        let mut at = 0;
        assert!((interpolate(&t, &x, 1.0, &mut at) - 1.0).abs() < 1e-9);
        assert!((interpolate(&t, &x, 1.5, &mut at) - 5.5).abs() < 1e-9);
        // a sum of steps that ends an ulp short of the edge
        let (t, mut at) = ([0.0, 1.0_f64.next_down(), 1.0, 2.0], 0);
        assert!((interpolate(&t, &x, 1.0, &mut at) - 1.0).abs() < 1e-9);
    }
}
