//! A converter as an environment: the plant with parameters by key and load changes anywhere in a period, or one from outside.

use plant::{Parameters, Plant, PlantState, Sample};
use sha2::{Digest, Sha256};
use toml_input::{FileName, Message};

use crate::environment::{Environment, LoadPath, Start, varied};
use crate::faults::Error;
use crate::outside::{Open, Outside};
use crate::read::no_number;

/// A load that changes at a sampling instant changes this much of a period before it, so that the sample shows it.
const JUST_BEFORE: f64 = 1e-9;

/// A converter of the `plant` crate, or one from outside beside nominal numbers.
#[derive(Debug, Clone)]
pub struct Converter {
    nominal: Parameters,
    circuit: Circuit,
}

/// What computes it.
#[derive(Debug, Clone)]
enum Circuit {
    // boxed: a plant is far larger
    Plant(Box<Plant>),
    Outside(Box<dyn Outside>),
}

impl Converter {
    /// A converter with these parameters, without voltage.
    ///
    /// # Errors
    /// If they are not those of a converter.
    pub fn new(parameters: &Parameters) -> Result<Self, Error> {
        Ok(Self {
            circuit: Circuit::Plant(Box::new(Plant::new(parameters)?)),
            nominal: parameters.clone(),
        })
    }

    /// The converter of a plant file, with some of its numbers replaced (`[set]` of a training file).
    ///
    /// # Errors
    /// If the file cannot be read, or is not a converter, or a key is not one of its numbers; if it names one from outside.
    pub fn load(file: impl Into<FileName>, set: &[(String, f64)]) -> Result<Self, Error> {
        Self::set(Parameters::from_file(file)?, set)
    }

    /// [`Converter::load`], of which one from outside is opened by `open`.
    ///
    /// # Errors
    /// As [`Converter::load`], and those of `open`.
    pub fn open(file: impl Into<FileName>, set: &[(String, f64)], open: &Open<'_>) -> Result<Self, Error> {
        let file = file.into();
        let (parameters, is_outside) = Parameters::nominal_from_file(file.clone())?;
        if !is_outside {
            return Self::set(parameters, set);
        }
        let outside = open(&file, &parameters)?;
        Ok(Self {
            nominal: Self::set(parameters, set)?.nominal,
            circuit: Circuit::Outside(outside),
        })
    }

    fn set(mut parameters: Parameters, set: &[(String, f64)]) -> Result<Self, Error> {
        for (key, value) in set {
            let missing = || no_number(key);
            let parameter = plant::parameter(key).ok_or_else(missing)?;
            parameter.set(&mut parameters, *value);
        }
        Self::new(&parameters)
    }

    /// The same with other numbers, by key.
    ///
    /// # Errors
    /// If they are not those of a converter.
    pub fn with(&self, numbers: &[(&str, f64)]) -> Result<Self, Error> {
        let nominal = varied(&self.nominal, numbers);
        let plant = Self::new(&nominal)?;
        Ok(match &self.circuit {
            Circuit::Plant(_) => plant,
            Circuit::Outside(outside) => Self {
                nominal,
                circuit: Circuit::Outside(outside.copy()),
            },
        })
    }

    /// What the converter is made of, without what an episode varies; of one from outside the nominal numbers beside it.
    #[must_use]
    pub fn parameters(&self) -> &Parameters {
        &self.nominal
    }

    /// What computes it, if that is not the plant.
    #[must_use]
    pub fn outside(&self) -> Option<&dyn Outside> {
        match &self.circuit {
            Circuit::Plant(_) => None,
            Circuit::Outside(outside) => Some(outside.as_ref()),
        }
    }
}

impl Environment for Converter {
    fn t_sample(&self) -> f64 {
        self.nominal.t_sw()
    }

    fn parameter(&self, key: &str) -> Option<f64> {
        plant::parameter(key).map(|parameter| parameter.get(&self.nominal))
    }

    fn ideal_ripple(&self, v_out: f64) -> f64 {
        match &self.circuit {
            // with what an episode varies
            Circuit::Plant(plant) => plant.parameters().ideal_ripple(v_out),
            Circuit::Outside(_) => self.nominal.ideal_ripple(v_out),
        }
    }

    fn holding_current(&self, v_out: f64, i_out: f64) -> f64 {
        self.nominal.holding_current(v_out, i_out)
    }

    fn identity(&self) -> Vec<u8> {
        // `{:?}` writes every number so that it survives the round trip: different plants give different texts
        let own = Sha256::digest(format!("{:?}", self.nominal)).to_vec();
        match &self.circuit {
            Circuit::Plant(_) => own,
            Circuit::Outside(outside) => [own, outside.identity()].concat(),
        }
    }

    fn restart(&mut self, start: &Start<'_>) -> Result<Sample, Error> {
        let mut parameters = varied(&self.nominal, start.varied);
        // a seed of 0, as scenarios have it, leaves the noise of the plant's file
        parameters.sensors.seed ^= start.seed;
        match &mut self.circuit {
            Circuit::Plant(plant) => {
                **plant = Plant::new(&parameters)?;
                Ok(plant.reset_at(start.v_out, start.i_l, &start.load))
            }
            Circuit::Outside(outside) => outside.restart(&parameters, start),
        }
    }

    fn step(&mut self, duty: f64, load: &LoadPath) -> Sample {
        let plant = match &mut self.circuit {
            Circuit::Plant(plant) => plant,
            Circuit::Outside(outside) => return outside.step(duty, load),
        };
        match load.change {
            None => plant.step(duty, &load.before),
            Some((at, after)) => {
                let at = at.min(1.0 - JUST_BEFORE);
                plant.step_with_change(duty, &load.before, &after, at)
            }
        }
    }

    fn failure(&self) -> Option<Error> {
        self.outside().and_then(Outside::failure)
    }

    fn set_source(&mut self, v_in: f64) -> Result<(), Error> {
        let plant = match &mut self.circuit {
            Circuit::Plant(plant) => plant,
            Circuit::Outside(outside) => return outside.set_source(v_in),
        };
        let mut parameters = plant.parameters().clone();
        parameters.converter.v_in = v_in;
        let state = *plant.state();
        **plant = Plant::new(&parameters)?;
        plant.restore(&state);
        Ok(())
    }

    fn save(&self) -> Result<Vec<u8>, Error> {
        let plant = match &self.circuit {
            Circuit::Plant(plant) => plant,
            Circuit::Outside(outside) => return outside.save(),
        };
        // the parameters too: an episode may have varied them
        let whole = (plant.parameters(), plant.state());
        serde_json::to_vec(&whole).map_err(|error| Message::new(format!("cannot write the plant down: {error}")).into())
    }

    fn load(&mut self, bytes: &[u8]) -> Result<(), Error> {
        let plant = match &mut self.circuit {
            Circuit::Plant(plant) => plant,
            Circuit::Outside(outside) => return outside.load(bytes),
        };
        let (parameters, state): (Parameters, PlantState) = serde_json::from_slice(bytes)
            .map_err(|error| Message::new("the plant in it is of another version").found(error.to_string()))?;
        **plant = Plant::new(&parameters)?;
        plant.restore(&state);
        Ok(())
    }
}
