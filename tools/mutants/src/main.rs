//! Changes to interp, policy and codegen, and whether a test notices.
//!
//! ```text
//! sources ─► draw by a seed ─► one copy of the workspace, each mutant behind a switch ─► one build ─► each test, no
//! mutant on: which switches each test asks ─► each mutant: the tests that ask it, the quickest first, until one fails
//! ```
//!
//! A tool that builds anew for each mutant takes a minute or more for each, on two cores.

mod changes;
mod copy;
mod draw;
mod instrument;
mod programs;
mod results;
mod run;
mod sites;

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use draw::{Drawn, Population};
use programs::{Build, Built, Test};
use results::Results;
use run::{End, Switched};

const USAGE: &str = "\
usage: cargo xtask mutants --seed S [--sample N] [--within T] [--without P] ... [--again [--with P]] [--table]

  --seed S     which mutants are drawn
  --sample N   so many of each of interp, policy and codegen (50)
  --within T   only by tests that take T seconds at most: a first look, what they do not catch stays open
  --without P  not by the tests that begin so, which are not measured either; what the others do not catch stays open
  --again      those that no test caught once more: a test may be new
  --with P     only by the tests that begin so, as `policy/` or `policy/chains: a_row`; what they do not catch stays as it was
  --table      only what is known, nothing is run

Results are in target/mutants/S.jsonl; a run that was stopped goes on. What changes nothing is listed in tools/mutants/equal.md.
";

/// A test may compute this many times as long as without a mutant, and [`GRACE`] beside it.
const PATIENCE: u32 = 10;
const GRACE: Duration = Duration::from_secs(10);
/// Tests that take longer than this are named.
const TOLD: Duration = Duration::from_secs(2);
/// A test that computes longer than this without a mutant does not end.
const LONGEST: Duration = Duration::from_secs(900);

#[derive(Debug, Default)]
struct Options {
    seed: u64,
    sample: usize,
    within: Option<Duration>,
    again: bool,
    with: String,
    without: Vec<String>,
    table: bool,
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let options = match parse(&arguments) {
        Ok(options) => options,
        Err(message) => {
            eprint!("error: {message}\n\n{USAGE}");
            return ExitCode::from(2);
        }
    };
    match Folders::here().and_then(|folders| work(&options, &folders)) {
        Ok(table) => {
            print!("{table}");
            ExitCode::SUCCESS
        }
        Err(message) => {
            eprintln!("error: {message}");
            ExitCode::FAILURE
        }
    }
}

fn parse(arguments: &[String]) -> Result<Options, String> {
    let mut options = Options {
        sample: 50,
        ..Options::default()
    };
    let mut seed = None;
    let mut words = arguments.iter();
    while let Some(word) = words.next() {
        let number = |words: &mut std::slice::Iter<'_, String>| {
            let text = words.next().ok_or_else(|| format!("`{word}` takes a number"))?;
            text.parse::<u64>()
                .map_err(|_| format!("`{word}` takes a number, found `{text}`"))
        };
        match word.as_str() {
            "--seed" => seed = Some(number(&mut words)?),
            "--sample" => options.sample = usize::try_from(number(&mut words)?).unwrap_or(usize::MAX),
            "--within" => options.within = Some(Duration::from_secs(number(&mut words)?)),
            "--without" => {
                let program = words.next().ok_or("`--without` takes the name of a program")?;
                options.without.push(program.clone());
            }
            "--again" => options.again = true,
            "--with" => options.with = words.next().ok_or("`--with` takes the name of a program")?.clone(),
            "--table" => options.table = true,
            _ => return Err(format!("unknown option `{word}`")),
        }
    }
    options.seed = seed.ok_or("`--seed` is missing")?;
    if !options.with.is_empty() && !options.again {
        return Err("`--with` comes with `--again`: a new mutant is for all tests".into());
    }
    Ok(options)
}

/// Where things are.
struct Folders {
    root: PathBuf,
    copy: PathBuf,
    build: PathBuf,
    out: PathBuf,
}

impl Folders {
    fn here() -> Result<Self, String> {
        let root = std::env::current_dir().map_err(|error| error.to_string())?;
        if !root.join("interp/src").is_dir() {
            return Err("start it in the root of the workspace, or by `cargo xtask mutants`".into());
        }
        let out = root.join("target/mutants");
        std::fs::create_dir_all(&out).map_err(|error| format!("{}: {error}", out.display()))?;
        Ok(Folders {
            copy: out.join("workspace"),
            build: out.join("build"),
            out,
            root,
        })
    }
}

