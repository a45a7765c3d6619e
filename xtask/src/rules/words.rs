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

/// One line a page: words of prose and figures per hundred of them; then all pages but the results, which hold figures by
/// nature.
pub fn report(pages: &BTreeMap<PathBuf, Page>) -> Vec<String> {
    let shown = pages
        .iter()
        .filter(|(path, page)| page.words > 0 && is_read_by_strangers(path));
    let mut lines = Vec::new();
    let mut outside_results = (0, 0);
    for (path, page) in shown {
        lines.push(line(page.words, page.figures, &path.display().to_string()));
        if !path.starts_with("docs/results") {
            outside_results.0 += page.words;
            outside_results.1 += page.figures;
        }
    }
    let (words, figures) = outside_results;
    if words > 0 {
        lines.push(line(words, figures, "all of them but the results"));
    }
    lines
}

fn line(words: usize, figures: usize, what: &str) -> String {
    let share = 100.0 * figures as f64 / words as f64;
    format!("{words:6} words {share:5.1} figures per 100   {what}")
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
        let results = PathBuf::from("docs/results/b.md");
        let pages = BTreeMap::from([
            (PathBuf::from("docs/a.md"), Page::read(&text)),
            (results, Page::read("one 1 2 3\n")),
        ]);
        let lines = report(&pages);
        assert_eq!(lines[0], "   100 words   1.0 figures per 100   docs/a.md");
        assert_eq!(
            lines[2],
            "   100 words   1.0 figures per 100   all of them but the results"
        );
    }
}
