//! Several outputs (contract section 9b), against values by hand.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::disallowed_methods)]

use interp::decisions::{Decisions, decisions};
use interp::golden::{golden_result, refusal};
use interp::{Command, Controller, InputError, Sample, status};
use policy::{NumericFormat, Policy};
use safetensors::Dtype;
use safetensors::tensor::{TensorView, serialize};

const CONTRACT: &str = r#"
name = "two"
sample_period = 1e-4

[[signal]]
name = "x"
range = [-4.0, 4.0]

[[feature]]
name = "x"
source = "x"

[network]
weights = "weights.safetensors"

[[output]]
name = "left"
actions = { duties = [0.25, 0.5, 0.75] }
limits = { duty = [0.0, 0.625] }
fallback = { duty = 0.125 }

[[output]]
name = "right"
actions = { continuous = { clip = [-1.0, 1.0], scale = 0.5, offset = 0.5 } }
limits = { duty = [0.0, 1.0], slew = 0.25, initial_duty = 0.5 }
fallback = { duty = 0.0625 }

[fallback]
hold = 1
"#;

/// One layer: Q of the choice is x, -x and 0.5, the continuous output is x / 4. All of it is exact.
fn controller() -> Controller<f32> {
    load(CONTRACT)
}

fn load(contract: &str) -> Controller<f32> {
    Controller::new(&policy(contract, &[]))
}

/// Of a contract beside this file of golden answers.
fn policy(contract: &str, golden: &[u8]) -> Policy {
    let folder = tempfile::tempdir().unwrap();
    let weights: Vec<u8> = [1.0_f32, -1.0, 0.0, 0.25]
        .iter()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    let bias: Vec<u8> = [0.0_f32, 0.0, 0.5, 0.0].iter().flat_map(|x| x.to_le_bytes()).collect();
    let tensors = [
        ("out.weight", TensorView::new(Dtype::F32, vec![4, 1], &weights).unwrap()),
        ("out.bias", TensorView::new(Dtype::F32, vec![4], &bias).unwrap()),
    ];
    std::fs::write(
        folder.path().join("weights.safetensors"),
        serialize(tensors, None).unwrap(),
    )
    .unwrap();
    let path = folder.path().join("policy.toml");
    std::fs::write(&path, contract).unwrap();
    let options = policy::ReadOptions {
        several_outputs: true,
        ..policy::ReadOptions::default()
    };
    std::fs::write(folder.path().join("golden.safetensors"), golden).unwrap();
    policy::load_with(&path, &options).unwrap_or_else(|faults| panic!("{faults}"))
}

fn step(controller: &mut Controller<f32>, x: f32) -> Vec<Command<f32>> {
    controller.step(&[Sample::Physical(x)]).unwrap().commands().collect()
}

fn duties(commands: &[Command<f32>]) -> Vec<f32> {
    commands.iter().map(|command| command.duty).collect()
}

#[test]
fn each_output_decides_by_its_own_columns_and_limits() {
    let mut controller = controller();
    // Q = 1, -1, 0.5: the first action; 0.5 * 0.25 + 0.5
    let commands = step(&mut controller, 1.0);
    assert_eq!(duties(&commands), [0.25, 0.625]);
    assert_eq!(commands[0].status, status::PRIMED);
    // Q = 0.25, -0.25, 0.5: the third action, cut off by the limits of left; right moves to 0.53125
    let commands = step(&mut controller, 0.25);
    assert_eq!((commands[0].action_index, commands[0].duty_sim), (2, 0.75));
    assert_eq!(duties(&commands), [0.625, 0.53125]);
    // one word for both: what left's limits did
    assert!(commands.iter().all(|command| command.status == status::LIMITED));
    // Q = -4, 4, 0.5: the second action; right wants 0 and moves by its slew limit from 0.53125
    let commands = step(&mut controller, -4.0);
    assert_eq!(duties(&commands), [0.5, 0.28125]);
    assert!(commands.iter().all(|command| command.status == status::SLEW_LIMITED));
}

#[test]
fn a_bad_sample_sends_every_output_to_its_own_fallback() {
    let mut controller = controller();
    step(&mut controller, 1.0);
    // one bad sample is bridged with the 1 that is held, the next is not
    let held = step(&mut controller, f32::NAN);
    assert_eq!(duties(&held), [0.25, 0.625]);
    let commands = step(&mut controller, f32::NAN);
    assert_eq!(duties(&commands), [0.125, 0.0625]);
    assert!(
        commands
            .iter()
            .all(|command| command.status == status::FALLBACK && command.duty_sim == command.duty)
    );
    // the slew limit of right starts from what was commanded
    let commands = step(&mut controller, 1.0);
    assert_eq!(duties(&commands), [0.25, 0.3125]);
}

