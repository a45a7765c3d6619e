//! The names that people's networks have: read right, or refused with the reason. None may be read wrong.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::disallowed_methods)]

mod common;

use common::{Saved, dense, named};

/// What `new` makes of a file.
enum Becomes {
    /// The contract names the file, and its check reads these layers.
    Plain(&'static [&'static str]),
    /// Weights of its own, of these layers.
    Joined(&'static [&'static str]),
    Refused(&'static str),
}
use Becomes::{Joined, Plain, Refused};

/// `6 -> 16 -> 16 -> 5` under three stems.
fn three(stems: [&str; 3]) -> Vec<(String, Vec<usize>)> {
    [dense(stems[0], 16, 6), dense(stems[1], 16, 16), dense(stems[2], 5, 16)].concat()
}

fn check(name: &str, tensors: &[(String, Vec<usize>)], becomes: Becomes) {
    check_with(name, tensors, becomes, &import::Options::default());
}

fn check_with(name: &str, tensors: &[(String, Vec<usize>)], becomes: Becomes, options: &import::Options) {
    let saved = Saved::new(tensors);
    let new = import::new_policy(&saved.weights(), &saved.contract(), options);
    let expected = match becomes {
        Refused(reason) => {
            let faults = new.err().unwrap_or_else(|| panic!("{name} is taken")).to_string();
            assert!(faults.contains(reason), "{name}: {faults}");
            assert!(faults.contains("hint:"), "{name} has no way out: {faults}");
            return;
        }
        Plain(names) => (names.to_vec(), true),
        Joined(names) => (names.to_vec(), false),
    };
    let new = new.unwrap_or_else(|faults| panic!("{name}: {faults}"));
    assert_eq!(new.beside.is_empty(), expected.1, "{name}: {:?}", new.said);
    let policy = saved.filled(&new);
    let sizes: Vec<_> = policy
        .layers
        .iter()
        .map(|layer| (layer.inputs, layer.outputs))
        .collect();
    let mut stored = Vec::new();
    for (layer, name) in policy.layers.iter().zip(&expected.0) {
        stored.push(saved.is(layer, name));
    }
    assert!(stored.iter().all(|same| *same), "{name}: {sizes:?} {:?}", policy.notes);
    assert_eq!(policy.layers.len(), expected.0.len(), "{name}");
}

#[test]
fn a_plain_chain_of_any_library_stays_in_its_file() {
    let plain: [(&str, [&str; 3]); 8] = [
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
    for (name, stems) in plain {
        let leaked: &'static [&'static str] = Box::leak(Box::new(stems));
        check(name, &three(stems), Plain(leaked));
    }
    let with_target = [
        three(["q_net.0", "q_net.2", "q_net.4"]),
        three(["q_net_target.0", "q_net_target.2", "q_net_target.4"]),
    ];
    check(
        "SB3 DQN policy",
        &with_target.concat(),
        Plain(&["q_net.0", "q_net.2", "q_net.4"]),
    );
    let actor_critic = [
        three(["actor.0", "actor.2", "actor.4"]),
        dense("critic.0", 16, 6),
        dense("critic.2", 16, 16),
        dense("critic.4", 1, 16),
    ];
    check(
        "CleanRL PPO",
        &actor_critic.concat(),
        Plain(&["actor.0", "actor.2", "actor.4"]),
    );
}

#[test]
fn a_kernel_stays_in_its_file() {
    for (name, stems) in [
        ("Flax", ["params/Dense_0", "params/Dense_1", "params/Dense_2"]),
        ("Keras", ["dense", "dense_1", "dense_2"]),
    ] {
        let widths = [(6, 16), (16, 16), (16, 5)];
        let tensors: Vec<_> = stems
            .iter()
            .zip(widths)
            .flat_map(|(stem, (i, o))| {
                [
                    named(&format!("{stem}/kernel"), &[i, o]),
                    named(&format!("{stem}/bias"), &[o]),
                ]
            })
            .collect();
        check(name, &tensors, Plain(Box::leak(Box::new(stems))));
    }
}

