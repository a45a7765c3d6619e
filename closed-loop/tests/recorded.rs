//! The example policy closes its loop on the circuit it was trained on as Stable-Baselines3 recorded it elsewhere.

#![allow(clippy::unwrap_used)] // helpers of tests stand outside of #[test] functions

use std::path::Path;

use closed_loop::scenario::{Instant, Task, load_step};
use closed_loop::{Agent, Converter};

/// A line of the fixture.
struct Recorded {
    load_step: [f64; 2],
    under: f64,
    over: f64,
    settling_ms: f64,
    tail_mean: f64,
    tail_max: f64,
    actions: Vec<u32>,
}

fn recorded() -> Vec<Recorded> {
    let lines = include_str!("fixtures/sb3_closed_loop.txt").lines();
    let read = |line: &str| {
        let words: Vec<&str> = line.split(' ').collect();
        let number = |n: usize| -> f64 { words[n].parse().unwrap() };
        Recorded {
            load_step: [number(0), number(1)],
            under: number(2),
            over: number(3),
            settling_ms: number(4),
            tail_mean: number(5),
            tail_max: number(6),
            actions: words[7].chars().map(|c| c.to_digit(12).unwrap()).collect(),
        }
    };
    lines.filter(|line| !line.starts_with('#')).map(read).collect()
}

/// Least number of periods, of 600, before a rounding turns a close choice round.
const SAME_ACTIONS: [usize; 6] = [526, 600, 600, 314, 338, 354];
/// From then on the two dither differently, by this much at most (V).
const DITHER: f64 = 5e-3;

#[test]
fn example_policy_repeats_the_closed_loop_stable_baselines_recorded() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let policy = policy::load(&root.join("examples/buck12/policy.toml")).unwrap();
    let environment = Converter::load(&root.join("examples/plants/sb3-buck12.toml"), &[]).unwrap();
    let task = Task::default();
    let at_sample = Instant { periods: 0, phase: 0.0 };
    for (recorded, same_actions) in recorded().into_iter().zip(SAME_ACTIONS) {
        let mut agent = Agent::<f32>::new(&policy).unwrap();
        let mut actions = Vec::new();
        let controller = |sample: &plant::Sample| {
            let duty = agent.step(&sample.measured).unwrap();
            actions.push(agent.command().action_index);
            duty
        };
        let (metrics, records) = load_step(
            environment.clone(),
            controller,
            100.0,
            &task,
            recorded.load_step,
            at_sample,
        )
        .unwrap();
        let same = actions
            .iter()
            .zip(&recorded.actions)
            .take_while(|(a, b)| a == b)
            .count();
        let after = &records[task.lead + 1..];
        let under = after.iter().map(|r| r.sample.v_min - 100.0).fold(0.0, f64::min);
        let over = after.iter().map(|r| r.sample.v_max - 100.0).fold(0.0, f64::max);
        assert!(same >= same_actions, "{:?}: {same} actions", recorded.load_step);
        let figures = [
            ("lowest error", under, recorded.under, DITHER),
            ("highest error", over, recorded.over, DITHER),
            // the record counts up to the first sample inside, in whole periods: in DCM, where the voltage falls by 70 mV
            // a period, the two simulations differ by up to 12 mV
            ("settling", 1e3 * metrics.settling + 0.1, recorded.settling_ms, 0.1001),
            ("mean of the tail", metrics.tail_mean, recorded.tail_mean, DITHER),
            ("largest error of the tail", metrics.tail_max, recorded.tail_max, DITHER),
        ];
        for (name, ours, theirs, resolution) in figures {
            let allowed = (0.02 * theirs.abs()).max(resolution);
            println!("{:?} {name}: {ours:.4}, recorded {theirs}", recorded.load_step);
            assert!(
                (ours - theirs).abs() <= allowed,
                "{:?} {name}: {ours} instead of {theirs}",
                recorded.load_step
            );
        }
    }
}
