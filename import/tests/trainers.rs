//! Models that torch and stable-baselines3 saved, against what these libraries compute: tests/fixtures/trainers/make.py.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::disallowed_methods)]

mod common;

use std::path::Path;

use common::library::{actions, assert_equals_library, expected, fixture, policy_of, refusal};
use common::{run, write};
use import::Options;

fn relu(x: f64) -> f64 {
    x.max(0.0)
}

#[test]
fn a_dqn_of_sb3_brings_architecture_bounds_and_golden_answers() {
    let (_folder, new, policy) = policy_of("sb3_dqn.zip", &Options::default());
    assert_equals_library(&policy, "sb3_dqn", relu, false);
    assert_eq!(policy.golden.as_ref().map(|golden| golden.count), Some(64));
    for line in [
        "DQN of stable-baselines3 2.9.2, discount 0.97",
        "hidden_activation = \"relu\"",
        "clip = [-1.5, 1.5]",
        "\ngolden = \"golden.safetensors\"",
    ] {
        assert!(new.contract.contains(line), "{line}\n{}", new.contract);
    }
    assert!(
        new.contract
            .contains("\nduties = [\"TODO\", \"TODO\", \"TODO\", \"TODO\", \"TODO\"]\n")
    );
}

/// A training with a seed leaves generators of random numbers in the spaces that VecNormalize saves.
#[test]
fn the_vecnormalize_of_a_seeded_training_says_the_same() {
    let contract = |name: &str| {
        let options = Options {
            vecnormalize: Some(fixture(name)),
            ..Options::default()
        };
        policy_of("sb3_ppo.zip", &options).1.contract
    };
    assert_eq!(
        contract("sb3_seeded_vecnormalize.pkl"),
        contract("sb3_ppo_vecnormalize.pkl")
    );
}

#[test]
fn the_vecnormalize_of_a_ppo_becomes_scale_offset_and_clip() {
    let options = Options {
        vecnormalize: Some(fixture("sb3_ppo_vecnormalize.pkl")),
        ..Options::default()
    };
    let (_folder, new, policy) = policy_of("sb3_ppo.zip", &options);
    assert!(
        new.contract.contains("hidden_activation = \"tanh\""),
        "{}",
        new.contract
    );
    assert_equals_library(&policy, "sb3_ppo", f64::tanh, false);
    let (raw, normal) = (
        expected("sb3_ppo_vecnormalize", "raw"),
        expected("sb3_ppo_vecnormalize", "normal"),
    );
    let mut clipped = 0;
    for (index, (raw, normal)) in raw.iter().zip(&normal).enumerate() {
        let feature = &policy.features[index % 6];
        let clip = feature.clip.unwrap();
        let (raw, normal) = (f64::from(*raw), f64::from(*normal));
        let x = feature.scale * raw + feature.offset;
        let found = x.clamp(clip.low, clip.high);
        clipped += usize::from(found != x);
        assert!(
            (found - normal).abs() <= 2e-6 * normal.abs().max(1.0),
            "{index}: {found} {normal}"
        );
    }
    // epsilon is a thousandth, beside a variance of a thousandth: a scale without it would be 1.4 times as large
    assert!(clipped > 64, "{clipped}");
}

#[test]
fn statistics_beside_a_model_are_taken_unasked() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::copy(fixture("sb3_ppo.zip"), folder.path().join("model.zip")).unwrap();
    std::fs::copy(
        fixture("sb3_ppo_vecnormalize.pkl"),
        folder.path().join("vecnormalize.pkl"),
    )
    .unwrap();
    let new = import::new_policy(
        &folder.path().join("model.zip"),
        &folder.path().join("policy.toml"),
        &Options::default(),
    );
    assert!(
        new.unwrap()
            .contract
            .contains("clip = [-4.0, 4.0] },   # network input 0; clip: clip_obs of VecNormalize")
    );
    std::fs::copy(fixture("sb3_a2c.zip"), folder.path().join("vecnormalize.pkl")).unwrap();
    let faults = refusal(&folder.path().join("model.zip"));
    assert!(faults.contains("vecnormalize.pkl"), "{faults}");
}

#[test]
fn a2c_and_quantiles_of_sb3_are_read() {
    let (_folder, new, policy) = policy_of("sb3_a2c.zip", &Options::default());
    assert!(new.contract.contains("hidden_activation = \"relu\""));
    assert_equals_library(&policy, "sb3_a2c", relu, false);
    let (_folder, new, policy) = policy_of("sb3_qrdqn.zip", &Options::default());
    assert!(new.contract.contains("mean over 10 quantiles"), "{}", new.contract);
    assert_equals_library(&policy, "sb3_qrdqn", relu, false);
}

