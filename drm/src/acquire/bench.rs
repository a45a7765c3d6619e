//! What can be measured: a converter that is stepped from sampling instant to sampling instant.

use std::convert::Infallible;

use plant::{Faults, Load, Parameters, Plant, Signals};

/// A converter under test, simulated by whatever means.
pub trait Bench {
    /// Why it cannot go on.
    type Error;

    /// Puts the converter near `v_out` V under `load` and returns what the sensors show. Where that cannot be done it may
    /// start from rest; it then takes longer to settle.
    ///
    /// # Errors
    /// If the converter cannot be started.
    fn start(&mut self, v_out: f64, load: &Load) -> Result<Signals, Self::Error>;

    /// One control period with `duty` under `load`; what the sensors show at its end.
    ///
    /// # Errors
    /// If the converter cannot go on.
    fn step(&mut self, duty: f64, load: &Load) -> Result<Signals, Self::Error>;
}

/// A converter of the `plant` crate.
#[derive(Debug, Clone)]
pub struct Simulated {
    plant: Plant,
}

impl Simulated {
    /// A converter with these parameters.
    ///
    /// # Errors
    /// If they are not those of a converter.
    pub fn new(parameters: &Parameters) -> Result<Self, Faults> {
        Ok(Simulated {
            plant: Plant::new(parameters)?,
        })
    }
}

impl Bench for Simulated {
    type Error = Infallible;

    fn start(&mut self, v_out: f64, load: &Load) -> Result<Signals, Infallible> {
        let i_out = self.plant.reset_at(v_out, 0.0, load).i_out;
        Ok(self.plant.reset_at(v_out, i_out, load).measured)
    }

    fn step(&mut self, duty: f64, load: &Load) -> Result<Signals, Infallible> {
        Ok(self.plant.step(duty, load).measured)
    }
}
