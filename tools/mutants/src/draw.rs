//! All mutants of the three crates, in an order that a seed draws.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use random::{Random, SplitMix};

use crate::sites::{self, Mutant};

/// Folders of the crates that are changed: what decides the bits of a command.
pub const CRATES: [&str; 3] = ["interp", "policy", "codegen"];

/// One mutant and where it stands.
#[derive(Clone, Debug)]
pub struct Drawn {
    /// A folder of [`CRATES`].
    pub krate: &'static str,
    /// From the root of the workspace.
    pub file: PathBuf,
    /// The change itself.
    pub mutant: Mutant,
}

impl Drawn {
    /// Its name in results: place and change.
    pub fn key(&self) -> String {
        let (line, column) = self.mutant.place;
        format!("{}:{line}:{column}: {}", self.file.display(), self.mutant.text)
    }
}

/// The name of each mutant in the list of those that change nothing, by its [`Drawn::key`]: file and change without the line,
/// which edits elsewhere move. Equal changes in a file are counted, `#2` the second: a reason stands for one place alone.
pub fn names(population: &Population) -> BTreeMap<String, String> {
    let mut alike: BTreeMap<String, Vec<&Drawn>> = BTreeMap::new();
    for drawn in population.mutants.iter().flatten() {
        let name = format!("{}: {}", drawn.file.display(), drawn.mutant.text);
        alike.entry(name).or_default().push(drawn);
    }
    let mut names = BTreeMap::new();
    for (name, mut all) in alike {
        all.sort_by_key(|drawn| drawn.mutant.place);
        let is_one = all.len() == 1;
        names.extend(all.iter().enumerate().map(|(at, drawn)| {
            let own = if is_one {
                name.clone()
            } else {
                format!("{name} #{}", at + 1)
            };
            (drawn.key(), own)
        }));
    }
    names
}

/// What the crates hold.
#[derive(Debug, Default)]
pub struct Population {
    /// For each crate its mutants, in the order in which they are drawn.
    pub mutants: Vec<Vec<Drawn>>,
    /// See [`sites::Found`].
    pub constant: usize,
    /// See [`sites::Found`].
    pub macros: usize,
}

/// Reads the sources below `root`.
///
/// # Errors
/// A source that cannot be read or is no Rust.
pub fn population(root: &Path, seed: u64) -> Result<Population, String> {
    let mut all = Population::default();
    for krate in CRATES {
        let mut mutants = Vec::new();
        for file in sources(&root.join(krate).join("src"))? {
            let text = std::fs::read_to_string(&file).map_err(|error| format!("{}: {error}", file.display()))?;
            let found = sites::find(&text).map_err(|error| format!("{}: {error}", file.display()))?;
            all.constant += found.constant;
            all.macros += found.macros;
            let file = file.strip_prefix(root).unwrap_or(&file).to_owned();
            mutants.extend(found.mutants.into_iter().map(|mutant| Drawn {
                krate,
                file: file.clone(),
                mutant,
            }));
        }
        // Fisher and Yates; a crate's order does not depend on what the others hold
        let mut random = SplitMix::new(seed);
        for last in (1..mutants.len()).rev() {
            mutants.swap(last, random.below(last + 1));
        }
        all.mutants.push(mutants);
    }
    Ok(all)
}

/// The unit tests of a module, where they have a file of their own: what they are given is no code of the crate.
fn is_of_tests(path: &Path) -> bool {
    path.file_name().is_some_and(|name| name == "tests.rs")
}

fn sources(folder: &Path) -> Result<Vec<PathBuf>, String> {
    let entries = std::fs::read_dir(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let mut paths: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    paths.sort();
    let mut files = Vec::new();
    for path in paths {
        if path.is_dir() {
            files.extend(sources(&path)?);
        } else if path.extension().is_some_and(|extension| extension == "rs") && !is_of_tests(&path) {
            files.push(path);
        }
    }
    Ok(files)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_changes_in_a_file_have_names_of_their_own_wherever_their_lines_go() {
        let names_of = |text: &str| {
            let mutants = sites::find(text).unwrap().mutants.into_iter().rev();
            let drawn = mutants.map(|mutant| Drawn {
                krate: "interp",
                file: "a.rs".into(),
                mutant,
            });
            let population = Population {
                mutants: vec![drawn.collect()],
                ..Population::default()
            };
            names(&population)
        };
        let names = names_of("fn f() -> &X {\n g(!a, 7);\n g(b, 7) }");
        assert_eq!(names["a.rs:2:4: no ! in `!a`"], "a.rs: no ! in `!a`");
        assert_eq!(names["a.rs:2:8: 7 becomes 8"], "a.rs: 7 becomes 8 #1");
        assert_eq!(names["a.rs:3:7: 7 becomes 8"], "a.rs: 7 becomes 8 #2");
    }
}
