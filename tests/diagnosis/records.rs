//! The records in `examples/diagnose/records`: the seeds that their README states make them again, and the diagnosis finds in
//! them what it states.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use blind::case::measure;
use blind::experiment::Extent;
use blind::plan::{Plan, plan_of};
use blind::score::diagnosis::{Cause, Diagnosis, Estimate, Verdict};
use tests::tools::{policyc, run};

/// Records of one converter: their seed, what is hidden, and each record with the path that the generator gives it.
struct Set {
    seed: u64,
    hidden: &'static [&'static str],
    files: &'static [(&'static str, &'static str)],
}

const SETS: [Set; 3] = [
    Set {
        seed: 16,
        hidden: &["dcr"],
        files: &[
            ("load-steps.csv", "heldout/lstep_I_10k.csv"),
            ("duty-steps.csv", "train/dstep_R_10k.csv"),
            ("power-steps.csv", "train/cpl_open_10k.csv"),
        ],
    },
    Set {
        seed: 21,
        hidden: &[],
        files: &[("nothing-wrong.csv", "train/dstep_R_10k.csv")],
    },
    Set {
        seed: 31,
        hidden: &["load_cable"],
        files: &[("ringing.csv", "heldout/lstep_I_10k.csv")],
    },
];

/// A tenth of the noise of the currents: another version of ngspice may take other steps, but it has the same circuit.
const AS_GOOD_AS_EQUAL: f64 = 0.005;

fn folder() -> PathBuf {
    tests::root().join("examples/diagnose/records")
}

fn planned(set: &Set) -> Plan {
    plan_of(set.seed, 0, set.hidden, Extent::Short).unwrap()
}

#[test]
fn the_seeds_of_the_readme_make_the_records_again() {
    let readme = std::fs::read_to_string(folder().join("README.md")).unwrap();
    for set in &SETS {
        let what = if set.hidden.is_empty() {
            "none".to_owned()
        } else {
            set.hidden.join(",")
        };
        let command = format!("cargo xtask blind --seed {} --cases 1 --only {what} --short", set.seed);
        assert!(readme.contains(&command), "the README does not say: {command}");
        let measured = measure(&planned(set), false).unwrap();
        for (name, path) in set.files {
            assert!(readme.contains(name) && readme.contains(path), "{name}, {path}");
            let (_, again) = measured.files.iter().find(|(file, _)| file == path).unwrap();
            let kept = std::fs::read_to_string(folder().join(name)).unwrap();
            assert_eq!(difference(&kept, again), None, "{name}");
        }
    }
}

/// What is not the same in two tables of numbers.
fn difference(kept: &str, again: &str) -> Option<String> {
    if kept.lines().next() != again.lines().next() || kept.lines().count() != again.lines().count() {
        return Some("other columns or another number of rows".to_owned());
    }
    let numbers = |line: &str| line.split(',').map(|cell| cell.parse().unwrap()).collect::<Vec<f64>>();
    let apart = |(kept, again): &(&str, &str)| {
        let mut pairs = numbers(kept).into_iter().zip(numbers(again));
        pairs.any(|(a, b)| (a - b).abs() > AS_GOOD_AS_EQUAL)
    };
    let mut rows = kept.lines().zip(again.lines()).skip(1);
    rows.find(apart).map(|(kept, again)| format!("{kept}\n{again}"))
}

#[test]
fn another_number_in_a_record_is_a_difference() {
    let kept = "t,v_o\n0.1,100.00\n0.2,100.01\n";
    assert_eq!(difference(kept, &kept.replace("100.01", "100.012")), None);
    assert!(difference(kept, &kept.replace("100.01", "100.02")).is_some());
    assert!(difference(kept, &kept.replace("v_o", "i_l")).is_some());
    assert!(difference(kept, "t,v_o\n0.1,100.00\n").is_some());
}

/// The four diagnoses of the tutorial.
struct Diagnoses {
    one_experiment: Diagnosis,
    two_experiments: Diagnosis,
    nothing_wrong: Diagnosis,
    ringing: Diagnosis,
    /// What the command prints.
    ringing_said: String,
}

fn diagnoses() -> &'static Diagnoses {
    static DIAGNOSES: OnceLock<Diagnoses> = OnceLock::new();
    DIAGNOSES.get_or_init(|| {
        let (ringing, ringing_said) = diagnosis(&["ringing.csv"], &[]);
        Diagnoses {
            one_experiment: diagnosis(&["load-steps.csv"], &["power-steps.csv"]).0,
            two_experiments: diagnosis(&["load-steps.csv", "duty-steps.csv"], &["power-steps.csv"]).0,
            nothing_wrong: diagnosis(&["nothing-wrong.csv"], &[]).0,
            ringing,
            ringing_said,
        }
    })
}

fn diagnosis(train: &[&str], heldout: &[&str]) -> (Diagnosis, String) {
    let out = tempfile::tempdir().unwrap();
    let mut command = Command::new(policyc());
    command
        .current_dir(folder())
        .args(["diagnose", "--model", "../../blind/plant.toml", "--train"]);
    command.args(train);
    if !heldout.is_empty() {
        command.arg("--heldout").args(heldout);
    }
    let ran = run(command.arg("--out").arg(out.path().join("found")));
    assert_eq!(ran.code, Some(0), "{train:?}\n{}", ran.stderr);
    (read(&out.path().join("found/diagnosis.json")), ran.stdout)
}

fn read(path: &Path) -> Diagnosis {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// Ids and hidden values of a set.
fn truth(set: &Set) -> Vec<(&'static str, Vec<(&'static str, f64)>)> {
    let plan = planned(set);
    let of = |effect: &&'static blind::effects::Effect| {
        let values = effect.parameters.iter().map(|p| (p.name, p.get(&plan.bench)));
        (effect.id, values.collect())
    };
    plan.effects.iter().map(of).collect()
}

