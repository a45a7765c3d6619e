//! Surveys: many cases of one group through the library, and a table of what became of them. The long ones run when asked for:
//!
//! ```text
//! POLICYC_SURVEY=bench POLICYC_SURVEY_SEED=7 POLICYC_SURVEY_CASES=60 \
//!     cargo test --workspace --test survey asked_for -- --ignored --nocapture
//! ```
//! See docs/reference/blind-cases.md.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::Mutex;

use blind::independent::{Answer, Case, Group, Outcome, Surveyed, judge, surveyed};
use blind::score::interval;
use diagnose::diagnosis::diagnose;
use diagnose::progress::Progress;
use diagnose::record::open_all;
use measured::ColumnMap;
use plant::Parameters;
use serde_json::Value;
use toml_input::{FileName, Files};

/// A fault of the bench is to be named within this time, s.
const SOON: f64 = 2.0;

/// What became of a case.
struct Became {
    answer: Answer,
    /// When the first note or refusal was said, s of the processor.
    noted: Option<f64>,
}

/// Processor's time of this process so far, s.
fn processor() -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let cells: Vec<f64> = text
        .rsplit(')')
        .next()
        .unwrap_or_default()
        .split_whitespace()
        .filter_map(|cell| cell.parse().ok())
        .collect();
    // user and system time, in hundredths; the state, a letter, is not among the numbers
    cells
        .get(10)
        .zip(cells.get(11))
        .map_or(0.0, |(user, system)| (user + system) / 100.0)
}

/// Diagnoses a case through the library; a search that takes more than `limit` seconds is given up.
fn became(case: &Case, limit: f64, is_enough: &(dyn Fn(&str) -> bool + Sync)) -> Became {
    let files: Files = (case.files.iter())
        .map(|(path, text)| (path.clone(), text.clone().into_bytes()))
        .collect();
    let named = |path: &str| FileName::new(Path::new(path)).among(Some(&files));
    let model = Parameters::from_file(named("plant.toml")).expect("the plant file of the generator");
    let of = |folder: &str| -> Vec<FileName> {
        let paths = case.files.iter().map(|(path, _)| path.as_str());
        paths.filter(|path| path.starts_with(folder)).map(named).collect()
    };
    let begun = processor();
    let (train, heldout) = match open_all(&of("train"), &of("heldout"), &ColumnMap::default(), &model) {
        Ok(records) => records,
        Err(faults) => {
            let seconds = processor() - begun;
            let answer = Answer {
                exit: Some(2),
                seconds,
                said: faults.to_string(),
                diagnosis: Value::Null,
            };
            return Became {
                answer,
                noted: Some(seconds),
            };
        }
    };
    let repairs: Vec<String> = train.iter().flat_map(|record| record.repairs.clone()).collect();
    let heard = Mutex::new((repairs.join("\n"), None));
    let first = processor() - begun;
    let say = |what: Progress<'_>| {
        if let Progress::Noticed(words) = what {
            let mut heard = heard.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
            heard.0.push('\n');
            heard.0.push_str(words);
            heard.1.get_or_insert(processor() - begun);
            assert!(!is_enough(&heard.0), "named");
        }
        // a panic is the one way to stop a search from outside
        assert!(processor() - begun < limit, "too long");
    };
    let found = catch_unwind(AssertUnwindSafe(|| diagnose(&model, train, &heldout, &say)));
    let (said, noted) = heard.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    let noted = noted.or((!repairs.is_empty()).then_some(first));
    let diagnosis = found.map_or(Value::Null, |found| {
        serde_json::to_value(&found.findings).expect("an answer is JSON")
    });
    let exit = Some(if diagnosis.is_null() { 3 } else { 0 });
    let answer = Answer {
        exit,
        seconds: processor() - begun,
        said,
        diagnosis,
    };
    Became { answer, noted }
}

/// Everything that an answer says, in lower case.
fn all_words(answer: &Answer) -> String {
    let diagnosis = &answer.diagnosis;
    let parts = ["/sentence", "/structure", "/doubts", "/noise/repairs"]
        .map(|key| diagnosis.pointer(key).map_or(String::new(), Value::to_string));
    format!("{}\n{}", answer.said, parts.join("\n")).to_lowercase()
}

