//! The look of what is said on a terminal: the colours of the faults' snippets, for every other word of the same meaning. A stream that
//! is no terminal, NO_COLOR and `--color never` take them out.

use std::ffi::OsString;

use anstream::ColorChoice;

use crate::arguments::Color;

/// What a word means.
#[derive(Debug, Clone, Copy)]
pub enum Meaning {
    /// It is not as it should be.
    Wrong,
    /// Worth knowing.
    Note,
    /// What to do.
    Hint,
    /// What stands above others.
    Title,
}

/// A word as it looks.
pub fn of(meaning: Meaning, word: &str) -> String {
    // as annotate-snippets has them for error, note and help
    let code = match meaning {
        Meaning::Wrong => "1;91",
        Meaning::Note => "1;92",
        Meaning::Hint | Meaning::Title => "1",
    };
    format!("\x1b[{code}m{word}\x1b[0m")
}

/// What lines of an answer begin with, and what that means.
const WORDS: [(&str, Meaning); 3] = [
    ("note", Meaning::Note),
    ("hint", Meaning::Hint),
    ("DIFFERENT", Meaning::Wrong),
];

/// An answer in words as it looks: the word that a line begins with.
pub fn of_answer(answer: &str) -> String {
    let line = |line: &str| {
        let found = WORDS.iter().find_map(|(word, meaning)| {
            let rest = line.strip_prefix(word)?;
            rest.starts_with(':').then(|| of(*meaning, word) + rest)
        });
        found.unwrap_or_else(|| line.to_owned())
    };
    answer.split('\n').map(line).collect::<Vec<_>>().join("\n")
}

/// What `--color` says of `arguments`, for faults of the command line too, which come before it is read.
pub fn choose(arguments: &[OsString]) {
    let words = || arguments.iter().map(|word| word.to_string_lossy());
    let named = words().find_map(|word| word.strip_prefix("--color=").map(str::to_owned));
    let apart = || words().skip_while(|word| word != "--color").nth(1);
    let color = match named.or_else(|| apart().map(Into::into)).as_deref() {
        Some("always") => Color::Always,
        Some("never") => Color::Never,
        _ => Color::Auto,
    };
    match color {
        Color::Always => ColorChoice::Always,
        Color::Never => ColorChoice::Never,
        // what the environment asks for
        Color::Auto => return,
    }
    .write_global();
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_word_of_a_line_alone_is_coloured() {
        let seen = of_answer("a\nnote: b\n  note: of the model\nnotes: none\nDIFFERENT: x\n");
        let note = of(Meaning::Note, "note");
        let different = of(Meaning::Wrong, "DIFFERENT");
        assert_eq!(
            seen,
            format!("a\n{note}: b\n  note: of the model\nnotes: none\n{different}: x\n")
        );
    }
}
