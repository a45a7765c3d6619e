//! One build on its way through the stream.

use policy::Policy;

use crate::compare;
use crate::golden;
use crate::oracle::Chunk;
use crate::protocol::{HELLO_WORDS, Layout};
use crate::report::{GoldenResult, Outcome};
use crate::runner::{RunError, RunFailure, Runner};
use crate::traces::Event;

/// A runner and what has been compared so far.
pub struct Lane<'a> {
    policy: &'a Policy,
    layout: &'a Layout,
    runner: Box<dyn Runner>,
    steps_compared: u64,
    golden: Option<GoldenResult>,
}

impl<'a> Lane<'a> {
    /// A lane that has not started.
    pub fn new(policy: &'a Policy, layout: &'a Layout, runner: Box<dyn Runner>) -> Self {
        Self {
            policy,
            layout,
            runner,
            steps_compared: 0,
            golden: None,
        }
    }

    /// Steps compared, all equal.
    pub fn steps_compared(&self) -> u64 {
        self.steps_compared
    }

    /// Known answers of this build, once they have been asked.
    pub fn golden(&self) -> Option<&GoldenResult> {
        self.golden.as_ref()
    }

    /// Starts the build; `Err` with the outcome if its self-test, integrity or sizes are wrong.
    pub fn start(&mut self) -> Result<(), Outcome> {
        let hello = match self.runner.start(HELLO_WORDS) {
            Ok(words) => words,
            Err(error) => {
                return Err(Outcome::Failed {
                    step: 0,
                    event: "start".to_owned(),
                    reason: error.reason.to_string(),
                    measurement: Vec::new(),
                });
            }
        };
        match compare::describe_hello(self.layout, &hello) {
            None => Ok(()),
            Some(difference) => Err(Outcome::Different {
                difference: Box::new(difference),
            }),
        }
    }

    /// Asks the known answers: compares their bits with the interpreter's and judges them against the trainer's.
    pub fn known_answers(&mut self, chunk: &Chunk) -> Result<(), Outcome> {
        let answer = self.runner.exchange(&chunk.input, chunk.expected.len());
        let words = match &answer {
            Ok(words) => words,
            Err(error) => &error.received,
        };
        if let Some(known) = &self.policy.golden {
            self.golden = Some(golden::judge(known, self.policy.actions.len(), words));
        }
        self.judge(chunk, answer)
    }

    /// Puts the build through a chunk; `Err` with the outcome at the first difference.
    pub fn follow(&mut self, chunk: &Chunk) -> Result<(), Outcome> {
        let answer = self.runner.exchange(&chunk.input, chunk.expected.len());
        self.judge(chunk, answer)
    }

    fn judge(&mut self, chunk: &Chunk, answer: Result<Vec<u32>, RunError>) -> Result<(), Outcome> {
        let (words, failure) = match answer {
            Ok(words) => (words, None),
            Err(error) => (error.received, Some(error.reason)),
        };
        if let Some(index) = compare::first_difference(&chunk.expected, &words)
            && let Some(difference) = compare::describe(self.policy, chunk, self.layout, index, words[index])
        {
            self.steps_compared = difference.step;
            return Err(Outcome::Different {
                difference: Box::new(difference),
            });
        }
        match failure {
            None => {
                let steps = chunk
                    .events
                    .iter()
                    .filter(|event| matches!(event, Event::Step(_)))
                    .count();
                self.steps_compared = chunk.first_step + steps as u64;
                Ok(())
            }
            Some(reason) => Err(self.failed(chunk, words.len(), &reason)),
        }
    }

    fn failed(&mut self, chunk: &Chunk, received: usize, reason: &RunFailure) -> Outcome {
        let place = compare::place(chunk, self.layout, received);
        let step = place.map_or(chunk.first_step, |place| place.step);
        self.steps_compared = step;
        Outcome::Failed {
            step,
            event: place
                .map_or("flush", |place| compare::event_name(place.event))
                .to_owned(),
            reason: reason.to_string(),
            measurement: place
                .map(|place| compare::measurement(self.policy, place.event))
                .unwrap_or_default(),
        }
    }
}