fn has_words(case: &Surveyed, text: &str) -> bool {
    let groups = &case.case.truth.expect.words;
    groups
        .iter()
        .any(|group| group.iter().all(|word| text.contains(&word.to_lowercase())))
}

/// The column of the table that a case counts in.
fn column(group: Group, case: &Surveyed, became: &Became) -> &'static str {
    let answer = &became.answer;
    let verdict = answer.diagnosis["verdict"]
        .as_str()
        .unwrap_or(if answer.exit == Some(2) { "refused" } else { "given up" });
    let outcome = judge(&case.case.truth, answer).outcome;
    let text = all_words(answer);
    let in_words = has_words(case, &text);
    match group {
        Group::Good => match verdict {
            "consistent" => "right",
            "refused" => "refused",
            _ => "false alarm",
        },
        Group::Bench if in_words && became.noted.is_some_and(|noted| noted < SOON) => "right",
        Group::Bench if outcome == Outcome::Right && !in_words => "right by cause",
        Group::Bench if outcome == Outcome::Right && answer.seconds < SOON => "right by cause",
        Group::Bench if in_words => "named late",
        Group::Bench if matches!(verdict, "explained" | "ambiguous" | "mostly_explained") => "wrong word",
        Group::Bench => "missed",
        // a cause at its bound is never named: `ambiguous` is looked at by itself
        Group::Nonsense => match verdict {
            "unexplained" | "refused" => "right",
            "given up" => "given up",
            "ambiguous" => "ambiguous",
            _ => "believed",
        },
        Group::Rhythm | Group::Unlisted => {
            let shown = answer.diagnosis["structure"].to_string().to_lowercase();
            // these words name what it does not follow
            let shown = shown
                .replace("following neither duty nor load nor time alone", "")
                .replace("without a line", "");
            let shaped = case.shapes.iter().any(|word| shown.contains(&word.to_lowercase()));
            match (verdict, outcome) {
                ("given up", _) => "given up",
                ("refused", _) => "refused",
                ("consistent", _) => "missed",
                (_, Outcome::Right) if shaped => "right",
                // the physics itself, which says more than a shape
                ("explained" | "ambiguous", Outcome::Right) => "right by cause",
                (_, Outcome::Right) => "right, other shape",
                _ => "wrong word",
            }
        }
    }
}

/// Runs `cases` of a group and prints what became of each and of all.
///
/// Those of more than `most` rows are not run: settled points alone, or what is short, in the time of a few long records.
fn survey(
    seed: u64,
    group: Group,
    cases: std::ops::Range<usize>,
    (limit, most): (f64, usize),
) -> BTreeMap<&'static str, usize> {
    let mut counts: BTreeMap<&'static str, usize> = BTreeMap::new();
    let mut by_id: BTreeMap<&'static str, BTreeMap<&'static str, usize>> = BTreeMap::new();
    for number in cases {
        let mut case = match surveyed(seed, group, number, false) {
            Ok(case) => case,
            Err(message) => {
                println!("{message}");
                continue;
            }
        };
        if case.rows > most {
            continue;
        }
        // whether a fault is named is known with its note: the search behind it is not waited for
        let is_enough = |said: &str| group == Group::Bench && has_words(&case, &said.to_lowercase());
        let one = became(&case.case, limit, &is_enough);
        let mut what = column(group, &case, &one);
        if (group, what) == (Group::Unlisted, "wrong word") {
            // of what no list has, a cause that leaves next to nothing cannot be told by anybody
            if let Ok(tied) = surveyed(seed, group, number, true) {
                case = tied;
                what = column(group, &case, &one);
            }
        }
        *counts.entry(what).or_default() += 1;
        *by_id.entry(case.id).or_default().entry(what).or_default() += 1;
        let hidden = case
            .case
            .truth
            .hidden
            .first()
            .map_or("nothing", |hidden| hidden.what.as_str());
        let judged = judge(&case.case.truth, &one.answer);
        println!(
            "{number} {} {} rows: {what} [{}] in {:.2} s: {hidden}; {}",
            case.id, case.rows, judged.verdict, one.answer.seconds, case.case.truth.converter
        );
        if what != "right" {
            let sentence = one.answer.diagnosis["sentence"].as_str().unwrap_or(&one.answer.said);
            println!(
                "    {}",
                sentence.chars().take(700).collect::<String>().replace('\n', " ")
            );
            println!(
                "    named {:?}; noted {}",
                judged.named,
                one.answer
                    .said
                    .replace('\n', " | ")
                    .chars()
                    .take(400)
                    .collect::<String>()
            );
        }
        if let Ok(folder) = std::env::var("POLICYC_SURVEY_KEEP") {
            for (path, text) in &case.case.files {
                let path = Path::new(&folder)
                    .join(format!("{}_{number:03}", group.word()))
                    .join(path);
                std::fs::create_dir_all(path.parent().unwrap()).unwrap();
                std::fs::write(path, text).unwrap();
            }
        }
    }
    table(group, &counts, &by_id);
    counts
}

