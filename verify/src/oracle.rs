//! What the interpreter answers, chunk by chunk, in the words of the protocol.

use interp::{Coefficients, Controller, InputError, Real, State, Trace};
use ndarray::Array1;
use policy::Policy;
use serde::Serialize;

use crate::protocol::{Layout, encode};
use crate::traces::{Event, Stream};

/// A piece of the stream with the answers expected to it.
#[derive(Debug, Clone, Default)]
pub struct Chunk {
    /// Number of control steps before this chunk.
    pub first_step: u64,
    /// The events in order.
    pub events: Vec<Event>,
    /// The events as words.
    pub input: Vec<u32>,
    /// All answers, one after the other.
    pub expected: Vec<u32>,
}

/// What the stream has reached, so that a user sees that the comparison was not vacuous.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Coverage {
    /// Steps with each status bit, bit 0 first (see [`interp::status::NAMES`]).
    pub status_bits: [u64; 9],
    /// Steps in which each action was chosen.
    pub actions: Vec<u64>,
    /// Attempts to replace the mapping coefficients that were accepted.
    pub mappings_accepted: u64,
    /// Attempts to replace the mapping coefficients that were refused.
    pub mappings_refused: u64,
    /// Calls of `reset`.
    pub resets: u64,
    /// New controllers.
    pub inits: u64,
}

/// The interpreter at work on the stream, in the floats of the policy's format.
#[derive(Debug, Clone)]
pub struct Oracle<T> {
    fresh: Controller<T>,
    controller: Controller<T>,
    trace: Trace<T>,
    layout: Layout,
    /// First column of each output.
    columns: Vec<usize>,
    steps: u64,
    checksum: Crc32,
    coverage: Coverage,
}

impl<T: Real> Oracle<T> {
    /// An oracle at the start of a stream.
    pub fn new(policy: &Policy) -> Self {
        let fresh = Controller::<T>::new(policy);
        Self {
            trace: fresh.blank_trace(),
            layout: Layout::new(policy, fresh.state_names()),
            columns: policy.paths().iter().map(|path| path.column).collect(),
            controller: fresh.clone(),
            fresh,
            steps: 0,
            checksum: Crc32::new(),
            coverage: Coverage {
                actions: vec![0; policy.outputs()],
                ..Coverage::default()
            },
        }
    }

    /// Names of the words.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Control steps so far.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// CRC-32 (IEEE 802.3) over all expected words so far, each little-endian.
    pub fn checksum(&self) -> u32 {
        self.checksum.value()
    }

    /// What the stream has reached so far.
    pub fn coverage(&self) -> &Coverage {
        &self.coverage
    }

    /// The interpreter in its present state.
    pub fn controller(&self) -> &Controller<T> {
        &self.controller
    }

    /// Puts the interpreter into another state of the same shape.
    pub fn restore(&mut self, state: &State<T>) {
        // a state that `controller` gave, with other numbers, always fits
        self.controller.restore(state);
    }

    /// The next chunk of `steps` control steps.
    pub fn next_chunk(&mut self, stream: &mut Stream<'_>, steps: u64) -> Result<Chunk, InputError> {
        let mut chunk = Chunk {
            first_step: self.steps,
            ..Chunk::default()
        };
        while self.steps < chunk.first_step + steps {
            let event = stream.next_event(&self.controller);
            self.answer(event, &mut chunk)?;
        }
        self.finish(&mut chunk);
        Ok(chunk)
    }

    /// A chunk of given events, such as known answers.
    pub fn chunk_of(&mut self, events: Vec<Event>) -> Result<Chunk, InputError> {
        let mut chunk = Chunk {
            first_step: self.steps,
            ..Chunk::default()
        };
        for event in events {
            self.answer(event, &mut chunk)?;
        }
        self.finish(&mut chunk);
        Ok(chunk)
    }

    fn finish(&mut self, chunk: &mut Chunk) {
        self.checksum.update(&chunk.expected);
    }

    fn answer(&mut self, event: Event, chunk: &mut Chunk) -> Result<(), InputError> {
        encode(&event, self.layout.scalar(), &mut chunk.input);
        let words = &mut chunk.expected;
        match &event {
            Event::Step(samples) => {
                self.controller.step_into(samples, &mut self.trace)?;
                let trace = &self.trace;
                let command = trace.command;
                let values = trace.observation.iter().chain(&trace.q_values).copied();
                let duties = trace.commands().map(|command| command.duty);
                let duties = duties.chain(trace.commands().map(|command| command.duty_sim));
                for number in values.chain(duties) {
                    number.append_words(words);
                }
                words.extend(trace.commands().map(|command| command.action_index));
                words.push(command.status);
                self.controller.state().append_words(words);
                // purity: the interpreter has one state and cannot contradict itself
                words.push(0);
                self.steps += 1;
                for (bit, count) in self.coverage.status_bits.iter_mut().enumerate() {
                    *count += u64::from(command.status >> bit & 1);
                }
                // section 9: the index is below N, after a fallback too
                for (command, column) in trace.commands().zip(&self.columns) {
                    self.coverage.actions[column + command.action_index as usize] += 1;
                }
            }
            Event::SetMapping { output, a, b, c, r } => {
                let [a, b, c] = [*a, *b, *c].map(T::nearest);
                let r = r.map(T::nearest);
                let accepted = self.controller.set_mapping_of(*output, Coefficients { a, b, c, r });
                words.push(u32::from(accepted));
                self.controller.state().append_words(words);
                self.coverage.mappings_accepted += u64::from(accepted);
                self.coverage.mappings_refused += u64::from(!accepted);
            }
            Event::Reset => {
                self.controller.reset();
                self.controller.state().append_words(words);
                self.coverage.resets += 1;
            }
            Event::Init => {
                self.controller = self.fresh.clone();
                self.controller.state().append_words(words);
                self.coverage.inits += 1;
            }
            Event::Network(observation) => {
                let observation: Array1<T> = observation.iter().map(|x| T::nearest(*x)).collect();
                for q in self.controller.q_values(&observation.view())? {
                    q.append_words(words);
                }
            }
        }
        chunk.events.push(event);
        Ok(())
    }
}

/// CRC-32 with the reflected polynomial 0xEDB88320, start and final XOR 0xFFFFFFFF.
#[derive(Debug, Clone)]
struct Crc32 {
    table: [u32; 256],
    state: u32,
}

impl Crc32 {
    fn new() -> Self {
        let mut table = [0u32; 256];
        for (n, entry) in table.iter_mut().enumerate() {
            *entry = (0..8).fold(
                n as u32,
                |c, _| if c & 1 == 1 { 0xedb8_8320 ^ (c >> 1) } else { c >> 1 },
            );
        }
        Self { table, state: u32::MAX }
    }

    fn update(&mut self, words: &[u32]) {
        for byte in words.iter().flat_map(|word| word.to_le_bytes()) {
            self.state = self.table[((self.state ^ u32::from(byte)) & 0xff) as usize] ^ (self.state >> 8);
        }
    }

    fn value(&self) -> u32 {
        !self.state
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn checksum_is_crc_32_of_the_little_endian_words() {
        // the check value of CRC-32 is 0xCBF43926 over the text 123456789; of the first eight digits it is 0x9AE0DAAF
        let mut crc = Crc32::new();
        crc.update(&[u32::from_le_bytes(*b"1234"), u32::from_le_bytes(*b"5678")]);
        assert_eq!(crc.value(), 0x9ae0_daaf);
    }
}
