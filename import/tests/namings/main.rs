//! The names that people's networks have: read right, or refused with the reason. None may be read wrong.
//!
//! `TABLE` has a row for each naming; what libraries write was looked up in their own files, saved by the versions that
//! tests/fixtures/trainers/versions.txt states.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::disallowed_methods)]

#[path = "../common/mod.rs"]
mod common;

mod actors;
mod chains;
mod refused;

use common::{Saved, dense, named};

/// Name and shape of each tensor of a file.
type Tensors = Vec<(String, Vec<usize>)>;

/// What `new` makes of a file.
enum Becomes {
    /// The contract names the file, and its check reads these layers.
    Plain(Vec<String>),
    /// Weights of its own, of these layers.
    Joined(Vec<String>),
    /// As the last, and a part of what is said of it.
    Doubted(Vec<String>, &'static str),
    /// Weights of its own of a continuous actor, and parts of the text of its contract.
    Actor(Vec<String>, &'static [&'static str]),
    /// The same of an actor with several commands, each an output of its own.
    Several(Vec<String>, &'static [&'static str]),
    /// Parts of the message, which also has a way out.
    Refused(&'static [&'static str]),
}
use Becomes::{Actor, Doubted, Joined, Plain, Refused, Several};

struct Row {
    name: &'static str,
    tensors: Tensors,
    actions: Option<usize>,
    output: Option<usize>,
    becomes: Becomes,
}

fn row(name: &'static str, tensors: impl Into<Tensors>, becomes: Becomes) -> Row {
    let tensors = tensors.into();
    Row {
        name,
        tensors,
        actions: None,
        output: None,
        becomes,
    }
}

impl Row {
    /// With `--actions`.
    fn actions(self, count: usize) -> Self {
        Row {
            actions: Some(count),
            ..self
        }
    }

    /// With `--output`.
    fn output(self, output: usize) -> Self {
        Row {
            output: Some(output),
            ..self
        }
    }
}

/// `6 -> 16 -> 16 -> outputs` under three stems.
fn ending(stems: [&str; 3], outputs: usize) -> Tensors {
    [
        dense(stems[0], 16, 6),
        dense(stems[1], 16, 16),
        dense(stems[2], outputs, 16),
    ]
    .concat()
}

/// `6 -> 16 -> 16 -> 5` under three stems.
fn three(stems: [&str; 3]) -> Tensors {
    ending(stems, 5)
}

/// Tensors, and others beside them.
fn with(tensors: Tensors, others: &[(&str, &[usize])]) -> Tensors {
    let others = others.iter().map(|(name, shape)| named(name, shape));
    tensors.into_iter().chain(others).collect()
}

fn names<const N: usize>(stems: [&str; N]) -> Vec<String> {
    stems.map(str::to_owned).to_vec()
}

fn check(row: &Row) {
    let name = row.name;
    let saved = Saved::new(&row.tensors);
    let options = import::Options {
        actions: row.actions,
        output: row.output,
        ..import::Options::default()
    };
    let new = import::new_policy(&saved.weights(), &saved.contract(), &options);
    let (stems, is_plain) = match &row.becomes {
        Refused(reasons) => {
            let faults = new.err().unwrap_or_else(|| panic!("{name} is taken")).to_string();
            for reason in *reasons {
                assert!(faults.contains(reason), "{name}: {faults}");
            }
            assert!(faults.contains("hint:"), "{name} has no way out: {faults}");
            return;
        }
        Plain(stems) => (stems, true),
        Joined(stems) | Doubted(stems, _) | Actor(stems, _) | Several(stems, _) => (stems, false),
    };
    let new = new.unwrap_or_else(|faults| panic!("{name}: {faults}"));
    assert_eq!(new.beside.is_empty(), is_plain, "{name}: {:?}", new.said);
    let policy = saved.filled(&new);
    assert_eq!(policy.layers.len(), stems.len(), "{name}");
    for (layer, stem) in policy.layers.iter().zip(stems) {
        assert!(saved.is(layer, stem), "{name}: `{stem}` {:?}", policy.notes);
    }
    let is_actor = matches!(row.becomes, Actor(..));
    assert_eq!(policy.head.continuous().is_some(), is_actor, "{name}");
    let outputs = policy.paths();
    let is_several = outputs.len() > 1 && outputs.iter().all(|path| path.head.continuous().is_some());
    assert_eq!(is_several, matches!(row.becomes, Several(..)), "{name}");
    if let Doubted(_, doubt) = row.becomes {
        assert!(
            new.said.iter().any(|line| line.contains(doubt)),
            "{name}: {:?}",
            new.said
        );
    }
    if let Actor(_, parts) | Several(_, parts) = row.becomes {
        for part in parts {
            assert!(new.contract.contains(part), "{name}: {part}\n{}", new.contract);
        }
    }
}

#[test]
fn every_naming_is_read_right_or_refused_with_a_way_out() {
    let table: Vec<Row> = chains::rows()
        .into_iter()
        .chain(actors::rows())
        .chain(refused::rows())
        .chain(refused::layer_norms())
        .collect();
    assert!(table.len() >= 35, "{} rows", table.len());
    table.iter().for_each(check);
}

#[test]
fn the_quantiles_of_qr_dqn_become_their_mean() {
    let tensors = [
        dense("quantile_net.quantile_net.0", 16, 6),
        dense("quantile_net.quantile_net.2", 15, 16),
    ]
    .concat();
    check(&row(
        "QR-DQN without --actions",
        tensors.clone(),
        Refused(&["--actions N"]),
    ));
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
fn of_a_dueling_network_the_advantage_is_read_and_said() {
    let tensors = [
        dense("feature.0", 16, 6),
        dense("value_stream", 1, 16),
        dense("advantage_stream", 5, 16),
    ]
    .concat();
    let saved = Saved::new(&tensors);
    let new = import::new_policy(&saved.weights(), &saved.contract(), &import::Options::default()).unwrap();
    let is_said = new.said.iter().any(|line| line.contains("differ by a constant"));
    assert!(is_said, "{:?}", new.said);
}
