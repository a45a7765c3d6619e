//! The policy in closed loop with a converter: interpreter, macro, compiled C and compiled Rust drive the same
//! trajectory, to the bit.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::path::Path;

use closed_loop::scenario::Task;
use closed_loop::{Agent, Answer, Call, Controller, Converter, External, LoadKind, LoadStep, Trajectory, follow};
use codegen::Language;
use interp::Sample;
use plant::Parameters;
use policy::Policy;
use verify::Live;

policy_macro::include_policy!(Regulator = "policy/policy.toml");

const STEPS: [LoadStep; 3] = [
    LoadStep {
        kind: LoadKind::Power,
        values: [200.0, 1000.0],
        source: None,
        reference: None,
    },
    LoadStep {
        kind: LoadKind::Power,
        values: [1000.0, 200.0],
        source: None,
        reference: None,
    },
    LoadStep {
        kind: LoadKind::Resistance,
        values: [50.0, 12.0],
        source: None,
        reference: None,
    },
];

fn task() -> Task {
    Task {
        instants: 4,
        sampling_instants: 1,
        lead: 40,
        after: 120,
        tail: 20,
        ..Task::default()
    }
}

/// The converters: loss-free, and with what makes a bench's samples odd numbers.
fn plants() -> [Parameters; 2] {
    let mut bench = Parameters::paper_model();
    bench.pwm.duty_delay = 1;
    bench.inductor.dcr = 0.08;
    bench.capacitor.esr = 0.01;
    bench.switch.v_f = 0.8;
    bench.sensors.v_out.noise = 0.05;
    bench.sensors.i_l.noise = 0.02;
    [Parameters::paper_model(), bench]
}

/// All load steps at all instants on both converters.
fn trajectories(controller: &mut dyn Controller) -> Vec<Trajectory> {
    let mut all = Vec::new();
    for parameters in plants() {
        let environment = Converter::new(&parameters).unwrap();
        for step in STEPS {
            for instant in task().all_instants() {
                all.push(follow(&environment, controller, 100.0, &task(), step, instant).unwrap());
            }
        }
    }
    all
}

fn interpreted(policy: &Policy) -> Vec<Trajectory> {
    trajectories(&mut Agent::<f32>::new(policy).unwrap())
}

fn compiled(policy: &Policy, language: Language) -> Vec<Trajectory> {
    let mut live = Live::start(policy, language).unwrap();
    let ask = |call: Call<'_>| match call {
        Call::Restart => live.restart().map(|()| None),
        Call::Step(samples) => live.step(samples).map(|command| {
            Some(Answer {
                duty: command.duty,
                action: Some(command.action_index),
                status: command.status,
            })
        }),
    };
    trajectories(&mut External::new(policy, ask).unwrap())
}

/// The controller of `include_policy!`, inside this very program.
fn included(policy: &Policy) -> Vec<Trajectory> {
    let mut controller = buck12::Regulator::new();
    let ask = |call: Call<'_>| {
        let Call::Step(samples) = call else {
            controller = buck12::Regulator::new();
            return Ok(None);
        };
        let value = |index: usize| match samples[index] {
            Sample::Physical(x) => x,
            Sample::Wide(x) => x as f32,
            Sample::Code(code) => code as f32,
        };
        let command = controller.step(&buck12::Measurement {
            v_out: value(0),
            i_l: value(1),
            i_out: value(2),
        });
        Ok(Some(Answer {
            duty: f64::from(command.duty),
            action: Some(command.action_index),
            status: command.status,
        }))
    };
    trajectories(&mut External::new(policy, ask).unwrap())
}

/// How many trajectories differ.
fn different(a: &[Trajectory], b: &[Trajectory]) -> usize {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).filter(|(a, b)| a.first_difference(b).is_some()).count()
}

fn example() -> Policy {
    policy::load(&tests::example()).unwrap()
}

#[test]
fn interpreter_macro_c_and_rust_drive_one_trajectory() {
    let policy = example();
    let reference = interpreted(&policy);
    let periods: usize = reference.iter().map(|trajectory| trajectory.periods.len()).sum();
    assert_eq!(reference.len(), 24);
    assert!(periods > 24 * 160, "{periods}");
    assert_eq!(different(&reference, &included(&policy)), 0, "macro");
    assert_eq!(different(&reference, &compiled(&policy, Language::C)), 0, "C");
    assert_eq!(different(&reference, &compiled(&policy, Language::Rust)), 0, "Rust");
    // a comparison of loops that rest would say nothing
    let actions = reference.iter().flat_map(|trajectory| &trajectory.periods);
    let mut seen: Vec<u32> = actions.filter_map(|period| period.answer.action).collect();
    seen.sort_unstable();
    seen.dedup();
    assert!(seen.len() >= 8, "{seen:?}");
}

#[test]
fn filters_codes_of_converters_and_activations_are_the_same_in_closed_loop() {
    // networks drawn at random hold no voltage, but drive the loop through limits, fallback and slew
    for case in ["adc_mapping", "filters", "activations", "tail_blocks"] {
        let folder = tests::root().join("tests/golden/cases").join(case);
        let policy = policy::load(&folder.join("policy.toml")).unwrap();
        let reference = interpreted(&policy);
        assert_eq!(different(&reference, &compiled(&policy, Language::C)), 0, "{case}, C");
        assert_eq!(
            different(&reference, &compiled(&policy, Language::Rust)),
            0,
            "{case}, Rust"
        );
    }
}

/// The example with the first value of a tensor put through `change`.
fn changed(folder: &Path, tensor: &str, change: impl Fn(f32) -> f32) -> Policy {
    let example = tests::example();
    tests::tools::copy_folder(example.parent().unwrap(), folder);
    let file = folder.join("weights.safetensors");
    let mut bytes = std::fs::read(&file).unwrap();
    let at = tests::fixture::first_byte(&bytes, tensor).unwrap();
    let value = f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
    bytes[at..at + 4].copy_from_slice(&change(value).to_le_bytes());
    std::fs::write(&file, bytes).unwrap();
    let contract = folder.join("policy.toml");
    let text = std::fs::read_to_string(&contract).unwrap();
    let without = text.lines().filter(|line| !line.starts_with("golden = "));
    std::fs::write(&contract, without.collect::<Vec<_>>().join("\n")).unwrap();
    policy::load(&contract).unwrap()
}

#[test]
fn one_changed_weight_is_another_trajectory() {
    let folder = tempfile::tempdir().unwrap();
    let reference = interpreted(&example());
    // one bias of the first layer, by 1 %
    let other = changed(folder.path(), "q_net.0.bias", |x| 1.01 * x);
    let found = different(&reference, &compiled(&other, Language::C));
    assert!(found > 0, "{found}");
    let found = different(&reference, &compiled(&other, Language::Rust));
    assert!(found > 0, "{found}");
}