#[test]
fn trunk_and_head_of_an_actor_are_joined() {
    let sb3 = [
        dense("mlp_extractor.policy_net.0", 16, 6),
        dense("mlp_extractor.policy_net.2", 16, 16),
        dense("mlp_extractor.value_net.0", 16, 6),
        dense("mlp_extractor.value_net.2", 16, 16),
        dense("action_net", 5, 16),
        dense("value_net", 1, 16),
    ];
    let names = &["mlp_extractor.policy_net.0", "mlp_extractor.policy_net.2", "action_net"];
    check("SB3 PPO", &sb3.concat(), Joined(names));
    let rllib = [
        dense("encoder.actor_encoder.net.mlp.0", 16, 6),
        dense("encoder.actor_encoder.net.mlp.2", 16, 16),
        dense("encoder.critic_encoder.net.mlp.0", 16, 6),
        dense("encoder.critic_encoder.net.mlp.2", 16, 16),
        dense("pi.net.mlp.0", 5, 16),
        dense("vf.net.mlp.0", 1, 16),
    ];
    let names = &[
        "encoder.actor_encoder.net.mlp.0",
        "encoder.actor_encoder.net.mlp.2",
        "pi.net.mlp.0",
    ];
    check("RLlib", &rllib.concat(), Joined(names));
    let shared = [
        dense("encoder.encoder.net.mlp.0", 16, 6),
        dense("encoder.encoder.net.mlp.2", 16, 16),
        dense("pi.net.mlp.0", 5, 16),
        dense("vf.net.mlp.0", 1, 16),
    ];
    let names = &["encoder.encoder.net.mlp.0", "encoder.encoder.net.mlp.2", "pi.net.mlp.0"];
    check("RLlib with a shared encoder", &shared.concat(), Joined(names));
    let old = [
        dense("_hidden_layers.0._model.0", 16, 6),
        dense("_hidden_layers.1._model.0", 16, 16),
        dense("_logits._model.0", 5, 16),
        dense("_value_branch_separate.0._model.0", 16, 6),
        dense("_value_branch_separate.1._model.0", 16, 16),
        dense("_value_branch._model.0", 1, 16),
    ];
    let names = &[
        "_hidden_layers.0._model.0",
        "_hidden_layers.1._model.0",
        "_logits._model.0",
    ];
    check("RLlib's old models", &old.concat(), Joined(names));
    let tianshou = [
        dense("actor.preprocess.model.model.0", 16, 6),
        dense("actor.preprocess.model.model.2", 16, 16),
        dense("actor.last.model.0", 5, 16),
        dense("critic.preprocess.model.model.0", 16, 6),
        dense("critic.preprocess.model.model.2", 16, 16),
        dense("critic.last.model.0", 1, 16),
    ];
    let names = &[
        "actor.preprocess.model.model.0",
        "actor.preprocess.model.model.2",
        "actor.last.model.0",
    ];
    check("Tianshou PPO", &tianshou.concat(), Joined(names));
}

#[test]
fn of_a_dueling_network_the_advantage_is_read() {
    for (name, trunk, value, advantage) in [
        ("streams", "feature.0", "value_stream", "advantage_stream"),
        ("heads", "fc1", "value_head", "advantage_head"),
        ("Tianshou", "model.model.0", "V.model", "Q.model"),
    ] {
        let tensors = [
            dense(trunk, 16, 6),
            dense(&format!("{value}.0"), 16, 16),
            dense(&format!("{value}.2"), 1, 16),
            dense(&format!("{advantage}.0"), 16, 16),
            dense(&format!("{advantage}.2"), 5, 16),
        ]
        .concat();
        let names = [trunk.to_owned(), format!("{advantage}.0"), format!("{advantage}.2")];
        let leaked: Vec<&'static str> = names.into_iter().map(|name| &*name.leak()).collect();
        check(name, &tensors, Joined(leaked.leak()));
        let saved = Saved::new(&tensors);
        let new = import::new_policy(&saved.weights(), &saved.contract(), &import::Options::default()).unwrap();
        assert!(
            new.said.iter().any(|line| line.contains("differ by a constant")),
            "{:?}",
            new.said
        );
    }
}

