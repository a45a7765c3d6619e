//! Does `policyc diagnose` find what ngspice hid? A few short cases; `cargo xtask blind --score` runs many full ones.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod records;

use std::path::Path;
use std::process::Command;
use std::sync::OnceLock;

use blind::case::{Case, measure};
use blind::experiment::Extent;
use blind::plan::plan_of;
use blind::score::{Diagnosis, Judgement, judge};
use tests::tools::{policyc, run};

/// What is hidden: sizes and experiments follow from the seed.
const HIDDEN: [(u64, &[&str]); 5] = [
    (101, &[]),
    (102, &["c_wrong"]),
    (103, &["dcr"]),
    (104, &["v_offset"]),
    (105, &["mains_pickup"]),
];

/// A policy trained on the nominal converter of all cases.
const POLICY: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/blind/policy");

struct Answered {
    case: Case,
    diagnosis: Diagnosis,
    /// The refitted mapping.
    mapping: policy::Mapping,
    /// Text of the extended plant file.
    extended: String,
}

fn answered() -> &'static [Answered] {
    static ANSWERED: OnceLock<Vec<Answered>> = OnceLock::new();
    ANSWERED.get_or_init(|| HIDDEN.iter().map(|(seed, ids)| answer(*seed, ids)).collect())
}

fn answer(seed: u64, ids: &[&str]) -> Answered {
    let case = measure(&plan_of(seed, 0, ids, Extent::Short).unwrap(), false).unwrap();
    let folder = tempfile::tempdir().unwrap();
    for (path, text) in &case.files {
        let path = folder.path().join(path);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    }
    let out = folder.path().join("out");
    let mut command = Command::new(policyc());
    command
        .args(["diagnose", "--model", "plant.toml"])
        .current_dir(folder.path());
    for (option, part) in [("--train", "train/"), ("--heldout", "heldout/")] {
        let files = case
            .files
            .iter()
            .map(|(path, _)| path)
            .filter(|path| path.starts_with(part));
        command.arg(option).args(files);
    }
    let ran = run(command.args(["--policy", POLICY, "--out"]).arg(&out));
    assert_eq!(ran.code, Some(0), "seed {seed}, {ids:?}\n{}{}", ran.stdout, ran.stderr);
    Answered {
        case,
        diagnosis: read(&out.join("diagnosis.json")),
        extended: std::fs::read_to_string(out.join("plant.extended.toml")).unwrap(),
        mapping: policy::load_mapping(&out.join("drm.toml")).unwrap(),
    }
}

fn read(path: &Path) -> Diagnosis {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

fn judged(answered: &Answered) -> Judgement {
    judge(&answered.case.truth, &answered.diagnosis)
}

#[test]
fn hidden_effects_are_found_and_nothing_is_found_where_nothing_is_hidden() {
    let all = answered();
    let none = judged(&all[0]);
    assert!(!none.false_alarm, "{none:#?}");
    for single in &all[1..4] {
        let judged = judged(single);
        assert!(judged.right_first && judged.nothing_wrong, "{judged:#?}");
        assert!(judged.worst_ratio <= 1.05, "{judged:#?}");
    }
    let unlisted = judged(&all[4]);
    assert!(unlisted.unexplained && unlisted.knowable, "{unlisted:#?}");
}

/// The same answers against exchanged truths: the judge does not nod at everything.
#[test]
fn exchanged_truths_are_noticed() {
    let all = answered();
    for (number, (_, ids)) in HIDDEN.iter().enumerate() {
        let other = &all[(number + 1) % all.len()];
        let judged = judge(&other.case.truth, &all[number].diagnosis);
        let passes = !judged.false_alarm && judged.right_first && judged.nothing_wrong || judged.unexplained;
        assert!(
            !passes || *ids == ["mains_pickup"] && judged.false_alarm,
            "{ids:?}: {judged:#?}"
        );
    }
}

/// The loop is closed in ngspice on the converter that the records come from.
#[test]
fn the_refitted_mapping_is_better_at_the_hidden_converter_and_the_same_where_nothing_is_hidden() {
    let policy = policy::load(&Path::new(POLICY).join("policy.toml")).unwrap();
    let all = answered();
    let close = |answered: &Answered, (seed, ids): (u64, &[&str])| {
        let bench = plan_of(seed, 0, ids, Extent::Short).unwrap().bench;
        let mut refitted = policy.clone();
        let load_current = policy.mapping.as_ref().unwrap().load_current;
        refitted.mapping = Some(policy::Mapping {
            load_current,
            ..answered.mapping
        });
        [&policy, &refitted].map(|policy| blind::control::close(&bench, policy).unwrap())
    };
    let [before, after] = close(&all[0], HIDDEN[0]);
    assert_eq!(before, after, "nothing is hidden: the mapping is kept");
    assert!(before.mean_abs < 0.3, "{before:?}");
    let [before, after] = close(&all[2], HIDDEN[2]);
    assert!(after.mean_abs < before.mean_abs, "{before:?} {after:?}");
    assert!(after.tail_mean < before.tail_mean, "{before:?} {after:?}");
}

#[test]
fn the_extended_file_is_a_plant_for_simulate_train_and_drm_acquire() {
    let answered = &answered()[2];
    assert!(answered.extended.contains("dcr = "), "{}", answered.extended);
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("extended.toml", &answered.extended);
    write(
        "scenario.toml",
        "plant = \"extended.toml\"\nload_steps = [[200, 500]]\ninstants = 1\nsampling_instants = 1\nlead = 40\nafter = 40\n\
         tail = 10\n",
    );
    let contract = format!("{POLICY}/policy.toml");
    write(
        "train.toml",
        &format!(
            "plant = \"extended.toml\"\ncontract = \"{contract}\"\nsteps = 300\n[network]\nhidden = [8]\n\
             [reward]\nv_ref = 100.0\n[episode]\nloads = {{ values = [200, 500], range = [200, 500] }}\n[selection]\n\
             every = 300\nload_steps = [[200, 500]]\ninstants = 1\nsampling_instants = 1\nlead = 20\nafter = 20\ntail = 5\n\
             [evaluation]\nload_steps = [[200, 500]]\ninstants = 1\nsampling_instants = 1\nlead = 20\nafter = 20\ntail = 5\n"
        ),
    );
    let commands: [&[&str]; 3] = [
        &["simulate", "scenario.toml", "--policy", POLICY, "--out", "simulated"],
        &["train", "train.toml", "--out", "trained"],
        &[
            "drm",
            "acquire",
            "--plant",
            "extended.toml",
            "--duties",
            "0.5",
            "--currents",
            "5",
            "--out",
            "points.csv",
        ],
    ];
    for arguments in commands {
        let ran = run(Command::new(policyc()).args(arguments).current_dir(folder.path()));
        assert_eq!(ran.code, Some(0), "{arguments:?}\n{}{}", ran.stdout, ran.stderr);
    }
    // the winding of the file is in the settled point: a duty of 0.5 yields less than with the nominal 0.1 ohm
    let points = std::fs::read_to_string(folder.path().join("points.csv")).unwrap();
    let row = points.lines().last().unwrap();
    let v_out: f64 = row.split(',').nth(5).unwrap().parse().unwrap();
    let nominal = 0.5 * (200.0 - 0.05 * 5.0) - 0.5 * (0.8 + 0.02 * 5.0) - 0.1 * 5.0;
    assert!(v_out < nominal - 0.3, "{row}");
}
