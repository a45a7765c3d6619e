//! The replay buffer: a ring of transitions, allocated once.

use random::{Random, Xoshiro};

/// Words of a transition beside its two observations: action, reward, terminated.
const EXTRA: usize = 3;

/// A ring of transitions; each is one stretch of memory (two observations, action, reward, terminated).
#[derive(Debug, Clone, PartialEq)]
pub struct ReplayBuffer {
    features: usize,
    capacity: usize,
    rows: Vec<f32>,
    /// Transition that the next one replaces once the ring is full.
    next: usize,
}

/// Transitions drawn from the buffer, by column; row-major where a row has several values.
#[derive(Debug, Clone, Default)]
pub struct Batch {
    /// `[size][features]`: what the agent saw.
    pub observations: Vec<f32>,
    /// `[size][features]`: what it saw one step later.
    pub next_observations: Vec<f32>,
    /// `[size]`
    pub actions: Vec<u32>,
    /// `[size]`
    pub rewards: Vec<f32>,
    /// `[size]`: 0 if the episode ended there for good (no value behind it), 1 otherwise, also where it was cut short.
    pub alive: Vec<f32>,
}

impl ReplayBuffer {
    /// Room for `capacity` transitions.
    #[must_use]
    pub fn new(features: usize, capacity: usize) -> Self {
        Self {
            features,
            capacity,
            rows: Vec::with_capacity(capacity * (2 * features + EXTRA)),
            next: 0,
        }
    }

    /// Number of transitions held.
    #[must_use]
    pub fn len(&self) -> usize {
        self.rows.len() / self.stride()
    }

    /// Whether nothing has been stored yet.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// All words and the place of the next transition, for a checkpoint.
    #[must_use]
    pub fn contents(&self) -> (&[f32], usize) {
        (&self.rows, self.next)
    }

    /// Puts back [`ReplayBuffer::contents`]; `false` and no change if they do not fit this buffer.
    pub fn restore(&mut self, rows: &[f32], next: usize) -> bool {
        let stride = self.stride();
        let count = rows.len() / stride;
        let fits = rows.len().is_multiple_of(stride) && count <= self.capacity && next < self.capacity.max(1);
        if fits {
            self.rows.clear();
            self.rows.extend_from_slice(rows);
            self.next = next;
        }
        fits
    }

    /// Whether every stored action is one of `actions`.
    #[must_use]
    pub fn holds_actions_below(&self, actions: usize) -> bool {
        let action = |row: &[f32]| row[2 * self.features];
        // in this form NaN is no action
        self.rows
            .chunks_exact(self.stride())
            .all(|row| action(row) >= 0.0 && action(row) < actions as f32)
    }

    /// Stores a transition, in the place of the oldest if the ring is full.
    pub fn push(&mut self, observation: &[f32], action: u32, reward: f32, next_observation: &[f32], terminated: bool) {
        // an index is exact in binary32 up to 2^24, far beyond any number of actions
        let tail = [action as f32, reward, if terminated { 0.0 } else { 1.0 }];
        if self.len() < self.capacity {
            self.rows.extend_from_slice(observation);
            self.rows.extend_from_slice(next_observation);
            self.rows.extend_from_slice(&tail);
        } else {
            let (f, stride) = (self.features, self.stride());
            let row = &mut self.rows[self.next * stride..(self.next + 1) * stride];
            row[..f].copy_from_slice(observation);
            row[f..2 * f].copy_from_slice(next_observation);
            row[2 * f..].copy_from_slice(&tail);
        }
        self.next = (self.next + 1) % self.capacity;
    }

    /// Draws `size` transitions with replacement; the buffer must not be empty.
    pub fn sample(&self, size: usize, rng: &mut Xoshiro, batch: &mut Batch) {
        batch.clear();
        let (count, f, stride) = (self.len(), self.features, self.stride());
        for _ in 0..size {
            let at = rng.below(count) * stride;
            let row = &self.rows[at..at + stride];
            batch.observations.extend_from_slice(&row[..f]);
            batch.next_observations.extend_from_slice(&row[f..2 * f]);
            batch.actions.push(row[2 * f] as u32);
            batch.rewards.push(row[2 * f + 1]);
            batch.alive.push(row[2 * f + 2]);
        }
    }

    fn stride(&self) -> usize {
        2 * self.features + EXTRA
    }
}

impl Batch {
    fn clear(&mut self) {
        self.observations.clear();
        self.next_observations.clear();
        self.actions.clear();
        self.rewards.clear();
        self.alive.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn filled(capacity: usize, pushes: usize) -> ReplayBuffer {
        let mut replay = ReplayBuffer::new(2, capacity);
        for n in 0..pushes {
            let x = n as f32;
            replay.push(&[x, -x], n as u32 % 7, x * 0.5, &[x + 1.0, -x - 1.0], n % 5 == 0);
        }
        replay
    }

    #[test]
    fn the_oldest_transition_is_replaced_first() {
        let replay = filled(4, 6);
        assert_eq!(replay.len(), 4);
        let first: Vec<f32> = replay.contents().0.chunks(7).map(|row| row[0]).collect();
        assert_eq!(first, [4.0, 5.0, 2.0, 3.0]);
    }

    #[test]
    fn a_sampled_transition_is_one_that_was_stored() {
        let replay = filled(50, 80);
        let mut batch = Batch::default();
        replay.sample(500, &mut Xoshiro::stream(3, 0), &mut batch);
        let mut seen = std::collections::BTreeSet::new();
        for n in 0..500 {
            let x = batch.observations[2 * n];
            seen.insert(x as usize);
            assert_eq!(batch.observations[2 * n + 1], -x);
            assert_eq!(batch.next_observations[2 * n..2 * n + 2], [x + 1.0, -x - 1.0]);
            assert_eq!(batch.actions[n], x as u32 % 7);
            assert_eq!(batch.rewards[n], x * 0.5);
            assert_eq!(batch.alive[n] == 0.0, (x as u32).is_multiple_of(5));
        }
        assert!(
            seen.iter().all(|n| (30..80).contains(n)) && seen.len() == 50,
            "{seen:?}"
        );
    }

    #[test]
    fn nothing_is_allocated_after_the_start() {
        let mut replay = ReplayBuffer::new(6, 100);
        let before = replay.rows.as_ptr();
        for _ in 0..250 {
            replay.push(&[0.0; 6], 0, 0.0, &[0.0; 6], false);
        }
        assert_eq!(replay.rows.as_ptr(), before);
    }

    #[test]
    fn contents_put_back_are_the_same_buffer() {
        let replay = filled(4, 6);
        let mut other = ReplayBuffer::new(2, 4);
        let (rows, next) = replay.contents();
        assert!(other.restore(rows, next));
        assert_eq!(other, replay);
        assert!(!other.restore(&rows[1..], next));
        assert!(!ReplayBuffer::new(2, 3).restore(rows, next));
    }

    #[test]
    fn an_action_that_the_network_does_not_have_is_seen() {
        let replay = filled(4, 3);
        assert!(replay.holds_actions_below(usize::MAX));
        let mut odd = filled(4, 3);
        for action in [7.0, -1.0, f32::NAN] {
            odd.rows[4] = action;
            assert!(!odd.holds_actions_below(5), "{action}");
        }
    }
}
