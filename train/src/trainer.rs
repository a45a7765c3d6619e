//! One training: the loop, what it says on its way, how it is judged.
//!
//! ```text
//! begin_episode ─► sense ─► act ─► plant ─► sense ─► replay ─► learn ─┬─► look, every so often ─► best, met
//!       ▲                    ▲                                        │
//!       └── episode over ────┴── next control period ─────────────────┘
//! ```
//!
//! Invariant: what decides how it goes on is in the trainer and its checkpoint. The clock is asked for `Progress` only.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant as Clock;

use plant::{Load, Sample};
use random::{Random, Xoshiro};
use toml_input::{Fault, Message};

use crate::contract::Contract;
use crate::episode::{Drawn, draw_change};
use crate::faults::Error;
pub use crate::judge::{Place, controller, quick_controller};
use crate::learner::{Learner, TargetUpdate, greedy};
use crate::network::Network;
pub(crate) use crate::progress::Sums;
pub use crate::progress::{Best, Ended, Look, Progress};
use crate::replay::ReplayBuffer;
use crate::settings::Settings;
use crate::trials::Told;
use crate::waiting::Waiting;
use closed_loop::Agent;
use closed_loop::environment::{Environment, LoadPath, Start};

/// Streams of a seed.
// a stream each: what one of them draws must not move the others
const WEIGHTS: u64 = 0;
const EXPLORATION: u64 = 1;
const REPLAY: u64 = 2;
const SCENARIO: u64 = 3;

/// A training in the middle of its work.
#[derive(Debug, Clone)]
pub struct Trainer<E> {
    pub(crate) settings: Settings,
    pub(crate) contract: Contract,
    pub(crate) seed: u64,
    pub(crate) nominal: E,
    pub(crate) environment: E,
    pub(crate) agent: Agent<f32>,
    pub(crate) learner: Learner,
    pub(crate) replay: ReplayBuffer,
    pub(crate) exploration: Xoshiro,
    pub(crate) sampling: Xoshiro,
    pub(crate) scenario: Xoshiro,
    pub(crate) step: u64,
    pub(crate) episode_step: u64,
    pub(crate) sample: Sample,
    pub(crate) load: Load,
    pub(crate) sums: Sums,
    pub(crate) curve: Vec<Look>,
    pub(crate) best: Option<Best>,
    pub(crate) met: bool,
    pub(crate) told: Told,
    pub(crate) waiting: Vec<Waiting>,
    before: Vec<f32>,
    scratch: [Vec<f32>; 2],
    /// When and at which control period this program began with it; not part of a checkpoint.
    started: Option<(Clock, u64)>,
}

impl<E: Environment> Trainer<E> {
    /// A training that has not begun.
    ///
    /// # Errors
    /// If contract, settings and plant do not fit together.
    pub fn new(settings: &Settings, contract: &Contract, environment: &E, seed: u64) -> Result<Self, Error> {
        check_fit(settings, contract, environment)?;
        let mut network = contract.network();
        network.initialise(&mut Xoshiro::stream(seed, WEIGHTS));
        let agent = Agent::<f32>::new(&contract.policy)?;
        let mut trainer = Self {
            replay: ReplayBuffer::new(network.inputs(), settings.learning.replay),
            learner: Learner::new(network, settings.learning.learner),
            settings: settings.clone(),
            contract: contract.clone(),
            seed,
            nominal: environment.clone(),
            environment: environment.clone(),
            agent,
            exploration: Xoshiro::stream(seed, EXPLORATION),
            sampling: Xoshiro::stream(seed, REPLAY),
            scenario: Xoshiro::stream(seed, SCENARIO),
            step: 0,
            episode_step: 0,
            sample: Sample::default(),
            load: Load::default(),
            sums: Sums::default(),
            curve: Vec::new(),
            best: None,
            met: false,
            told: Told::new(0),
            waiting: Vec::new(),
            before: Vec::new(),
            scratch: [Vec::new(), Vec::new()],
            started: None,
        };
        trainer.told = Told::new(trainer.trial_count());
        trainer.try_out_spread()?;
        trainer.begin_with_the_law()?;
        trainer.begin_episode()?;
        Ok(trainer)
    }

    /// A law that networks add to is the first candidate: what does no better than it is not kept, and does not end the training.
    fn begin_with_the_law(&mut self) -> Result<(), Error> {
        let mut told = self.told.clone();
        if let Some(law) = self.law(&mut told)? {
            self.told = told;
            self.best = Some(law);
        }
        Ok(())
    }

