//! How much a run says beside its answer, for the whole process: what a command tells on its way lies deep in it.

use std::borrow::Cow;
use std::io::Write;
use std::sync::atomic::{AtomicU8, Ordering};

use crate::arguments::Loudness;
use crate::look::{self, Meaning};

const USUAL: u8 = 0;
const QUIET: u8 = 1;
const VERBOSE: u8 = 2;

static LOUDNESS: AtomicU8 = AtomicU8::new(USUAL);

/// What a note begins with, on its own line of an answer and on standard error.
const NOTE: &str = "note: ";

/// Takes over what the command line asks for.
pub fn set(loudness: Loudness) {
    let loudness = match loudness {
        Loudness { quiet: true, .. } => QUIET,
        Loudness { verbose: true, .. } => VERBOSE,
        Loudness { .. } => USUAL,
    };
    LOUDNESS.store(loudness, Ordering::Relaxed);
}

/// Only answers and errors.
pub fn is_quiet() -> bool {
    LOUDNESS.load(Ordering::Relaxed) == QUIET
}

/// More than usual.
pub fn is_verbose() -> bool {
    LOUDNESS.load(Ordering::Relaxed) == VERBOSE
}

/// A line on standard error that tells how the work goes on, unless the run is quiet.
pub fn tell(line: &str) {
    if !is_quiet() {
        // what cannot be told is no reason to stop
        let _ = writeln!(anstream::stderr(), "{line}");
    }
}

/// [`tell`] for a run that tells more.
pub fn tell_more(line: impl FnOnce() -> String) {
    if is_verbose() {
        tell(&line());
    }
}

/// A note on standard error: for a command whose answer is no text.
pub fn note(note: &str) {
    tell(&look::of_answer(&format!("{NOTE}{note}")));
}

/// That a signal ended the run, and what became of it, on standard error: it is no answer. A quiet run says it, too.
pub fn interrupted(what: &str) {
    // nobody may be listening any more
    let _ = writeln!(anstream::stderr(), "interrupted; {what}");
}

/// What is not as it should be, with what to do, on standard error: an answer in a quiet run, too.
pub fn different(problem: &str, hint: Option<&str>) {
    let hint = hint.map(|hint| format!("\n  = {}: {hint}", look::of(Meaning::Hint, "hint")));
    let word = look::of(Meaning::Wrong, "DIFFERENT");
    // what cannot be told is no reason to stop
    let _ = writeln!(anstream::stderr(), "\n{word}: {problem}{}", hint.unwrap_or_default());
}

/// The notes of an answer, without the word.
pub fn notes_of(answer: &str) -> impl Iterator<Item = String> {
    answer
        .lines()
        .filter_map(|line| line.strip_prefix(NOTE).map(str::to_owned))
}

/// What a run says of an answer: a quiet one leaves the notes out.
pub fn heard(answer: &str) -> Cow<'_, str> {
    match is_quiet() {
        true => without_notes(answer).into(),
        false => answer.into(),
    }
}

/// An answer without the lines of its notes. Those that go on are indented.
fn without_notes(answer: &str) -> String {
    let mut is_note = false;
    let kept = answer.lines().filter(|line| {
        is_note = line.starts_with(NOTE) || (is_note && line.starts_with(' '));
        !is_note
    });
    kept.collect::<Vec<_>>().join("\n").trim_end().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_note_goes_with_the_lines_that_go_on() {
        let answer = "fit\n  a = 1\nnote: the table\n  is short\nequal: x\n\nnote: last";
        assert_eq!(without_notes(answer), "fit\n  a = 1\nequal: x");
        assert_eq!(notes_of(answer).collect::<Vec<_>>(), ["the table", "last"]);
    }

    #[test]
    fn what_only_mentions_notes_stays() {
        let answer = "a\n  note: of the model\nnotes: none";
        assert_eq!(without_notes(answer), answer);
    }
}