#[test]
fn torch_files_of_every_kind_are_read() {
    for file in ["state_dict.pth", "whole_module.pt"] {
        let (_folder, new, policy) = policy_of(file, &Options::default());
        assert_equals_library(&policy, "state_dict", relu, false);
        // a state dict does not say it
        let said = new.contract.contains("hidden_activation = \"relu\"");
        assert_eq!(said, file == "whole_module.pt", "{}", new.contract);
    }
    let (_folder, new, policy) = policy_of("checkpoint.pt", &Options::default());
    assert!(new.said[0].contains("`model_state_dict`"), "{:?}", new.said);
    assert_equals_library(&policy, "state_dict", relu, false);
    let (_folder, _, policy) = policy_of("dueling.pth", &Options::default());
    assert_equals_library(&policy, "dueling", relu, true);
    let (_folder, new, policy) = policy_of("batch_norm_module.pt", &Options::default());
    assert_equals_library(&policy, "batch_norm_module", relu, false);
    // the module holds its epsilon
    assert!(!new.said.iter().any(|line| line.contains("default")), "{:?}", new.said);
}

/// `predict(obs, deterministic=True)` of the library, in units of the action space, which are duties here.
#[test]
fn continuous_models_of_sb3_command_the_duties_of_the_library() {
    for (name, activation) in [
        ("sb3_sac_duty", relu as fn(f64) -> f64),
        ("sb3_td3_duty", relu),
        ("sb3_ppo_duty", f64::tanh),
    ] {
        let (_folder, new, policy) = policy_of(&format!("{name}.zip"), &Options::default());
        assert!(new.beside.contains_key("golden.safetensors"), "{name}");
        let head = policy.head.continuous().unwrap_or_else(|| panic!("{name}"));
        let (obs, duties) = (expected(name, "obs"), expected(name, "duty"));
        assert_eq!(duties.len(), 64);
        let inside = duties.iter().filter(|duty| (0.11..0.84).contains(*duty)).count();
        assert!(inside > 20, "{name}: {inside} duties that nothing cut off");
        for (row, duty) in duties.iter().enumerate() {
            let x: Vec<f64> = obs[row * 6..(row + 1) * 6].iter().map(|x| f64::from(*x)).collect();
            let found = head.duty(run(&policy, &x, activation)[0]);
            // of a span of .75: 1e-5 of the range
            assert!(
                (found - f64::from(*duty)).abs() < 7.5e-6,
                "{name}, row {row}: {found} {duty}"
            );
        }
    }
}

#[test]
fn graphs_that_end_in_a_command_are_read_with_what_scales_it() {
    for (name, activation, entry) in [
        (
            "tanh_actor",
            relu as fn(f64) -> f64,
            "squash = \"tanh\", scale = 0.375, offset = 0.475",
        ),
        ("clipped_actor", f64::tanh, "clip = [-1.0, 1.0], scale = 0.3"),
        (
            "sigmoid_actor",
            relu,
            "{ squash = \"sigmoid\" }   # check: the command is 0.0 to 1.0",
        ),
    ] {
        let (_folder, new, policy) = policy_of(&format!("{name}.onnx"), &Options::default());
        assert!(new.contract.contains(entry), "{}", new.contract);
        let head = policy.head.continuous().unwrap_or_else(|| panic!("{name}"));
        let (obs, duties) = (expected(name, "obs"), expected(name, "duty"));
        for (row, duty) in duties.iter().enumerate() {
            let x: Vec<f64> = obs[row * 6..(row + 1) * 6].iter().map(|x| f64::from(*x)).collect();
            let found = head.duty(run(&policy, &x, activation)[0]);
            assert!(
                (found - f64::from(*duty)).abs() < 6e-6,
                "{name}, row {row}: {found} {duty}"
            );
        }
        let inside = duties.iter().filter(|duty| (0.21..0.79).contains(*duty)).count();
        assert!(inside > 10, "{name}: {inside} duties that nothing cut off");
    }
}

#[test]
fn an_action_space_that_is_no_duty_leaves_scale_and_offset_open() {
    for (file, known) in [
        ("sb3_sac.zip", "{ squash = \"tanh\", scale = \"TODO\""),
        ("sb3_td3.zip", "{ squash = \"tanh\", scale = \"TODO\""),
        ("sb3_ddpg.zip", "{ squash = \"tanh\", scale = \"TODO\""),
        ("sb3_ppo_continuous.zip", "{ clip = [-1.0, 1.0], scale = \"TODO\""),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let new = import::new_policy(&fixture(file), &folder.path().join("policy.toml"), &Options::default());
        let contract = new.unwrap_or_else(|faults| panic!("{file}: {faults}")).contract;
        assert!(contract.contains(known), "{file}: {contract}");
        assert!(contract.contains("own command is -1.0 to 1.0"), "{file}");
    }
}

