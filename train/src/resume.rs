//! A training to bytes and back: everything that decides how it goes on.

use interp::{Coefficients, State};
use plant::{Load, Sample, Signals};
use random::Xoshiro;
use sha2::{Digest, Sha256};

use crate::checkpoint::{Reader, Writer, other};
use crate::faults::Error;
use crate::network::Network;
use crate::score::Score;
use crate::trainer::{Best, Look, Sums, Trainer};
use crate::trials::Told;
use crate::waiting::Waiting;
use closed_loop::environment::Environment;

impl<E: Environment> Trainer<E> {
    /// The whole training: networks, optimiser, replay, random numbers, plant, filters, curve, best policy, what the
    /// trials told.
    ///
    /// # Errors
    /// If the plant's state cannot be written down.
    pub fn checkpoint(&self) -> Result<Vec<u8>, Error> {
        let mut to = Writer::new();
        to.bytes(&self.identity());
        to.words(&[self.seed, self.step, self.episode_step, u64::from(self.met)]);
        for rng in [&self.exploration, &self.sampling, &self.scenario] {
            to.words(&rng.state());
        }
        to.floats(&self.learner.online.parameters);
        to.floats(&self.learner.target_network.parameters);
        to.u64(self.learner.adam.steps);
        to.floats(&self.learner.adam.mean);
        to.floats(&self.learner.adam.square);
        let (rows, next) = self.replay.contents();
        to.floats(rows);
        to.u64(next as u64);
        to.bytes(&self.environment.save()?);
        let Signals {
            v_out,
            i_l,
            i_out,
            v_in,
        } = self.sample.measured;
        to.numbers(&[self.sample.v_out, v_out, i_l, i_out, v_in]);
        to.numbers(&[self.load.conductance, self.load.current, self.load.power]);
        write_state(&mut to, self.agent.state());
        let Sums {
            periods,
            updates,
            reward,
            error,
            loss,
        } = self.sums;
        to.words(&[periods, updates]);
        to.numbers(&[reward, error, loss]);
        to.u64(self.curve.len() as u64);
        for look in &self.curve {
            to.u64(look.step);
            to.numbers(&[look.reward, look.error, look.loss, look.epsilon, look.cost]);
        }
        to.u64(u64::from(self.best.is_some()));
        if let Some(best) = &self.best {
            to.words(&[best.step, u64::from(best.second), u64::from(best.score.met)]);
            to.f64(best.score.cost);
            to.floats(&best.network.parameters);
        }
        to.u64(self.told.0.len() as u64);
        to.numbers(&self.told.0);
        to.u64(self.waiting.len() as u64);
        for one in &self.waiting {
            to.words(&[one.step, u64::from(one.second)]);
            to.numbers(&[one.bound, one.beside]);
            to.floats(&one.network.parameters);
        }
        Ok(to.finish())
    }

    /// Puts this training where a checkpoint of the same files left it; the seed is the checkpoint's.
    ///
    /// # Errors
    /// If the bytes are damaged, of another version or of another training. The training must not be used then.
    pub fn resume(&mut self, bytes: &[u8]) -> Result<(), Error> {
        let mut from = Reader::new(bytes)?;
        if from.bytes()? != self.identity() {
            return Err(other());
        }
        (self.seed, self.step, self.episode_step) = (from.u64()?, from.u64()?, from.u64()?);
        self.met = from.u64()? != 0;
        for rng in [&mut self.exploration, &mut self.sampling, &mut self.scenario] {
            *rng = Xoshiro::from_state([from.u64()?, from.u64()?, from.u64()?, from.u64()?]);
        }
        from.floats_into(&mut self.learner.online.parameters)?;
        from.floats_into(&mut self.learner.target_network.parameters)?;
        self.learner.adam.steps = from.u64()?;
        from.floats_into(&mut self.learner.adam.mean)?;
        from.floats_into(&mut self.learner.adam.square)?;
        let rows = from.floats()?;
        // an action is an index into the outputs of the network
        let fits =
            self.replay.restore(&rows, from.count()?) && self.replay.holds_actions_below(self.learner.online.outputs());
        if !fits {
            return Err(other());
        }
        self.environment.load(from.bytes()?)?;
        self.sample = Sample {
            v_out: from.f64()?,
            measured: Signals {
                v_out: from.f64()?,
                i_l: from.f64()?,
                i_out: from.f64()?,
                v_in: from.f64()?,
            },
            // the rest of a sample is not read before the next one comes
            ..Sample::default()
        };
        self.load = Load {
            conductance: from.f64()?,
            current: from.f64()?,
            power: from.f64()?,
        };
        let state = read_state(&mut from)?;
        if !self.agent.restore(&state) {
            return Err(other());
        }
        // the observation is a function of state and sample: it comes back by looking again
        self.agent.sense(&self.sample.measured)?;
        self.read_course(&mut from)?;
        from.finish()
    }

