//! Tables of actions.

use super::{Doubted, Joined, Plain, Row, Tensors, dense, named, names, row, three};

pub fn rows() -> Vec<Row> {
    [
        plain(),
        kernels(),
        joined(),
        of_rllib(),
        dueling(),
        noisy(),
        other_tools(),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// A plain chain stays in its file.
fn plain() -> Vec<Row> {
    let rows: [(&str, [&str; 3]); 8] = [
        ("SB3 DQN", ["q_net.q_net.0", "q_net.q_net.2", "q_net.q_net.4"]),
        ("CleanRL DQN", ["network.0", "network.2", "network.4"]),
        ("Tianshou DQN", ["model.model.0", "model.model.2", "model.model.4"]),
        (
            "TorchRL DQN",
            ["module.0.module.0", "module.0.module.2", "module.0.module.4"],
        ),
        ("DDP", ["module.net.0", "module.net.2", "module.net.4"]),
        (
            "torch.compile",
            ["_orig_mod.net.0", "_orig_mod.net.2", "_orig_mod.net.4"],
        ),
        ("own module", ["fc1", "fc2", "out"]),
        (
            "Tianshou DQN in a policy",
            ["model.net.model.0", "model.net.model.2", "model.last.model.0"],
        ),
    ];
    let mut rows: Vec<Row> = rows
        .into_iter()
        .map(|(name, stems)| row(name, three(stems), Plain(names(stems))))
        .collect();
    let with_target = [
        three(["q_net.0", "q_net.2", "q_net.4"]),
        three(["q_net_target.0", "q_net_target.2", "q_net_target.4"]),
    ];
    let becomes = Plain(names(["q_net.0", "q_net.2", "q_net.4"]));
    rows.push(row("SB3 DQN policy", with_target.concat(), becomes));
    let actor_critic = [
        three(["actor.0", "actor.2", "actor.4"]),
        dense("critic.0", 16, 6),
        dense("critic.2", 16, 16),
        dense("critic.4", 1, 16),
    ];
    let becomes = Plain(names(["actor.0", "actor.2", "actor.4"]));
    rows.push(row("CleanRL PPO", actor_critic.concat(), becomes));
    rows
}

fn kernels() -> Vec<Row> {
    let of = |name, stems: [&str; 3]| {
        let widths = [(6, 16), (16, 16), (16, 5)];
        let tensors = stems.iter().zip(widths).flat_map(|(stem, (i, o))| {
            [
                named(&format!("{stem}/kernel"), &[i, o]),
                named(&format!("{stem}/bias"), &[o]),
            ]
        });
        row(name, tensors.collect::<Tensors>(), Plain(names(stems)))
    };
    vec![
        of("Flax", ["params/Dense_0", "params/Dense_1", "params/Dense_2"]),
        of("Keras", ["dense", "dense_1", "dense_2"]),
    ]
}

/// `log_std_clip_param_const` stands beside every head of RLlib.
fn rllib(tensors: &[Tensors], heads: &[&str]) -> Tensors {
    let constant = |head: &&str| named(&format!("{head}.log_std_clip_param_const"), &[1]);
    tensors.concat().into_iter().chain(heads.iter().map(constant)).collect()
}

fn joined() -> Vec<Row> {
    let sb3 = [
        dense("mlp_extractor.policy_net.0", 16, 6),
        dense("mlp_extractor.policy_net.2", 16, 16),
        dense("mlp_extractor.value_net.0", 16, 6),
        dense("mlp_extractor.value_net.2", 16, 16),
        dense("action_net", 5, 16),
        dense("value_net", 1, 16),
    ];
    let tianshou = [
        "actor.preprocess.model.model.0",
        "actor.preprocess.model.model.2",
        "actor.last.model.0",
    ];
    let ppo = [
        three(tianshou),
        dense("critic.preprocess.model.model.0", 16, 6),
        dense("critic.preprocess.model.model.2", 16, 16),
        dense("critic.last.model.0", 1, 16),
    ];
    let in_policy = [
        "policy.model.model.model.0",
        "policy.model.model.model.2",
        "policy.model.model.model.4",
    ];
    let old_model = [
        "model_old.module.model.model.0",
        "model_old.module.model.model.2",
        "model_old.module.model.model.4",
    ];
    let in_sb3 = ["mlp_extractor.policy_net.0", "mlp_extractor.policy_net.2", "action_net"];
    vec![
        row("SB3 PPO", sb3.concat(), Joined(names(in_sb3))),
        row("Tianshou PPO", ppo.concat(), Joined(names(tianshou))),
        row(
            "Tianshou's DQN algorithm",
            [three(in_policy), three(old_model)].concat(),
            Joined(names(in_policy)),
        ),
    ]
}

fn of_rllib() -> Vec<Row> {
    let separate = [
        "encoder.actor_encoder.net.mlp.0",
        "encoder.actor_encoder.net.mlp.2",
        "pi.net.mlp.0",
    ];
    let apart = [
        three(separate),
        dense("encoder.critic_encoder.net.mlp.0", 16, 6),
        dense("encoder.critic_encoder.net.mlp.2", 16, 16),
        dense("vf.net.mlp.0", 1, 16),
    ];
    let shared = ["encoder.encoder.net.mlp.0", "encoder.encoder.net.mlp.2", "pi.net.mlp.0"];
    let together = [three(shared), dense("vf.net.mlp.0", 1, 16)];
    let two = [super::ending(shared, 2), dense("vf.net.mlp.0", 1, 16)];
    let four = [super::ending(shared, 4), dense("vf.net.mlp.0", 1, 16)];
    let old = [
        dense("_hidden_layers.0._model.0", 16, 6),
        dense("_hidden_layers.1._model.0", 16, 16),
        dense("_logits._model.0", 5, 16),
        dense("_value_branch_separate.0._model.0", 16, 6),
        dense("_value_branch_separate.1._model.0", 16, 16),
        dense("_value_branch._model.0", 1, 16),
    ];
    let in_old = [
        "_hidden_layers.0._model.0",
        "_hidden_layers.1._model.0",
        "_logits._model.0",
    ];
    vec![
        row("RLlib PPO", rllib(&apart, &["pi", "vf"]), Joined(names(separate))),
        row(
            "RLlib PPO, shared encoder",
            rllib(&together, &["pi", "vf"]),
            Joined(names(shared)),
        ),
        row(
            "RLlib PPO, Discrete(2)",
            rllib(&two, &["pi", "vf"]),
            Joined(names(shared)),
        )
        .actions(2),
        row(
            "RLlib PPO, four outputs",
            rllib(&four, &["pi", "vf"]),
            Doubted(names(shared), "2 commands"),
        ),
        row("RLlib's old models", old.concat(), Joined(names(in_old))),
    ]
}

fn dueling() -> Vec<Row> {
    let streams = |name, trunk: &str, value: &str, advantage: &str| {
        let tensors = [
            dense(trunk, 16, 6),
            dense(&format!("{value}.0"), 16, 16),
            dense(&format!("{value}.2"), 1, 16),
            dense(&format!("{advantage}.0"), 16, 16),
            dense(&format!("{advantage}.2"), 5, 16),
        ];
        let stems = [trunk.to_owned(), format!("{advantage}.0"), format!("{advantage}.2")];
        row(name, tensors.concat(), Joined(stems.to_vec()))
    };
    let own = ["encoder.net.mlp.0", "encoder.net.mlp.2", "af.net.mlp.0"];
    let target = [
        "_target_encoder.net.mlp.0",
        "_target_encoder.net.mlp.2",
        "_target_af.net.mlp.0",
    ];
    let rllib_dqn = [three(own), three(target), dense("vf.net.mlp.0", 1, 16)];
    vec![
        streams("dueling, streams", "feature.0", "value_stream", "advantage_stream"),
        streams("dueling, heads", "fc1", "value_head", "advantage_head"),
        streams("dueling of Tianshou", "model.model.0", "V.model", "Q.model"),
        row("RLlib DQN", rllib(&rllib_dqn, &["af", "vf"]), Joined(names(own))),
    ]
}

/// The means of noisy layers.
fn noisy() -> Vec<Row> {
    let of = |name, mean: [&str; 2], noise: [&str; 4]| {
        let mut tensors = Vec::new();
        for (stem, outputs, inputs) in [("net.0", 16, 6), ("net.2", 5, 16)] {
            tensors.push(named(&format!("{stem}.{}", mean[0]), &[outputs, inputs]));
            tensors.push(named(&format!("{stem}.{}", mean[1]), &[outputs]));
            tensors.extend(noise.map(|leaf| named(&format!("{stem}.{leaf}"), &[outputs])));
        }
        row(name, tensors, Joined(names(["net.0", "net.2"])))
    };
    let sigma = ["weight_sigma", "bias_sigma", "weight_epsilon", "bias_epsilon"];
    vec![
        of("NoisyNet", ["weight_mu", "bias_mu"], sigma),
        of(
            "NoisyNet of Tianshou",
            ["mu_W", "mu_bias"],
            ["sigma_W", "sigma_bias", "eps_p", "eps_q"],
        ),
    ]
}

/// Other names and orders.
fn other_tools() -> Vec<Row> {
    let chain = |stems: [&str; 3], weight: &str, bias: &str, is_flipped: bool, column: &[usize]| -> Tensors {
        let widths = [(16, 6), (16, 16), (5, 16)];
        let layers = stems.iter().zip(widths).flat_map(|(stem, (o, i))| {
            let shape = if is_flipped { [i, o] } else { [o, i] };
            let bias_shape: Vec<usize> = [&[o], column].concat();
            [
                named(&weight.replace('*', stem), &shape),
                named(&bias.replace('*', stem), &bias_shape),
            ]
        });
        layers.collect()
    };
    let fc = ["fc_1", "fc_2", "fc_3"];
    let keras = ["layers/dense", "layers/dense_1", "layers/dense_2"];
    let own = ["l1", "l2", "l3"];
    vec![
        row(
            "MATLAB W1, b1",
            chain(["1", "2", "3"], "W*", "b*", false, &[1]),
            Joined(names(["W1", "W2", "W3"])),
        ),
        row(
            "MATLAB fc_1/Weights",
            chain(fc, "*/Weights", "*/Bias", false, &[1]),
            Joined(names(fc)),
        ),
        row(
            "Keras 3",
            chain(keras, "*/vars/0", "*/vars/1", true, &[]),
            Joined(names(keras)),
        ),
        row(
            "transposed weights",
            chain(own, "*.weight", "*.bias", true, &[]),
            Joined(names(own)),
        ),
    ]
}
