//! From the true signals to what the sensors show: delay and low-pass, gain and offset, noise, quantisation.

use serde::{Deserialize, Serialize};

use crate::effects::sensor_noise::Noise;
use crate::effects::sensor_quantisation;
use crate::parameters::{Parameters, Sensor};
use crate::signals::Signals;

const CHANNELS: usize = 4;
/// Longest delay of a sensor, periods.
pub(crate) const LONGEST: usize = 8;

/// The constants of the sensors.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Sensing {
    sensors: [Sensor; CHANNELS],
    /// Every sensor shows what is true.
    pub ideal: bool,
    /// Some sensor shows what was true earlier.
    pub looks_back: bool,
    /// When a delayed sensor looks, s from the step's start, and for how many steps it keeps the value.
    captures: [Option<(f64, usize)>; CHANNELS],
}

/// What delayed sensors remember, and the noise.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Memory {
    history: [[f64; LONGEST]; CHANNELS],
    noise: Noise,
}

impl Memory {
    pub fn new(seed: u64, shown: [f64; CHANNELS]) -> Self {
        Memory {
            history: shown.map(|value| [value; LONGEST]),
            noise: Noise::new(seed),
        }
    }

    /// Forgets what was seen, but goes on with the same stream of noise.
    pub fn refill(&mut self, shown: [f64; CHANNELS]) {
        self.history = shown.map(|value| [value; LONGEST]);
    }
}

impl Sensing {
    pub fn new(p: &Parameters) -> Self {
        let all = &p.sensors;
        let sensors = [&all.v_out, &all.i_l, &all.i_out, &all.v_in].map(Sensor::clone);
        let t_sw = p.t_sw();
        let captures = sensors.clone().map(|sensor| {
            (sensor.delay > 0.0).then(|| {
                let whole = (sensor.delay / t_sw).floor();
                let part = sensor.delay - whole * t_sw;
                // `check` keeps the delay below `LONGEST` periods; the bounds only take away rounding
                ((t_sw - part).max(0.0), (whole as usize).min(LONGEST - 1))
            })
        });
        let neutral = Sensor::default();
        Sensing {
            ideal: sensors.iter().all(|sensor| *sensor == neutral),
            looks_back: sensors.iter().any(|s| s.delay > 0.0),
            sensors,
            captures,
        }
    }

    /// The first instant after `s` at which a delayed sensor looks, or `limit`.
    pub fn next_capture(&self, s: f64, limit: f64) -> f64 {
        let later = self.captures.iter().flatten().map(|&(at, _)| at).filter(|&at| at > s);
        later.fold(limit, f64::min)
    }

    /// Lets the sensors that look between `from` (excluded) and `to` do so.
    pub fn capture(&self, memory: &mut Memory, from: f64, to: f64, true_signals: &Signals, filtered: [f64; CHANNELS]) {
        let now = self.unfiltered_or(true_signals, filtered);
        for (n, capture) in self.captures.iter().enumerate() {
            if let Some((at, _)) = capture
                && *at > from
                && *at <= to
            {
                memory.history[n].copy_within(0..LONGEST - 1, 1);
                memory.history[n][0] = now[n];
            }
        }
    }

    fn unfiltered_or(&self, signals: &Signals, filtered: [f64; CHANNELS]) -> [f64; CHANNELS] {
        let mut now = array(signals);
        for (n, sensor) in self.sensors.iter().enumerate() {
            if sensor.low_pass > 0.0 {
                now[n] = filtered[n];
            }
        }
        now
    }

    /// The next number of a sensor's noise.
    #[inline]
    pub fn noise(&self, memory: &mut Memory, channel: usize) -> f64 {
        let noise = self.sensors[channel].noise;
        // a sensor without noise draws nothing, so that it does not move the noise of the others
        if noise > 0.0 {
            noise * memory.noise.normal()
        } else {
            0.0
        }
    }

    /// What the sensors show at the sampling instant.
    pub fn show(&self, memory: &mut Memory, true_signals: &Signals, filtered: [f64; CHANNELS]) -> Signals {
        if self.ideal {
            return *true_signals;
        }
        let mut now = self.unfiltered_or(true_signals, filtered);
        for (n, sensor) in self.sensors.iter().enumerate() {
            if let Some((_, kept)) = self.captures[n] {
                now[n] = memory.history[n][kept];
            }
            let mut value = sensor.gain * now[n] + sensor.offset;
            if sensor.noise > 0.0 {
                value += self.noise(memory, n);
            }
            now[n] = sensor_quantisation::round(value, sensor.lsb);
        }
        let [v_out, i_l, i_out, v_in] = now;
        Signals {
            v_out,
            i_l,
            i_out,
            v_in,
        }
    }
}

pub(crate) fn array(signals: &Signals) -> [f64; CHANNELS] {
    [signals.v_out, signals.i_l, signals.i_out, signals.v_in]
}
