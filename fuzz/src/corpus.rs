//! Inputs from which others are made: the seeds, and what drew an answer of a new kind.

use std::collections::BTreeSet;

use random::{Random, SplitMix};

use crate::guard::Answer;

/// Entries kept beside the seeds.
// a reader has some hundred messages; more entries would only thin out the ones before
const MOST_FOUND: usize = 1_000;
/// Letters of a message that make its kind: behind them stand names and numbers of the input.
const KIND_LETTERS: usize = 60;

/// The inputs of one target.
#[derive(Debug)]
pub struct Corpus {
    entries: Vec<Vec<u8>>,
    seeds: usize,
    kinds: BTreeSet<(bool, String)>,
    /// Longest input that is made.
    pub most_bytes: usize,
}

impl Corpus {
    /// A corpus of seeds; an empty input is one of them if there are none.
    #[must_use]
    pub fn new(mut seeds: Vec<Vec<u8>>) -> Self {
        if seeds.is_empty() {
            seeds.push(Vec::new());
        }
        let longest = seeds.iter().map(Vec::len).max().unwrap_or(0);
        Corpus {
            seeds: seeds.len(),
            entries: seeds,
            kinds: BTreeSet::new(),
            // room for insertions and not much more: a longer input takes time and shows nothing that a short one does not
            most_bytes: (longest + longest / 2).max(2_048),
        }
    }

    /// An entry, seeds half of the time.
    pub fn draw(&self, random: &mut SplitMix) -> &[u8] {
        let among = if random.one_in(2) {
            self.seeds
        } else {
            self.entries.len()
        };
        self.entries.get(random.below(among)).map_or(&[], Vec::as_slice)
    }

    /// The seeds, each to be read once as it is.
    #[must_use]
    pub fn seed(&self, index: usize) -> Option<&[u8]> {
        self.entries
            .get(index)
            .filter(|_| index < self.seeds)
            .map(Vec::as_slice)
    }

    /// Keeps `input` if nothing before it drew such an answer.
    pub fn learn(&mut self, input: &[u8], answer: &Answer) {
        let is_new = self.kinds.insert((answer.accepted, kind(&answer.message)));
        let is_seed = self.entries.iter().take(self.seeds).any(|seed| seed == input);
        if is_new && !is_seed && self.entries.len() < self.seeds + MOST_FOUND {
            self.entries.push(input.to_vec());
        }
    }

    /// How many kinds of answers there were.
    #[must_use]
    pub fn kinds(&self) -> usize {
        self.kinds.len()
    }
}

/// The letters of a message before and behind all that it quotes: what the program says, without what the input said.
fn kind(message: &str) -> String {
    // a name may hold a quote of its own, so the first and the last one count
    let quotes = ['`', '"'];
    let (before, behind) = match (message.find(quotes), message.rfind(quotes)) {
        (Some(first), Some(last)) => (&message[..first], &message[last..]),
        _ => (message, ""),
    };
    let letters = before.chars().chain(behind.chars()).filter(char::is_ascii_alphabetic);
    letters.take(KIND_LETTERS).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_numbers_make_no_new_kind() {
        assert_eq!(kind("`a` is 3 volts"), kind("`bcd` is 44 volts"));
        assert_ne!(kind("`a` is 3 volts"), kind("`a` is 3 amps"));
    }

    #[test]
    fn an_answer_of_a_new_kind_keeps_its_input() {
        let mut corpus = Corpus::new(vec![b"seed".to_vec()]);
        corpus.learn(b"one", &Answer::refused("first"));
        corpus.learn(b"two", &Answer::refused("first"));
        corpus.learn(b"three", &Answer::accepted("first"));
        assert_eq!(corpus.entries, [b"seed".to_vec(), b"one".to_vec(), b"three".to_vec()]);
    }
}