fn work(options: &Options, folders: &Folders) -> Result<String, String> {
    let population = draw::population(&folders.root, options.seed)?;
    let mut results = Results::open(&folders.out.join(format!("{}.jsonl", options.seed)))?;
    let equal = std::fs::read_to_string(folders.root.join("tools/mutants/equal.md")).unwrap_or_default();
    let equal = results::judged(&equal);
    say(&format!(
        "{} places, and {} that are evaluated while it compiles; {} calls of macros are not looked into",
        population.mutants.iter().map(Vec::len).sum::<usize>(),
        population.constant,
        population.macros
    ));
    if options.table {
        return Ok(results.table(
            &sample(&population, &results, options.sample),
            &draw::names(&population),
            &equal,
        ));
    }
    let (built, tests) = build(options, folders, &population, &mut results)?;
    let tests: Vec<Test> = tests
        .into_iter()
        .filter(|test| {
            let begins = |name: &String| test.label().starts_with(name);
            begins(&options.with) && !options.without.iter().any(begins)
        })
        .collect();
    let mut asked = measured(&tests, folders, built.len())?;
    asked.retain(|asked| options.within.is_none_or(|most| asked.seconds <= most));
    let asks_all = options.with.is_empty() && options.without.is_empty() && options.within.is_none();
    let sample = sample(&population, &results, options.sample);
    let names = draw::names(&population);
    // an equal one passes whatever it is asked, and costs more than a hundred others
    let is_equal = |key: &String| names.get(key).is_some_and(|name| equal.contains(name));
    for key in sample.iter().map(Drawn::key) {
        if is_equal(&key) && results.of(&key).is_none() {
            results.add(&key, "passed", "as judged", 0.0)?;
        }
        let Some(number) = built.iter().position(|drawn| drawn.key() == key) else {
            return Err(format!("{key} was not built"));
        };
        let is_known = match results.of(&key) {
            Some("passed" | "not reached" | "stuck") => !options.again,
            other => other.is_some(),
        };
        if !is_known {
            let (end, by, seconds) = try_one(number, &asked)?;
            say(&format!("{end}: {key} {by} ({seconds:.1} s)"));
            if asks_all || results::is_caught(end) {
                results.add(&key, end, &by, seconds)?;
            }
        }
    }
    Ok(results.table(&sample, &names, &equal))
}

/// The first of each crate in the order of the seed, without those that do not compile.
fn sample(population: &Population, results: &Results, count: usize) -> Vec<Drawn> {
    let compiles = |drawn: &&Drawn| results.of(&drawn.key()) != Some("does not compile");
    let crates = population.mutants.iter();
    crates
        .flat_map(|mutants| mutants.iter().filter(compiles).take(count).cloned())
        .collect()
}

/// Builds, without those that do not compile. Some more mutants than are wanted are in it, which take their places: to build
/// without them at the end would build everything twice.
fn build(
    options: &Options,
    folders: &Folders,
    population: &Population,
    results: &mut Results,
) -> Result<(Vec<Drawn>, Vec<Test>), String> {
    let spare = options.sample / 3 + 5;
    loop {
        let mutants = sample(population, results, options.sample + spare);
        let placed = copy::refresh(&folders.root, &folders.copy, &mutants)?;
        let cargo = Build {
            root: &folders.copy,
            target: &folders.build,
        };
        match cargo.tests(&placed, &folders.out.join("programs"))? {
            Built::Tests(tests) => return Ok((mutants, tests)),
            Built::Without(bad) => {
                say(&format!("{} of {} do not compile", bad.len(), mutants.len()));
                for number in bad {
                    results.add(&mutants[number].key(), "does not compile", "", 0.0)?;
                }
            }
        }
    }
}

/// A test, how long it takes, and the mutants whose switch it asks.
struct Asked {
    test: Test,
    seconds: Duration,
    mutants: BTreeSet<usize>,
}

