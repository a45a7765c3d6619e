//! The build script's door: the example crates, whose build scripts have generated a controller in Rust and one in C, answer
//! as the interpreter does.

use interp::{Controller, Sample};
use policy::Policy;
use tests::tools::copy_folder;
use verify::traces::{Event, Stream};

use super::example;

const STEPS: u32 = 20_000;

/// The first step at which the generated controller of a module and the interpreter differ in duty, status or state.
macro_rules! first_difference {
    ($module:path, $policy:expr) => {{
        use $module as door;
        let policy: &Policy = $policy;
        let mut stream = Stream::new(policy, 9, &[]);
        let mut expected = Controller::<f32>::new(policy);
        let mut generated = door::Controller::new();
        assert!(door::Controller::integrity() && door::Controller::self_test() == Ok(()));
        let mut steps = 0;
        let mut different = None;
        while steps < STEPS && different.is_none() {
            match stream.next_event(&expected) {
                Event::Step(samples) => {
                    let answer = expected.step(&samples).unwrap();
                    let [v_out, i_l, i_out] = physical(&samples);
                    let measured = door::Measurement { v_out, i_l, i_out };
                    let before = generated.eval(&measured);
                    let observation = generated.observe(&measured);
                    let q = door::Controller::q_values(&observation);
                    let command = generated.step(&measured);
                    let bits = |q: &[f32]| q.iter().map(|q| q.to_bits()).collect::<Vec<_>>();
                    let equal = command.duty.to_bits() == answer.command.duty.to_bits()
                        && command.status == answer.command.status
                        && command.action_index == answer.command.action_index
                        && before == command
                        && bits(&q) == bits(answer.q_values.as_slice().unwrap())
                        && generated.state_words().as_slice() == expected.state_words();
                    steps += 1;
                    different = (!equal).then_some(steps);
                }
                Event::SetMapping { a, b, c, r } => {
                    let ([a, b, c], r) = ([a, b, c].map(|x| x as f32), r.map(|r| r as f32));
                    assert_eq!(generated.set_mapping(a, b, c), expected.set_mapping(a, b, c, r));
                }
                Event::Reset => {
                    generated.reset();
                    expected.reset();
                }
                Event::Init => {
                    generated = door::Controller::default();
                    expected = Controller::new(policy);
                }
                Event::Network(_) => {}
            }
        }
        different
    }};
}

fn physical(samples: &[Sample]) -> [f32; 3] {
    let values = samples.iter().map(|sample| match sample {
        Sample::Physical(value) => *value,
        Sample::Wide(value) => *value as f32,
        Sample::Code(code) => panic!("the example measures in volts and amperes, not in codes ({code})"),
    });
    values.collect::<Vec<_>>().try_into().unwrap()
}

#[test]
fn rust_from_a_build_script_answers_as_the_interpreter() {
    assert_eq!(first_difference!(example_build_rust::buck12, &example()), None);
}

#[test]
fn c_from_a_build_script_answers_as_the_interpreter() {
    assert_eq!(first_difference!(example_build_c::buck12, &example()), None);
}

/// The comparison itself: the interpreter of a policy with another bias is not followed.
#[test]
fn another_policy_is_told_apart_in_both_languages() {
    let folder = tempfile::tempdir().unwrap();
    copy_folder(&tests::root().join("examples/buck12"), folder.path());
    let path = folder.path().join("weights.safetensors");
    let mut bytes = std::fs::read(&path).unwrap();
    // the first network layer's bias; its name is the trainer's
    let start = tests::fixture::first_byte(&bytes, "q_net.0.bias").unwrap();
    bytes[start + 3] ^= 0x80;
    std::fs::write(&path, bytes).unwrap();
    let contract = folder.path().join("policy.toml");
    let text = std::fs::read_to_string(&contract).unwrap();
    let without_golden: Vec<&str> = text.lines().filter(|line| !line.starts_with("golden")).collect();
    std::fs::write(&contract, without_golden.join("\n")).unwrap();
    let other = policy::load(&contract).unwrap_or_else(|faults| panic!("{faults}"));
    assert!(first_difference!(example_build_rust::buck12, &other).is_some());
    assert!(first_difference!(example_build_c::buck12, &other).is_some());
}
