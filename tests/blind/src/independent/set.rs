//! A set of cases: made, kept, diagnosed and scored.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use crate::independent::draft::{Case, Name};
use crate::independent::families::{Options, draw, ids};
use crate::independent::judge::{Answer, Judgement, judge};
use crate::independent::records::Extent;
use crate::independent::tally;
use crate::independent::truth::{Family, Truth};
use crate::rng::Rng;

/// Twelve cases in a row: how many of each family.
const ROUND: [(Family, usize); 6] = [
    (Family::Healthy, 2),
    (Family::Cause, 4),
    (Family::Disturbed, 1),
    (Family::Bench, 2),
    (Family::Nonsense, 1),
    (Family::Unlisted, 2),
];
/// A cause that does not show on one converter is tried on others.
const DRAWS: u64 = 400;
/// Nobody waits longer for an answer, s.
const LIMIT: &str = "900";

/// A set as it is asked for.
#[derive(Debug, Clone)]
pub struct Set {
    /// Everything follows from it.
    pub seed: u64,
    /// How many cases.
    pub cases: usize,
    /// Folder of the set.
    pub out: PathBuf,
    /// Cases of this family alone.
    pub only: Option<Family>,
    /// Short records.
    pub short: bool,
    /// Look for what else explains the records.
    pub rivals: bool,
    /// No other topology than the buck.
    pub buck_only: bool,
    /// Cases at a time.
    pub jobs: usize,
}

/// Family of a case, its number in the family, and what is hidden in it.
fn planned(seed: u64, case: usize, only: Option<Family>) -> (Family, &'static str) {
    let (family, number) = match only {
        Some(family) => (family, case),
        None => {
            let mut order: Vec<Family> = ROUND.iter().flat_map(|(family, many)| vec![*family; *many]).collect();
            let round = case / order.len();
            let own = |round: usize| {
                let mut order = order.clone();
                Rng::new(seed, &[71, round as u64]).shuffle(&mut order);
                order
            };
            let here = own(round);
            let family = here[case % order.len()];
            let many = order.iter().filter(|other| **other == family).count();
            let before = here[..case % order.len()]
                .iter()
                .filter(|other| **other == family)
                .count();
            order.clear();
            (family, round * many + before)
        }
    };
    let mut all = ids(family);
    let turn = number / all.len();
    Rng::new(seed, &[72, family as u64, turn as u64]).shuffle(&mut all);
    (family, all[number % all.len()])
}

/// Makes one case: draws until what is hidden shows.
///
/// # Errors
/// If no draw does.
pub fn make(
    seed: u64,
    case: usize,
    only: Option<Family>,
    short: bool,
    rivals: bool,
    buck_only: bool,
) -> Result<Case, String> {
    let (family, id) = planned(seed, case, only);
    let name = Name { seed, case, family };
    let extent = if short { Extent::Short } else { Extent::Full };
    let options = Options {
        extent,
        rivals,
        buck_only,
    };
    (0..DRAWS)
        .find_map(|draws| draw(name, id, options, &mut Rng::new(seed, &[73, case as u64, draws])))
        .ok_or_else(|| format!("case {case}: {id} never shows in {DRAWS} draws"))
}

impl Set {
    fn case_folder(&self, case: usize) -> PathBuf {
        self.out.join("cases").join(format!("case_{case:03}"))
    }

    /// Makes, diagnoses with `policyc` unless it is none, and writes `score.md` and `score.json`; returns the score.
    ///
    /// # Errors
    /// If a file cannot be read or written, or the folder holds another set.
    pub fn run(&self, policyc: Option<&Path>) -> Result<String, String> {
        create(&self.out.join("cases"))?;
        let (next, done) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let (failed, judged) = (Mutex::new(Vec::new()), Mutex::new(Vec::new()));
        let work = || {
            loop {
                let case = next.fetch_add(1, Ordering::Relaxed);
                if case >= self.cases {
                    return;
                }
                let started = Instant::now();
                let outcome = self.one(case, policyc);
                let count = done.fetch_add(1, Ordering::Relaxed) + 1;
                let seconds = started.elapsed().as_secs_f64();
                let line = match &outcome {
                    Ok(None) => "made".to_owned(),
                    Ok(Some(judgement)) => format!("{}: {}", judgement.family.word(), judgement.outcome.word()),
                    Err(message) => format!("failed: {message}"),
                };
                println!("[{count}/{}] case_{case:03} {line} ({seconds:.1} s)", self.cases);
                match outcome {
                    Ok(judgement) => locked(&judged, |all| all.extend(judgement.map(|judgement| (case, judgement)))),
                    Err(message) => locked(&failed, |all| all.push(message)),
                }
            }
        };
        std::thread::scope(|scope| {
            for _ in 0..self.jobs.max(1) {
                scope.spawn(work);
            }
        });
        let failed = failed.into_inner().unwrap_or_default();
        let mut judged: Vec<(usize, Judgement)> = judged.into_inner().unwrap_or_default();
        judged.sort_by_key(|(case, _)| *case);
        let text = tally::markdown(self.seed, &judged);
        if policyc.is_some() {
            write(&self.out.join("score.md"), &text)?;
            write(&self.out.join("score.json"), &tally::json(self.seed, &judged))?;
        }
        match failed.is_empty() {
            true => Ok(text),
            false => Err(format!("{} cases failed:\n{}", failed.len(), failed.join("\n"))),
        }
    }