/// Runs each test without a mutant. The quickest comes first.
fn measured(tests: &[Test], folders: &Folders, count: usize) -> Result<Vec<Asked>, String> {
    let file = folders.out.join(format!("asked-{}", std::process::id()));
    let mut all = Vec::new();
    for test in tests {
        let _ = std::fs::remove_file(&file);
        let (end, seconds) = run::run(test, Switched::Asked(&file), LONGEST)?;
        let text = std::fs::read_to_string(&file).unwrap_or_default();
        let mutants: BTreeSet<usize> = text.lines().filter_map(|line| line.parse().ok()).collect();
        let reached = mutants.iter().filter(|number| **number < count).count();
        if seconds > TOLD || end != End::Passed {
            let seconds = seconds.as_secs_f64();
            say(&format!("{}: {seconds:.1} s, {reached} mutants, {end:?}", test.label()));
        }
        if end != End::Passed {
            return Err(format!(
                "{} fails without a mutant: {}",
                test.label(),
                test.path.display()
            ));
        }
        all.push(Asked {
            test: test.clone(),
            seconds,
            mutants,
        });
    }
    let _ = std::fs::remove_file(&file);
    let total: Duration = all.iter().map(|asked| asked.seconds).sum();
    say(&format!(
        "{} tests pass without a mutant, in {:.0} s",
        all.len(),
        total.as_secs_f64()
    ));
    all.sort_by_key(|asked| asked.seconds);
    Ok(all)
}

/// How it ended, by which test, and after how many seconds.
fn try_one(number: usize, tests: &[Asked]) -> Result<(&'static str, String, f64), String> {
    let mut total = 0.0;
    let mut last = ("not reached", String::new());
    for asked in tests.iter().filter(|asked| asked.mutants.contains(&number)) {
        let limit = asked.seconds * PATIENCE + GRACE;
        let (end, seconds) = run::run(&asked.test, Switched::On(number), limit)?;
        total += seconds.as_secs_f64();
        last = match end {
            // one that stood still is no reason to leave out the others
            End::Passed | End::Stuck if last.0 == "stuck" => last,
            End::Passed => ("passed", String::new()),
            End::Stuck => ("stuck", asked.test.label()),
            End::Failed => ("failed", asked.test.label()),
            End::Looped => ("looped", asked.test.label()),
            End::Grew => ("grew", asked.test.label()),
        };
        if matches!(end, End::Failed | End::Looped | End::Grew) {
            still_passes(asked)?;
            break;
        }
    }
    Ok((last.0, last.1, total))
}

/// Without the mutant the test has to pass again, or it was the machine and not the mutant that failed it.
fn still_passes(asked: &Asked) -> Result<(), String> {
    match run::run(&asked.test, Switched::Off, LONGEST)?.0 {
        End::Passed => Ok(()),
        end => Err(format!(
            "{} passed without a mutant and now does not: {end:?}",
            asked.test.label()
        )),
    }
}

/// Progress goes to standard error: the table alone is the result.
fn say(line: &str) {
    eprintln!("{line}");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seed_is_asked_for_and_numbers_are_read() {
        let words = |line: &str| line.split(' ').map(str::to_owned).collect::<Vec<_>>();
        let options = parse(&words("--seed 7 --sample 20 --again")).unwrap();
        assert_eq!((options.seed, options.sample, options.again), (7, 20, true));
        let first_look = parse(&words("--seed 7 --within 3")).unwrap();
        assert_eq!(
            parse(&words("--seed 7 --without tests/cli --without tests/on_target"))
                .unwrap()
                .without,
            ["tests/cli", "tests/on_target"]
        );
        assert_eq!(
            (options.within, first_look.within),
            (None, Some(Duration::from_secs(3)))
        );
        assert!(parse(&words("--sample 3")).unwrap_err().contains("--seed"));
        assert!(parse(&words("--seed x")).unwrap_err().contains("`x`"));
        assert!(parse(&words("--sede 1")).unwrap_err().contains("`--sede`"));
        assert_eq!(
            parse(&words("--seed 7 --again --with policy/")).unwrap().with,
            "policy/"
        );
        assert!(
            parse(&words("--seed 7 --with policy/"))
                .unwrap_err()
                .contains("--again")
        );
    }

    /// The same seed draws the same mutants, another one others; and there are thousands to draw from.
    #[test]
    fn a_seed_draws_the_same_mutants_again() {
        let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        let first = |seed| -> Vec<String> {
            let population = draw::population(&root, seed).unwrap();
            assert!(population.mutants.iter().all(|mutants| mutants.len() > 300));
            population.mutants.iter().map(|mutants| mutants[0].key()).collect()
        };
        assert_eq!(first(1), first(1));
        assert_ne!(first(1), first(2));
    }
}
