//! Policies that real libraries trained, from their files to verified code: tests/fixtures/trainers/train.py.
//!
//! The repository holds those of libraries whose files say the least, with 64 observations each. `cargo xtask test --full`
//! trains all anew with the libraries in an environment of their own, and takes 1,000 observations.

use std::path::{Path, PathBuf};
use std::process::Command;

use super::Desk;
use super::actor::{PROTECTION, REST};

/// A file, what is typed behind `new`, and what the user fills in.
struct Trained {
    file: &'static str,
    options: &'static str,
    filled: &'static [(&'static str, &'static str)],
}

const fn trained(
    file: &'static str,
    options: &'static str,
    filled: &'static [(&'static str, &'static str)],
) -> Trained {
    Trained { file, options, filled }
}

const RELU: (&str, &str) = ("hidden_activation = \"TODO\"", "hidden_activation = \"relu\"");
const TANH: (&str, &str) = ("hidden_activation = \"TODO\"", "hidden_activation = \"tanh\"");
const DUTIES: (&str, &str) = (
    "[\"TODO\", \"TODO\", \"TODO\", \"TODO\", \"TODO\"]",
    "[0.1, 0.25, 0.4, 0.55, 0.7]",
);
/// The environment's action space is 0.1 to 0.85.
const SCALED: (&str, &str) = ("scale = \"TODO\", offset = \"TODO\"", "scale = 0.375, offset = 0.475");
const CLIPPED: (&str, &str) = ("clip = [\"TODO\", \"TODO\"]", "clip = [0.1, 0.85]");

const STORED: [Trained; 10] = [
    trained("cleanrl_dqn.pt", "", &[RELU, DUTIES]),
    trained("cleanrl_ppo.pt", "", &[TANH, DUTIES]),
    trained("cleanrl_td3.pt", "", &[]),
    trained("cleanrl_sac.pt", "", &[]),
    trained("cleanrl_ppo_box.pt", "", &[CLIPPED]),
    trained("tianshou_dqn.pt", "", &[RELU, DUTIES]),
    trained("tianshou_ddpg.pt", "", &[RELU, SCALED]),
    trained("rllib_ppo.pt", "", &[TANH, DUTIES]),
    trained("rllib_ppo_box.pt", " --actions 1", &[TANH, SCALED]),
    trained("rllib_dqn.pt", "", &[TANH, DUTIES]),
];

/// Archives that say all but the duties of a table.
const ARCHIVES: [Trained; 9] = [
    trained("sb3_dqn.zip", "", &[DUTIES]),
    trained("sb3_qrdqn.zip", "", &[DUTIES]),
    trained("sb3_ppo.zip", "", &[DUTIES]),
    trained("sb3_a2c.zip", "", &[DUTIES]),
    trained("sb3_sac.zip", "", &[]),
    trained("sb3_td3.zip", "", &[]),
    trained("sb3_ddpg.zip", "", &[]),
    trained("sb3_ppo_box.zip", "", &[]),
    trained("sb3_a2c_box.zip", "", &[]),
];

/// `new`, filled in, with the library's answers in the place of those that `new` computed: the network of every build gives
/// them within 1e-5, and every decision.
fn becomes_verified_code(folder: &Path, trained: &Trained, observations: usize) {
    let desk = Desk::new("minimal");
    std::fs::create_dir(desk.path("trained")).unwrap();
    std::fs::copy(folder.join(trained.file), desk.path(trained.file)).unwrap();
    desk.succeed(&format!(
        "new {}{} --out trained/policy.toml",
        trained.file, trained.options
    ));
    let draft = desk.read("trained/policy.toml");
    let (network, limits) = (draft.find("[network]").unwrap(), draft.find("[limits]").unwrap());
    let mut rest = draft[network..limits].to_owned();
    for (open, filled) in trained.filled {
        assert!(rest.contains(open), "{}: {open}\n{rest}", trained.file);
        rest = rest.replace(open, filled).replace("# golden =", "golden =");
    }
    rest = rest.replace("# golden =", "golden =");
    assert!(!rest.contains("\"TODO\""), "{}: {rest}", trained.file);
    desk.write("trained/policy.toml", &format!("{REST}\n{rest}\n{PROTECTION}"));
    let stem = trained.file.split('.').next().unwrap();
    let expected = folder.join(format!("{stem}.expected.safetensors"));
    std::fs::copy(expected, desk.path("trained/golden.safetensors")).unwrap();
    let said = desk.succeed("inspect trained");
    assert!(
        said.contains(&format!("{observations} golden vectors")),
        "{}: {said}",
        trained.file
    );
    // the network is the library's; that every build computes it is shown of one file of each kind, and of all in the long run
    let is_one_of_a_kind = ["cleanrl_td3.pt", "rllib_dqn.pt"].contains(&trained.file);
    if is_one_of_a_kind || tests::full() {
        desk.succeed("compile trained --emit c,rust --out code --no-costs");
        let said = desk.succeed("verify trained --generated code --steps 500");
        assert!(said.contains("in f32"), "{}: {said}", trained.file);
    }
}

fn stored() -> PathBuf {
    tests::root().join("tests/fixtures/trainers/trained")
}

#[test]
fn policies_of_other_libraries_become_verified_code() {
    for trained in &STORED {
        becomes_verified_code(&stored(), trained, 64);
    }
}

#[test]
fn policies_that_every_library_trains_anew_become_verified_code() {
    if !tests::full() {
        return;
    }
    let root = tests::root().join("target/trainers");
    let python = root.join("bin/python");
    let scripts = tests::root().join("tests/fixtures/trainers");
    let ran = |command: &mut Command| {
        let status = command.status().unwrap();
        assert!(status.success(), "{command:?}: {status}");
    };
    if !python.is_file() {
        ran(Command::new("python3").args(["-m", "venv"]).arg(&root));
    }
    ran(Command::new(&python)
        .args(["-m", "pip", "install", "--quiet", "-r"])
        .arg(scripts.join("requirements.txt")));
    let folder = tempfile::tempdir().unwrap();
    ran(Command::new(&python)
        .arg(scripts.join("train.py"))
        .arg(folder.path())
        .arg("1000"));
    for trained in STORED.iter().chain(&ARCHIVES) {
        becomes_verified_code(folder.path(), trained, 1000);
    }
}
