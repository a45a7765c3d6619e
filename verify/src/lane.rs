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
            // answers that came before a crash are judged; those that are missing count as wrong
            Err(error) => &error.received,
        };
        if let Some(known) = &self.policy.golden {
            let result = golden::judge(known, self.layout.scalar(), &self.policy.head, words);
            self.golden = Some(result.told(self.policy.numeric_format.is_integer()));
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
        // before the failure: a difference in what came before a crash is nearer to the cause
        if let Some(index) = compare::first_difference(&chunk.expected, &words)
            && let Some(difference) = compare::describe(self.policy, chunk, self.layout, index, &words)
        {
            // the steps before it were equal
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
        // the first word that did not come belongs to the event that did not end
        let place = compare::place(chunk, self.layout, received);
        let step = place.map_or(chunk.first_step, |place| place.step);
        self.steps_compared = step;
        Outcome::Failed {
            step,
            event: place.map_or("end", |place| compare::event_name(place.event)).to_owned(),
            reason: reason.to_string(),
            measurement: place
                .map(|place| compare::measurement(self.policy, place.event))
                .unwrap_or_default(),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use interp::Sample;

    use super::*;
    use crate::oracle::Oracle;

    /// Answers a chunk rightly except for one word, or stops before it.
    struct Fake {
        hello: Vec<u32>,
        answer: Vec<u32>,
        fail: Option<RunFailure>,
    }

    impl Runner for Fake {
        fn start(&mut self, _: usize) -> Result<Vec<u32>, RunError> {
            Ok(self.hello.clone())
        }

        fn exchange(&mut self, _: &[u32], _: usize) -> Result<Vec<u32>, RunError> {
            match self.fail.take() {
                None => Ok(self.answer.clone()),
                Some(reason) => Err(RunError {
                    received: self.answer.clone(),
                    reason,
                }),
            }
        }
    }

    fn with_chunk(test: impl FnOnce(&Policy, &Layout, &Chunk)) {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/buck12/policy.toml");
        let policy = policy::load(&path).unwrap_or_else(|faults| panic!("{faults:#?}"));
        let mut oracle = Oracle::<f32>::new(&policy);
        let steps = (0..20).map(|n| Event::Step([99.0, 10.0 + n as f32, 9.5].map(Sample::Physical).to_vec()));
        let chunk = oracle.chunk_of(steps.collect()).unwrap();
        test(&policy, oracle.layout(), &chunk);
    }

    fn outcome(policy: &Policy, layout: &Layout, chunk: &Chunk, fake: Fake) -> (Result<(), Outcome>, u64) {
        let mut lane = Lane::new(policy, layout, Box::new(fake));
        let result = lane.start().and_then(|()| lane.follow(chunk));
        (result, lane.steps_compared())
    }

    /// Words of a step's answer: 6 observations, 12 Q values, 4 of the command, 13 of the state, purity.
    const STEP: usize = 6 + 12 + 4 + 13 + 1;

    #[test]
    fn equal_words_are_equal() {
        with_chunk(|policy, layout, chunk| {
            let fake = Fake {
                hello: layout.hello().to_vec(),
                answer: chunk.expected.clone(),
                fail: None,
            };
            assert_eq!(outcome(policy, layout, chunk, fake), (Ok(()), 20));
        });
    }

    #[test]
    fn one_bit_in_one_word_is_found_and_named() {
        with_chunk(|policy, layout, chunk| {
            let names = [
                (0, "observation[0] (e)"),
                (6 + 5, "q[5]"),
                (21, "status"),
                (22 + 3, "state e_del.0.delay[0]"),
            ];
            for (word, name) in names {
                let mut answer = chunk.expected.clone();
                answer[7 * STEP + word] ^= 1;
                let fake = Fake {
                    hello: layout.hello().to_vec(),
                    answer,
                    fail: None,
                };
                let (Err(Outcome::Different { difference }), 7) = outcome(policy, layout, chunk, fake) else {
                    panic!("{name}")
                };
                assert_eq!((difference.step, difference.what.as_str()), (7, name));
                assert_ne!(difference.expected.bits, difference.got.bits);
                assert_eq!(difference.measurement.len(), 3);
            }
        });
    }

    #[test]
    fn a_failed_self_test_is_a_difference_at_the_start() {
        with_chunk(|policy, layout, chunk| {
            let mut hello = layout.hello().to_vec();
            hello[1] = 4;
            let fake = Fake {
                hello,
                answer: vec![],
                fail: None,
            };
            let (Err(Outcome::Different { difference }), 0) = outcome(policy, layout, chunk, fake) else {
                panic!()
            };
            assert_eq!(
                (difference.event.as_str(), difference.what.as_str()),
                ("start", "self_test")
            );
        });
    }

    #[test]
    fn a_crash_names_the_step_it_happened_in() {
        with_chunk(|policy, layout, chunk| {
            let answer = chunk.expected[..3 * STEP + 10].to_vec();
            let fail = Some(RunFailure::Ended {
                status: "signal: 11".into(),
                stderr: String::new(),
            });
            let fake = Fake {
                hello: layout.hello().to_vec(),
                answer,
                fail,
            };
            let (
                Err(Outcome::Failed {
                    step, event, reason, ..
                }),
                3,
            ) = outcome(policy, layout, chunk, fake)
            else {
                panic!()
            };
            assert_eq!((step, event.as_str()), (3, "step"));
            assert!(reason.contains("signal: 11"));
        });
    }
}
