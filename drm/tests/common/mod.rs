//! What several tests of tables need.
#![allow(dead_code, clippy::unwrap_used, clippy::panic)]

use std::convert::Infallible;
use std::path::Path;

use drm::acquire::Bench;
use drm::{Table, TableOptions};
use measured::Sheet;
use plant::{Faults, Load, Parameters, Plant, Signals};

/// A CSV text as a file called `table.csv`.
pub fn sheet(text: &str) -> Sheet {
    Sheet::parse(Path::new("table.csv"), text.into(), &Table::file_options()).unwrap()
}

/// A table that must be sound.
pub fn table(text: &str) -> Table {
    Table::read(&sheet(text), &TableOptions::default()).unwrap_or_else(|faults| panic!("{faults}"))
}

/// A converter of the `plant` crate.
#[derive(Debug, Clone)]
pub struct Simulated {
    plant: Plant,
}

impl Simulated {
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