    /// A network that adds nothing to the law, judged on the selection scenarios; `None` without such a law.
    pub(crate) fn law(&self, told: &mut Told) -> Result<Option<Best>, Error> {
        let Some(network) = self.contract.adds_nothing() else {
            return Ok(None);
        };
        let mut judging = self.judging(&network)?;
        judging.advance(f64::INFINITY, usize::MAX, told)?;
        let score = judging.bound;
        drop(judging);
        Ok(Some(Best {
            step: 0,
            second: false,
            score,
            network,
        }))
    }

    /// Control periods so far.
    #[must_use]
    pub fn step_count(&self) -> u64 {
        self.step
    }

    /// Seed of the training.
    #[must_use]
    pub fn seed(&self) -> u64 {
        self.seed
    }

    /// The learning curve so far.
    #[must_use]
    pub fn curve(&self) -> &[Look] {
        &self.curve
    }

    /// The network that acts.
    #[must_use]
    pub fn network(&self) -> &Network {
        &self.learner.online
    }

    /// The policy that did best so far; nothing before the first look, unless there is a law to add to: then a network that adds
    /// nothing to it, after 0 control periods. Of a training that was interrupted a later one may have done better, which
    /// [`Trainer::finish`] finds out.
    #[must_use]
    pub fn best(&self) -> Option<&Best> {
        self.best.as_ref()
    }

    /// Trains until the specification is met, the budget is used or `stop` is raised; `progress` is called at every look.
    /// Where it stopped it can go on, also from a checkpoint, as if it had not stopped.
    ///
    /// # Errors
    /// If a drawn plant is not a converter.
    pub fn run(&mut self, stop: &AtomicBool, progress: impl FnMut(&Progress)) -> Result<Ended, Error> {
        self.run_until(self.settings.steps, stop, progress)
    }

    /// [`Trainer::run`] up to control period `last` only, where it counts as interrupted.
    ///
    /// # Errors
    /// As [`Trainer::run`].
    pub fn run_until(
        &mut self,
        last: u64,
        stop: &AtomicBool,
        mut progress: impl FnMut(&Progress),
    ) -> Result<Ended, Error> {
        let (started, first) = *self.started.get_or_insert_with(|| (Clock::now(), self.step));
        while self.step < self.settings.steps && !self.met {
            if stop.load(Ordering::Relaxed) || self.step >= last {
                return Ok(Ended::Interrupted);
            }
            self.control_period()?;
            // the end counts as well: a budget need not be a multiple, and a policy never judged cannot be kept
            if self.step.is_multiple_of(self.settings.selection.every) || self.step == self.settings.steps {
                self.look()?;
                let elapsed = started.elapsed().as_secs_f64();
                let left = (self.settings.steps - self.step) as f64 / (self.step - first).max(1) as f64;
                let look = self.curve.last().copied().unwrap_or_default();
                progress(&Progress {
                    seed: self.seed,
                    look,
                    best: self.best.as_ref().map_or(f64::INFINITY, |best| best.score.cost),
                    steps: self.settings.steps,
                    elapsed,
                    remaining: elapsed * left,
                });
            }
        }
        self.settle()?;
        Ok(if self.met { Ended::Met } else { Ended::Budget })
    }

    /// One control period: act, measure, remember, learn.
    fn control_period(&mut self) -> Result<(), Error> {
        let learning = &self.settings.learning;
        let epsilon = learning.epsilon(self.step);
        let action = if self.exploration.unit() < epsilon {
            self.exploration.below(self.learner.online.outputs())
        } else {
            self.learner
                .online
                .q_values(self.agent.observation(), &mut self.scratch);
            greedy(&self.scratch[0])
        };
        let action = action as u32;
        self.before.clear();
        self.before.extend_from_slice(self.agent.observation());
        let before = self.agent.previous_duty();
        let duty = self.agent.act(action);
        let path = self.load_path();
        self.sample = self.environment.step(duty, &path);
        if let Some(error) = self.environment.failure() {
            return Err(error);
        }
        self.load = path.end();
        self.agent.sense(&self.sample.measured)?;

        let reward = self.settings.reward.of(self.sample.v_out, duty - before);
        self.replay
            // never terminated: control has no end, an episode is only cut short, and what lies behind it has a value
            .push(&self.before, action, reward as f32, self.agent.observation(), false);
        self.step += 1;
        self.episode_step += 1;
        let error = (self.sample.v_out - self.settings.reward.v_ref).abs();
        self.sums.periods += 1;
        self.sums.reward += reward;
        self.sums.error += error;
        self.learn();
        let lost = error.is_nan() || error > self.settings.episode.max_error;
        if lost || self.episode_step >= self.settings.episode.steps {
            self.begin_episode()?;
        }
        Ok(())
    }

