//! The same controllers on converters whose parts are others than those they were made for.
//!
//! ```text
//!  --spread KEY=LOW,HIGH[,N] ─► N (or N x M) converters ─┐
//!  --spread-draws N ──────────► N drawn converters ──────┤
//!  policy, law, classical controllers of the nominal one ┴─► worst of all load steps ─► tables, pictures, spread.csv
//! ```

mod figures;
mod range;
mod shown;

pub(super) use range::check;
pub use range::{Draws, Spread};
pub(super) use shown::Json;

use super::findings::Setting;
use super::runs::{Progress, knows, runs_of};
use crate::controller::{Controller, follow};
use crate::converter::Converter;
use crate::faults::Error;
use crate::scenario::{Metrics, Task};

/// Instants of a load step on each converter, the first of them a sampling instant.
// the worst of six phases lies within a sixth of a period of the worst of all
const INSTANTS: usize = 6;

/// What one converter showed.
#[derive(Debug, Clone, PartialEq)]
pub struct Cell {
    /// Its numbers, in the order of the keys.
    pub numbers: Vec<f64>,
    /// By controller: the worst of all load steps, figure by figure.
    pub worst: Vec<(String, Metrics)>,
}

/// All converters of a spread: those of a grid with the first key running fastest, or drawn ones.
#[derive(Debug, Clone, PartialEq)]
pub struct Spreads {
    /// One or two of a grid.
    pub of: Vec<Spread>,
    /// How they were drawn, if they were.
    pub draws: Option<Draws>,
    /// By converter.
    pub cells: Vec<Cell>,
}

/// Runs of controllers of these names on all converters.
pub(super) fn runs(setting: &Setting, names: &[&str]) -> usize {
    let converters = range::converters(&setting.spread, setting.draws).len();
    converters * runs_of(setting, names, task(setting).all_instants().len())
}

/// The task at a converter of the spread, of which there are many.
fn task(setting: &Setting) -> Task {
    Task {
        instants: INSTANTS,
        sampling_instants: 1,
        ..setting.scenario.task.clone()
    }
}

/// Runs all controllers on all converters; `progress` is told before each converter.
///
/// # Errors
/// If numbers make no converter, a controller fails, or who is told ends it.
pub(super) fn run(
    setting: &Setting,
    controllers: &mut [(&str, &mut Box<dyn Controller>)],
    progress: &mut Progress<'_, '_>,
) -> Result<Option<Spreads>, Error> {
    let of = &setting.spread;
    let converters = range::converters(of, setting.draws);
    if converters.is_empty() {
        return Ok(None);
    }
    let count = converters.len();
    let names: Vec<&str> = controllers.iter().map(|(name, _)| *name).collect();
    let runs_each = runs(setting, &names) / count;
    let mut cells = Vec::new();
    for (n, numbers) in converters.into_iter().enumerate() {
        let keys = of.iter().map(|spread| spread.key.as_str());
        let named: Vec<(&str, f64)> = keys.zip(numbers.clone()).collect();
        let text: Vec<String> = named
            .iter()
            .map(|(key, value)| format!("{key} = {value:.4e}"))
            .collect();
        progress.say(&format_args!("converter {} of {count}: {}", n + 1, text.join(", ")))?;
        cells.push(cell(setting, &setting.converter.with(&named)?, numbers, controllers)?);
        progress.ran(runs_each);
    }
    Ok(Some(Spreads {
        of: of.clone(),
        draws: setting.draws,
        cells,
    }))
}

fn cell(
    setting: &Setting,
    converter: &Converter,
    numbers: Vec<f64>,
    controllers: &mut [(&str, &mut Box<dyn Controller>)],
) -> Result<Cell, Error> {
    let task = task(setting);
    let mut worst = Vec::new();
    for (name, controller) in controllers {
        let mut metrics = Metrics::default();
        for step in setting.scenario.load_steps.iter().filter(|step| knows(name, **step)) {
            for instant in task.all_instants() {
                let trajectory = follow(converter, controller.as_mut(), setting.v_ref, &task, *step, instant)?;
                metrics = metrics.worst(trajectory.metrics);
            }
        }
        worst.push(((*name).to_owned(), metrics));
    }
    Ok(Cell { numbers, worst })
}

impl Spreads {
    pub(super) fn controllers(&self) -> impl Iterator<Item = &str> {
        let first = self.cells.first().map_or(&[][..], |cell| cell.worst.as_slice());
        first.iter().map(|(name, _)| name.as_str())
    }

    /// The figures of a controller, converter by converter.
    pub(super) fn of_controller<'a>(&'a self, name: &'a str) -> impl Iterator<Item = &'a Metrics> {
        let all = self.cells.iter().flat_map(|cell| &cell.worst);
        all.filter(move |(other, _)| other == name).map(|(_, metrics)| metrics)
    }
}
