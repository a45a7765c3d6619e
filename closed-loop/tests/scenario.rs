//! Scenario files: what is read, and what is said where.

#![allow(clippy::unwrap_used)] // helpers of tests stand outside of #[test] functions

use std::path::Path;

use closed_loop::baselines::Kind;
use closed_loop::limit::left_out;
use closed_loop::scenario::Task;
use closed_loop::{LoadKind, LoadStep, Scenario};
use plant::Parameters;

fn read(text: &str) -> Scenario {
    Scenario::from_toml(Path::new("bench/s.toml"), text).unwrap()
}

#[track_caller]
fn refuse(text: &str, words: &[&str]) {
    let said = Scenario::from_toml(Path::new("s.toml"), text).unwrap_err().to_string();
    for word in words {
        assert!(said.contains(word), "{word}\n{said}");
    }
}

#[test]
fn an_empty_file_is_the_paper_s_six_load_steps() {
    let scenario = read("");
    assert_eq!(scenario.task, Task::default());
    let steps: Vec<LoadStep> = Task::default().load_steps.into_iter().map(LoadStep::from).collect();
    assert_eq!((scenario.load_steps.len(), &scenario.load_steps), (6, &steps));
    assert_eq!(scenario.baselines, Kind::ALL);
    assert_eq!(scenario.limits, [[0.0, 1.0]]);
    assert_eq!((scenario.plant, scenario.v_ref), (None, None));
    assert!(scenario.task.all_instants().len() >= 24);
}

#[test]
fn every_example_is_a_scenario_and_the_commented_one_says_the_defaults() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/simulate");
    let mut found = 0;
    let entries = std::fs::read_dir(&folder).unwrap();
    // a folder is a policy for them
    for path in entries.map(|entry| entry.unwrap().path()).filter(|path| path.is_file()) {
        let scenario = Scenario::load(&path).unwrap();
        assert!(scenario.plant.unwrap().is_file());
        found += 1;
    }
    assert!(found >= 5, "{found}");
    let commented = Scenario::load(&folder.join("paper.toml")).unwrap();
    let bare = Scenario {
        plant: commented.plant.clone(),
        v_ref: commented.v_ref,
        // it says them; a file that does not is told so
        default_steps: false,
        ..read("")
    };
    assert!(read("").default_steps);
    assert_eq!(commented, bare);
}

#[test]
fn the_plant_is_found_from_the_scenario_s_folder() {
    assert_eq!(
        read("plant = \"../p.toml\"").plant.unwrap().path,
        Path::new("bench/../p.toml")
    );
}

#[test]
fn load_steps_of_every_kind_stand_in_their_units() {
    let scenario = read("resistance_steps = [[50, 10]]\ncurrent_steps = [[2, 10]]\n");
    let shown: Vec<String> = scenario.load_steps.iter().map(LoadStep::to_string).collect();
    assert_eq!(shown, ["2 -> 10 A", "50 -> 10 ohm"], "no powers unless asked for");
    let scenario = read("current_steps = [[2, 10]]\nload_steps = [[1, 2]]\n");
    let kinds: Vec<LoadKind> = scenario.load_steps.iter().map(|step| step.kind).collect();
    assert_eq!(kinds, [LoadKind::Power, LoadKind::Current]);
}

#[test]
fn limits_are_none_one_or_several() {
    assert!(read("limit = false").limits.is_empty());
    assert_eq!(read("limit = true").limits, [[0.0, 1.0]]);
    assert_eq!(read("limit = [0.44, 0.55]").limits, [[0.44, 0.55]]);
    let several = read("limit = [[0.44, 0.55], [0, 1]]").limits;
    assert_eq!(several, [[0.44, 0.55], [0.0, 1.0]]);
    refuse(
        "limit = \"full\"",
        &["s.toml:1:9", "the text \"full\"", "`false`, duties [low, high]"],
    );
    refuse("limit = [0.6, 0.5]", &["s.toml:1:9", "write [0.5, 0.6]"]);
    refuse(
        "limit = [[0, 1], [0.5, 1.5]]",
        &["s.toml:1:24", "out of range", "found: 1.5"],
    );
}

#[test]
fn all_faults_are_reported_at_their_places() {
    let text = "plant = 3\nload_stepz = [[200, 500]]\nlead = 0\ncurrent_steps = [[2, -1]]\n\
                baselines = [\"pid\", \"deadbeet\"]\n[set]\n\"pwm.duty_dely\" = 1\n\"pwm.duty_delay\" = 9\n";
    let words = [
        "s.toml:1:9",
        "a text in quotes",
        "s.toml:2:1",
        "did you mean `load_steps`?",
        "s.toml:3:8",
        "1 to 1000000",
        "s.toml:4:22",
        "found: -1",
        "s.toml:5:21",
        "did you mean \"deadbeat\"?",
        "s.toml:7:19",
        "did you mean `pwm.duty_delay`?",
        "s.toml:8:20",
        "0 to 8",
    ];
    refuse(text, &words);
}

#[test]
fn numbers_that_contradict_each_other_are_refused() {
    refuse(
        "v_ref = 5.0\nafter = 50",
        &["s.toml:2:9", "tail = 100, after = 50", "last part"],
    );
    refuse("tail = 301", &["s.toml:1:8", "tail = 301, after = 300"]);
    refuse("lead = 99999", &["s.toml:1:8", "too long", "at most 100000"]);
    refuse("load_steps = []", &["without a load step", "load_steps = [[200, 500]"]);
}

#[test]
fn what_the_limit_leaves_out_is_named() {
    let mut plant = Parameters::paper_model();
    assert!(left_out(&plant).is_empty());
    plant.pwm.duty_delay = 1;
    plant.inductor.dcr = 0.1;
    plant.capacitor.esr = 0.01;
    assert!(
        left_out(&plant).is_empty(),
        "delay and losses are part of it, and the jump of a buck's voltage"
    );
    plant.sensors.v_out.noise = 0.05;
    assert_eq!(left_out(&plant), ["sensors.v_out.noise"]);
    (plant.converter.topology, plant.converter.v_in) = (plant::Topology::Boost, 50.0);
    assert_eq!(left_out(&plant), ["capacitor.esr", "sensors.v_out.noise"]);
}