#[test]
fn a_planted_call_is_refused_by_name_and_does_not_run() {
    let folder = tempfile::tempdir().unwrap();
    let planted = folder.path().join("planted.pt");
    std::fs::copy(fixture("planted.pt"), &planted).unwrap();
    let faults = refusal(&planted);
    assert!(faults.contains("`posix.system`"), "{faults}");
    assert!(!folder.path().join("planted-was-here").exists());
    assert!(!Path::new("planted-was-here").exists());
}

#[test]
fn the_format_before_archives_is_refused_with_the_line_that_converts_it() {
    let faults = refusal(&fixture("legacy.pth"));
    assert!(faults.contains("torch.save(torch.load("), "{faults}");
}

#[test]
fn an_onnx_graph_is_read_with_and_without_external_data() {
    for file in ["gemm.onnx", "external.onnx"] {
        let (_folder, new, policy) = policy_of(file, &Options::default());
        assert!(
            new.contract.contains("hidden_activation = \"relu\""),
            "{}",
            new.contract
        );
        assert_equals_library(&policy, "gemm", relu, false);
    }
}

#[test]
fn the_normalisation_of_a_graph_becomes_features() {
    let (_folder, _, policy) = policy_of("normalised.onnx", &Options::default());
    let (obs, normal) = (expected("normalised", "obs"), expected("normalised", "normal"));
    let (q, chosen) = (expected("normalised", "q"), actions("normalised"));
    for (row, chosen) in chosen.iter().enumerate() {
        let mut x = Vec::new();
        for (index, feature) in policy.features.iter().enumerate() {
            let found = feature.scale * f64::from(obs[row * 6 + index]) + feature.offset;
            assert!((found - f64::from(normal[row * 6 + index])).abs() <= 2e-6 * found.abs().max(1.0));
            x.push(found);
        }
        let found = run(&policy, &x, relu);
        let best = (0..5).fold(0, |best, a| if found[a] > found[best] { a } else { best });
        assert_eq!(best, *chosen);
        for (found, q) in found.iter().zip(&q[row * 5..]) {
            assert!(
                (found - f64::from(*q)).abs() <= 1e-5 * found.abs().max(1.0),
                "{found} {q}"
            );
        }
    }
}

#[test]
fn an_odd_graph_is_refused_by_its_node() {
    let faults = refusal(&fixture("branching.onnx"));
    assert!(
        faults.contains("branches") && faults.contains("Gemm `/a/Gemm`"),
        "{faults}"
    );
    let folder = tempfile::tempdir().unwrap();
    let whole = std::fs::read(fixture("gemm.onnx")).unwrap();
    let at = whole.windows(6).position(|six| six == b"\"\x04Relu").unwrap();
    let mut other = whole.clone();
    other[at + 2..at + 6].copy_from_slice(b"Mish");
    let file = folder.path().join("mish.onnx");
    write(&file, &other);
    let faults = refusal(&file);
    assert!(faults.contains("Mish `/network/network.1/Relu`"), "{faults}");
}

#[test]
fn external_data_outside_the_folder_are_refused_unread() {
    let folder = tempfile::tempdir().unwrap();
    let whole = std::fs::read(fixture("external.onnx")).unwrap();
    let name = b"external.onnx.data";
    for elsewhere in [b"../etc/passwd/aaaa", b"/etc/passwd/aaaaaa"] {
        let mut other = whole.clone();
        while let Some(at) = other.windows(name.len()).position(|here| here == name) {
            other[at..at + name.len()].copy_from_slice(elsewhere);
        }
        let file = folder.path().join("external.onnx");
        write(&file, &other);
        assert!(refusal(&file).contains("outside its folder"));
    }
    let file = folder.path().join("alone.onnx");
    write(&file, &whole);
    assert!(refusal(&file).contains("external.onnx.data"));
}

