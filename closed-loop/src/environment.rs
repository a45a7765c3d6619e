//! What a training and a scenario ask of a simulated converter.

use plant::{Load, Parameters, Sample};
use toml_input::Message;

use crate::faults::Error;

/// The load over one control period.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadPath {
    /// At the start of the period.
    pub before: Load,
    /// Where in the period the load changes, above 0 up to 1, and what it is from there on. At 1 it changes at the
    /// sampling instant that ends the period, and the sample taken there shows it.
    pub change: Option<(f64, Load)>,
}

impl LoadPath {
    /// A load that does not change.
    #[must_use]
    pub fn constant(load: Load) -> Self {
        Self {
            before: load,
            change: None,
        }
    }

    /// The load at the end of the period.
    #[must_use]
    pub fn end(&self) -> Load {
        self.change.map_or(self.before, |(_, after)| after)
    }
}

/// Where a converter starts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Start<'a> {
    /// Output voltage, V.
    pub v_out: f64,
    /// Inductor current, A.
    pub i_l: f64,
    /// Load.
    pub load: Load,
    /// Seed of whatever is random in it.
    pub seed: u64,
    /// Parameters of the plant that differ from its file, by key.
    pub varied: &'a [(&'a str, f64)],
}

/// A converter under control, one control period at a time.
pub trait Environment: Clone + Send {
    /// Control period, s.
    fn t_sample(&self) -> f64;

    /// The plant file's value of a number, by key (`switch.v_f`); nothing if there is none.
    fn parameter(&self, key: &str) -> Option<f64>;

    /// Ripple of the inductor's current without losses at `v_out` V in continuous conduction, A peak to peak.
    fn ideal_ripple(&self, v_out: f64) -> f64;

    /// The inductor current that holds `v_out` V at a load of `i_out` A, A; the load's unless the output receives a part of it
    /// only.
    fn holding_current(&self, _v_out: f64, i_out: f64) -> f64 {
        i_out
    }

    /// Bytes that stand for the plant's file: equal plants, equal bytes.
    fn identity(&self) -> Vec<u8>;

    /// Starts anew; the sample is the one the controller acts on first.
    ///
    /// # Errors
    /// If the varied parameters are not those of a converter.
    fn restart(&mut self, start: &Start<'_>) -> Result<Sample, Error>;

    /// Applies a duty for one control period; the sample is taken at its end.
    fn step(&mut self, duty: f64, load: &LoadPath) -> Sample;

    /// Why the converter has failed since its start, where something else than a plant computes it. Its samples are no numbers then.
    fn failure(&self) -> Option<Error> {
        None
    }

    /// The source has this voltage from now on, V.
    ///
    /// # Errors
    /// If this kind of converter cannot change it while it runs.
    fn set_source(&mut self, _v_in: f64) -> Result<(), Error> {
        Err(Message::new("this converter's source cannot step while it runs").into())
    }

    /// Everything that changes from step to step, and the varied parameters.
    ///
    /// # Errors
    /// If it cannot be written down.
    fn save(&self) -> Result<Vec<u8>, Error>;

    /// Puts back what [`Environment::save`] gave.
    ///
    /// # Errors
    /// If it is not of this kind of plant.
    fn load(&mut self, bytes: &[u8]) -> Result<(), Error>;
}

/// A converter some of whose numbers are others than its file's, in each of its runs.
#[derive(Debug, Clone)]
pub struct Varied<E> {
    nominal: E,
    /// By key; behind them come those that a run varies itself.
    numbers: Vec<(String, f64)>,
}

impl<E: Environment> Varied<E> {
    /// `nominal` with these numbers, by key.
    #[must_use]
    pub fn new(nominal: &E, numbers: Vec<(String, f64)>) -> Self {
        Self {
            nominal: nominal.clone(),
            numbers,
        }
    }
}

impl<E: Environment> Environment for Varied<E> {
    fn t_sample(&self) -> f64 {
        self.nominal.t_sample()
    }

    fn parameter(&self, key: &str) -> Option<f64> {
        let own = self.numbers.iter().rev().find(|(name, _)| name == key);
        own.map_or_else(|| self.nominal.parameter(key), |(_, value)| Some(*value))
    }

    fn ideal_ripple(&self, v_out: f64) -> f64 {
        // of the run that is under way, which has these numbers
        self.nominal.ideal_ripple(v_out)
    }

    fn holding_current(&self, v_out: f64, i_out: f64) -> f64 {
        self.nominal.holding_current(v_out, i_out)
    }

    fn identity(&self) -> Vec<u8> {
        [self.nominal.identity(), format!("{:?}", self.numbers).into_bytes()].concat()
    }

    fn restart(&mut self, start: &Start<'_>) -> Result<Sample, Error> {
        let own = self.numbers.iter().map(|(key, value)| (key.as_str(), *value));
        let varied: Vec<(&str, f64)> = own.chain(start.varied.iter().copied()).collect();
        self.nominal.restart(&Start {
            varied: &varied,
            ..*start
        })
    }

    fn step(&mut self, duty: f64, load: &LoadPath) -> Sample {
        self.nominal.step(duty, load)
    }

    fn failure(&self) -> Option<Error> {
        self.nominal.failure()
    }

    fn set_source(&mut self, v_in: f64) -> Result<(), Error> {
        self.nominal.set_source(v_in)
    }

    fn save(&self) -> Result<Vec<u8>, Error> {
        self.nominal.save()
    }

    fn load(&mut self, bytes: &[u8]) -> Result<(), Error> {
        self.nominal.load(bytes)
    }
}

/// `nominal` with some of its numbers replaced, by key; keys that are none of its numbers change nothing.
#[must_use]
pub fn varied(nominal: &Parameters, varied: &[(&str, f64)]) -> Parameters {
    let mut parameters = nominal.clone();
    for (key, value) in varied {
        if let Some(parameter) = plant::parameter(key) {
            parameter.set(&mut parameters, *value);
        }
    }
    parameters
}
