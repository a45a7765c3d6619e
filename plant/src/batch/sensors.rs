//! The sensors of converters side by side: [`crate::sensing`] without delays and low-passes.

use crate::lane::{LANES, Lane, Mask, mask};
use crate::parameters::Sensor;
use crate::plain::Number;
use crate::plant::Plant;

/// The sensors of [`LANES`] converters.
#[derive(Debug, Clone)]
pub(super) struct Sensors {
    channels: [Channel; 4],
}

/// One quantity.
#[derive(Debug, Clone)]
struct Channel {
    /// Some sensor shows something else than what is true.
    is_ideal: bool,
    is_noisy: bool,
    gain: Lane,
    offset: Lane,
    lsb: Lane,
    /// Where there are steps.
    steps: Mask,
    has_steps: bool,
}

impl Channel {
    fn new(sensors: [&Sensor; LANES]) -> Self {
        let neutral = Sensor::default();
        let steps = mask(|n| sensors[n].lsb != 0.0);
        Channel {
            is_ideal: sensors.iter().all(|sensor| **sensor == neutral),
            is_noisy: sensors.iter().any(|sensor| sensor.noise > 0.0),
            gain: Lane::each(|n| sensors[n].gain),
            offset: Lane::each(|n| sensors[n].offset),
            // a quotient that is not taken, but no division by 0
            lsb: Lane::each(|n| if steps[n] == 1 { sensors[n].lsb } else { 1.0 }),
            has_steps: steps != [0; LANES],
            steps,
        }
    }
}

impl Sensors {
    /// Nothing where every sensor shows what is true.
    pub fn new(plants: &[Plant]) -> Option<Self> {
        let of = |at: usize| {
            Channel::new(std::array::from_fn(|n| {
                let all = &plants[n].parameters.sensors;
                [&all.v_out, &all.i_l, &all.i_out, &all.v_in][at]
            }))
        };
        let sensors = Sensors {
            channels: [0, 1, 2, 3].map(of),
        };
        let is_ideal = sensors.channels.iter().all(|channel| channel.is_ideal);
        (!is_ideal).then_some(sensors)
    }

    /// What they show of these signals. Noise is drawn by the `seen` lanes only.
    #[inline(always)]
    pub fn show(&self, plants: &mut [Plant], mut signals: [Lane; 4], seen: &Mask) -> [Lane; 4] {
        for (at, (channel, signal)) in self.channels.iter().zip(&mut signals).enumerate() {
            if channel.is_ideal {
                continue;
            }
            let mut value = channel.gain * *signal + channel.offset;
            if channel.is_noisy {
                for n in 0..LANES {
                    if seen[n] == 1 {
                        value.0[n] += plants[n].noise(at);
                    }
                }
            }
            if channel.has_steps {
                // `sensor_quantisation::round`
                let steps = value / channel.lsb + Lane::of(0.5);
                let rounded = Lane(steps.0.map(f64::floor)) * channel.lsb;
                value = rounded.or(&channel.steps, value);
            }
            *signal = value;
        }
        signals
    }
}

impl Plant {
    /// The next number of a sensor's noise; 0 and no draw of one without.
    #[inline]
    fn noise(&mut self, channel: usize) -> f64 {
        self.sensing.noise(&mut self.state.memory, channel)
    }
}