    fn learn(&mut self) {
        let learning = &self.settings.learning;
        if self.step < learning.warm_up {
            return;
        }
        let rate = learning.rate(self.step, self.settings.steps);
        for _ in 0..learning.updates_per_step {
            self.sums.loss += self.learner.update(&self.replay, rate, &mut self.sampling);
            self.sums.updates += 1;
        }
    }

    /// The load of the coming control period; it changes every so often.
    fn load_path(&mut self) -> LoadPath {
        let mut path = LoadPath::constant(self.load);
        let (loads, _) = self.settings.stage(self.step);
        let change = draw_change(&self.settings.episode, loads, self.episode_step, &mut self.scenario);
        path.change = change.map(|(at, power)| (at, Load::power(power)));
        path
    }

    /// A new converter, a new load, a new start; the episode before is cut short, not ended: its last transition says so.
    fn begin_episode(&mut self) -> Result<(), Error> {
        let (loads, share) = self.settings.stage(self.step);
        let nominal = |key: &str| self.nominal.parameter(key).unwrap_or_default();
        let drawn = Drawn::new(&self.settings, loads, share, &nominal, &mut self.scenario);
        self.load = Load::power(drawn.load);
        self.agent.reset();
        self.sample = self.environment.restart(&Start {
            v_out: drawn.v_out,
            i_l: drawn.i_l(&self.load, |v_out, i_out| self.nominal.holding_current(v_out, i_out)),
            load: self.load,
            seed: drawn.seed,
            varied: &drawn.varied,
        })?;
        self.episode_step = 0;
        self.agent.sense(&self.sample.measured)
    }

    /// Judges two candidates on the selection scenarios: the network that acts and, with a soft update, the target network,
    /// its running mean, in which the noise of single updates has averaged out. Keeps the best of all looks.
    fn look(&mut self) -> Result<(), Error> {
        let soft = matches!(self.settings.learning.learner.target_update, TargetUpdate::Soft { .. });
        let mut networks = vec![self.learner.online.clone()];
        networks.extend(soft.then(|| self.learner.target_network.clone()));
        let cost = self.consider(&networks)?;
        let per = |sum: f64, count: u64| sum / count.max(1) as f64;
        let sums = std::mem::take(&mut self.sums);
        self.curve.push(Look {
            step: self.step,
            reward: per(sums.reward, sums.periods),
            error: per(sums.error, sums.periods),
            loss: per(sums.loss, sums.updates),
            epsilon: self.settings.learning.epsilon(self.step),
            cost,
        });
        self.conclude()
    }
}

/// # Errors
/// If they have different control periods, or the plant has not what is to be varied.
pub(crate) fn check_fit<E: Environment>(
    settings: &Settings,
    contract: &Contract,
    environment: &E,
) -> Result<(), Error> {
    let (policy, plant) = (contract.policy.sample_period, environment.t_sample());
    // a decimal period and 1 / f_sw may differ by rounding
    if (policy / plant - 1.0).abs() > 1e-9 {
        let message = Message::new("contract and plant have different control periods").found(format!(
            "sample_period = {policy} s in the contract, {plant} s at the plant"
        ));
        return Err(message.hint("f_sw of the plant is 1 / sample_period").into());
    }
    let topology = "converter.topology";
    let randomised = settings
        .randomise
        .iter()
        .map(|varied| ("[[randomise]]", varied.key.as_str()));
    let spread = settings
        .spread
        .iter()
        .flat_map(|spread| spread.keys().map(|key| ("[[spread]]", key)));
    let others: Vec<(&str, &str)> = randomised.chain(spread).collect();
    if let Some((table, _)) = others.iter().find(|(_, key)| *key == topology) {
        let message = Message::new(format!("{table} has another `{topology}`")).found("another converter");
        return Err(Fault::in_file(&settings.file, message.expected("that of the plant")).into());
    }
    if let Some((table, key)) = others.iter().find(|(_, key)| *key == "converter.f_sw") {
        // the plant's period would no longer be that of the controller
        let message = Message::new(format!("{table} has another `{key}`")).found("another control period");
        return Err(Fault::in_file(&settings.file, message.expected("that of the contract")).into());
    }
    let unknown = others.iter().find(|(_, key)| environment.parameter(key).is_none());
    match unknown {
        None => Ok(()),
        Some((table, name)) => {
            let message = Message::new(format!("{table} names `{name}`, which is not a number of the plant"));
            let hint = "write it as in the plant's file, `table.key`: `switch.v_f`";
            let known = plant::parameters().map(|parameter| parameter.key);
            Err(Fault::in_file(&settings.file, message.hint(hint).did_you_mean(name, known)).into())
        }
    }
}