/// Nodes need no names in ONNX, and some exporters give none.
#[test]
fn layers_of_nodes_without_a_name_are_called_by_their_weights() {
    let folder = tempfile::tempdir().unwrap();
    let mut graph = std::fs::read(fixture("gemm.onnx")).unwrap();
    let begin = b"/network/";
    let named: Vec<usize> = (2..graph.len())
        .filter(|at| graph[*at..].starts_with(begin) && graph[at - 2] == 0x1a)
        .collect();
    assert_eq!(named.len(), 5, "three layers and two activations");
    for at in named {
        // field 3 is the name, field 6 a remark
        graph[at - 2] = 0x32;
    }
    let file = folder.path().join("nameless.onnx");
    write(&file, &graph);
    let new = import::new_policy(&file, &folder.path().join("policy.toml"), &Options::default()).unwrap();
    let layers = "# layers, first to last: network.0.weight > network.2.weight > network.4.weight";
    assert!(new.contract.contains(layers), "{}", new.contract);
    // a fault names such a node, too
    let at = graph.windows(6).position(|six| six == b"\"\x04Relu").unwrap();
    graph[at + 2..at + 6].copy_from_slice(b"Mish");
    write(&file, &graph);
    let faults = refusal(&file);
    assert!(faults.contains("Mish `/network/network.1/Relu_output_0`"), "{faults}");
}

/// Every prefix and every changed byte of an archive is read or refused, and soon.
#[test]
fn a_damaged_archive_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["state_dict.pth", "sb3_dqn.zip", "gemm.onnx"] {
        let whole = std::fs::read(fixture(name)).unwrap();
        let file = folder.path().join(name);
        let begun = std::time::Instant::now();
        for cut in (0..whole.len()).step_by(197) {
            write(&file, &whole[..cut]);
            refusal(&file);
        }
        for at in (0..whole.len()).step_by(61) {
            let mut damaged = whole.clone();
            damaged[at] ^= 0xff;
            write(&file, &damaged);
            let _ = import::new_policy(&file, &folder.path().join("policy.toml"), &Options::default());
        }
        assert!(begun.elapsed().as_secs() < 20, "{:?}", begun.elapsed());
    }
}

/// What the trainer answered checks more than what can be computed from the tensors.
#[test]
fn golden_answers_beside_a_model_are_taken_and_lie_beside_its_new_weights() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    std::fs::copy(fixture("sb3_dqn.zip"), path("model.zip")).unwrap();
    std::fs::copy(fixture("sb3_dqn.expected.safetensors"), path("golden.safetensors")).unwrap();
    let new = |contract: &str| import::new_policy(&path("model.zip"), &path(contract), &Options::default()).unwrap();
    let there = new("policy.toml");
    assert!(
        there.contract.contains("\ngolden = \"golden.safetensors\""),
        "{}",
        there.contract
    );
    assert!(!there.contract.contains("golden_outside"), "they were not drawn");
    assert!(!there.beside.contains_key("golden.safetensors"), "it is there already");
    assert!(
        there.said.join(" ").contains("taken as the trainer's"),
        "{:?}",
        there.said
    );
    std::fs::create_dir(path("apart")).unwrap();
    let apart = new("apart/policy.toml");
    assert_eq!(apart.contract, there.contract);
    assert_eq!(
        apart.beside.get("golden.safetensors"),
        Some(&std::fs::read(path("golden.safetensors")).unwrap())
    );
    // what an earlier call made is no answer of the trainer
    std::fs::remove_file(path("golden.safetensors")).unwrap();
    let drawn = new("policy.toml");
    std::fs::write(path("golden.safetensors"), &drawn.beside["golden.safetensors"]).unwrap();
    assert_eq!(new("apart/policy.toml").contract, drawn.contract);
}

/// A contract that named them would be refused by every command.
#[test]
fn golden_answers_of_another_network_are_refused_with_the_way_out() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let twelve = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/buck12/golden.safetensors");
    std::fs::copy(fixture("sb3_dqn.zip"), path("model.zip")).unwrap();
    std::fs::copy(twelve, path("golden.safetensors")).unwrap();
    let text = refusal(&path("model.zip"));
    assert!(text.contains("tensor `q`"), "{text}");
    assert!(text.contains("move that of another network away"), "{text}");
}

#[test]
fn statistics_in_a_file_of_numpy_are_refused_with_the_formula() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::copy(fixture("sb3_ppo.zip"), folder.path().join("model.zip")).unwrap();
    let json = &br#"{"obs_mean": [0.1], "obs_var": [0.2]}"#[..];
    for (start, kind) in [
        (&b"PK\x03\x04rest"[..], ".npz"),
        (b"\x93NUMPY\x01\x00", ".npy"),
        (json, "JSON"),
    ] {
        std::fs::write(folder.path().join("vecnormalize.pkl"), start).unwrap();
        let faults = refusal(&folder.path().join("model.zip"));
        for words in [
            kind,
            "scale = 1 / sqrt(var + epsilon)",
            "offset = -mean / sqrt(var",
            "clip = [-clip_obs",
        ] {
            assert!(faults.contains(words), "{words}: {faults}");
        }
    }
}