#[test]
fn the_quantiles_of_qr_dqn_become_their_mean() {
    let tensors = [
        dense("quantile_net.quantile_net.0", 16, 6),
        dense("quantile_net.quantile_net.2", 15, 16),
    ]
    .concat();
    check("QR-DQN without --actions", &tensors, Refused("--actions N"));
    let saved = Saved::new(&tensors);
    let options = import::Options {
        actions: Some(5),
        ..import::Options::default()
    };
    let new = import::new_policy(&saved.weights(), &saved.contract(), &options).unwrap();
    let policy = saved.filled(&new);
    let last = policy.layers.last().unwrap();
    let (weight, bias) = (
        saved.values("quantile_net.quantile_net.2.weight"),
        saved.values("quantile_net.quantile_net.2.bias"),
    );
    for action in 0..5 {
        let mean =
            |of: &dyn Fn(usize) -> f32| ((0..3).map(|q| f64::from(of(q * 5 + action))).sum::<f64>() / 3.0) as f32;
        assert_eq!(last.bias[action], mean(&|row| bias[row]));
        for input in 0..16 {
            assert_eq!(last.weights[action * 16 + input], mean(&|row| weight[row * 16 + input]));
        }
    }
}

#[test]
fn continuous_actors_are_refused_where_the_tensors_do_not_say_what_is_made_of_the_mean() {
    let continuous = "commands a number";
    let sac = [
        dense("latent_pi.0", 64, 6),
        dense("latent_pi.2", 64, 64),
        dense("mu", 2, 64),
        dense("log_std", 2, 64),
    ];
    check("SB3 SAC actor", &sac.concat(), Refused(continuous));
    let whole: Vec<_> = sac
        .concat()
        .into_iter()
        .map(|(name, shape)| (format!("actor.{name}"), shape))
        .collect();
    check("SB3 SAC policy", &whole, Refused(continuous));
    let cleanrl = [
        dense("fc1", 64, 6),
        dense("fc2", 64, 64),
        dense("fc_mean", 2, 64),
        dense("fc_logstd", 2, 64),
    ];
    check("CleanRL SAC", &cleanrl.concat(), Refused(continuous));
    check("SB3 TD3 actor", &three(["mu.0", "mu.2", "mu.4"]), Refused(continuous));
    let ddpg = [
        three(["fc1", "fc2", "fc_mu"]),
        vec![named("action_scale", &[5]), named("action_bias", &[5])],
    ];
    check("CleanRL DDPG", &ddpg.concat(), Refused(continuous));
    let gaussian = [
        dense("mlp_extractor.policy_net.0", 16, 6),
        dense("action_net", 2, 16),
        vec![named("log_std", &[2])],
    ];
    check("SB3 PPO with a Box", &gaussian.concat(), Refused(continuous));
    let cleanrl = [
        three(["actor_mean.0", "actor_mean.2", "actor_mean.4"]),
        vec![named("actor_logstd", &[1, 5])],
    ];
    check("CleanRL PPO with a Box", &cleanrl.concat(), Refused(continuous));
}

