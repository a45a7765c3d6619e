//! Moves of a controller with the expected answers, as the words the kit reads.

use crate::crc::crc32_words;

/// First word of a move; the kit's C program reads the same numbers.
mod kind {
    pub const STEP: u32 = 0;
    pub const SET_MAPPING: u32 = 1;
    /// Added once for each output before the one whose mapping is set.
    pub const OUTPUT: u32 = 16;
    pub const RESET: u32 = 2;
    pub const INIT: u32 = 3;
    pub const DAMAGE: u32 = 4;
    pub const STEP_WITHOUT_NUMBERS: u32 = 5;
    pub const NETWORK: u32 = 6;
}

/// Moves and answers, one after the other.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Trace {
    words: Vec<u32>,
    events: u32,
    steps: u32,
}

impl Trace {
    /// All words.
    #[must_use]
    pub fn words(&self) -> &[u32] {
        &self.words
    }

    /// Number of moves.
    #[must_use]
    pub fn events(&self) -> u32 {
        self.events
    }

    /// Number of control steps among them.
    #[must_use]
    pub fn steps(&self) -> u32 {
        self.steps
    }

    /// A control step: bits of the measurement, then bits of each duty, of each duty_sim, the action indices, status; of `rest`
    /// (observation, Q values, state afterwards) the checksum alone is kept.
    pub fn step(&mut self, measurement: &[u32], command: &[u32], rest: impl IntoIterator<Item = u32>) {
        self.step_of(kind::STEP, measurement, command, rest);
    }

    /// A control step in which a NaN arises: as [`Trace::step`], with the state afterwards alone for `rest`.
    pub fn step_without_numbers(&mut self, measurement: &[u32], command: &[u32], state: impl IntoIterator<Item = u32>) {
        self.step_of(kind::STEP_WITHOUT_NUMBERS, measurement, command, state);
    }

    fn step_of(&mut self, kind: u32, measurement: &[u32], command: &[u32], rest: impl IntoIterator<Item = u32>) {
        self.open(kind);
        self.words.extend_from_slice(measurement);
        self.words.extend_from_slice(command);
        // a checksum for the rest: the kit lies in the flash of a board, where each word counts
        self.words.push(crc32_words(rest));
        self.steps += 1;
    }

    /// An attempt to replace the coefficients of the mapping of the output of that index.
    pub fn set_mapping(
        &mut self,
        output: usize,
        coefficients: &[u32],
        accepted: u32,
        state: impl IntoIterator<Item = u32>,
    ) {
        self.open(mapping_kind(output));
        self.words.extend_from_slice(coefficients);
        self.words.extend([accepted, crc32_words(state)]);
    }

    /// `reset`: the mapping's coefficients stay.
    pub fn reset(&mut self, state: impl IntoIterator<Item = u32>) {
        self.open(kind::RESET);
        self.words.push(crc32_words(state));
    }

    /// `init`.
    pub fn init(&mut self, state: impl IntoIterator<Item = u32>) {
        self.open(kind::INIT);
        self.words.push(crc32_words(state));
    }

    /// One word of the state gets other bits.
    pub fn damage(&mut self, word: u32, bits: u32, state: impl IntoIterator<Item = u32>) {
        self.open(kind::DAMAGE);
        self.words.extend([word, bits, crc32_words(state)]);
    }

    /// The network alone: bits of an observation, which need not be one that a step reaches; of the Q values the checksum is kept.
    pub fn network(&mut self, observation: &[u32], q_values: impl IntoIterator<Item = u32>) {
        self.open(kind::NETWORK);
        self.words.extend_from_slice(observation);
        self.words.push(crc32_words(q_values));
    }

    fn open(&mut self, kind: u32) {
        self.words.push(kind);
        self.events += 1;
    }
}

/// First word of a move that sets the mapping of the output of that index.
pub(super) fn mapping_kind(output: usize) -> u32 {
    kind::SET_MAPPING + kind::OUTPUT * output as u32
}

#[cfg(test)]
mod tests {
    use super::Trace;

    #[test]
    fn moves_follow_each_other_with_kind_input_and_answer() {
        let mut trace = Trace::default();
        trace.init([]);
        // the check value of the CRC-32 catalogue, over eight digits: 0x9AE0DAAF
        let rest = [u32::from_le_bytes(*b"1234"), u32::from_le_bytes(*b"5678")];
        trace.step(&[7, 8], &[1, 2, 3, 4], rest);
        trace.set_mapping(0, &[5, 6, 7], 1, []);
        trace.set_mapping(2, &[5, 6, 7], 0, []);
        trace.network(&[8, 9], rest);
        assert_eq!(
            trace.words(),
            [
                3,
                0,
                0,
                7,
                8,
                1,
                2,
                3,
                4,
                0x9AE0_DAAF,
                1,
                5,
                6,
                7,
                1,
                0,
                33,
                5,
                6,
                7,
                0,
                0,
                6,
                8,
                9,
                0x9AE0_DAAF
            ]
        );
        assert_eq!((trace.events(), trace.steps()), (5, 1));
    }
}
