//! The learner against PyTorch and against finite differences of a loss written again from its definition.

#![allow(clippy::unwrap_used, clippy::panic)]

use policy::Activation;
use random::{Random, Xoshiro};
use serde::Deserialize;
use train::learner::{Learner, LearnerSettings, Loss, TargetUpdate, greedy};
use train::network::Network;
use train::optimiser::AdamSettings;
use train::replay::Batch;

#[derive(Deserialize)]
struct Fixture {
    widths: Vec<usize>,
    rows: usize,
    discount: f64,
    learning_rate: f64,
    cases: Vec<Case>,
}

#[derive(Deserialize)]
struct Case {
    name: String,
    activation: String,
    double: bool,
    loss: String,
    soft: f64,
    hard: u64,
    clip: f64,
    start: Vec<f32>,
    start_target: Vec<f32>,
    updates: Vec<Update>,
}

#[derive(Deserialize)]
struct Update {
    observations: Vec<f32>,
    next_observations: Vec<f32>,
    actions: Vec<u32>,
    rewards: Vec<f32>,
    alive: Vec<f32>,
    loss: f64,
    gradient: Vec<f32>,
    online: Vec<f32>,
    target: Vec<f32>,
}

impl Update {
    fn batch(&self) -> Batch {
        Batch {
            observations: self.observations.clone(),
            next_observations: self.next_observations.clone(),
            actions: self.actions.clone(),
            rewards: self.rewards.clone(),
            alive: self.alive.clone(),
        }
    }
}

fn settings(batch: usize) -> LearnerSettings {
    LearnerSettings {
        batch,
        discount: 0.9,
        double: false,
        target_update: TargetUpdate::Soft { rate: 1e-3 },
        loss: Loss::Huber,
        gradient_clip: None,
        adam: AdamSettings::default(),
    }
}

fn assert_close(name: &str, found: &[f32], expected: &[f32], tolerance: f32) {
    assert_eq!(found.len(), expected.len(), "{name}");
    for (n, (a, b)) in found.iter().zip(expected).enumerate() {
        assert!((a - b).abs() <= tolerance, "{name}, {n}: found {a}, expected {b}");
    }
}

#[test]
fn losses_gradients_parameters_and_target_networks_are_those_of_pytorch() {
    let fixture: Fixture = serde_json::from_str(include_str!("fixtures/updates.json")).unwrap();
    for case in &fixture.cases {
        let hidden = match case.activation.as_str() {
            "relu" => Activation::Relu,
            "tanh" => Activation::Tanh,
            _ => Activation::LeakyRelu { slope: 0.1 },
        };
        let mut network = Network::zeros(&fixture.widths, &[hidden, hidden, Activation::Identity]);
        network.parameters.copy_from_slice(&case.start);
        let settings = LearnerSettings {
            discount: fixture.discount,
            double: case.double,
            loss: if case.loss == "huber" {
                Loss::Huber
            } else {
                Loss::Squared
            },
            target_update: match case.hard {
                0 => TargetUpdate::Soft { rate: case.soft },
                every => TargetUpdate::Hard { every },
            },
            gradient_clip: (case.clip > 0.0).then_some(case.clip),
            ..settings(fixture.rows)
        };
        let mut learner = Learner::new(network, settings);
        learner.target_network.parameters.copy_from_slice(&case.start_target);
        for (n, update) in case.updates.iter().enumerate() {
            let name = format!("{}, update {n}", case.name);
            let batch = update.batch();
            let loss = learner.gradient(&batch);
            assert!(
                (loss / update.loss - 1.0).abs() < 1e-5,
                "{name}: loss {loss}, expected {}",
                update.loss
            );
            assert_close(
                &format!("{name}, gradient"),
                learner.last_gradient(),
                &update.gradient,
                2e-6,
            );
            learner.update_on(&batch, fixture.learning_rate);
            assert_close(
                &format!("{name}, online"),
                &learner.online.parameters,
                &update.online,
                2e-5,
            );
            assert_close(
                &format!("{name}, target"),
                &learner.target_network.parameters,
                &update.target,
                2e-5,
            );
        }
    }
}

/// Q values in binary64, one row, from the layout of the parameters alone.
fn q_values(widths: &[usize], parameters: &[f64], activation: fn(f64) -> f64, observation: &[f32]) -> Vec<f64> {
    let mut x: Vec<f64> = observation.iter().map(|&o| f64::from(o)).collect();
    let mut at = 0;
    for (layer, pair) in widths.windows(2).enumerate() {
        let (inputs, outputs) = (pair[0], pair[1]);
        let bias = at + inputs * outputs;
        let sum = |o: usize| {
            (0..inputs)
                .map(|i| x[i] * parameters[at + i * outputs + o])
                .sum::<f64>()
        };
        let last = layer + 2 == widths.len();
        let y = (0..outputs).map(|o| parameters[bias + o] + sum(o));
        x = y.map(|y| if last { y } else { activation(y) }).collect();
        at = bias + outputs;
    }
    x
}

fn random_batch(rows: usize, features: usize, actions: usize, rng: &mut Xoshiro) -> Batch {
    let mut values = |count: usize, size: f64| (0..count).map(|_| rng.uniform(-size, size) as f32).collect::<Vec<_>>();
    let (observations, next_observations, rewards) = (
        values(rows * features, 2.0),
        values(rows * features, 2.0),
        values(rows, 4.0),
    );
    Batch {
        observations,
        next_observations,
        rewards,
        actions: (0..rows).map(|_| rng.below(actions) as u32).collect(),
        alive: (0..rows).map(|n| f32::from(u8::from(n % 4 != 0))).collect(),
    }
}