#[test]
fn what_is_no_chain_is_refused_by_name() {
    let q = || three(["network.0", "network.2", "network.4"]);
    let c51 = [
        dense("network.0", 16, 6),
        dense("network.2", 255, 16),
        vec![named("atoms", &[51])],
    ];
    check("CleanRL C51", &c51.concat(), Refused("categorical"));
    let c51 = [dense("network.0", 16, 6), dense("network.2", 612, 16)];
    check("C51 without its support", &c51.concat(), Refused("612 outputs"));
    let norm = [
        q(),
        vec![named("network.1.weight", &[16]), named("network.1.bias", &[16])],
    ];
    check("LayerNorm", &norm.concat(), Refused("LayerNorm"));
    let recurrent = |cell: &str| {
        [
            named(&format!("{cell}.weight_ih_l0"), &[64, 6]),
            named(&format!("{cell}.weight_hh_l0"), &[64, 16]),
        ]
        .to_vec()
    };
    check(
        "LSTM",
        &[recurrent("lstm"), dense("head", 5, 16)].concat(),
        Refused("recurrent"),
    );
    check(
        "GRU",
        &[recurrent("rnn"), dense("head", 5, 16)].concat(),
        Refused("recurrent"),
    );
    check(
        "convolution",
        &[vec![named("cnn.0.weight", &[8, 6, 3])], q()].concat(),
        Refused("convolution"),
    );
    let two_heads = [dense("body.0", 16, 6), dense("left", 5, 16), dense("right", 5, 16)];
    check("two heads", &two_heads.concat(), Refused("more than one chain"));
    check(
        "a single output",
        &[dense("l.0", 16, 6), dense("l.2", 1, 16)].concat(),
        Refused("hint"),
    );
    check(
        "a tensor that nobody knows",
        &[q(), vec![named("network.gain", &[16])]].concat(),
        Refused("network.gain"),
    );
}

#[test]
fn the_mean_of_a_noisy_layer_is_read() {
    for (mean, leaves) in [
        (
            ["weight_mu", "bias_mu"],
            ["weight_sigma", "bias_sigma", "weight_epsilon", "bias_epsilon"],
        ),
        (["mu_W", "mu_bias"], ["sigma_W", "sigma_bias", "eps_p", "eps_q"]),
    ] {
        let mut tensors = Vec::new();
        for (stem, outputs, inputs) in [("net.0", 16, 6), ("net.2", 5, 16)] {
            tensors.push(named(&format!("{stem}.{}", mean[0]), &[outputs, inputs]));
            tensors.push(named(&format!("{stem}.{}", mean[1]), &[outputs]));
            for leaf in leaves {
                tensors.push(named(&format!("{stem}.{leaf}"), &[outputs]));
            }
        }
        check(mean[0], &tensors, Joined(&["net.0", "net.2"]));
    }
}

#[test]
fn names_and_orders_of_other_tools_are_read() {
    let matlab: Vec<_> = [(1, 16, 6), (2, 16, 16), (3, 5, 16)]
        .into_iter()
        .flat_map(|(n, o, i)| [named(&format!("W{n}"), &[o, i]), named(&format!("b{n}"), &[o, 1])])
        .collect();
    check("MATLAB W1, b1", &matlab, Joined(&["W1", "W2", "W3"]));
    let matlab: Vec<_> = [("fc_1", 16, 6), ("fc_2", 16, 16), ("fc_3", 5, 16)]
        .into_iter()
        .flat_map(|(n, o, i)| {
            [
                named(&format!("{n}/Weights"), &[o, i]),
                named(&format!("{n}/Bias"), &[o, 1]),
            ]
        })
        .collect();
    check("MATLAB fc_1/Weights", &matlab, Joined(&["fc_1", "fc_2", "fc_3"]));
    let keras: Vec<_> = [
        ("layers/dense", 6, 16),
        ("layers/dense_1", 16, 16),
        ("layers/dense_2", 16, 5),
    ]
    .into_iter()
    .flat_map(|(n, i, o)| {
        [
            named(&format!("{n}/vars/0"), &[i, o]),
            named(&format!("{n}/vars/1"), &[o]),
        ]
    })
    .collect();
    check(
        "Keras 3",
        &keras,
        Joined(&["layers/dense", "layers/dense_1", "layers/dense_2"]),
    );
    let flipped: Vec<_> = [("l1", 6, 16), ("l2", 16, 16), ("l3", 16, 5)]
        .into_iter()
        .flat_map(|(n, i, o)| {
            [
                named(&format!("{n}.weight"), &[i, o]),
                named(&format!("{n}.bias"), &[o]),
            ]
        })
        .collect();
    check("transposed weights", &flipped, Joined(&["l1", "l2", "l3"]));
    let mut mixed = flipped;
    mixed[4] = named("l3.weight", &[5, 16]);
    check("one transposed weight", &mixed, Refused("others as [inputs, outputs]"));
}
