//! Plans: what they multiply to, and what is wrong with them.
#![allow(clippy::unwrap_used, clippy::panic, clippy::disallowed_methods)] // helpers of tests stand outside of #[test] functions

use std::path::Path;

use campaign::{Axis, Kind, Plan};

/// A folder with two policies, a training, a scenario and a plant.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in [
        ("a/policy.toml", "[network]\nweights = \"w.safetensors\"\n"),
        ("a/w.safetensors", "one"),
        ("b/policy.toml", "[network]\nweights = \"w.safetensors\"\n"),
        ("b/w.safetensors", "two"),
        (
            "train.toml",
            "plant = \"plant.toml\"\ncontract = \"a/policy.toml\"\nseeds = [4, 7]\n",
        ),
        ("plant.toml", "[converter]\n"),
        ("other.toml", "[converter]\nx = 1\n"),
        ("scenario.toml", "plant = \"plant.toml\"\n"),
        ("one.csv", "t,v_out\n"),
        ("empty/readme", ""),
    ] {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    }
    folder
}

fn plan(folder: &Path, text: &str) -> Plan {
    Plan::from_text(&folder.join("plan.toml"), text).unwrap_or_else(|faults| panic!("{faults}"))
}

fn lines(plan: &Plan) -> Vec<String> {
    plan.tasks.iter().map(|task| task.arguments.join(" ")).collect()
}

#[track_caller]
fn refused(text: &str, place: (usize, usize), words: &[&str]) {
    let folder = folder();
    let faults = Plan::from_text(&folder.path().join("plan.toml"), text).err().unwrap();
    let shown = faults.to_string();
    assert_eq!(faults.list[0].line_column(), Some(place), "{shown}");
    for word in words {
        assert!(shown.contains(word), "{word}\n{shown}");
    }
}

#[test]
fn every_kind_of_section_becomes_the_command_lines_of_its_product() {
    let folder = folder();
    let text = r#"
        [[train]]
        settings = "train.toml"
        [[simulate]]
        scenarios = ["scenario.toml"]
        policies = ["a", "b/policy.toml"]
        plants = ["other.toml"]
        [[verify]]
        policies = "a"
        formats = ["f32", "i16"]
        steps = 5
        shards = 2
        seed = 10
        [[verify]]
        policies = "b"
        codes = true
        shards = 2
        [[certify]]
        policies = "a"
        boxes = [10, 20]
        allow_outside = true
        [[diagnose]]
        models = "plant.toml"
        train = "one.csv"
        heldout = ["one.csv"]
        settled = true
        [[prove]]
        policies = "b"
        targets = "cortex-m4f"
    "#;
    let seven = "in/policy.toml";
    let expected = [
        "train in/train.toml --seeds 4 --threads 1 --json --quiet --out out".to_owned(),
        "train in/train.toml --seeds 7 --threads 1 --json --quiet --out out".to_owned(),
        "simulate in/scenario.toml --policy in/a/policy.toml --plant in/other.toml --quiet --out out".to_owned(),
        "simulate in/scenario.toml --policy in/b/policy.toml --plant in/other.toml --quiet --out out".to_owned(),
        format!("verify {seven} --format f32 --steps 3 --seed 10 --json --quiet"),
        format!("verify {seven} --format f32 --steps 2 --seed 11 --json --quiet"),
        format!("verify {seven} --format i16 --steps 3 --seed 10 --json --quiet"),
        format!("verify {seven} --format i16 --steps 2 --seed 11 --json --quiet"),
        format!("verify {seven} --codes --shard 1/2 --out out --json --quiet"),
        format!("verify {seven} --codes --shard 2/2 --out out --json --quiet"),
        format!("certify {seven} --boxes 10 --allow-outside --quiet --out out"),
        format!("certify {seven} --boxes 20 --allow-outside --quiet --out out"),
        "diagnose --model in/plant.toml --train in/one.csv --heldout in/one.csv --settled --quiet --out out".to_owned(),
        format!("prove {seven} --target cortex-m4f --quiet --out out"),
    ];
    assert_eq!(lines(&plan(folder.path(), text)), expected);
}

