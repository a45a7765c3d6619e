//! White noise of a sensor at the sampling instant, seeded by `sensors.seed`: [`Random::normal`] of one stream for all sensors.

use random::{Random, Xoshiro};
use serde::{Deserialize, Serialize};

use crate::entry::{Effect, Field, Parameter, Way, of_each_sensor};

/// Catalogue entry.
pub const EFFECT: Effect = Effect {
    name: "sensor_noise",
    meaning: "noise of a sensor",
    needs: Way::Batch,
    parameters: of_each_sensor!(
        noise,
        ("V", "A"),
        // a step of the quantisation below, up to two
        "standard deviation",
        (0.0, 1e5),
        (1e-3, 0.2),
        0.0,
        Parameter {
            key: "sensors.seed",
            unit: "1",
            meaning: "seed of the noise of all sensors",
            allowed: (0.0, u64::MAX as f64),
            typical: (0.0, 1e6),
            neutral: 0.0,
            switches_on: false,
            field: Field::Whole(|p| p.sensors.seed, |p, value| p.sensors.seed = value),
        }
    ),
};

/// Where the noise of all sensors stands in its stream: the words of a [`Xoshiro`], as a checkpoint stores them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub(crate) struct Noise([u64; 4]);

impl Noise {
    pub fn new(seed: u64) -> Self {
        Noise(Xoshiro::new(seed).state())
    }

    /// A number of mean 0 and variance 1.
    #[inline]
    pub fn normal(&mut self) -> f64 {
        let mut random = Xoshiro::from_state(self.0);
        let number = random.normal();
        self.0 = random.state();
        number
    }
}
