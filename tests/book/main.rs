//! README and book: every command runs as it stands, and reference pages say what the program does.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod blocks;
mod own_lines;
mod page;
mod reference;

use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use page::Outcome;

/// Names a part of the paths of the pages to run, for whoever writes one.
const ONLY: &str = "POLICYC_BOOK_ONLY";

/// Readme and pages of the book, relative to the root, in the order of the contents.
fn pages() -> Vec<PathBuf> {
    let contents = std::fs::read_to_string(tests::root().join("docs/SUMMARY.md")).unwrap();
    let targets = contents.split("](").skip(1).filter_map(|rest| rest.split_once(')'));
    let listed = targets.filter(|(target, _)| target.ends_with(".md"));
    let in_book = listed.map(|(target, _)| Path::new("docs").join(target));
    let only = std::env::var(ONLY).unwrap_or_default();
    std::iter::once(PathBuf::from("README.md"))
        .chain(in_book)
        .filter(|path| path.to_string_lossy().contains(&only))
        .collect()
}

/// All pages, as many at a time as there are cores.
fn run_all(pages: &[PathBuf]) -> Vec<(PathBuf, Outcome)> {
    let next = Mutex::new(pages.iter());
    let done = Mutex::new(Vec::new());
    let readers = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..readers {
            scope.spawn(|| {
                loop {
                    let Some(path) = next.lock().unwrap().next() else {
                        return;
                    };
                    let text = std::fs::read_to_string(tests::root().join(path)).unwrap();
                    let first = blocks::continues(&text).map(|first| tests::root().join(first));
                    let before = first.map(|first| std::fs::read_to_string(first).unwrap());
                    done.lock()
                        .unwrap()
                        .push((path.clone(), page::run(&text, before.as_deref())));
                }
            });
        }
    });
    done.into_inner().unwrap()
}

/// What was run and what was not, past libtest, which keeps the words of a passing test to itself.
fn tell(outcomes: &[(PathBuf, Outcome)]) {
    let mut out = std::io::stderr().lock();
    for (path, outcome) in outcomes.iter().filter(|(_, outcome)| outcome.commands > 0) {
        let (seconds, blocks) = (outcome.seconds, outcome.commands);
        writeln!(out, "{seconds:6.1} s {blocks:3} blocks   {}", path.display()).unwrap();
    }
    for (path, outcome) in outcomes {
        for reason in &outcome.left_out {
            writeln!(out, "not run: {}:{reason}", path.display()).unwrap();
        }
    }
}

#[test]
fn every_command_block_of_readme_and_book_runs_as_it_stands() {
    let pages = pages();
    assert!(!pages.is_empty(), "no page has {ONLY} in its path");
    let outcomes = run_all(&pages);
    tell(&outcomes);
    let faults = outcomes.iter().flat_map(|(path, outcome)| {
        let place = |fault: &String| format!("{}:{fault}", path.display());
        outcome.faults.iter().map(place)
    });
    let faults: Vec<String> = faults.collect();
    assert!(faults.is_empty(), "\n{}", faults.join("\n\n"));
}

/// The test itself: a page can fail in each of the ways that it looks for.
#[test]
fn a_page_that_lies_is_told_from_one_that_does_not() {
    let good = "```toml,file=a/b.toml\nx = 1\n```\n```sh\ncd a\ncat b.toml\n```\n```text,shown\nx = 1\n```\n\
                ```sh,exit=3\nexit 3\n```\n```sh\nls b.toml ../../policyc/examples\npolicyc --version\n```\n\
                <!-- not tested: a reason -->\n```sh\nfalse\n```\n```sh\n# needs: no-such-program\nfalse\n```\n";
    let outcome = page::run(good, None);
    assert_eq!(outcome.faults, Vec::<String>::new());
    assert_eq!((outcome.commands, outcome.left_out.len()), (3, 2));
    for (bad, line) in [
        ("```sh\ntrue\nfalse\ntrue\n```\n", "2: fails"),
        ("```sh\nfalse | true\n```\n", "2: fails"),
        ("```sh,exit=1\ntrue\n```\n", "2: fails"),
        ("```sh,exit=1\nfalse\ntrue\n```\n```sh\nls /nowhere\n```\n", "6: fails"),
        ("```sh\necho one\n```\n```text,shown\ntwo\n```\n", "5: not printed"),
        ("```bash\nls\n```\n", "2: `bash`"),
    ] {
        let faults = page::run(bad, None).faults;
        assert!(faults.len() == 1 && faults[0].starts_with(line), "{bad}{faults:?}");
    }
    let goes_on = "<!-- continues: one.md -->\n```sh\ncat made $WORD\n```\n```text,shown\nof the first\n```\n";
    assert_eq!(blocks::continues(goes_on), Some("one.md"));
    let first = "```sh\necho of the first >made\nWORD=made\n```\n";
    assert_eq!(page::run(goes_on, Some(first)).faults, Vec::<String>::new());
    let alone = page::run(goes_on, None).faults;
    assert!(
        alone.first().is_some_and(|fault| fault.starts_with("3: fails")),
        "{alone:?}"
    );
}
