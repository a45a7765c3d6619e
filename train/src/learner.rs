//! DQN (Mnih et al., 2015; van Hasselt et al., 2016): from a batch of transitions to better parameters.

use random::Xoshiro;

use crate::network::{Activations, Backward, Network};
use crate::optimiser::{Adam, AdamSettings, clip};
use crate::replay::{Batch, ReplayBuffer};

/// How the target network follows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TargetUpdate {
    /// After each update: target += rate * (online - target).
    Soft {
        /// 0 < rate <= 1.
        rate: f64,
    },
    /// A copy every so many updates.
    Hard {
        /// At least 1.
        every: u64,
    },
}

/// Loss of the temporal difference, mean over the batch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Loss {
    /// x^2 / 2 up to |x| = 1, |x| - 1/2 beyond.
    Huber,
    /// x^2 / 2.
    Squared,
}

/// What the learner is told.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LearnerSettings {
    /// Transitions per update.
    pub batch: usize,
    /// Discount per control period, 0..1.
    pub discount: f64,
    /// Double DQN: the online network chooses the next action, the target network values it.
    pub double: bool,
    /// How the target network follows.
    pub target_update: TargetUpdate,
    /// Loss of the temporal difference.
    pub loss: Loss,
    /// Largest norm of the gradient.
    pub gradient_clip: Option<f64>,
    /// The optimiser's constants.
    pub adam: AdamSettings,
}

/// Online network, target network, optimiser.
#[derive(Debug, Clone)]
pub struct Learner {
    settings: LearnerSettings,
    /// The network that acts.
    pub online: Network,
    /// The network that values what comes next.
    pub target_network: Network,
    /// Its memory.
    pub adam: Adam,
    batch: Batch,
    buffers: Buffers,
}

#[derive(Debug, Clone)]
struct Buffers {
    now: Activations,
    next: Activations,
    /// Online network on the next observations, for double DQN only.
    choice: Option<Activations>,
    backward: Backward,
    slopes: Vec<f32>,
}

impl Learner {
    /// A learner whose target network is the given one as well.
    #[must_use]
    pub fn new(network: Network, settings: LearnerSettings) -> Self {
        let buffers = Buffers {
            now: network.activations(settings.batch),
            next: network.activations(settings.batch),
            choice: settings.double.then(|| network.activations(settings.batch)),
            backward: network.backward_buffers(settings.batch),
            slopes: vec![0.0; settings.batch],
        };
        Self {
            settings,
            adam: Adam::new(network.parameters.len(), settings.adam),
            target_network: network.clone(),
            online: network,
            batch: Batch::default(),
            buffers,
        }
    }

    /// One update from transitions drawn from `replay`, which must not be empty. Returns the loss.
    pub fn update(&mut self, replay: &ReplayBuffer, learning_rate: f64, rng: &mut Xoshiro) -> f64 {
        let mut batch = std::mem::take(&mut self.batch);
        replay.sample(self.settings.batch, rng, &mut batch);
        let loss = self.update_on(&batch, learning_rate);
        self.batch = batch;
        loss
    }

    /// One update from a batch of the configured size. Returns the loss.
    pub fn update_on(&mut self, batch: &Batch, learning_rate: f64) -> f64 {
        let loss = self.gradient(batch);
        if let Some(limit) = self.settings.gradient_clip {
            clip(&mut self.buffers.backward.gradient, limit);
        }
        self.adam.update(
            &mut self.online.parameters,
            &self.buffers.backward.gradient,
            learning_rate,
        );
        self.follow();
        loss
    }

    /// Loss of a batch; its gradient is left in [`Learner::last_gradient`].
    pub fn gradient(&mut self, batch: &Batch) -> f64 {
        let Buffers {
            now,
            next,
            choice,
            backward,
            slopes,
        } = &mut self.buffers;
        self.online.forward(&batch.observations, now);
        self.target_network.forward(&batch.next_observations, next);
        if let Some(choice) = choice {
            self.online.forward(&batch.next_observations, choice);
        }
        let outputs = self.online.outputs();
        let values = next.outputs().chunks_exact(outputs);
        let choosing = choice.as_ref().unwrap_or(next).outputs().chunks_exact(outputs);
        let predicted = now.outputs().chunks_exact(outputs);
        // the mean, not the sum: learning rate and clipping then mean the same for every size of batch
        let scale = 1.0 / batch.actions.len().max(1) as f32;
        let discount = self.settings.discount as f32;
        let mut loss = 0.0_f64;
        for (row, ((q, value), choosing)) in predicted.zip(values).zip(choosing).enumerate() {
            let expected = batch.rewards[row] + discount * batch.alive[row] * value[greedy(choosing)];
            let difference = q[batch.actions[row] as usize] - expected;
            let (part, slope) = match self.settings.loss {
                Loss::Huber if difference.abs() > 1.0 => (difference.abs() - 0.5, difference.signum()),
                Loss::Huber | Loss::Squared => (0.5 * difference * difference, difference),
            };
            loss += f64::from(part);
            slopes[row] = slope * scale;
        }
        self.online
            .backward(&batch.observations, now, &batch.actions, slopes, backward);
        loss * f64::from(scale)
    }

    /// Gradient that the last [`Learner::gradient`] left (after an update: clipped).
    #[must_use]
    pub fn last_gradient(&self) -> &[f32] {
        &self.buffers.backward.gradient
    }

    fn follow(&mut self) {
        let pairs = self.target_network.parameters.iter_mut().zip(&self.online.parameters);
        match self.settings.target_update {
            TargetUpdate::Soft { rate } => {
                let rate = rate as f32;
                pairs.for_each(|(target, &online)| *target += rate * (online - *target));
            }
            // the optimiser's count is part of a checkpoint, so a resumed training copies at the same updates
            TargetUpdate::Hard { every } if self.adam.steps.is_multiple_of(every.max(1)) => {
                pairs.for_each(|(target, &online)| *target = online);
            }
            TargetUpdate::Hard { .. } => {}
        }
    }
}

/// Index of the largest value, the lowest among equals (contract section 7).
#[must_use]
pub fn greedy(values: &[f32]) -> usize {
    // so that a NaN never wins, not even as the first
    let (mut best, mut index) = (-f32::MAX, 0);
    for (n, &value) in values.iter().enumerate() {
        if value > best {
            (best, index) = (value, n);
        }
    }
    index
}
