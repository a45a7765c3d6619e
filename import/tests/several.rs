//! Models with several outputs: one command of several, one table of several, the gains of a law; and norms over the values of a
//! step. tests/fixtures/trainers/spaces.py
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::disallowed_methods)]

mod common;

use common::library::{expected, fixture, policy_of, refusal};
use common::{Saved, dense, run};
use import::Options;
use policy::Head;

fn output(output: usize) -> Options {
    Options {
        output: Some(output),
        ..Options::default()
    }
}

fn gains() -> Options {
    Options {
        gains: true,
        ..Options::default()
    }
}

/// The refusal of a model of the fixtures.
fn refused(file: &str, options: &Options) -> String {
    let folder = tempfile::tempdir().unwrap();
    let new = import::new_policy(&fixture(file), &folder.path().join("policy.toml"), options);
    new.err().unwrap_or_else(|| panic!("{file} is taken")).to_string()
}

/// Whether a policy gives these columns of the five logits that the library gave.
fn assert_columns(policy: &policy::Policy, columns: std::ops::Range<usize>) {
    let (obs, logits) = (expected("sb3_a2c", "obs"), expected("sb3_a2c", "q"));
    for (x, expected) in obs.chunks_exact(6).zip(logits.chunks_exact(5)) {
        let x: Vec<f64> = x.iter().map(|x| f64::from(*x)).collect();
        let found = run(policy, &x, |v| v.max(0.0));
        let expected = &expected[columns.clone()];
        assert_eq!(found.len(), expected.len());
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - f64::from(*expected)).abs() < 1e-4, "{found} {expected}");
        }
    }
}

/// The last layer was computed of the tensors as saved, and every choice of it is clear.
fn assert_golden(policy: &policy::Policy) {
    let golden = policy.golden.as_ref().unwrap();
    assert_eq!(golden.q_values.len(), policy.outputs() * golden.count);
    let features = policy.features.len();
    let rows = golden.observations.chunks_exact(features);
    for (x, expected) in rows.zip(golden.q_values.chunks_exact(policy.outputs())) {
        let x: Vec<f64> = x.iter().map(|x| f64::from(*x)).collect();
        let found = run(policy, &x, |v| v.max(0.0));
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - f64::from(*expected)).abs() < 1e-4, "{found} {expected}");
        }
        for path in policy.paths().iter().filter(|path| path.head.is_choice()) {
            let mut own = expected[path.columns()].to_vec();
            own.sort_by(f32::total_cmp);
            let [.., next, best] = own.as_slice() else {
                panic!("{own:?}")
            };
            assert!(best > next, "{own:?}");
        }
    }
}

#[test]
fn a_multidiscrete_becomes_a_choice_for_each_dimension() {
    let (_folder, new, policy) = policy_of("sb3_multidiscrete.zip", &Options::default());
    let widths: Vec<_> = policy
        .paths()
        .iter()
        .map(|path| (path.columns(), path.head.is_choice()))
        .collect();
    assert_eq!(widths, [(0..2, true), (2..5, true)]);
    assert!(new.contract.contains("5 outputs for 2 duties"), "{}", new.contract);
    assert_columns(&policy, 0..5);
    assert_golden(&policy);
    let faults = refused("sb3_multidiscrete.zip", &output(2));
    assert!(
        faults.contains("--output names none") && faults.contains("0 to 1"),
        "{faults}"
    );
    let faults = refused("sb3_dqn.zip", &output(0));
    assert!(faults.contains("one table of actions"), "{faults}");
}

#[test]
fn several_commands_of_sb3_become_outputs_with_their_own_ends() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("policy.toml");
    let mut new = import::new_policy(&fixture("sb3_several.zip"), &path, &Options::default()).unwrap();
    for entry in [
        "5 outputs for 5 duties",
        "clip = [0.1, 0.85] }   # check: the command is 0.1 to 0.85",
        "own command is -1.0 to 1.0",
        "duty = [0.0, 0.05]",
    ] {
        assert!(new.contract.contains(entry), "{entry}\n{}", new.contract);
    }
    let open = "scale = \"TODO\", offset = \"TODO\"";
    new.contract = new.contract.replace(open, "scale = 0.01, offset = 0.5");
    let policy = common::filled(folder.path(), &new);
    let columns: Vec<_> = policy.paths().iter().map(|path| path.columns()).collect();
    assert_eq!(columns, [0..1, 1..2, 2..3, 3..4, 4..5]);
    assert_eq!(policy.output_names(), ["u0", "u1", "u2", "u3", "u4"]);
    assert_columns(&policy, 0..5);
    assert_golden(&policy);
}

#[test]
fn of_a_multidiscrete_the_logits_of_one_dimension_are_kept() {
    for (dimension, columns, other) in [(0, 0..2, 1), (1, 2..5, 0)] {
        let (_folder, new, policy) = policy_of("sb3_multidiscrete.zip", &output(dimension));
        assert_eq!(policy.actions().len(), columns.len());
        let said = format!("dimension {dimension} of the MultiDiscrete [2, 3] chooses the duty");
        let left = format!("{other} is left out");
        assert!(
            new.contract.contains(&said) && new.contract.contains(&left),
            "{}",
            new.contract
        );
        assert!(policy.golden.is_some(), "computed of the same logits");
        assert_columns(&policy, columns);
    }
}

