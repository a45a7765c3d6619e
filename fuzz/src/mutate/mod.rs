//! How an input is changed: at bytes, at words of a text, or inside of a container that is put together again.

mod bytes;
mod tokens;

use random::{Random, SplitMix};

use crate::corpus::Corpus;
use crate::forms::Form;
use crate::targets::Target;

/// Bytes of a part between two changes; ten times what an input may have in the end.
const LONGEST: usize = 1 << 20;

/// Changes `part`, which may be a whole input or what a container holds.
pub fn edit(part: &mut Vec<u8>, words: &[&str], other: &[u8], random: &mut SplitMix) {
    // mostly one change, so that what lies behind the first check is reached; now and then many
    let changes = if random.one_in(8) {
        1 + random.below(16)
    } else {
        1 + random.below(3)
    };
    for _ in 0..changes {
        if is_text(part) && !random.one_in(4) {
            tokens::edit(part, words, other, random);
        } else {
            bytes::edit(part, words, other, random);
        }
        // each change may copy what is there many times, and sixteen of them would fill the memory
        part.truncate(LONGEST);
    }
}

/// Makes the next input of a target.
pub(crate) fn mutate(target: &Target, corpus: &Corpus, random: &mut SplitMix, input: &mut Vec<u8>) {
    input.clear();
    input.extend_from_slice(corpus.draw(random));
    let other = corpus.draw(random);
    let change = |part: &mut Vec<u8>, random: &mut SplitMix| edit(part, target.words, other, random);
    // a container whose lengths are wrong is refused at its door, so most changes keep it whole
    let is_inside = target.form != Form::Bytes && !random.one_in(4);
    match is_inside.then(|| target.form.edit(input, random, &change)).flatten() {
        Some(edited) => *input = edited,
        None => edit(input, target.words, other, random),
    }
    input.truncate(corpus.most_bytes);
}

/// Whether bytes are to be changed as words; the beginning tells.
fn is_text(bytes: &[u8]) -> bool {
    let head = &bytes[..bytes.len().min(256)];
    !head.is_empty()
        && head
            .iter()
            .all(|byte| matches!(byte, b'\t' | b'\n' | b'\r' | 32..=126 | 128..))
}