#[test]
fn gradient_is_the_slope_of_the_loss() {
    let relu = |x: f64| x.max(0.0);
    let leaky = |x: f64| if x > 0.0 { x } else { f64::from(0.05_f32) * x };
    #[allow(clippy::type_complexity)] // a row per activation reads best as it stands
    let kinds: [(Activation, fn(f64) -> f64); 3] = [
        (Activation::Relu, relu),
        (Activation::Tanh, f64::tanh),
        (Activation::LeakyRelu { slope: 0.05 }, leaky),
    ];
    let (widths, rows) = ([4, 9, 6, 5], 24);
    for (activation, function) in kinds {
        for loss in [Loss::Huber, Loss::Squared] {
            let mut rng = Xoshiro::stream(11, 0);
            let mut network = Network::zeros(&widths, &[activation, activation, Activation::Identity]);
            network.initialise(&mut rng);
            let batch = random_batch(rows, 4, 5, &mut rng);
            let mut learner = Learner::new(network, LearnerSettings { loss, ..settings(rows) });
            learner.gradient(&batch);
            let gradient = learner.last_gradient().to_vec();

            let start: Vec<f64> = learner.online.parameters.iter().map(|&p| f64::from(p)).collect();
            let q = |parameters: &[f64], observations: &[f32], row: usize| {
                q_values(&widths, parameters, function, &observations[4 * row..4 * row + 4])
            };
            let value = |parameters: &[f64]| -> f64 {
                let one = |row: usize| {
                    // the target network is the network at the start and does not move with the parameters
                    let next = q(&start, &batch.next_observations, row)
                        .into_iter()
                        .fold(f64::MIN, f64::max);
                    let expected = f64::from(batch.rewards[row]) + 0.9 * f64::from(batch.alive[row]) * next;
                    let x = q(parameters, &batch.observations, row)[batch.actions[row] as usize] - expected;
                    match loss {
                        Loss::Huber if x.abs() > 1.0 => x.abs() - 0.5,
                        _ => 0.5 * x * x,
                    }
                };
                (0..rows).map(one).sum::<f64>() / rows as f64
            };
            for n in 0..start.len() {
                let (mut up, mut down, h) = (start.clone(), start.clone(), 1e-6);
                up[n] += h;
                down[n] -= h;
                let slope = (value(&up) - value(&down)) / (2.0 * h);
                let found = f64::from(gradient[n]);
                assert!(
                    (found - slope).abs() < 1e-5,
                    "{activation:?} {loss:?} {n}: found {found}, slope {slope}"
                );
            }
        }
    }
}

#[test]
fn double_dqn_values_the_action_that_the_online_network_chooses() {
    // one linear layer of one input: Q_a(s) = w_a s; the networks disagree on the best action
    let mut network = Network::zeros(&[1, 2], &[Activation::Identity]);
    network.parameters.copy_from_slice(&[1.0, 2.0, 0.0, 0.0]);
    let batch = Batch {
        observations: vec![1.0],
        next_observations: vec![1.0],
        actions: vec![0],
        rewards: vec![0.0],
        alive: vec![1.0],
    };
    let loss = |double| {
        let mut learner = Learner::new(
            network.clone(),
            LearnerSettings {
                double,
                loss: Loss::Squared,
                ..settings(1)
            },
        );
        learner.target_network.parameters.copy_from_slice(&[5.0, 3.0, 0.0, 0.0]);
        learner.gradient(&batch)
    };
    let squared = |x: f64| 0.5 * x * x;
    assert!(
        (loss(false) - squared(1.0 - 0.9 * 5.0)).abs() < 1e-5,
        "plain: the target network's own best, 5"
    );
    assert!(
        (loss(true) - squared(1.0 - 0.9 * 3.0)).abs() < 1e-5,
        "double: the target network's value of action 1"
    );
}

#[test]
fn nothing_is_expected_behind_a_terminated_episode() {
    let mut network = Network::zeros(&[1, 2], &[Activation::Identity]);
    network.parameters.copy_from_slice(&[0.0, 0.0, 10.0, 20.0]);
    let mut batch = Batch {
        observations: vec![1.0],
        next_observations: vec![1.0],
        actions: vec![1],
        rewards: vec![20.0],
        alive: vec![0.0],
    };
    let mut learner = Learner::new(network, settings(1));
    assert_eq!(learner.gradient(&batch), 0.0);
    batch.alive[0] = 1.0;
    assert!(learner.gradient(&batch) > 1.0);
}

#[test]
fn one_observation_alone_and_in_a_batch_agree_but_for_the_order_of_summation() {
    let mut rng = Xoshiro::stream(5, 0);
    let relu = Activation::Relu;
    let mut network = Network::zeros(&[6, 64, 64, 12], &[relu, relu, Activation::Identity]);
    network.initialise(&mut rng);
    let rows: Vec<f32> = (0..6 * 32).map(|_| rng.uniform(-3.0, 3.0) as f32).collect();
    let mut activations = network.activations(32);
    network.forward(&rows, &mut activations);
    let mut scratch = [Vec::new(), Vec::new()];
    for (row, q) in rows.chunks(6).zip(activations.outputs().chunks(12)) {
        network.q_values(row, &mut scratch);
        assert_close("q", &scratch[0], q, 1e-5);
        assert_eq!(greedy(&scratch[0]), greedy(q));
    }
}
