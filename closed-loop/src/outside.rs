//! A converter that this program does not compute.

use std::fmt::Debug;

use plant::{Parameters, Sample};
use toml_input::FileName;

use crate::environment::{LoadPath, Start};
use crate::faults::Error;

/// A circuit that something else computes, in the place of a plant's; [`crate::Converter`] holds one beside nominal numbers.
///
/// Equal starts and equal duties give equal samples. A copy goes on from the same state.
pub trait Outside: Debug + Send + Sync {
    /// A copy in the same state.
    fn copy(&self) -> Box<dyn Outside>;

    /// What it is, for a note: `converter.fmu`.
    fn name(&self) -> String;

    /// Bytes that stand for it: equal converters, equal bytes.
    fn identity(&self) -> Vec<u8>;

    /// Whether one runs at a time only, however many copies there are.
    fn is_only_one(&self) -> bool;

    /// What the user should know of how it is run, one sentence each.
    fn notes(&self) -> Vec<String>;

    /// Starts anew, with the numbers of the plant's file but for those that a run varies; the sample is the one the controller acts
    /// on first.
    ///
    /// # Errors
    /// If it is not told of a number that is another than its file's, or a load that it cannot draw, or it does not start.
    fn restart(&mut self, parameters: &Parameters, start: &Start<'_>) -> Result<Sample, Error>;

    /// Applies a duty for one control period. Where it fails the sample is not a number, and [`Outside::failure`] says why.
    fn step(&mut self, duty: f64, load: &LoadPath) -> Sample;

    /// Why it has failed since the start, if it has.
    fn failure(&self) -> Option<Error>;

    /// As [`crate::Environment::set_source`].
    ///
    /// # Errors
    /// If its source cannot step.
    fn set_source(&mut self, v_in: f64) -> Result<(), Error>;

    /// As [`crate::Environment::save`].
    ///
    /// # Errors
    /// If it cannot be written down.
    fn save(&self) -> Result<Vec<u8>, Error>;

    /// As [`crate::Environment::load`].
    ///
    /// # Errors
    /// If it is not of this converter.
    fn load(&mut self, bytes: &[u8]) -> Result<(), Error>;
}

impl Clone for Box<dyn Outside> {
    fn clone(&self) -> Self {
        self.copy()
    }
}

/// Opens the converter that a plant's file names beside its numbers, which are given.
pub type Open<'a> = dyn Fn(&FileName, &Parameters) -> Result<Box<dyn Outside>, Error> + 'a;
