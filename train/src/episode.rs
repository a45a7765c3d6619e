//! What is drawn for an episode: a converter, a load, a start, and the loads on its way.

use plant::Load;
use random::{Random, Xoshiro};

use crate::settings::{Draw, Episode, Loads, Settings};

/// The beginning of an episode.
#[derive(Debug, Clone)]
pub(crate) struct Drawn<'s> {
    /// In the unit of the load's kind.
    pub load: f64,
    /// Output voltage, V.
    pub v_out: f64,
    /// Inductor current beside the load's, A.
    pub beside: f64,
    /// Of the sensors' noise.
    pub seed: u64,
    /// Numbers of the plant that differ from its file, by key.
    pub varied: Vec<(&'s str, f64)>,
}

impl<'s> Drawn<'s> {
    /// Draws it. `share` of the randomisation is in force, 0..1; `nominal` gives a number of the plant's file.
    pub fn new(
        settings: &'s Settings,
        loads: &Loads,
        share: f64,
        nominal: &dyn Fn(&str) -> f64,
        rng: &mut Xoshiro,
    ) -> Self {
        let load = draw_load(loads, rng);
        let episode = &settings.episode;
        let v_out = rng.uniform(episode.initial_voltage[0], episode.initial_voltage[1]);
        let beside = rng.uniform(episode.initial_current[0], episode.initial_current[1]);
        let seed = rng.bits();
        let mut varied = Vec::new();
        for parameter in &settings.randomise {
            let nominal = nominal(&parameter.key);
            let drawn = match parameter.draw {
                Draw::Value([low, high]) => rng.uniform(low, high),
                Draw::Factor([low, high]) => nominal * rng.uniform(low, high),
            };
            // drawn whatever the share is: a stage of the curriculum does not shift what is drawn behind it
            varied.push((parameter.key.as_str(), nominal + share * (drawn - nominal)));
        }
        Self {
            load,
            v_out,
            beside,
            seed,
            varied,
        }
    }

    /// Inductor current at the start, A; `holding` is what holds a voltage at a load current, by V and A.
    pub fn i_l(&self, load: &Load, holding: impl Fn(f64, f64) -> f64) -> f64 {
        // a training may start at 0 V
        let drawn = load.conductance * self.v_out + load.current + load.power / self.v_out.max(1.0);
        (holding(self.v_out, drawn) + self.beside).max(0.0)
    }
}

/// The load's change in the coming control period, if it is time for one: where in the period, and to what.
pub(crate) fn draw_change(
    episode: &Episode,
    loads: &Loads,
    episode_step: u64,
    rng: &mut Xoshiro,
) -> Option<(f64, f64)> {
    if !(episode_step + 1).is_multiple_of(episode.load_every) {
        return None;
    }
    let load = draw_load(loads, rng);
    let at = if episode.any_phase {
        // above 0: at 0 the load would change at a sample that has been taken
        1.0 - rng.unit()
    } else {
        1.0
    };
    Some((at, load))
}

fn draw_load(loads: &Loads, rng: &mut Xoshiro) -> f64 {
    if !loads.values.is_empty() && rng.unit() < loads.share {
        loads.values[rng.below(loads.values.len())]
    } else {
        rng.uniform(loads.range[0], loads.range[1])
    }
}
