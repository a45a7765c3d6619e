//! How much of the product says why: lines with a comment that is no documentation, crate by crate. A figure, no gate: a
//! comment written to reach it would be worth nothing.

use std::collections::BTreeMap;
use std::path::Path;

/// Folders whose crates are not shipped.
const TEST_SIDE: [&str; 5] = ["tests", "bench", "xtask", "examples", "firmware"];

/// Lines of code and documentation that are not empty, and how many of them hold a comment.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Count {
    pub lines: usize,
    pub comments: usize,
}

/// The crate that a file counts for: Rust of `<crate>/src` outside of the test side.
pub fn crate_of(path: &Path) -> Option<&str> {
    let mut parts = path.iter().filter_map(|part| part.to_str());
    let (member, folder) = (parts.next()?, parts.next()?);
    let is_rust = path.extension().is_some_and(|extension| extension == "rs");
    let is_product = is_rust && folder == "src" && path.file_name().is_some_and(|name| name != "tests.rs");
    (is_product && !TEST_SIDE.contains(&member)).then_some(member)
}

/// Counts a file up to its unit tests, which stand last.
pub fn count(text: &str) -> Count {
    let mut count = Count::default();
    for line in text.lines().map(str::trim).take_while(|line| *line != "#[cfg(test)]") {
        count.lines += usize::from(!line.is_empty());
        count.comments += usize::from(has_comment(line));
    }
    count
}

/// Whether a line is a comment or ends in one. Behind code a comment follows a delimiter, so that `//` of an address in a
/// text is none.
fn has_comment(line: &str) -> bool {
    let is_comment = |rest: &str| rest.starts_with("//") && !rest.starts_with("///") && !rest.starts_with("//!");
    let behind_code = [", //", "; //", "{ //", ") //", "} //"];
    is_comment(line) || behind_code.iter().any(|delimited| line.contains(delimited))
}

/// One line a crate, then all of them.
pub fn report(counts: &BTreeMap<String, Count>) -> Vec<String> {
    let mut all = Count::default();
    let mut lines = Vec::new();
    for (name, count) in counts {
        all.lines += count.lines;
        all.comments += count.comments;
        lines.push(line(*count, name));
    }
    lines.push(line(all, "all of them"));
    lines
}

fn line(count: Count, what: &str) -> String {
    let share = 100.0 * count.comments as f64 / count.lines.max(1) as f64;
    format!("{:6} lines {share:5.2} % say why   {what}", count.lines)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn documentation_texts_and_tests_say_no_why() {
        let text = "/// doc\n//! doc\n// why\nlet x = 1; // why\nlet u = \"http://x\";\n\n#[cfg(test)]\nmod tests {\n// not\n}\n";
        assert_eq!(count(text), Count { lines: 5, comments: 2 });
    }

    #[test]
    fn the_test_side_does_not_count() {
        assert_eq!(crate_of(Path::new("plant/src/effects/esr.rs")), Some("plant"));
        for path in [
            "tests/src/lib.rs",
            "plant/tests/files.rs",
            "plant/src/tests.rs",
            "plant/src/a.md",
        ] {
            assert_eq!(crate_of(Path::new(path)), None, "{path}");
        }
    }
}
