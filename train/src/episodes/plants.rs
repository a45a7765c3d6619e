//! The converters themselves: side by side where they are plain enough, one by one otherwise.

use closed_loop::{Converter, Environment, LoadPath, Start};
use plant::{Batch, Load, Parameters, Sample, Signals};

use crate::faults::Error;
use crate::settings::{Draw, Settings};

/// Converters.
#[derive(Debug, Clone)]
pub(super) enum Plants {
    /// In the lanes of the vector unit.
    Batch(Box<SideBySide>),
    /// Each by itself.
    Single(Vec<Converter>),
}

#[derive(Debug, Clone)]
pub(super) struct SideBySide {
    batch: Batch,
    loads: Vec<Load>,
    /// Whether a converter has other numbers than the plant's file.
    varied: Vec<bool>,
}

/// A load that changes at a sampling instant changes this much of a period before it: as [`Converter`] has it.
const JUST_BEFORE: f64 = 1e-9;

impl Plants {
    pub fn new(settings: &Settings, nominal: &Converter, count: usize) -> Result<Self, Error> {
        // one alone gains nothing, and its sample has the extremes within the period, too
        if count > 1 && fits(settings, nominal) {
            return Ok(Self::Batch(Box::new(SideBySide {
                batch: Batch::new(&vec![nominal.parameters().clone(); count])?,
                loads: vec![Load::default(); count],
                varied: vec![false; count],
            })));
        }
        Ok(Self::Single(vec![nominal.clone(); count]))
    }

    pub fn restart(&mut self, index: usize, nominal: &Converter, start: &Start<'_>) -> Result<Sample, Error> {
        match self {
            Self::Single(converters) => converters[index].restart(start),
            Self::Batch(many) => {
                // most trainings vary nothing, and the converter that stands there is the right one
                if many.varied[index] || !start.varied.is_empty() {
                    let parameters = closed_loop::environment::varied(nominal.parameters(), start.varied);
                    many.batch.replace(index, &parameters)?;
                    many.varied[index] = !start.varied.is_empty();
                }
                many.batch.reset_at(index, start.v_out, start.i_l);
                Ok(shown(many.batch.signals(index, &start.load)))
            }
        }
    }

    /// One control period of all; `take` is given each one's sample.
    pub fn step(&mut self, duties: &[f64], paths: &[LoadPath], take: &mut dyn FnMut(usize, Sample)) {
        let many = match self {
            Self::Single(converters) => {
                for (index, converter) in converters.iter_mut().enumerate() {
                    take(index, converter.step(duties[index], &paths[index]));
                }
                return;
            }
            Self::Batch(many) => many,
        };
        let batch = &mut many.batch;
        for (load, path) in many.loads.iter_mut().zip(paths) {
            *load = path.before;
        }
        // computed with the others and put back: changes are rare
        let changing = |(index, path): (usize, &LoadPath)| path.change.map(|change| (index, change));
        let changes: Vec<_> = paths
            .iter()
            .enumerate()
            .filter_map(changing)
            .map(|(index, change)| (index, change, batch.v_out()[index], batch.i_l()[index]))
            .collect();
        batch.step(duties, &many.loads);
        for (index, (at, after), v_out, i_l) in changes {
            batch.reset_at(index, v_out, i_l);
            batch.step_with_change(
                index,
                duties[index],
                [&paths[index].before, &after],
                at.min(1.0 - JUST_BEFORE),
            );
            many.loads[index] = after;
        }
        for (index, load) in many.loads.iter().enumerate() {
            take(index, shown(batch.signals(index, load)));
        }
    }
}

/// Whether every converter that can be drawn fits into a batch.
fn fits(settings: &Settings, nominal: &Converter) -> bool {
    let mut parameters = nominal.parameters().clone();
    // an effect is on where a number is off its neutral value, so the ends of what is drawn show it
    for parameter in &settings.randomise {
        let Some(number) = plant::parameter(&parameter.key) else {
            continue;
        };
        let drawn = match parameter.draw {
            Draw::Value([_, high]) => high,
            Draw::Factor([_, high]) => high * number.get(&parameters),
        };
        number.set(&mut parameters, drawn);
    }
    let fits = |parameters: &Parameters| Batch::new(std::slice::from_ref(parameters)).is_ok();
    fits(nominal.parameters()) && fits(&parameters)
}

/// A sample of sensors that show what is.
fn shown(signals: Signals) -> Sample {
    Sample {
        v_out: signals.v_out,
        i_l: signals.i_l,
        i_out: signals.i_out,
        v_in: signals.v_in,
        measured: signals,
        ..Sample::default()
    }
}
