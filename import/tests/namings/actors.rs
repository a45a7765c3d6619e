//! Continuous actors as bare state dicts: what the names fix, what the library's definition adds, and what stays open.

use super::{Actor, Refused, Row, Several, Tensors, dense, ending, named, names, row, with};

pub fn rows() -> Vec<Row> {
    [
        cleanrl(),
        stable_baselines(),
        tianshou(),
        rllib(),
        torchrl(),
        unnamed(),
        picked(),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// The scale and bias that `Saved` draws are no duties, so scale and offset stay open here; tests/trainers.rs has real ones.
fn cleanrl() -> Vec<Row> {
    let fc = ["fc1", "fc2", "fc_mu"];
    let buffers: &[(&str, &[usize])] = &[("action_scale", &[1]), ("action_bias", &[1])];
    let in_a_vector: &[(&str, &[usize])] = &[("action_scale", &[1, 1]), ("action_bias", &[1, 1])];
    let several: &[(&str, &[usize])] = &[("action_scale", &[3]), ("action_bias", &[3])];
    let relu = "hidden_activation = \"relu\"   # as in CleanRL's definition: check";
    let squash = "continuous = { squash = \"tanh\", scale = ";
    let parts: &[&str] = Box::leak(Box::new([
        relu,
        squash,
        "CleanRL's td3_continuous_action.py",
        "Is that your definition?",
    ]));
    let several_parts: &[&str] = &[
        "3 outputs for 3 duties",
        "CleanRL's td3_continuous_action.py",
        "name = \"u2\"",
    ];
    let sac = ["fc1", "fc2", "fc_mean"];
    let sac_parts: &[&str] = Box::leak(Box::new([relu, squash, "CleanRL's sac_continuous_action.py"]));
    let deviation = dense("fc_logstd", 1, 16);
    let mean = ["actor_mean.0", "actor_mean.2", "actor_mean.4"];
    let critic = [
        dense("critic.0", 16, 6),
        dense("critic.2", 16, 16),
        dense("critic.4", 1, 16),
    ]
    .concat();
    let ppo = |outputs| {
        with(
            [ending(mean, outputs), critic.clone()].concat(),
            &[("actor_logstd", &[1, outputs][..])],
        )
    };
    vec![
        row(
            "CleanRL TD3, DDPG",
            with(ending(fc, 1), buffers),
            Actor(names(fc), parts),
        ),
        row(
            "CleanRL TD3, vector environment",
            with(ending(fc, 1), in_a_vector),
            Actor(names(fc), parts),
        ),
        row(
            "CleanRL TD3, three commands",
            with(ending(fc, 3), several),
            Several(names(fc), several_parts),
        ),
        row(
            "CleanRL SAC",
            with([ending(sac, 1), deviation].concat(), buffers),
            Actor(names(sac), sac_parts),
        ),
        row(
            "CleanRL PPO with a Box",
            ppo(1),
            Actor(
                names(mean),
                &[
                    "hidden_activation = \"tanh\"   # as in CleanRL's definition: check",
                    "continuous = { clip = [\"TODO\", \"TODO\"] }",
                    "NormalizeObservation",
                    "source = \"TODO\", scale = \"TODO\", offset = \"TODO\" }",
                ],
            ),
        ),
        row(
            "CleanRL PPO, two commands",
            ppo(2),
            Several(
                names(mean),
                &["clip = [\"TODO\", \"TODO\"] }", "2 outputs for 2 duties"],
            ),
        ),
    ]
}

/// One of several commands.
fn picked() -> Vec<Row> {
    let several: &[(&str, &[usize])] = &[("action_scale", &[3]), ("action_bias", &[3])];
    let fc = ["fc1", "fc2", "fc_mu"];
    let mean = ["actor_mean.0", "actor_mean.2", "actor_mean.4"];
    let sac = ["latent_pi.0", "latent_pi.2", "mu"];
    let td3 = ["actor.mu.0", "actor.mu.2", "actor.mu.4"];
    let of_three: &[&str] = &["squash = \"tanh\"", "output 0 of 3 is the duty; 1 and 2 are left out"];
    let td3_of_three = || with(ending(fc, 3), several);
    vec![
        row(
            "CleanRL TD3, the first of three",
            td3_of_three(),
            Actor(names(fc), of_three),
        )
        .output(0),
        row(
            "CleanRL TD3, a fourth of three",
            td3_of_three(),
            Refused(&["--output names none", "0 to 2"]),
        )
        .output(3),
        row(
            "CleanRL PPO, the first of two",
            with(ending(mean, 2), &[("actor_logstd", &[1, 2])]),
            Actor(names(mean), OF_TWO),
        )
        .output(0),
        row(
            "SB3 SAC, the first of two",
            [ending(sac, 2), dense("log_std", 2, 16)].concat(),
            Actor(names(sac), OF_TWO),
        )
        .output(0),
        row("SB3 TD3, the first of two", ending(td3, 2), Actor(names(td3), OF_TWO)).output(0),
    ]
}

/// What is said of a command that was picked.
const OF_TWO: &[&str] = &["output 0 of 2 is the duty; 1 is left out", "continuous = {"];

fn stable_baselines() -> Vec<Row> {
    let sac = |prefix: &str, outputs: usize| -> Tensors {
        let layer = |name: &str, outputs, inputs| dense(&format!("{prefix}{name}"), outputs, inputs);
        let layers = [
            layer("latent_pi.0", 64, 6),
            layer("latent_pi.2", 64, 64),
            layer("mu", outputs, 64),
        ];
        [layers.concat(), layer("log_std", outputs, 64)].concat()
    };
    let stems = names(["latent_pi.0", "latent_pi.2", "mu"]);
    let in_policy = names(["actor.latent_pi.0", "actor.latent_pi.2", "actor.mu"]);
    let critics = [
        dense("critic.qf0.0", 64, 7),
        dense("critic.qf0.2", 1, 64),
        dense("critic_target.qf0.0", 64, 7),
    ]
    .concat();
    let sac_parts: &[&str] = &[
        "hidden_activation = \"TODO\"   # relu unless you gave stable-baselines3 another one",
        "continuous = { squash = \"tanh\", scale = \"TODO\", offset = \"TODO\" }",
        "SAC of stable-baselines3 by the names",
    ];
    let td3_parts: &[&str] = &[
        "continuous = { squash = \"tanh\", scale = \"TODO\"",
        "TD3 or DDPG of stable-baselines3",
    ];
    let td3 = ["actor.mu.0", "actor.mu.2", "actor.mu.4"];
    let target = ending(["actor_target.mu.0", "actor_target.mu.2", "actor_target.mu.4"], 1);
    let ppo = |noise: &[usize]| {
        let layers = [
            dense("mlp_extractor.policy_net.0", 16, 6),
            dense("mlp_extractor.value_net.0", 16, 6),
            dense("action_net", 1, 16),
            dense("value_net", 1, 16),
        ];
        with(layers.concat(), &[("log_std", noise)])
    };
    let ppo_parts: &[&str] = &["continuous = { clip = [\"TODO\", \"TODO\"] }", "# tanh unless you gave"];
    vec![
        row("SB3 SAC actor", sac("", 1), Actor(stems.clone(), sac_parts)),
        row(
            "SB3 SAC policy",
            [sac("actor.", 1), critics.clone()].concat(),
            Actor(in_policy, sac_parts),
        ),
        row(
            "SB3 SAC, two commands",
            sac("", 2),
            Several(
                stems.clone(),
                &["squash = \"tanh\", scale = \"TODO\"", "2 outputs for 2 duties"],
            ),
        ),
        row(
            "SB3 SAC with use_sde",
            with(
                [dense("latent_pi.0", 64, 6), dense("mu", 1, 64)].concat(),
                &[("log_std", &[64, 1])],
            ),
            Refused(&["use_sde"]),
        ),
        row(
            "SB3 TD3 actor",
            ending(["mu.0", "mu.2", "mu.4"], 1),
            Actor(names(["mu.0", "mu.2", "mu.4"]), td3_parts),
        ),
        row(
            "SB3 TD3 policy",
            [ending(td3, 1), target, critics].concat(),
            Actor(names(td3), td3_parts),
        ),
        row(
            "SB3 PPO with a Box",
            ppo(&[1]),
            Actor(names(["mlp_extractor.policy_net.0", "action_net"]), ppo_parts),
        ),
        row("SB3 PPO with use_sde", ppo(&[16, 1]), Refused(&["use_sde"])),
    ]
}

fn tianshou() -> Vec<Row> {
    let stems = [
        "actor.preprocess.model.model.0",
        "actor.preprocess.model.model.2",
        "actor.last.model.0",
    ];
    let in_policy = stems.map(|stem| format!("policy.{stem}"));
    let algorithm = [
        ending(in_policy.each_ref().map(String::as_str), 1),
        ending(
            [
                "actor_old.module.preprocess.model.model.0",
                "actor_old.module.preprocess.model.model.2",
                "actor_old.module.last.model.0",
            ],
            1,
        ),
        dense("critic.preprocess.model.model.0", 16, 7),
        dense("critic.last.model.0", 1, 16),
        dense("critic_old.module.preprocess.model.model.0", 16, 7),
        dense("critic_old.module.last.model.0", 1, 16),
    ];
    let parts: &[&str] = &[
        "continuous = { squash = \"tanh\", scale = \"TODO\"",
        "ContinuousActorDeterministic",
    ];
    let mean = ["preprocess.model.model.0", "preprocess.model.model.2", "mu.model.0"];
    let open: &[&str] = &[
        "continuous = { squash = \"TODO\"",
        "ContinuousActorProbabilistic",
        "of PPO and A2C it is mu, clipped",
    ];
    vec![
        row("Tianshou DDPG policy", ending(stems, 1), Actor(names(stems), parts)),
        row(
            "Tianshou DDPG algorithm",
            algorithm.concat(),
            Actor(in_policy.to_vec(), parts),
        ),
        row(
            "Tianshou PPO, SAC",
            with(ending(mean, 1), &[("sigma_param", &[1, 1])]),
            Actor(names(mean), open),
        ),
        row(
            "Tianshou SAC, conditioned",
            [ending(mean, 1), dense("sigma.model.0", 1, 16)].concat(),
            Actor(names(mean), open),
        ),
        row(
            "Tianshou SAC, two commands",
            [ending(mean, 2), dense("sigma.model.0", 2, 16)].concat(),
            Several(names(mean), &["squash = \"TODO\"", "2 outputs for 2 duties"]),
        ),
        row(
            "Tianshou SAC, the first of two commands",
            [ending(mean, 2), dense("sigma.model.0", 2, 16)].concat(),
            Actor(names(mean), OF_TWO),
        )
        .output(0),
    ]
}

fn rllib() -> Vec<Row> {
    let stems = ["encoder.encoder.net.mlp.0", "encoder.encoder.net.mlp.2", "pi.net.mlp.0"];
    let constants: &[(&str, &[usize])] = &[
        ("pi.log_std_clip_param_const", &[1]),
        ("vf.log_std_clip_param_const", &[1]),
    ];
    let ppo = |outputs| {
        with(
            [ending(stems, outputs), dense("vf.net.mlp.0", 1, 16)].concat(),
            constants,
        )
    };
    let parts: &[&str] = &[
        "continuous = { clip = [-1.0, 1.0], scale = \"TODO\"",
        "RLlib's PPO",
        "# tanh unless you gave",
    ];
    let of_two: &[&str] = &[
        "the first output is read, the mean",
        "continuous = { clip = [-1.0, 1.0], scale = \"TODO\"",
    ];
    let sac = ["pi_encoder.net.mlp.0", "pi_encoder.net.mlp.2", "pi.net.mlp.0"];
    let critics = [
        dense("qf_encoder.fusion_layers.0", 256, 32),
        dense("qf.net.mlp.0", 1, 16),
        dense("target_qf.net.mlp.0", 1, 16),
    ];
    let sac_parts: &[&str] = &["continuous = { squash = \"TODO\"", "commands the mean itself, clipped"];
    vec![
        row(
            "RLlib PPO with a Box, or Discrete(2)",
            ppo(2),
            Refused(&["two outputs may be two actions", "--actions 1"]),
        ),
        row("RLlib PPO with a Box", ppo(2), Actor(names(stems), of_two)).actions(1),
        row(
            "RLlib PPO, free_log_std",
            with(ppo(1), &[("pi.log_std", &[1])]),
            Actor(names(stems), parts),
        ),
        row(
            "RLlib PPO, free_log_std, the first of two commands",
            with(ppo(2), &[("pi.log_std", &[2])]),
            Actor(names(stems), OF_TWO),
        )
        .output(0),
        row(
            "RLlib SAC",
            [ending(sac, 2), critics.concat()].concat(),
            Actor(names(sac), sac_parts),
        )
        .actions(1),
        row(
            "RLlib PPO, two commands",
            ppo(4),
            Refused(&["than --actions says", "4 outputs", "--output N"]),
        )
        .actions(1),
    ]
}

fn torchrl() -> Vec<Row> {
    let stems = ["module.0.module.0", "module.0.module.2", "module.0.module.4"];
    let inner = ["module.0.module.0.0", "module.0.module.0.2", "module.0.module.0.4"];
    let ends: &[(&str, &[usize])] = &[("module.1.action_low", &[]), ("module.1.action_high", &[])];
    let two_ends: &[(&str, &[usize])] = &[("module.1.action_low", &[2]), ("module.1.action_high", &[2])];
    let parts: &[&str] = &["continuous = { squash = \"tanh\", scale = ", "TorchRL's TanhModule"];
    let open: &[&str] = &["the first output is read, the mean", "continuous = { squash = \"TODO\""];
    vec![
        row(
            "TorchRL TD3, DDPG",
            with(ending(stems, 1), ends),
            Actor(names(stems), parts),
        ),
        row(
            "TorchRL TD3, two commands",
            with(ending(stems, 2), two_ends),
            Several(names(stems), &["TorchRL's TanhModule", "2 outputs for 2 duties"]),
        ),
        row(
            "TorchRL TD3, the first of two commands",
            with(ending(stems, 2), two_ends),
            Actor(names(stems), OF_TWO),
        )
        .output(0),
        row(
            "TorchRL PPO, SAC, or two actions",
            ending(inner, 2),
            Refused(&["--actions 1", "--actions 2"]),
        ),
        row("TorchRL PPO, SAC", ending(inner, 2), Actor(names(inner), open)).actions(1),
    ]
}

/// What no library defines is asked for.
fn unnamed() -> Vec<Row> {
    let gaussian_of_sequences = [ending(["mu.0", "mu.2", "mu.4"], 1), dense("sigma.0", 1, 6)].concat();
    let renorm = |stem: &str| -> Tensors {
        let vectors = ["weight", "bias", "running_mean", "running_var"];
        let vectors = vectors.map(|leaf| named(&format!("{stem}.{leaf}"), &[64]));
        [&vectors[..], &[named(&format!("{stem}.steps"), &[])]].concat()
    };
    let crossq = [
        dense("latent_pi.0", 64, 6),
        renorm("latent_pi.1"),
        dense("mu", 1, 64),
        dense("log_std", 1, 64),
    ];
    let own = ["fc1", "fc2", "out"];
    let open: &[&str] = &[
        "continuous = { squash = \"TODO\", scale = \"TODO\", offset = \"TODO\" }",
        "hidden_activation = \"TODO\"",
    ];
    let spinning = ["pi.net.0", "pi.net.2", "pi.mu_layer"];
    let gaussian = || {
        [
            ending(spinning, 1),
            dense("pi.log_std_layer", 1, 16),
            dense("q1.q.0", 16, 7),
        ]
        .concat()
    };
    let matlab = [("W1", [16, 6]), ("W2", [1, 16])]
        .iter()
        .map(|(name, shape)| named(name, shape));
    let matlab: Tensors = matlab.chain([named("b1", &[16, 1]), named("b2", &[1, 1])]).collect();
    vec![
        row(
            "a single output",
            ending(own, 1),
            Refused(&["1 outputs", "--actions 1"]),
        ),
        row(
            "a single output that is a command",
            ending(own, 1),
            Actor(names(own), open),
        )
        .actions(1),
        row(
            "three outputs, of which one is the command",
            ending(own, 3),
            Actor(
                names(own),
                &["output 0 of 3 is the duty", "continuous = { squash = \"TODO\""],
            ),
        )
        .output(0),
        row(
            "mean and deviation as two sequences",
            gaussian_of_sequences,
            Refused(&["commands a number", "--actions 1"]),
        ),
        row("CrossQ's BatchRenorm", crossq.concat(), Refused(&["BatchRenorm"])),
        row(
            "Spinning Up SAC",
            gaussian(),
            Refused(&["commands a number", "--actions 1"]),
        ),
        row("Spinning Up SAC, mean alone", gaussian(), Actor(names(spinning), open)).actions(1),
        row("MATLAB's actor", matlab, Actor(names(["W1", "W2"]), open)).actions(1),
    ]
}
