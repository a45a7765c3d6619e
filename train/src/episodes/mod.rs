//! Many episodes side by side, for a trainer outside of this program: converters, the contract's controller in front of each,
//! loads, rewards, and the next episode where one has ended.
//!
//! ```text
//! actions ─► Agent::act ─► duties ─┐                       ┌─► rewards, ends
//!                                  ├─► Plants::step ─► samples
//! load profile or draws ─► loads ──┘                       └─► Agent::sense ─► observations
//! ```
//!
//! Invariant: converter `n` of many, seeded with `s`, lives the life of a single one seeded with `s`, to the bit.

mod plants;

use closed_loop::{Agent, Converter, Environment, LoadKind, LoadPath};
use plant::{Load, Sample};
use random::Xoshiro;
use toml_input::Message;

use crate::contract::Contract;
use crate::episode::{Drawn, draw_change};
use crate::faults::Error;
use crate::settings::Settings;
use crate::trainer::check_fit;
use plants::Plants;

/// What a trainer chose for each converter.
#[derive(Debug, Clone, Copy)]
pub enum Actions<'a> {
    /// Indices into the contract's actions.
    Index(&'a [i64]),
    /// Duties before the mapping, 0..1, for a contract that commands a number.
    Duty(&'a [f32]),
}

/// What a control period gave each converter.
#[derive(Debug)]
pub struct Given<'a> {
    /// `[count][features]`: what the network would see next.
    pub observations: &'a mut [f32],
    /// `[count]`
    pub rewards: &'a mut [f64],
    /// `[count]`: the episode was cut short, because its time is over or the voltage was lost.
    pub truncated: &'a mut [bool],
}

/// A start in the place of a drawn one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Begin {
    /// Output voltage, V.
    pub v_out: f64,
    /// Inductor current, A; that of the load unless given.
    pub i_l: Option<f64>,
    /// Load in the unit of its kind; drawn or of the profile unless given.
    pub load: Option<f64>,
    /// Seed of the sensors' noise; 0 is that of the plant's file.
    pub noise: u64,
}

/// One converter of them.
#[derive(Debug, Clone)]
struct Life {
    agent: Agent<f32>,
    rng: Xoshiro,
    /// Control periods of this episode.
    step: u64,
    load: Load,
    sample: Sample,
}

/// Converters in the middle of their episodes.
#[derive(Debug, Clone)]
pub struct Episodes {
    settings: Settings,
    kind: LoadKind,
    /// Loads by control period of an episode, ascending; none: drawn.
    profile: Vec<(u64, f64)>,
    nominal: Converter,
    plants: Plants,
    lives: Vec<Life>,
    duties: Vec<f64>,
    paths: Vec<LoadPath>,
    features: usize,
}

impl Episodes {
    /// `count` converters before their first episode; converter `n` is seeded with `n`.
    ///
    /// # Errors
    /// If settings, contract and plant do not fit together, or a profile does not begin with the episode.
    pub fn new(
        settings: &Settings,
        contract: &Contract,
        nominal: &Converter,
        count: usize,
        (kind, profile): (LoadKind, Vec<(u64, f64)>),
    ) -> Result<Self, Error> {
        check_fit(settings, contract, nominal)?;
        let ascending = profile.windows(2).all(|pair| pair[0].0 < pair[1].0);
        if !ascending || profile.first().is_some_and(|first| first.0 != 0) {
            let message = Message::new("the load profile is not one")
                .found(format!("{profile:?}"))
                .expected("pairs of control period and load, the first at period 0, periods ascending");
            return Err(message.into());
        }
        let agent = Agent::<f32>::new(&contract.policy)?;
        let life = |seed: usize| Life {
            agent: agent.clone(),
            rng: Xoshiro::new(seed as u64),
            step: 0,
            load: Load::default(),
            sample: Sample::default(),
        };
        let mut episodes = Self {
            kind,
            profile,
            plants: Plants::new(settings, nominal, count)?,
            settings: settings.clone(),
            nominal: nominal.clone(),
            lives: (0..count).map(life).collect(),
            duties: vec![0.0; count],
            paths: vec![LoadPath::constant(Load::default()); count],
            features: contract.policy.features.len(),
        };
        for index in 0..count {
            episodes.begin(index, None)?;
        }
        Ok(episodes)
    }

    /// Number of converters.
    #[must_use]
    pub fn count(&self) -> usize {
        self.lives.len()
    }

    /// Features of an observation.
    #[must_use]
    pub fn features(&self) -> usize {
        self.features
    }

    /// Whether the converters are computed side by side.
    #[must_use]
    pub fn is_batch(&self) -> bool {
        matches!(self.plants, Plants::Batch(_))
    }

    /// Seeds everything that is random of one converter.
    pub fn seed(&mut self, index: usize, seed: u64) {
        self.lives[index].rng = Xoshiro::new(seed);
    }

