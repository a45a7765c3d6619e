//! Networks that libraries trained and saved, on the processors people take: a controller of a microcontroller and the box of
//! dSPACE. The files and the libraries' own answers are those of the importer's tests.

#[path = "../../import/tests/common/mod.rs"]
mod common;

use common::library::fixture;
use import::Options;

/// What each library saves: choices, quantiles, logits and commands; activations of every form.
const SAVED: [&str; 19] = [
    "sb3_dqn.zip",
    "sb3_qrdqn.zip",
    "sb3_ppo.zip",
    "sb3_a2c.zip",
    "sb3_ppo_duty.zip",
    "sb3_sac_duty.zip",
    "sb3_td3_duty.zip",
    "dueling.pth",
    "gemm.onnx",
    "keras.onnx",
    "sigmoid_actor.onnx",
    "trained/cleanrl_dqn.pt",
    "trained/cleanrl_ppo.pt",
    "trained/cleanrl_sac.pt",
    "trained/cleanrl_td3.pt",
    "trained/tianshou_dqn.pt",
    "trained/tianshou_ddpg.pt",
    "trained/rllib_dqn.pt",
    "trained/rllib_ppo.pt",
];

/// Each policy in one build of C and in Rust.
fn saved_networks_are_equal_on(target: &str) {
    let target = super::target(target);
    for file in SAVED {
        let folder = tempfile::tempdir().unwrap();
        let new = import::new_policy(&fixture(file), &folder.path().join("policy.toml"), &Options::default())
            .unwrap_or_else(|faults| panic!("{file}: {faults}"));
        let policy = common::filled(folder.path(), &new);
        let report = super::run(&policy, target, &super::compilers(target), &["-O2", "-O"], 150);
        assert_eq!(
            report.builds.len(),
            super::compilers(target).len(),
            "{file}: {report:?}"
        );
        super::assert_equal(&report, &format!("{file} on {}\n{}", target.name, new.contract));
    }
}

#[test]
fn saved_networks_are_equal_on_cortex_m4f() {
    saved_networks_are_equal_on("cortex-m4f");
}

#[test]
fn saved_networks_are_equal_on_powerpc() {
    saved_networks_are_equal_on("dspace-ds1202");
}
