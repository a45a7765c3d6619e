//! Source files in which every mutant stands behind its switch.

use std::ops::Range;

use crate::sites::{Mutant, Piece};

/// What a mutant became of: where it stands in the instrumented text, as often as the code around it was doubled.
pub type Ranges = Vec<(usize, Range<usize>)>;

/// The text with all of these mutants in it; each comes with its number.
pub fn instrument(text: &str, mutants: &[(usize, &Mutant)]) -> (String, Ranges) {
    let mut order = mutants.to_vec();
    // the outer one first: it takes those within along
    order.sort_by_key(|(number, mutant)| (mutant.range.start, std::cmp::Reverse(mutant.range.end), *number));
    let mut writer = Writer {
        text,
        out: String::with_capacity(2 * text.len()),
        ranges: Vec::new(),
    };
    writer.write(0..text.len(), &order);
    (writer.out, writer.ranges)
}

struct Writer<'a> {
    text: &'a str,
    out: String,
    ranges: Ranges,
}

impl Writer<'_> {
    /// The code of `range` with the mutants in it, which are in order.
    fn write(&mut self, range: Range<usize>, mutants: &[(usize, &Mutant)]) {
        let mut at = range.start;
        let mut rest = mutants;
        while let Some(((number, mutant), behind)) = rest.split_first() {
            self.out.push_str(&self.text[at..mutant.range.start]);
            let within = behind
                .iter()
                .take_while(|(_, other)| other.range.start < mutant.range.end);
            let (within, behind) = match mutant.range.is_empty() {
                // an insertion: another one at the same place comes after it
                true => behind.split_at(0),
                false => behind.split_at(within.count()),
            };
            let start = self.out.len();
            self.replace(*number, mutant, within);
            self.ranges.push((*number, start..self.out.len()));
            at = mutant.range.end;
            rest = behind;
        }
        self.out.push_str(&self.text[at..range.end]);
    }

    fn replace(&mut self, number: usize, mutant: &Mutant, within: &[(usize, &Mutant)]) {
        for piece in &mutant.pieces {
            match piece {
                Piece::Text(text) => self.out.push_str(text),
                Piece::Switch => self.out.push_str(&format!("crate::mutant_switch::on({number})")),
                Piece::Source(range) => {
                    let inner = within.iter().filter(|(_, other)| {
                        // an insertion at the end belongs to what comes before it
                        range.start <= other.range.start && other.range.end <= range.end
                    });
                    let inner: Vec<_> = inner.copied().collect();
                    self.write(range.clone(), &inner);
                }
            }
        }
    }
}

/// The module behind the switches of a crate: which mutant is on, and a note of each switch that was asked.
pub const SWITCH: &str = r#"//! Written by tools/mutants.
use std::io::Write;
use std::sync::LazyLock;
use std::sync::atomic::{AtomicBool, Ordering};

static ON: LazyLock<usize> = LazyLock::new(|| number("MUTANT"));
static ASKED: LazyLock<Option<String>> = LazyLock::new(|| std::env::var("MUTANTS_ASKED").ok());
static SEEN: [AtomicBool; COUNT] = [const { AtomicBool::new(false) }; COUNT];

fn number(name: &str) -> usize {
    std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(usize::MAX)
}

pub(crate) fn on(number: usize) -> bool {
    if let Some(path) = &*ASKED {
        if !SEEN[number].swap(true, Ordering::Relaxed) {
            let mut file = std::fs::OpenOptions::new().append(true).create(true).open(path).unwrap();
            file.write_all(format!("{number}\n").as_bytes()).unwrap();
        }
    }
    *ON == number
}
"#;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sites;

    fn all(text: &str) -> (String, Ranges) {
        let found = sites::find(text).unwrap();
        let numbered: Vec<(usize, &Mutant)> = found.mutants.iter().enumerate().collect();
        instrument(text, &numbered)
    }

    #[test]
    fn an_operator_stands_beside_its_mutant() {
        let text = "fn f() -> &X { a - b }";
        let found = sites::find(text).unwrap();
        let (out, ranges) = instrument(text, &[(7, &found.mutants[0])]);
        assert_eq!(
            out,
            "fn f() -> &X { (if crate::mutant_switch::on(7) { (a) + (b) } else { a - b }) }"
        );
        assert_eq!(&out[ranges[0].1.clone()], &out[15..out.len() - 2]);
    }

    /// Every mutant is there, in code that is still Rust, also where one lies in or at another.
    #[test]
    fn nested_mutants_all_have_their_switch() {
        let text =
            "fn f(a: u8) -> bool { if a + 1 * 2 < 3 { g(!a)?; } match a { 1 | 2 if a == 0 => {} _ => {} } -1 > 0 }";
        let (out, ranges) = all(text);
        syn::parse_file(&out).unwrap();
        let count = sites::find(text).unwrap().mutants.len();
        for number in 0..count {
            assert!(out.contains(&format!("on({number})")), "{number}\n{out}");
            assert!(ranges.iter().any(|(other, _)| *other == number));
        }
    }

    #[test]
    fn without_mutants_nothing_changes() {
        let text = "fn f() {}\n";
        assert_eq!(instrument(text, &[]), (text.to_owned(), Vec::new()));
    }
}
