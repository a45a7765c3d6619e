//! The plant as an environment: parameters by key, load changes anywhere in a period.

use plant::{Parameters, Plant, PlantState, Sample};
use sha2::{Digest, Sha256};
use toml_input::{FileName, Message};

use crate::environment::{Environment, LoadPath, Start, varied};
use crate::faults::Error;
use crate::read::no_number;

/// A load that changes at a sampling instant changes this much of a period before it, so that the sample shows it.
const JUST_BEFORE: f64 = 1e-9;

/// A converter of the `plant` crate.
#[derive(Debug, Clone)]
pub struct Converter {
    nominal: Parameters,
    plant: Plant,
}

impl Converter {
    /// A converter with these parameters, without voltage.
    ///
    /// # Errors
    /// If they are not those of a converter.
    pub fn new(parameters: &Parameters) -> Result<Self, Error> {
        Ok(Self {
            plant: Plant::new(parameters)?,
            nominal: parameters.clone(),
        })
    }

    /// The converter of a plant file, with some of its numbers replaced (`[set]` of a training file).
    ///
    /// # Errors
    /// If the file cannot be read, or is not a converter, or a key is not one of its numbers.
    pub fn load(file: impl Into<FileName>, set: &[(String, f64)]) -> Result<Self, Error> {
        let mut parameters = Parameters::from_file(file)?;
        for (key, value) in set {
            let missing = || no_number(key);
            let parameter = plant::parameter(key).ok_or_else(missing)?;
            parameter.set(&mut parameters, *value);
        }
        Self::new(&parameters)
    }

    /// What the plant is made of, without what an episode varies.
    #[must_use]
    pub fn parameters(&self) -> &Parameters {
        &self.nominal
    }
}

impl Environment for Converter {
    fn t_sample(&self) -> f64 {
        self.plant.t_sample()
    }

    fn parameter(&self, key: &str) -> Option<f64> {
        plant::parameter(key).map(|parameter| parameter.get(&self.nominal))
    }

    fn ideal_ripple(&self, v_out: f64) -> f64 {
        self.plant.parameters().ideal_ripple(v_out)
    }

    fn holding_current(&self, v_out: f64, i_out: f64) -> f64 {
        self.nominal.holding_current(v_out, i_out)
    }

    fn identity(&self) -> Vec<u8> {
        // `{:?}` writes every number so that it survives the round trip: different plants give different texts
        Sha256::digest(format!("{:?}", self.nominal)).to_vec()
    }

    fn restart(&mut self, start: &Start<'_>) -> Result<Sample, Error> {
        let mut parameters = varied(&self.nominal, start.varied);
        // a seed of 0, as scenarios have it, leaves the noise of the plant's file
        parameters.sensors.seed ^= start.seed;
        self.plant = Plant::new(&parameters)?;
        Ok(self.plant.reset_at(start.v_out, start.i_l, &start.load))
    }

    fn step(&mut self, duty: f64, load: &LoadPath) -> Sample {
        match load.change {
            None => self.plant.step(duty, &load.before),
            Some((at, after)) => {
                let at = at.min(1.0 - JUST_BEFORE);
                self.plant.step_with_change(duty, &load.before, &after, at)
            }
        }
    }

    fn set_source(&mut self, v_in: f64) -> Result<(), Error> {
        let mut parameters = self.plant.parameters().clone();
        parameters.converter.v_in = v_in;
        let state = *self.plant.state();
        self.plant = Plant::new(&parameters)?;
        self.plant.restore(&state);
        Ok(())
    }

    fn save(&self) -> Result<Vec<u8>, Error> {
        // the parameters too: an episode may have varied them
        let whole = (self.plant.parameters(), self.plant.state());
        serde_json::to_vec(&whole).map_err(|error| Message::new(format!("cannot write the plant down: {error}")).into())
    }

    fn load(&mut self, bytes: &[u8]) -> Result<(), Error> {
        let (parameters, state): (Parameters, PlantState) = serde_json::from_slice(bytes)
            .map_err(|error| Message::new("the plant in it is of another version").found(error.to_string()))?;
        self.plant = Plant::new(&parameters)?;
        self.plant.restore(&state);
        Ok(())
    }
}
