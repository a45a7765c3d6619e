//! Any simulated converter as one that settled points are measured at.

use clap::ValueEnum;
use closed_loop::refit::AtEnvironment;
use closed_loop::{Converter, Error};
use drm::acquire::Bench;
use plant::Parameters;
use spice::SpiceConverter;

/// What simulates the converter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Simulator {
    /// The plant of this program
    Plant,
    /// ngspice's shared library: shares no code with the plant, 1 ms and more for each control period
    Ngspice,
}

impl Simulator {
    /// A converter of these parameters, as a bench.
    ///
    /// # Errors
    /// If the simulator cannot simulate it.
    pub fn bench(self, parameters: &Parameters) -> Result<Box<dyn Bench<Error = Error>>, Error> {
        Ok(match self {
            Simulator::Plant => Box::new(AtEnvironment(Converter::new(parameters)?)),
            Simulator::Ngspice => Box::new(AtEnvironment(SpiceConverter::new(parameters)?)),
        })
    }
}
