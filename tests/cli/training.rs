//! `policyc train`: a policy folder, byte for byte whatever interrupts it.

use std::process::Stdio;
use std::time::{Duration, Instant};

use tests::tools::{Ran, copy_folder};

use super::{Desk, contents};

const SETTINGS: &str = r#"
plant = "../plants/paper-model.toml"
contract = "contract/policy.toml"
seeds = [3, 5]
steps = 1200

[network]
hidden = [8]

[learning]
batch = 16
warm_up = 100

[reward]
v_ref = 100.0

[episode]
loads = { values = [200, 500, 800, 1000], range = [150, 1050], share = 0.5 }

[selection]
every = 200
load_steps = [[210, 480]]
instants = 2
lead = 20
after = 40
tail = 10

[evaluation]
load_steps = [[200, 500]]
instants = 2
lead = 20
after = 40
tail = 10
"#;

pub fn desk() -> Desk {
    let desk = Desk::new("paper");
    let examples = tests::root().join("examples");
    copy_folder(&examples.join("plants"), &desk.path("plants"));
    std::fs::create_dir(desk.path("train")).unwrap();
    copy_folder(&examples.join("train/paper12"), &desk.path("train/contract"));
    desk.write("train/train.toml", SETTINGS);
    desk
}

fn train(desk: &Desk, more: &str) -> Ran {
    desk.type_in(&format!("train train/train.toml {more}"))
}

#[test]
fn a_trained_policy_is_a_whole_folder_that_compiles() {
    let desk = desk();
    let table = desk.succeed("train train/train.toml --out out");
    assert!(
        table.contains("200 -> 500") && table.contains("2,400 control periods"),
        "{table}"
    );
    let names: Vec<String> = contents(&desk.path("out/seeds/5"))
        .into_iter()
        .map(|file| file.0)
        .collect();
    let expected = [
        "evaluation.csv",
        "golden.safetensors",
        "learning-curve.csv",
        "policy.toml",
        "report.txt",
    ];
    assert_eq!(names[..5], expected);
    assert!(!desk.path("out/checkpoints").exists());
    // compile answers the golden vectors, which the trainer's own matrices made
    desk.succeed("compile out --emit c,rust --out code");
    let weights = std::fs::read(desk.path("out/seeds/5/weights.safetensors")).unwrap();
    std::fs::write(desk.path("out/weights.safetensors"), weights).unwrap();
    let other = std::fs::read(desk.path("out/seeds/3/golden.safetensors")).unwrap();
    std::fs::write(desk.path("out/golden.safetensors"), other).unwrap();
    desk.refuse("compile out --emit c --out code", &["golden"]);
}

#[test]
fn seeds_decide_and_nothing_else() {
    let desk = desk();
    desk.succeed("train train/train.toml --out together");
    desk.succeed("train train/train.toml --out alone --seeds 5 --threads 1");
    assert_eq!(
        contents(&desk.path("together/seeds/5")),
        contents(&desk.path("alone/seeds/5"))
    );
    assert_ne!(
        desk.read("together/seeds/3/learning-curve.csv"),
        desk.read("alone/learning-curve.csv")
    );
}

#[cfg(unix)]
#[test]
fn an_interrupted_training_goes_on_to_the_same_bytes() {
    let desk = desk();
    desk.edit("train/train.toml", "steps = 1200", "steps = 100000");
    desk.edit("train/train.toml", "seeds = [3, 5]", "seeds = [5]");
    desk.edit("train/train.toml", "every = 200", "every = 20000");
    let mut command = desk.command();
    command.args(["train", "train/train.toml", "--out", "out"]);
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
    // a checkpoint on the way shows that it is in its midst
    let begun = Instant::now();
    while !desk.path("out/checkpoints/seed-5.bin").exists() {
        assert!(begun.elapsed() < Duration::from_secs(120) && child.try_wait().unwrap().is_none());
        std::thread::sleep(Duration::from_millis(5));
    }
    let ended = super::interrupt(child);
    assert_eq!(ended.status.code(), Some(130));
    let text = String::from_utf8(ended.stdout).unwrap();
    assert!(text.contains("--resume"), "{text}");
    assert!(!desk.path("out/policy.toml").exists());

    // typed once more, the command does not throw the work away
    let before = contents(&desk.path("out/checkpoints"));
    desk.refuse(
        "train train/train.toml --out out",
        &["interrupted training", "--resume"],
    );
    assert_eq!(contents(&desk.path("out/checkpoints")), before);

    desk.succeed("train train/train.toml --out out --resume");
    desk.succeed("train train/train.toml --out whole");
    assert_eq!(contents(&desk.path("out")), contents(&desk.path("whole")));
}

#[test]
fn a_missed_specification_is_exit_code_1_and_the_policy_is_there() {
    let desk = desk();
    desk.write("train/train.toml", &format!("{SETTINGS}\n[[spec]]\ndeviation = 1e-6\n"));
    let ran = train(&desk, "--out out --seeds 3");
    assert_eq!(ran.code, Some(1), "{}{}", ran.stdout, ran.stderr);
    let figure = ["The specification is missed: ", "deviation 13.", "limit 1.0000 µV"];
    for words in figure {
        assert!(ran.stdout.contains(words), "{words}: {}", ran.stdout);
    }
    assert!(desk.read("out/report.txt").contains("FAILS"));
}

#[test]
fn what_cannot_be_trained_is_refused_before_it_costs_time() {
    let desk = desk();
    let before = desk.listing();
    desk.refuse("train nothing.toml --out out", &["nothing.toml"]);
    desk.refuse("train train/train.toml --out out --seeds 3,3", &["--seeds", "twice"]);
    desk.refuse("train train/train.toml --out out --resume", &["nothing to resume"]);
    desk.refuse("train train/train.toml --out policy", &["holds a policy already"]);
    desk.edit("train/train.toml", "batch = 16", "bach = 16");
    desk.refuse("train train/train.toml --out out", &["train.toml:", "bach", "batch"]);
    desk.edit("train/train.toml", "bach = 16", "batch = 16");
    desk.edit("train/train.toml", "paper-model.toml", "paper-modell.toml");
    desk.refuse("train train/train.toml --out out", &["paper-modell.toml"]);
    assert_eq!(desk.listing(), before);
}