/// Where a diagnosis is not the truth: another cause, one too many or too few, a rival, a value outside of its interval.
fn disagreement(found: &Diagnosis, truth: &[(&str, Vec<(&str, f64)>)]) -> Option<String> {
    let named: Vec<&str> = found.causes.iter().map(|cause| cause.id.as_str()).collect();
    let hidden: Vec<&str> = truth.iter().map(|(id, _)| *id).collect();
    if named != hidden || found.causes.iter().any(|cause| !cause.rivals.is_empty()) {
        return Some(format!("{hidden:?} is hidden, found is {:?}", found.causes));
    }
    let holds = |estimate: &Estimate, value: f64| {
        estimate.low.is_some_and(|low| low <= value) && estimate.high.is_some_and(|high| value <= high)
    };
    let is_off = |cause: &Cause, values: &[(&str, f64)]| {
        let outside =
            |(name, value): &(&str, f64)| !cause.parameters.get(*name).is_some_and(|found| holds(found, *value));
        values.iter().any(outside)
    };
    let mut pairs = found.causes.iter().zip(truth);
    pairs
        .find(|(cause, (_, values))| is_off(cause, values))
        .map(|(cause, (_, values))| format!("{values:?} is hidden, found is {cause:?}"))
}

#[test]
fn two_experiments_show_the_cause_and_a_model_that_predicts_a_third() {
    let found = &diagnoses().two_experiments;
    assert_eq!(found.verdict, Verdict::Explained);
    assert_eq!(disagreement(found, &truth(&SETS[0])), None);
    let whole = found.gain.heldout.iter().filter(|held| held.regime == "all");
    let mut shrunk = 0;
    for held in whole {
        // four standard errors of the error of 150 rows, if it is nothing but noise
        assert!(held.rmse_after < held.floor * 1.25, "{held:?}");
        shrunk += usize::from(held.rmse_after < 0.3 * held.rmse_before);
    }
    assert!(shrunk >= 2, "{:?}", found.gain);
}

#[test]
fn one_experiment_leaves_a_tie_that_holds_the_cause() {
    let found = &diagnoses().one_experiment;
    assert_eq!(found.verdict, Verdict::Ambiguous);
    let first = &found.causes[0];
    let mut tied: Vec<&str> = first
        .rivals
        .iter()
        .flat_map(|rival| rival.ids())
        .map(String::as_str)
        .collect();
    tied.push(&first.id);
    assert!(tied.contains(&"dcr") && tied.contains(&"diode"), "{tied:?}");
}

#[test]
fn nothing_is_found_where_nothing_is_wrong_and_no_cause_where_none_explains() {
    let all = diagnoses();
    assert_eq!(all.nothing_wrong.verdict, Verdict::Consistent);
    assert_eq!(disagreement(&all.nothing_wrong, &truth(&SETS[1])), None);
    assert_eq!(
        (all.ringing.verdict, all.ringing.causes.len()),
        (Verdict::Unexplained, 0)
    );
}

#[test]
fn what_comes_nearest_is_said_where_nothing_explains_and_called_no_explanation() {
    let said = &diagnoses().ringing_said;
    assert!(said.contains("Nearest comes "), "{said}");
    assert!(
        said.contains("% of the error above the noise: too little for an explanation"),
        "{said}"
    );
}

#[test]
fn the_verdict_is_printed_before_the_notes() {
    let model = "../../blind/plant.toml";
    let out = tempfile::tempdir().unwrap();
    // values cut to tenths lie on the steps of a converter, which is a note
    let table = std::fs::read_to_string(folder().join("nothing-wrong.csv")).unwrap();
    let record = out.path().join("coarse.csv");
    let cut = |line: &str| {
        let cells = line.split(',').enumerate();
        let cells = cells.map(|(n, cell)| match cell.parse::<f64>() {
            Ok(value) if n == 2 => format!("{:.2}", (value / 0.04).round() * 0.04),
            _ => cell.to_owned(),
        });
        cells.collect::<Vec<_>>().join(",")
    };
    std::fs::write(&record, table.lines().map(cut).collect::<Vec<_>>().join("\n")).unwrap();
    let mut command = Command::new(policyc());
    command
        .current_dir(folder())
        .args(["diagnose", "--model", model, "--train"]);
    let ran = run(command.arg(&record).arg("--out").arg(out.path().join("found")));
    let place = |text: &str| {
        ran.stdout
            .find(text)
            .unwrap_or_else(|| panic!("{text}: {}", ran.stdout))
    };
    assert!(
        place("verdict: ") < place("note: ") && place("note: ") < place("to look at: "),
        "{}",
        ran.stdout
    );
}

/// The check itself: it notices every truth that is not the one of the records.
#[test]
fn a_planted_wrong_truth_is_noticed() {
    let all = diagnoses();
    let [(id, values)] = &truth(&SETS[0])[..] else {
        panic!("one effect is hidden")
    };
    let (name, value) = values[0];
    for wrong in [
        vec![],
        vec![("r_ds_on", values.clone())],
        vec![(*id, vec![(name, 1.1 * value)])],
        vec![(*id, vec![("r_d", value)])],
        vec![(*id, values.clone()), ("esr", vec![("esr", 0.2)])],
    ] {
        assert!(disagreement(&all.two_experiments, &wrong).is_some(), "{wrong:?}");
    }
    assert!(disagreement(&all.one_experiment, &truth(&SETS[0])).is_some());
    assert!(disagreement(&all.nothing_wrong, &truth(&SETS[0])).is_some());
}
