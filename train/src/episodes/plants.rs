//! The converters themselves: side by side where they are plain enough, one by one otherwise.

use closed_loop::{Converter, Environment, LoadPath, Start};
use plant::{Batch, Load, Parameters, Sample};

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
    /// Converter, fraction of the period and load behind it.
    changes: Vec<(usize, f64, Load)>,
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
                changes: Vec::new(),
                varied: vec![false; count],
            })));
        }
        Ok(Self::Single(vec![nominal.clone(); count]))
    }

    pub fn restart(&mut self, index: usize, nominal: &Converter, start: &Start<'_>) -> Result<Sample, Error> {
        match self {
            Self::Single(converters) => converters[index].restart(start),
            Self::Batch(many) => {
                let mut parameters = closed_loop::environment::varied(nominal.parameters(), start.varied);
                parameters.sensors.seed ^= start.seed;
                // most trainings vary nothing, and the converter that stands there is the right one; not if its noise begins anew
                if many.varied[index] || !start.varied.is_empty() || is_noisy(&parameters) {
                    many.batch.replace(index, &parameters)?;
                    many.varied[index] = !start.varied.is_empty();
                }
                many.batch.reset_at(index, start.v_out, start.i_l, &start.load);
                Ok(shown(&many.batch, index, &start.load))
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
        many.changes.clear();
        for (index, path) in paths.iter().enumerate() {
            if let Some((at, after)) = path.change {
                many.changes.push((index, at.min(1.0 - JUST_BEFORE), after));
            }
        }
        batch.step_with_changes(duties, &many.loads, &many.changes);
        for (index, _, after) in &many.changes {
            many.loads[*index] = *after;
        }
        for (index, load) in many.loads.iter().enumerate() {
            take(index, shown(batch, index, load));
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

fn is_noisy(parameters: &Parameters) -> bool {
    let all = &parameters.sensors;
    [&all.v_out, &all.i_l, &all.i_out, &all.v_in]
        .iter()
        .any(|sensor| sensor.noise > 0.0)
}

/// A sample without extremes.
fn shown(batch: &Batch, index: usize, load: &Load) -> Sample {
    let signals = batch.signals(index, load);
    Sample {
        v_out: signals.v_out,
        i_l: signals.i_l,
        i_out: signals.i_out,
        v_in: signals.v_in,
        measured: batch.measured(index, load),
        ..Sample::default()
    }
}