#[test]
fn of_several_commands_of_sb3_one_is_kept_with_its_own_ends() {
    let (_folder, new, policy) = policy_of("sb3_several.zip", &output(0));
    assert!(
        new.contract
            .contains("clip = [0.1, 0.85] }   # check: the command is 0.1 to 0.85"),
        "{}",
        new.contract
    );
    assert!(
        new.contract
            .contains("output 0 of 5 is the duty; 1, 2, 3 and 4 are left out"),
        "{}",
        new.contract
    );
    assert_columns(&policy, 0..1);
    let (_folder, new, policy) = policy_of("sb3_several.zip", &output(1));
    assert!(new.contract.contains("own command is -1.0 to 1.0"), "{}", new.contract);
    assert_columns(&policy, 1..2);
}

#[test]
fn the_commands_of_sb3_as_gains_keep_their_own_ends() {
    let (_folder, new, policy) = policy_of("sb3_several.zip", &gains());
    for entry in [
        "clip = [0.1, 0.85] },   # g0",
        "clip = [0.0, 0.05] },   # g2",
        "clip = [0.0, 40.0] },   # g4",
    ] {
        assert!(new.contract.contains(entry), "{entry}\n{}", new.contract);
    }
    let Head::Schedule(head) = &policy.head else {
        panic!("{:?}", policy.head)
    };
    assert_eq!(head.gains.len(), 5);
    let ends = head.gains[3].ends();
    assert_eq!((ends.low, ends.high), (-2.0, 2.0));
    assert!(
        policy
            .golden
            .as_ref()
            .is_some_and(|golden| golden.q_values.len() == 5 * golden.count)
    );
    assert_columns(&policy, 0..5);
    let faults = refused("sb3_dqn.zip", &gains());
    assert!(faults.contains("this model chooses"), "{faults}");
}

#[test]
fn several_commands_of_a_graph_become_outputs_with_their_own_scale() {
    let (_folder, new, policy) = policy_of("several_actor.onnx", &Options::default());
    for entry in [
        "3 outputs for 3 duties",
        "squash = \"tanh\", scale = 0.375, offset = 0.475 }",
        "squash = \"tanh\", scale = 0.02, offset = 0.03 }",
    ] {
        assert!(new.contract.contains(entry), "{entry}\n{}", new.contract);
    }
    let columns: Vec<_> = policy.paths().iter().map(|path| path.columns()).collect();
    assert_eq!(columns, [0..1, 1..2, 2..3]);
    let duties: Vec<_> = policy.paths().iter().map(|path| path.head.duties()).collect();
    assert!(
        (duties[0][0] - 0.1).abs() < 1e-6 && (duties[2][1] - 0.05).abs() < 1e-6,
        "{duties:?}"
    );
    assert!(!new.contract.contains("the one output"), "{}", new.contract);
}

#[test]
fn of_several_commands_of_a_graph_one_is_kept_with_its_own_scale() {
    let (_folder, new, policy) = policy_of("several_actor.onnx", &output(0));
    assert!(
        new.contract
            .contains("squash = \"tanh\", scale = 0.375, offset = 0.475 }"),
        "{}",
        new.contract
    );
    assert_eq!(policy.outputs(), 1);
    let (_folder, new, _) = policy_of("several_actor.onnx", &output(2));
    assert!(
        new.contract
            .contains("squash = \"tanh\", scale = 0.02, offset = 0.03 }"),
        "{}",
        new.contract
    );
    assert!(new.contract.contains("0 and 1 are left out"), "{}", new.contract);
    let (_folder, new, policy) = policy_of("several_actor.onnx", &gains());
    assert_eq!(policy.head.schedule().map(|head| head.gains.len()), Some(3));
    for entry in [
        "scale = 0.375, offset = 0.475 },   # g0",
        "scale = 0.02, offset = 0.03 },   # g2",
    ] {
        assert!(new.contract.contains(entry), "{entry}\n{}", new.contract);
    }
}