    /// Begins an episode of one converter: drawn, or as `begin` says, without randomisation then.
    ///
    /// # Errors
    /// If a drawn plant is not a converter.
    pub fn begin(&mut self, index: usize, begin: Option<&Begin>) -> Result<(), Error> {
        let life = &mut self.lives[index];
        let nominal = |key: &str| closed_loop::Environment::parameter(&self.nominal, key).unwrap_or_default();
        let mut drawn = Drawn::new(
            &self.settings,
            &self.settings.episode.loads,
            1.0,
            &nominal,
            &mut life.rng,
        );
        if let Some((_, first)) = self.profile.first() {
            drawn.load = *first;
        }
        drawn.load = begin.and_then(|begin| begin.load).unwrap_or(drawn.load);
        life.load = self.kind.load(drawn.load);
        if let Some(begin) = begin {
            (drawn.v_out, drawn.beside, drawn.seed) = (begin.v_out, 0.0, begin.noise);
            drawn.varied.clear();
        }
        let i_l = begin
            .and_then(|begin| begin.i_l)
            .unwrap_or_else(|| drawn.i_l(&life.load, |v_out, i_out| self.nominal.holding_current(v_out, i_out)));
        let start = closed_loop::Start {
            v_out: drawn.v_out,
            i_l,
            load: life.load,
            seed: drawn.seed,
            varied: &drawn.varied,
        };
        life.sample = self.plants.restart(index, &self.nominal, &start)?;
        life.step = 0;
        life.agent.reset();
        life.agent.sense(&life.sample.measured)
    }

    /// One control period of every converter for which `over` is false; those for which it is true begin an episode in its
    /// place, whatever their action, with reward 0. There are as many of each as converters.
    ///
    /// # Errors
    /// If a drawn plant is not a converter; if a slice has another length.
    pub fn step(&mut self, actions: Actions<'_>, over: &[bool], given: Given<'_>) -> Result<(), Error> {
        self.check_lengths(actions, over, &given)?;
        for (index, life) in self.lives.iter_mut().enumerate() {
            self.paths[index] = life.path(&self.settings, self.kind, &self.profile);
            given.rewards[index] = 0.0;
            if over[index] {
                continue;
            }
            let before = life.agent.previous_duty();
            self.duties[index] = match actions {
                // beyond the last action counts as the last, and so does one below the first
                Actions::Index(indices) => life.agent.act(u32::try_from(indices[index]).unwrap_or(u32::MAX)),
                Actions::Duty(duties) => life.agent.give(duties[index]),
            };
            // what the reward wants to know of it, before the state has gone on
            given.rewards[index] = self.duties[index] - before;
        }
        let lives = &mut self.lives;
        self.plants.step(&self.duties, &self.paths, &mut |index, sample| {
            lives[index].sample = sample
        });
        for (index, is_over) in over.iter().enumerate() {
            given.truncated[index] = false;
            if *is_over {
                self.begin(index, None)?;
            } else {
                let life = &mut self.lives[index];
                life.load = self.paths[index].end();
                life.step += 1;
                life.agent.sense(&life.sample.measured)?;
                let reward = &self.settings.reward;
                given.rewards[index] = reward.of(life.sample.v_out, given.rewards[index]);
                let error = (life.sample.v_out - reward.v_ref).abs();
                let episode = &self.settings.episode;
                let lost = error.is_nan() || error > episode.max_error;
                given.truncated[index] = lost || life.step >= episode.steps;
            }
            let room = &mut given.observations[index * self.features..][..self.features];
            room.copy_from_slice(self.lives[index].agent.observation());
        }
        Ok(())
    }

    fn check_lengths(&self, actions: Actions<'_>, over: &[bool], given: &Given<'_>) -> Result<(), Error> {
        let count = self.count();
        let chosen = match actions {
            Actions::Index(indices) => indices.len(),
            Actions::Duty(duties) => duties.len(),
        };
        let lengths = [chosen, over.len(), given.rewards.len(), given.truncated.len()];
        if lengths == [count; 4] && given.observations.len() == count * self.features {
            return Ok(());
        }
        let message = Message::new("an array is not as long as there are converters");
        let message = message.found(format!("{lengths:?} and {}", given.observations.len()));
        Err(message
            .expected(format!("{count}, and observations of {}", self.features))
            .into())
    }

    /// What the network of one converter would see.
    #[must_use]
    pub fn observation(&self, index: usize) -> &[f32] {
        self.lives[index].agent.observation()
    }

    /// True and measured signals of one converter at the latest sampling instant. Of converters side by side the extremes within
    /// the period are not computed and stand at 0.
    #[must_use]
    pub fn sample(&self, index: usize) -> &Sample {
        &self.lives[index].sample
    }

    /// The load of one converter, in the unit of its kind.
    #[must_use]
    pub fn load(&self, index: usize) -> f64 {
        self.kind.value(&self.lives[index].load)
    }

    /// The duty that last left the controller of one converter, 0..1, and its status bits; none of them is set before the
    /// first control period of an episode.
    #[must_use]
    pub fn command(&self, index: usize) -> (f64, u32) {
        let life = &self.lives[index];
        // the trace still holds the command of the episode before
        let status = if life.step == 0 { 0 } else { life.agent.command().status };
        (life.agent.previous_duty(), status)
    }

    /// Control periods of one converter's episode so far.
    #[must_use]
    pub fn periods(&self, index: usize) -> u64 {
        self.lives[index].step
    }
}

impl Life {
    /// The load of the coming control period.
    fn path(&mut self, settings: &Settings, kind: LoadKind, profile: &[(u64, f64)]) -> LoadPath {
        let mut path = LoadPath::constant(self.load);
        let change = if profile.is_empty() {
            draw_change(&settings.episode, &settings.episode.loads, self.step, &mut self.rng)
        } else {
            // at the sampling instant that ends this period the next one begins
            let due = profile.iter().find(|(period, _)| *period == self.step + 1);
            due.map(|(_, load)| (1.0, *load))
        };
        path.change = change.map(|(at, load)| (at, kind.load(load)));
        path
    }
}