    fn one(&self, case: usize, policyc: Option<&Path>) -> Result<Option<Judgement>, String> {
        let folder = self.case_folder(case);
        if !folder.join("truth.json").exists() {
            let made = make(self.seed, case, self.only, self.short, self.rivals, self.buck_only)?;
            self.keep(case, &made)?;
        }
        let truth: Truth = read(&folder.join("truth.json"))?;
        if truth.seed != self.seed || self.only.is_some_and(|family| family != truth.family) {
            return Err(format!("{} is a case of another set", folder.display()));
        }
        let Some(policyc) = policyc else { return Ok(None) };
        let answers = self.out.join("diagnoses").join(format!("case_{case:03}"));
        if !answers.join("answer.json").exists() {
            let answer = diagnose(policyc, &folder, &answers)?;
            let text = serde_json::to_string_pretty(&answer).map_err(|error| error.to_string())?;
            write(&answers.join("answer.json"), &(text + "\n"))?;
        }
        let answer: Answer = read(&answers.join("answer.json"))?;
        Ok(Some(judge(&truth, &answer)))
    }

    /// An interrupted run leaves no half case behind.
    fn keep(&self, case: usize, made: &Case) -> Result<(), String> {
        let draft = self.out.join("cases").join(format!(".case_{case:03}"));
        let _ = std::fs::remove_dir_all(&draft);
        for (path, text) in &made.files {
            let path = draft.join(path);
            create(path.parent().unwrap_or(&draft))?;
            write(&path, text)?;
        }
        let truth = serde_json::to_string_pretty(&made.truth).map_err(|error| error.to_string())?;
        write(&draft.join("truth.json"), &(truth + "\n"))?;
        let folder = self.case_folder(case);
        std::fs::rename(&draft, &folder).map_err(|error| format!("{}: {error}", folder.display()))
    }
}

fn locked<T>(all: &Mutex<T>, change: impl FnOnce(&mut T)) {
    if let Ok(mut all) = all.lock() {
        change(&mut all);
    }
}

/// Runs the command as a user does, and takes what it said, how it ended, and the processor's time.
fn diagnose(policyc: &Path, case: &Path, answers: &Path) -> Result<Answer, String> {
    create(answers)?;
    let out = answers.join("out");
    let _ = std::fs::remove_dir_all(&out);
    let times = answers.join("times.txt");
    // `times` of a POSIX shell: user and system time of the children stand on its second line
    let script = "limit=$1; times=$2; shift 2; timeout \"$limit\" \"$@\"; code=$?; times > \"$times\"; exit $code";
    let mut command = Command::new("sh");
    command.args(["-c", script, "sh", LIMIT]).arg(&times).arg(policyc);
    command.arg("diagnose").arg("--model").arg(case.join("plant.toml"));
    for (option, folder) in [("--train", "train"), ("--heldout", "heldout")] {
        command.arg(option).args(tables(&case.join(folder))?);
    }
    command.arg("--out").arg(&out);
    let output = command.output().map_err(|error| format!("sh: {error}"))?;
    let diagnosis = match std::fs::read_to_string(out.join("diagnosis.json")) {
        Ok(text) => serde_json::from_str(&text).map_err(|error| format!("{}: {error}", out.display()))?,
        Err(_) => serde_json::Value::Null,
    };
    let said = [&output.stdout[..], &output.stderr[..]].concat();
    Ok(Answer {
        exit: output.status.code(),
        seconds: cpu_seconds(&std::fs::read_to_string(&times).unwrap_or_default()),
        said: String::from_utf8_lossy(&said).into_owned(),
        diagnosis,
    })
}

/// User and system time of the children in the text of `times`.
fn cpu_seconds(text: &str) -> f64 {
    let seconds = |word: &str| {
        let (minutes, seconds) = word.trim_end_matches('s').split_once('m')?;
        Some(60.0 * minutes.parse::<f64>().ok()? + seconds.parse::<f64>().ok()?)
    };
    let line = text.lines().nth(1).unwrap_or_default();
    line.split_whitespace().filter_map(seconds).sum()
}

fn tables(folder: &Path) -> Result<Vec<PathBuf>, String> {
    let entries = std::fs::read_dir(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let mut files: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    files.sort();
    Ok(files)
}

fn read<T: serde::de::DeserializeOwned>(path: &Path) -> Result<T, String> {
    let text = std::fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))?;
    serde_json::from_str(&text).map_err(|error| format!("{}: {error}", path.display()))
}

fn create(folder: &Path) -> Result<(), String> {
    std::fs::create_dir_all(folder).map_err(|error| format!("{}: {error}", folder.display()))
}

fn write(path: &Path, text: &str) -> Result<(), String> {
    std::fs::write(path, text).map_err(|error| format!("{}: {error}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_round_of_twelve_has_every_family() {
        for (family, many) in ROUND {
            let here = (24..36).filter(|case| planned(5, *case, None).0 == family).count();
            assert_eq!(here, many, "{family:?}");
        }
    }

    #[test]
    fn every_id_comes_before_one_comes_twice() {
        let all = ids(Family::Cause);
        let mut met: Vec<&str> = (0..all.len())
            .map(|case| planned(9, case, Some(Family::Cause)).1)
            .collect();
        met.sort_unstable();
        let mut wanted = all.clone();
        wanted.sort_unstable();
        assert_eq!(met, wanted);
    }

    #[test]
    fn times_of_the_children_are_added() {
        assert!((cpu_seconds("0m0.00s 0m0.01s\n1m2.50s 0m0.25s\n") - 62.75).abs() < 1e-12);
    }
}