#[test]
fn several_commands_of_a_definition_become_outputs_with_their_own_scale() {
    let tensors = [dense("fc1", 16, 6), dense("fc_mu", 3, 16)].concat();
    let scales = [common::named("action_scale", &[3]), common::named("action_bias", &[3])];
    let saved = Saved::new(&[tensors, scales.to_vec()].concat());
    let new = import::new_policy(&saved.weights(), &saved.contract(), &Options::default()).unwrap();
    let (scales, biases) = (saved.values("action_scale"), saved.values("action_bias"));
    // decimals as short as binary32 takes them, at each step
    let short = |x: f64| format!("{:?}", x as f32).parse::<f64>().unwrap();
    for (scale, bias) in scales.iter().zip(&biases) {
        let (scale, bias) = (short(f64::from(*scale)), short(f64::from(*bias)));
        let own = format!("{:?} to {:?}", short(bias - scale), short(bias + scale));
        assert!(new.contract.contains(&own), "{own}\n{}", new.contract);
    }
    let open = "scale = \"TODO\", offset = \"TODO\"";
    let filled = import::NewPolicy {
        contract: new.contract.replace(open, "scale = 0.1, offset = 0.5"),
        ..new
    };
    let policy = saved.filled(&filled);
    assert_eq!(policy.output_names(), ["u0", "u1", "u2"]);
    assert_eq!(policy.layers.last().unwrap().weights, saved.values("fc_mu.weight"));
    // more than a contract holds, and no word which of them is the duty
    let wide = Saved::new(&[dense("fc1", 16, 6), dense("fc_mu", 17, 16), scales_of(17)].concat());
    let faults = import::new_policy(&wide.weights(), &wide.contract(), &Options::default()).unwrap_err();
    assert!(faults.to_string().contains("at most 16"), "{faults}");
}

fn scales_of(count: usize) -> Vec<(String, Vec<usize>)> {
    vec![
        common::named("action_scale", &[count]),
        common::named("action_bias", &[count]),
    ]
}

#[test]
fn tensors_that_say_nothing_of_their_outputs_are_shared_out_as_the_user_says() {
    let saved = Saved::new(&[dense("fc1", 16, 6), dense("out", 4, 16)].concat());
    let outputs = |list: &[usize]| Options {
        outputs: list.to_vec(),
        ..Options::default()
    };
    let new = |options: &Options| import::new_policy(&saved.weights(), &saved.contract(), options);
    let mixed = saved.filled(&new(&outputs(&[3, 1])).unwrap());
    let widths: Vec<_> = mixed
        .paths()
        .iter()
        .map(|path| (path.columns(), path.head.is_choice()))
        .collect();
    assert_eq!(widths, [(0..3, true), (3..4, false)]);
    let all = new(&outputs(&[1, 1, 1, 1])).unwrap();
    let open = "scale = \"TODO\", offset = \"TODO\"";
    let all = import::NewPolicy {
        contract: all.contract.replace(open, "scale = 0.1, offset = 0.5"),
        ..all
    };
    assert_eq!(saved.filled(&all).output_names().len(), 4);
    let shared = new(&outputs(&[3, 2])).unwrap_err().to_string();
    assert!(
        shared.contains("together 5") && shared.contains("add up to 4"),
        "{shared}"
    );
    let known = refused("sb3_several.zip", &outputs(&[3, 2]));
    assert!(known.contains("says something else than the file"), "{known}");
    let known = refused("sb3_dqn.zip", &outputs(&[3, 2]));
    assert!(known.contains("--outputs"), "{known}");
}

#[test]
fn the_row_of_the_picked_output_is_kept() {
    let tensors = [dense("fc1", 16, 6), dense("fc_mu", 3, 16)].concat();
    let scales = [common::named("action_scale", &[3]), common::named("action_bias", &[3])];
    let saved = Saved::new(&[tensors, scales.to_vec()].concat());
    let new = import::new_policy(&saved.weights(), &saved.contract(), &output(1)).unwrap();
    let policy = saved.filled(&new);
    let last = policy.layers.last().unwrap();
    assert_eq!(last.weights, saved.values("fc_mu.weight")[16..32]);
    assert_eq!(last.bias, saved.values("fc_mu.bias")[1..2]);
    // from -scale to scale around the bias: no duty, so the contract leaves scale and offset open
    let (scale, bias) = (saved.values("action_scale")[1], saved.values("action_bias")[1]);
    let own = format!("own command is {:?} to {:?}", bias - scale, bias + scale);
    assert!(new.contract.contains(&own), "{own}\n{}", new.contract);
}

#[test]
fn tensors_become_gains_where_somebody_says_so() {
    let saved = Saved::new(&[dense("fc1", 16, 6), dense("out", 3, 16)].concat());
    let new = import::new_policy(&saved.weights(), &saved.contract(), &gains()).unwrap();
    let policy = saved.filled(&new);
    assert_eq!(policy.head.schedule().map(|head| head.gains.len()), Some(3));
    assert!(new.contract.contains("# base = \"v_ref / 200\""), "{}", new.contract);
}

#[test]
fn a_norm_over_the_values_of_a_step_is_refused_in_every_form() {
    for (file, found) in [
        ("layer_norm.onnx", "LayerNormalization `norm`"),
        ("layer_norm_steps.onnx", "ReduceMean `mean`"),
        ("layer_norm_module.pt", "a module of the class LayerNorm"),
    ] {
        let faults = refusal(&fixture(file));
        for part in ["a LayerNorm is not compiled", found, "hint:", "BatchNorm1d"] {
            assert!(faults.contains(part), "{file}, {part}: {faults}");
        }
    }
}
