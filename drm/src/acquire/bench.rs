//! What can be measured: a converter that is stepped from sampling instant to sampling instant.

use plant::{Load, Signals};

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
