//! Results as JSON lines, so that a run that was stopped goes on; and the table made of them.

use std::collections::{BTreeMap, BTreeSet};
use std::io::Write;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use crate::draw::{CRATES, Drawn};

/// What is known of each mutant, by its name.
#[derive(Debug)]
pub struct Results {
    path: PathBuf,
    found: BTreeMap<String, Value>,
}

/// Caught, whether by a failing test or by a limit.
const CAUGHT: [&str; 3] = ["failed", "looped", "grew"];

/// Whether a mutant that ended so was caught.
pub fn is_caught(result: &str) -> bool {
    CAUGHT.contains(&result)
}

impl Results {
    /// Those of an earlier run, if the file is there.
    ///
    /// # Errors
    /// A line that is no result.
    pub fn open(path: &Path) -> Result<Self, String> {
        let text = std::fs::read_to_string(path).unwrap_or_default();
        let mut found = BTreeMap::new();
        for (number, line) in text.lines().enumerate() {
            let value: Value =
                serde_json::from_str(line).map_err(|error| format!("{}:{}: {error}", path.display(), number + 1))?;
            // the last word counts
            found.insert(value["mutant"].as_str().unwrap_or_default().to_owned(), value);
        }
        Ok(Results {
            path: path.to_owned(),
            found,
        })
    }

    /// How it ended, by its name.
    pub fn of(&self, key: &str) -> Option<&str> {
        self.found.get(key)?["result"].as_str()
    }

    /// Adds a line.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn add(&mut self, key: &str, result: &str, by: &str, seconds: f64) -> Result<(), String> {
        let value = json!({ "mutant": key, "result": result, "by": by, "seconds": (seconds * 10.0).round() / 10.0 });
        let mut file = std::fs::OpenOptions::new()
            .create(true)
            .append(true)
            .open(&self.path)
            .map_err(|error| format!("{}: {error}", self.path.display()))?;
        writeln!(file, "{value}").map_err(|error| format!("{}: {error}", self.path.display()))?;
        self.found.insert(key.to_owned(), value);
        Ok(())
    }

    /// Counts for each crate, and the mutants that no test caught; `equal` are the
    /// [names](crate::draw::names) of those that a person judged to change nothing. Below each stands its name for that list.
    pub fn table(&self, sample: &[Drawn], names: &BTreeMap<String, String>, equal: &BTreeSet<String>) -> String {
        let mut text = String::from(
            "| crate | mutants | caught | change nothing | missed | caught of those that change something |\n",
        );
        text.push_str("|---|---:|---:|---:|---:|---:|\n");
        let mut left = String::new();
        for krate in CRATES {
            let own: Vec<&Drawn> = sample.iter().filter(|drawn| drawn.krate == krate).collect();
            let (mut caught, mut same, mut missed) = (0, 0, 0_usize);
            for key in own.iter().map(|drawn| drawn.key()) {
                match self.of(&key) {
                    Some(result) if is_caught(result) => caught += 1,
                    Some(_) if names.get(&key).is_some_and(|name| equal.contains(name)) => same += 1,
                    result => {
                        missed += usize::from(result.is_some());
                        let (result, name) = (result.unwrap_or("not run"), names.get(&key).map_or("", String::as_str));
                        left.push_str(&format!("{result}: {key}\n- ``{name} ``\n"));
                    }
                }
            }
            let share = 100.0 * caught as f64 / (caught + missed).max(1) as f64;
            let count = own.len();
            text.push_str(&format!(
                "| `{krate}` | {count} | {caught} | {same} | {missed} | {share:.1} % |\n"
            ));
        }
        text + "\n" + &left
    }
}

/// The list of those that change nothing: in each line that begins with `- ` a name in backticks, and why.
pub fn judged(text: &str) -> BTreeSet<String> {
    let lines = text.lines().filter_map(|line| line.strip_prefix("- ``"));
    lines
        .filter_map(|line| Some(line.split_once("``")?.0.trim().to_owned()))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_list_is_read_by_name() {
        let list = judged("# x\n- ``a/b.rs: < becomes <= in `a::b < c` `` both ends are excluded before\n");
        assert_eq!(list.iter().collect::<Vec<_>>(), ["a/b.rs: < becomes <= in `a::b < c`"]);
    }
}