    fn read_course(&mut self, from: &mut Reader<'_>) -> Result<(), Error> {
        self.sums = Sums {
            periods: from.u64()?,
            updates: from.u64()?,
            reward: from.f64()?,
            error: from.f64()?,
            loss: from.f64()?,
        };
        self.curve.clear();
        for _ in 0..from.count()? {
            self.curve.push(Look {
                step: from.u64()?,
                reward: from.f64()?,
                error: from.f64()?,
                loss: from.f64()?,
                epsilon: from.f64()?,
                cost: from.f64()?,
            });
        }
        self.best = None;
        if from.u64()? != 0 {
            let (step, second) = (from.u64()?, from.u64()? != 0);
            let met = from.u64()? != 0;
            let score = Score { met, cost: from.f64()? };
            self.best = Some(Best {
                step,
                second,
                score,
                network: self.read_network(from)?,
            });
        }
        let count = from.count()?;
        // before so many are read: the trials are those of the training file
        if count != self.trial_count() {
            return Err(other());
        }
        self.told = Told((0..count).map(|_| from.f64()).collect::<Result<_, _>>()?);
        self.waiting.clear();
        for _ in 0..from.count()? {
            self.waiting.push(Waiting {
                step: from.u64()?,
                second: from.u64()? != 0,
                bound: from.f64()?,
                beside: from.f64()?,
                network: self.read_network(from)?,
            });
        }
        Ok(())
    }

    fn read_network(&self, from: &mut Reader<'_>) -> Result<Network, Error> {
        // for its shape
        let mut network = self.learner.online.clone();
        from.floats_into(&mut network.parameters)?;
        Ok(network)
    }

    /// Digest of training file, contract and plant.
    fn identity(&self) -> [u8; 32] {
        let mut digest = Sha256::new();
        // not the seed: a checkpoint says which it is of
        digest.update(self.settings.digest.as_bytes());
        digest.update(self.contract.digest());
        digest.update(self.nominal.identity());
        digest.finalize().into()
    }
}

fn write_state(to: &mut Writer, state: &State<f32>) {
    to.floats(&state.held);
    to.floats(&state.memory);
    to.floats(&[state.previous_duty, state.previous_command]);
    to.floats(state.soft_cap.as_slice());
    let coefficients = state
        .mapping
        .map(|Coefficients { a, b, c, r }| [Some(a), Some(b), Some(c), r]);
    let coefficients: Vec<f32> = coefficients.into_iter().flatten().flatten().collect();
    to.floats(&coefficients);
    to.u64(u64::from(state.bad_count));
    to.u64(u64::from(state.primed));
}

fn read_state(from: &mut Reader<'_>) -> Result<State<f32>, Error> {
    let (held, memory) = (from.floats()?, from.floats()?);
    let mut duties = [0.0; 2];
    from.floats_into(&mut duties)?;
    let soft_cap = from.floats()?.first().copied();
    let mapping = match *from.floats()?.as_slice() {
        [a, b, c] => Some(Coefficients { a, b, c, r: None }),
        [a, b, c, r] => Some(Coefficients { a, b, c, r: Some(r) }),
        _ => None,
    };
    Ok(State {
        held,
        memory,
        previous_duty: duties[0],
        previous_command: duties[1],
        soft_cap,
        mapping,
        mapping_check: mapping.map(|own| own.check_word()),
        // a training has one duty
        others: Vec::new(),
        bad_count: u32::try_from(from.u64()?).map_err(|_| other())?,
        primed: u32::try_from(from.u64()?).map_err(|_| other())?,
    })
}
