//! Any simulated converter as one that settled points are measured at.

use clap::ValueEnum;
use closed_loop::{Converter, Environment, Error, LoadPath, Start};
use drm::acquire::Bench;
use plant::{Load, Parameters, Signals};
use spice::SpiceConverter;

/// What simulates the converter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Simulator {
    /// The plant of this program
    Plant,
    /// ngspice's shared library: shares no code with the plant, 1 ms and more for each control period
    Ngspice,
}

/// An environment as a bench.
pub struct AtEnvironment<E>(pub E);

impl<E: Environment> Bench for AtEnvironment<E> {
    type Error = Error;

    fn start(&mut self, v_out: f64, load: &Load) -> Result<Signals, Error> {
        let start = Start {
            v_out,
            i_l: load.conductance * v_out + load.current + load.power / v_out,
            load: *load,
            seed: 0,
            varied: &[],
        };
        Ok(self.0.restart(&start)?.measured)
    }

    fn step(&mut self, duty: f64, load: &Load) -> Result<Signals, Error> {
        let sample = self.0.step(duty, &LoadPath::constant(*load));
        match sample.v_out.is_finite() {
            true => Ok(sample.measured),
            false => Err(Error::Mismatch("the simulation of the converter failed".to_owned())),
        }
    }
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
