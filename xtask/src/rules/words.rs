//! Lengths of prose: the README is a map, and figures stand with their results.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::markdown::Page;

/// Whoever needs more has not said whose problem it is.
const README_WORDS: usize = 600;

/// Words as `wc -w` counts them.
pub fn check_readme(text: &str) -> Option<String> {
    let words = text.split_whitespace().count();
    (words > README_WORDS).then(|| format!("README.md: {words} words, more than {README_WORDS}"))
}

/// One line a page: words of prose and figures per hundred of them; results pages hold figures by nature.
pub fn report(pages: &BTreeMap<PathBuf, Page>) -> Vec<String> {
    let shown = pages
        .iter()
        .filter(|(path, page)| page.words > 0 && is_read_by_strangers(path));
    let line = |(path, page): (&PathBuf, &Page)| {
        let share = 100.0 * page.figures as f64 / page.words as f64;
        format!(
            "{:6} words {share:5.1} figures per 100   {}",
            page.words,
            path.display()
        )
    };
    shown.map(line).collect()
}

fn is_read_by_strangers(path: &Path) -> bool {
    path.starts_with("docs") || path.components().count() == 1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_readme_of_601_words_is_too_long() {
        assert_eq!(check_readme(&"word ".repeat(600)), None);
        assert!(check_readme(&"word ".repeat(601)).is_some_and(|fault| fault.contains("601")));
    }

    #[test]
    fn figures_are_counted_per_hundred_words_of_prose() {
        let text = format!("{} 7.\n", "word ".repeat(99));
        let pages = BTreeMap::from([(PathBuf::from("docs/a.md"), Page::read(&text))]);
        assert_eq!(report(&pages), ["   100 words   1.0 figures per 100   docs/a.md"]);
    }
}