#[test]
fn a_flip_in_the_state_of_one_output_stops_all() {
    let mut controller = controller();
    step(&mut controller, 1.0);
    let mut state = controller.state().clone();
    state.others[0].previous_command = f32::NAN;
    assert!(controller.restore(&state));
    let commands = step(&mut controller, 1.0);
    assert_eq!(duties(&commands), [0.125, 0.0625]);
    assert!(
        commands
            .iter()
            .all(|command| command.status == status::FALLBACK | status::STATE)
    );
    assert!(commands.iter().all(|command| command.action_index == 0));
    controller.reset();
    assert_eq!(duties(&step(&mut controller, 1.0)), [0.25, 0.625]);
}

#[test]
fn a_commit_needs_a_command_for_each_output() {
    let mut controller = controller();
    let sample = [Sample::Physical(1.0)];
    let trace = controller.eval(&sample).unwrap();
    let few = controller.commit(&sample, &trace.command).unwrap_err();
    assert_eq!(few, InputError::CommandCount { expected: 2, found: 1 });
    let mut twin = controller.clone();
    let commands: Vec<_> = trace.commands().collect();
    twin.commit_all(&sample, &commands).unwrap();
    controller.step(&sample).unwrap();
    assert_eq!(twin.state(), controller.state());
    assert_eq!(
        controller.state_names(),
        [
            "held.x",
            "left.previous_duty",
            "left.previous_command",
            "right.previous_duty",
            "right.previous_command",
            "bad_count",
            "primed"
        ]
    );
}

/// h = g = 1, 8 V, no correction: a prediction from 2 V and 1 A is exact.
const OBSERVERS: &str = r#"
[[signal]]
name = "i_out"
range = [0.0, 8.0]

[[observer]]
name = "model_left"
duty = "left"
carrier = "centre"
inductance = 1e-4
capacitance = 1e-4
input_voltage = 8.0
output_voltage = "x"
load_current = "i_out"
compute_delay = 1
gains = { current = 0.0, voltage = 0.0, bias = 0.0 }
current = [0.0, 16.0]
bias = [-1.0, 1.0]
"#;

#[test]
fn an_observer_is_driven_by_the_command_of_its_own_output() {
    let right = OBSERVERS.split_once("[[observer]]").unwrap().1;
    let right = format!("[[observer]]{}", right.replace("left", "right"));
    let contract = CONTRACT
        .replace("[[feature]]", &format!("{OBSERVERS}\n{right}\n[[feature]]"))
        .replace("duty = [0.0, 0.625] }", "duty = [0.0, 0.625], initial_duty = 0.25 }");
    let mut controller = load(&contract);
    let samples = [Sample::Physical(2.0), Sample::Physical(1.0)];
    let trace = controller.step(&samples).unwrap();
    // left, d = 0.25: a = 1 + 8 / 8 - 1, v = 2 + a - 1, i = 1 + 8 / 4 - 2
    assert_eq!(trace.estimates[0], [1.0, 2.0, 0.0, 0.0]);
    // right, d = 0.5: a = 1 + 8 / 4 - 1, v = 2 + a - 1, i = 1 + 8 / 2 - (2 + 3) / 2
    assert_eq!(trace.estimates[1], [2.5, 3.0, 0.0, 0.0]);
    // Q = 2, -2, 0.5 and 0.5: left stays at 0.25, right moves by its slew limit to 0.75
    let commands: Vec<_> = trace.commands().collect();
    assert_eq!(duties(&commands), [0.25, 0.75]);
    let trace = controller.step(&samples).unwrap();
    assert_eq!(trace.estimates[0], [1.0, 2.0, 0.0, 0.0]);
    // from i = 2.5 and v = 3 with d = 0.75: a = 2.5 + 3 - 1.5, v = 3 + a - 1 ends at the 4 V of x, i = 2.5 + 6 - (3 + 4) / 2
    assert_eq!(trace.estimates[1], [5.0, 4.0, 0.0, 0.0]);
}

