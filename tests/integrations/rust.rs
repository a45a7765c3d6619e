//! The build script's way: the example crates, whose build scripts have generated a controller in Rust and one in C, answer
//! as the interpreter does.

use std::process::Command;

use codegen::Output;
use interp::{Controller, Sample};
use policy::{Policy, Scalar};
use tests::tools::{copy_folder, run_silently, rustc};
use verify::traces::{Event, Stream};

use super::{example, golden_case, legs, write};

const STEPS: u32 = 20_000;

/// The first step at which the generated controller of a module and the interpreter differ in duty, status or state.
macro_rules! first_difference {
    ($module:path, $policy:expr) => {{
        use $module as generated_code;
        let policy: &Policy = $policy;
        let mut stream = Stream::new(policy, 9, &[]);
        let mut expected = Controller::<f32>::new(policy);
        let mut generated = generated_code::Controller::new();
        assert!(generated_code::Controller::integrity() && generated_code::Controller::self_test() == Ok(()));
        let mut steps = 0;
        let mut different = None;
        while steps < STEPS && different.is_none() {
            match stream.next_event(&expected) {
                Event::Step(samples) => {
                    let answer = expected.step(&samples).unwrap();
                    let [v_out, i_l, i_out] = physical(&samples);
                    let measured = generated_code::Measurement { v_out, i_l, i_out };
                    let before = generated.eval(&measured);
                    let observation = generated.observe(&measured);
                    let q = generated_code::Controller::q_values(&observation);
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
                Event::SetMapping { a, b, c, r, .. } => {
                    let ([a, b, c], r) = ([a, b, c].map(|x| x as f32), r.map(|r| r as f32));
                    assert_eq!(generated.set_mapping(a, b, c), expected.set_mapping(a, b, c, r));
                }
                Event::Reset => {
                    generated.reset();
                    expected.reset();
                }
                Event::Init => {
                    generated = generated_code::Controller::default();
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

/// The declarations of the C core in Rust, against the Rust backend: every word of state, command, observation and Q values.
#[test]
fn the_c_core_answers_through_its_declarations_as_rust_does_in_both_widths() {
    for name in ["constructs", "wide"] {
        answer_alike(&golden_case(name), BOTH);
    }
}

/// Runs the program with both controllers; it ends with an error where they differ.
fn answer_alike(policy: &Policy, both: &str) {
    let name = &policy.name;
    let folder = tempfile::tempdir().unwrap();
    let outputs = [Output::Rust, Output::RustOverC];
    let generated = codegen::sources(policy, targets::host(), &outputs, None);
    let mut all = generated.unwrap().files;
    let text = both.replace("NAME", name).replace(
        "NUMBER",
        match policy.numeric_format.scalar() {
            Scalar::F32 => "f32",
            Scalar::F64 => "f64",
        },
    );
    all.insert("both.rs".to_owned(), text);
    write(&all, folder.path());
    let object = ["-O1", "-ffp-contract=off", "-c", "-o", "core.o", &format!("{name}.c")].map(str::to_owned);
    run_silently(Command::new("gcc").args(object).current_dir(folder.path()));
    let flags = ["--edition=2021", "-O", "-Clink-arg=core.o", "both.rs"];
    run_silently(rustc().args(flags).current_dir(folder.path()));
    run_silently(&mut Command::new(folder.path().join("both")));
}

/// The same with three duties, and a function for each mapping.
#[test]
fn the_c_core_of_several_outputs_answers_through_its_declarations_as_rust_does() {
    let step = "two.set_mapping_left(1.03, -0.0025, 0.006, 0.0009));
            let right = if step % 200 == 50 { 0.97 } else { 7.0 };
            assert_eq!(one.set_mapping_right(right, 0.001, 0.0), two.set_mapping_right(right, 0.001, 0.0));
            assert_eq!(two.set_mapping_right(right, 0.001, 0.0), step % 200 == 50);";
    let both = BOTH
        .replace("one.set_mapping(", "one.set_mapping_left(")
        .replace("two.set_mapping(1.03, -0.0025, 0.006, 0.0009));", step);
    assert!(both.contains(step));
    for case in ["constructs", "wide"] {
        answer_alike(&legs(case), &both);
    }
}

const BOTH: &str = r#"
#[allow(dead_code)]
#[path = "NAME.rs"]
mod rust;
#[allow(dead_code)]
#[path = "NAME_ffi.rs"]
mod core;

fn main() {
    let (mut one, mut two) = (rust::Controller::new(), core::Controller::new());
    assert!(core::Controller::integrity() && core::Controller::self_test() == Ok(()));
    let mut random = 1_u32;
    let mut draw = || {
        random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (random >> 8) as NUMBER / 3.0e5
    };
    for step in 0..2000 {
        let (v_out, i_l, i_out) = (draw() + 20.0, draw() as i32 * 40, draw() * 0.3);
        let (a, b) = (rust::Measurement { v_out, i_l, i_out }, core::Measurement { v_out, i_l, i_out });
        assert_eq!(one.observe(&a), two.observe(&b));
        assert_eq!(rust::Controller::q_values(&one.observe(&a)), core::Controller::q_values(&two.observe(&b)));
        let (x, y) = (one.step(&a), two.step(&b));
        assert_eq!((x.duty, x.duty_sim, x.action_index, x.status), (y.duty, y.duty_sim, y.action_index, y.status));
        assert_eq!(one.state_words(), two.state_words(), "{step}");
        if step % 100 == 50 {
            assert_eq!(one.set_mapping(1.03, -0.0025, 0.006, 0.0009), two.set_mapping(1.03, -0.0025, 0.006, 0.0009));
        }
    }
}
"#;