#[test]
fn a_task_is_named_by_what_it_reads_and_by_nothing_else() {
    let text = "[[simulate]]\nscenarios = \"scenario.toml\"\npolicies = [\"a\", \"b\"]\n";
    let (first, second) = (folder(), folder());
    let ids = |folder: &Path| -> Vec<String> { plan(folder, text).tasks.into_iter().map(|task| task.id).collect() };
    let before = ids(first.path());
    assert_eq!(before, ids(second.path()), "the folder of the plan");
    std::fs::write(second.path().join("unread.toml"), "x = 1").unwrap();
    assert_eq!(before, ids(second.path()), "a file that nobody names");
    // the weights of one policy, through its contract
    std::fs::write(second.path().join("b/w.safetensors"), "2wo").unwrap();
    let after = ids(second.path());
    assert_eq!(before[0], after[0]);
    assert_ne!(before[1], after[1]);
    // the plant of the scenario
    std::fs::write(second.path().join("plant.toml"), "[converter] # edited\n").unwrap();
    assert_ne!(ids(second.path())[0], before[0]);
}

#[test]
fn what_two_sections_ask_for_is_one_task() {
    let folder = folder();
    let section = "[[train]]\nsettings = \"train.toml\"\nseeds = { first = 6, count = 3 }\n";
    let found = plan(
        folder.path(),
        &format!("{section}{section}[[train]]\nsettings = \"./train.toml\"\nseeds = [7]\n"),
    );
    let seeds: Vec<&Axis> = found.tasks.iter().map(|task| &task.axes[1].1).collect();
    assert_eq!(seeds, [&Axis::Number(6), &Axis::Number(7), &Axis::Number(8)]);
    assert!(found.tasks.iter().all(|task| task.kind == Kind::Train));
}

#[test]
fn faults_of_a_plan_have_their_places() {
    refused("[[trian]]\n", (1, 3), &["unknown key `trian`", "did you mean `train`?"]);
    refused(
        "[[train]]\nsettings = \"trian.toml\"\n",
        (2, 12),
        &["cannot find the file"],
    );
    refused(
        "[[train]]\nsettings = \"train.toml\"\nseed = 1\n",
        (3, 1),
        &["did you mean `seeds`?"],
    );
    refused(
        "[[train]]\nsettings = \"train.toml\"\nseeds = [1, 2, 1]\n",
        (3, 16),
        &["twice", "found: 1"],
    );
    refused(
        "[[train]]\nsettings = \"train.toml\"\nseeds = []\n",
        (3, 9),
        &["`seeds` is empty"],
    );
    refused(
        "[[train]]\nsettings = \"train.toml\"\nseeds = { count = 0 }\n",
        (3, 19),
        &["1 to 100000"],
    );
    refused(
        "[[train]]\nsettings = \"train.toml\"\nseeds = \"0..8\"\n",
        (3, 9),
        &["whole number"],
    );
    refused("[[verify]]\npolicies = \"empty\"\n", (2, 12), &["holds no policy.toml"]);
    refused(
        "[[verify]]\npolicies = \"a\"\nsteps = 2\nshards = 3\n",
        (1, 1),
        &["more shards than steps"],
    );
    refused(
        "[[diagnose]]\nmodels = \"plant.toml\"\n",
        (1, 1),
        &["`train` is missing", "measured records"],
    );
    refused("[[certify]]\npolicies = []\n", (2, 12), &["`policies` is empty"]);
}

#[test]
fn a_plan_without_a_task_is_a_fault() {
    let faults = Plan::from_text(Path::new("plan.toml"), "name = \"none\"\n")
        .err()
        .unwrap();
    assert!(faults.to_string().contains("[[train]], [[simulate]]"), "{faults}");
}

#[test]
fn a_file_that_is_named_and_broken_is_a_fault_of_that_file() {
    let folder = folder();
    std::fs::write(folder.path().join("plant.toml"), "[converter\n").unwrap();
    let text = "[[train]]\nsettings = \"train.toml\"\n";
    let faults = Plan::from_text(&folder.path().join("plan.toml"), text).err().unwrap();
    assert_eq!(faults.list.len(), 1, "once for both seeds: {faults}");
    assert!(faults.list[0].file.ends_with("plant.toml"), "{faults}");
}

/// 2e13 tasks: the product is refused before it is made.
#[test]
fn more_tasks_than_a_folder_can_hold_are_refused_before_they_are_made() {
    let boxes: Vec<String> = (1..=2000).map(|boxes| boxes.to_string()).collect();
    let formats = vec!["\"f32\""; 10_000].join(", ");
    let text = format!(
        "[[certify]]\npolicies = \"a\"\nboxes = [{}]\nformats = [{formats}]\n",
        boxes.join(", ")
    );
    refused(&text, (1, 1), &["100000", "tasks"]);
    let settings = ["\"train.toml\""; 2].join(", ");
    let text = format!("[[train]]\nsettings = [{settings}]\nseeds = {{ count = 100000 }}\n");
    refused(&text, (1, 1), &["100000", "tasks"]);
}