/// With golden answers at x = 1, 2 and -4: these last layers, actions of left and duties of right, as far as they are given.
fn answered(output: &[f32], actions: &[i32], duties: &[f32]) -> Policy {
    let floats = |values: &[f32]| -> Vec<u8> { values.iter().flat_map(|x| x.to_le_bytes()).collect() };
    let (obs, output, duties) = (floats(&[1.0, 2.0, -4.0]), floats(output), floats(duties));
    let actions: Vec<u8> = actions.iter().flat_map(|x| x.to_le_bytes()).collect();
    let tensors = [
        ("obs", Dtype::F32, vec![3, 1], &obs),
        ("output", Dtype::F32, vec![3, 4], &output),
        ("action_left", Dtype::I32, vec![3], &actions),
        ("duty_right", Dtype::F32, vec![3], &duties),
    ];
    let given = tensors.iter().filter(|(.., bytes)| !bytes.is_empty());
    let views =
        given.map(|(name, dtype, shape, bytes)| (*name, TensorView::new(*dtype, shape.clone(), bytes).unwrap()));
    let golden = serialize(views, None).unwrap();
    let contract = CONTRACT.replace("[network]", "[network]\ngolden = \"golden.safetensors\"");
    policy(&contract, &golden)
}

const LAYER: [f32; 12] = [1.0, -1.0, 0.5, 0.25, 2.0, -2.0, 0.5, 0.5, -4.0, 4.0, 0.5, -1.0];

#[test]
fn golden_answers_are_judged_output_by_output() {
    let own = answered(&LAYER, &[0, 0, 1], &[0.625, 0.75, 0.0]);
    let result = golden_result(&own).unwrap();
    assert!(result.passed() && refusal(&own).is_none(), "{result}");
    assert_eq!(
        (result.vectors, result.actions_equal, result.actions_compared),
        (3, 3, 3)
    );
    assert_eq!(
        (result.worst_relative_error, result.worst_duty_error),
        (Some(0.0), Some(0.0))
    );
    let said = result.to_string();
    for part in [
        "left: action equal in 3 of 3",
        "; right: largest error of the duty 0.0e0",
    ] {
        assert!(said.contains(part), "{said}");
    }
    // the column of right is another network's: its duty is off by 0.25 / 2 of 1, and left is what it was
    let mut layer = LAYER;
    layer[3] += 0.25;
    let own = answered(&layer, &[0, 0, 1], &[]);
    let result = golden_result(&own).unwrap();
    let passed: Vec<bool> = result.outputs.iter().map(|own| own.result.passed()).collect();
    assert_eq!((passed, result.worst_duty_error), (vec![true, false], Some(0.125)));
    assert!(result.to_string().contains("; right: DIFFERENT: "), "{result}");
    assert!(result.hint().starts_with("output `right`: "), "{}", result.hint());
    let refused = format!("{:?}", refusal(&own).unwrap());
    assert!(refused.contains("right: DIFFERENT"), "{refused}");
    // told, not judged: of each output
    assert!(result.told(true).passed());
}

#[test]
fn what_a_format_changes_is_counted_output_by_output() {
    let kept = decisions(&answered(&LAYER, &[], &[]), None).unwrap();
    let names: Vec<_> = kept.each().iter().map(|(name, _)| name.unwrap().to_owned()).collect();
    assert_eq!(
        (names, kept.kept(), kept.numeric_format()),
        (vec!["left".to_owned(), "right".to_owned()], true, "f32")
    );
    // in the trainer's second row another Q is the largest, and his duty in the first is 0.01 of 1 away
    let mut otherwise = LAYER;
    otherwise[4] = 0.25;
    let duties = [0.635, 0.75, 0.0];
    let changed = decisions(&answered(&otherwise, &[], &duties), None).unwrap();
    let beyond: Vec<_> = changed.beyond().collect();
    let [
        (Some("left"), Decisions::Choice(left)),
        (Some("right"), Decisions::Continuous(right)),
    ] = beyond.as_slice()
    else {
        panic!("{beyond:?}")
    };
    assert_eq!((left.changed, left.observations, left.worst[0].row), (1, 3, 1));
    assert!((right.largest - 0.01).abs() < 1e-6 && right.worst.as_ref().unwrap().row == 0);
    assert_eq!(changed.remedy(), "golden_decisions = 0.34 and golden_duty = 1.0e-2");
    assert_eq!(changed.accepting_share(), Some(0.34));
    // an entry for what is beyond, and for nothing else
    let duty = decisions(&answered(&LAYER, &[], &duties), None).unwrap();
    assert!(
        duty.accepting_share().is_none() && duty.remedy().starts_with("golden_duty"),
        "{}",
        duty.remedy()
    );
    for (allowed, kept) in [(0.33, false), (0.34, true)] {
        let own = decisions(&answered(&otherwise, &[], &[]), Some(allowed)).unwrap();
        assert_eq!(own.kept(), kept, "{allowed}");
    }
    for format in NumericFormat::ALL {
        let own = decisions(&answered(&LAYER, &[], &[]).with_format(format), None).unwrap();
        assert_eq!((own.numeric_format(), own.each().len()), (format.name(), 2));
        assert!(own.kept(), "{own:?}");
    }
}