fn table(group: Group, counts: &BTreeMap<&str, usize>, by_id: &BTreeMap<&str, BTreeMap<&str, usize>>) {
    let all: usize = counts.values().sum();
    println!("== {} of {all}", group.word());
    for (what, count) in counts {
        let (low, high) = interval(*count, all);
        println!(
            "| {what} | {count} of {all}, {:.1} % ({:.1} to {:.1} %) |",
            100.0 * *count as f64 / all as f64,
            100.0 * low,
            100.0 * high
        );
    }
    for (id, counts) in by_id {
        println!("  {id}: {counts:?}");
    }
}

#[test]
#[ignore = "minutes to hours: runs what the environment asks for"]
fn what_is_asked_for() {
    let variable = |name: &str| std::env::var(format!("POLICYC_SURVEY{name}")).ok();
    let number = |name: &str, usual: f64| variable(name).and_then(|text| text.parse().ok()).unwrap_or(usual);
    let group = variable("").unwrap_or_else(|| "bench".to_owned());
    let group = Group::ALL
        .into_iter()
        .find(|known| known.word() == group)
        .expect("a group of a survey");
    let first = number("_FIRST", 0.0) as usize;
    let cases = first..first + number("_CASES", 30.0) as usize;
    let seed = variable("_SEED").and_then(|text| text.parse().ok()).unwrap_or(1);
    survey(
        seed,
        group,
        cases,
        (number("_LIMIT", 60.0), number("_MOST", 1e9) as usize),
    );
}

#[test]
fn faults_of_the_bench_are_named_within_seconds() {
    let named = survey(1_795_660_989_316_065_565, Group::Bench, 1..6, (4.0, usize::MAX));
    assert_eq!(named.get("right"), Some(&5), "{named:?}");
}

#[test]
fn records_that_misled_once_have_their_answer() {
    // in the first two the current stops in every period, so that the initial one is forgotten; in the next two a sample at the very start
    // of the period lies before the edge in one row and behind it in another; the last is drawn evenly
    let cases = [
        (Group::Good, 54),
        (Group::Good, 83),
        (Group::Good, 27),
        (Group::Good, 50),
        (Group::Nonsense, 1),
    ];
    for (group, number) in cases {
        let found = survey(1_795_731_871_201_373_090, group, number..number + 1, (60.0, usize::MAX));
        assert_eq!(found.get("right"), Some(&1), "{group:?} {number}: {found:?}");
    }
    // a core of another power, whose rest was a late sensor, is found; a bent voltmeter is no gain and no offset where held out it shifts
    for (number, answer) in [(22, "right by cause"), (83, "right")] {
        let seed = 1_795_963_070_261_140_255;
        let found = survey(seed, Group::Unlisted, number..number + 1, (60.0, usize::MAX));
        assert_eq!(found.get(answer), Some(&1), "{number}: {found:?}");
    }
}
