//! Flipped bits of the state: no step commands what is no number, and a damaged state is seen in the same step.
//!
//! ```text
//!  base states of a run ─► each bit of each word flipped ─► six steps ─► interpreter ─► what the contract promises
//!                                                                     └► C, Rust     ─► the same words
//! ```

mod campaign;

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

use codegen::program::StateValue;
use codegen::{Language, Output};
use interp::{Controller, Sample, State, status};
use policy::{NumericFormat, Policy};
use random::{Random, SplitMix};

/// Steps behind a flip.
const STEPS: usize = 6;
/// Steps before the base states: unprimed, primed, held, after a fallback, primed again.
const BASES: [usize; 5] = [0, 3, 5, 9, 14];

fn example() -> Policy {
    policy::load(&tests::example()).unwrap()
}

/// Every kind of filter and limit, the four-term mapping and codes of a converter.
fn constructs() -> Policy {
    policy::load(&tests::root().join("tests/golden/cases/constructs/policy.toml")).unwrap()
}

/// A flip: the state before, and the measurements behind it.
struct Flip {
    word: usize,
    state: Vec<u32>,
    samples: Vec<Vec<Sample>>,
}

/// The state made of words in the order of the contract.
fn state_of(shape: &State<f32>, words: &[u32]) -> State<f32> {
    let mut state = shape.clone();
    let mut words = words.iter().copied();
    for (number, word) in state.numbers_mut().zip(words.by_ref()) {
        *number = f32::from_bits(word);
    }
    state.mapping_check = state.mapping_check.map(|_| words.next().unwrap().into());
    state.bad_count = words.next().unwrap();
    state.primed = words.next().unwrap();
    state
}

/// A measurement within the ranges, or one that is not, as often as `bad` says.
fn sample(policy: &Policy, rng: &mut SplitMix, bad: f64) -> Vec<Sample> {
    let one = |signal: &policy::Signal| {
        let is_bad = rng.uniform(0.0, 1.0) < bad;
        match (signal.adc, is_bad) {
            (Some(adc), false) => {
                let x = rng.uniform(signal.range.low, signal.range.high);
                Sample::Code(((x - adc.offset) / adc.gain) as i32)
            }
            (Some(_), true) => Sample::Code(i32::MAX),
            (None, false) => Sample::Physical(rng.uniform(signal.range.low, signal.range.high) as f32),
            (None, true) => Sample::Physical(f32::NAN),
        }
    };
    policy.signals.iter().map(one).collect()
}

/// Every bit of every word of the state, from each base.
fn flips(policy: &Policy) -> Vec<Flip> {
    let mut rng = SplitMix::new(17);
    let mut controller = Controller::<f32>::new(policy);
    let mut flips = Vec::new();
    for step in 0..=BASES[BASES.len() - 1] {
        if BASES.contains(&step) {
            let state = controller.state_words();
            for bit in 0..32 * state.len() {
                let mut flipped = state.clone();
                flipped[bit / 32] ^= 1 << (bit % 32);
                let samples = (0..STEPS).map(|_| sample(policy, &mut rng, 0.05)).collect();
                flips.push(Flip {
                    word: bit / 32,
                    state: flipped,
                    samples,
                });
            }
        }
        // a good start, a bridged sample, a fallback, and good again
        let bad = match step {
            4 | 6..=9 => 1.0,
            _ => 0.0,
        };
        controller.step(&sample(policy, &mut rng, bad)).unwrap();
    }
    flips
}

fn word(sample: Sample) -> u32 {
    match sample {
        Sample::Physical(x) => x.to_bits(),
        Sample::Wide(x) => (x as f32).to_bits(),
        Sample::Code(code) => code.cast_unsigned(),
    }
}

/// What the interpreter answers to a flip: per step duty, duty before the mapping, index, status, then the state.
fn answered(policy: &Policy, flip: &Flip) -> Vec<Vec<u32>> {
    let mut controller = Controller::<f32>::new(policy);
    assert!(controller.restore(&state_of(controller.state(), &flip.state)));
    assert_eq!(
        controller.state_words(),
        flip.state,
        "the words are in the contract's order"
    );
    let step = |samples: &Vec<Sample>| {
        let before = controller.state_words();
        let pure = controller.eval(samples).unwrap().command;
        assert_eq!(controller.state_words(), before, "eval changes nothing");
        let command = controller.step(samples).unwrap().command;
        assert_eq!(pure.duty.to_bits(), command.duty.to_bits());
        let mut words = vec![
            command.duty.to_bits(),
            command.duty_sim.to_bits(),
            command.action_index,
            command.status,
        ];
        words.extend(controller.state_words());
        words
    };
    flip.samples.iter().map(step).collect()
}

/// What the contract promises after whatever flip.
fn assert_promises(policy: &Policy, flip: &Flip, answers: &[Vec<u32>]) {
    let damaged = |answer: &Vec<u32>| answer[3] & status::STATE != 0;
    let is_seen = answers.first().is_some_and(damaged);
    for answer in answers {
        let duty = f64::from(f32::from_bits(answer[0]));
        let is_fallback = answer[0] == (policy.fallback.duty as f32).to_bits();
        let is_limited = duty >= policy.limits.duty.low && duty <= policy.limits.duty.high;
        assert!(
            is_limited || is_fallback,
            "word {}: duty {duty}, {answer:x?}",
            flip.word
        );
        assert_eq!(
            damaged(answer),
            is_seen,
            "word {}: seen at once and for ever, or not at all",
            flip.word
        );
        if is_seen {
            assert_eq!(answer[2..4], [0, status::STATE | status::FALLBACK]);
            assert!(is_fallback, "word {}", flip.word);
        }
    }
}

/// Which state words belong to the mapping: its coefficients and their check word.
fn of_mapping(policy: &Policy) -> Vec<usize> {
    let names = Controller::<f32>::new(policy);
    let names = names.state_names().iter().enumerate();
    names
        .filter(|(_, name)| name.starts_with("mapping."))
        .map(|(word, _)| word)
        .collect()
}

#[test]
fn no_flipped_bit_of_the_state_makes_a_duty_that_is_no_number_or_outside() {
    for policy in [example(), constructs()] {
        let of_mapping = of_mapping(&policy);
        let (mut seen, mut of_these) = (0, 0);
        for flip in flips(&policy) {
            let answers = answered(&policy, &flip);
            assert_promises(&policy, &flip, &answers);
            let is_seen = answers[0][3] & status::STATE != 0;
            seen += usize::from(is_seen);
            if of_mapping.contains(&flip.word) {
                of_these += 1;
                let bits = flip.state[flip.word];
                assert!(is_seen, "{bits:x} in word {} of the mapping is not seen", flip.word);
            }
        }
        // the flips reach what the test is about
        assert!(
            of_these == 32 * BASES.len() * of_mapping.len() && seen > of_these,
            "{}: {of_these} of the mapping, {seen} seen",
            policy.name
        );
    }
}

#[test]
fn a_damaged_state_is_left_by_init_and_by_reset_unless_the_mapping_is_damaged() {
    let policy = example();
    let of_mapping = of_mapping(&policy);
    let good = sample(&policy, &mut SplitMix::new(3), 0.0);
    for flip in flips(&policy).iter().step_by(7) {
        let mut controller = Controller::<f32>::new(&policy);
        controller.restore(&state_of(controller.state(), &flip.state));
        let status = controller.step(&flip.samples[0]).unwrap().command.status;
        if status & status::STATE == 0 {
            continue;
        }
        controller.reset();
        let status = controller.step(&good).unwrap().command.status;
        let is_kept = of_mapping.contains(&flip.word);
        assert_eq!(status & status::STATE != 0, is_kept, "word {}", flip.word);
        let mut fresh = Controller::<f32>::new(&policy);
        assert_eq!(fresh.step(&good).unwrap().command.status & status::STATE, 0);
    }
}

/// A program that reads states and measurements and writes answers, in words.
fn program_in_c(policy: &Policy) -> String {
    let (n, signals) = (&policy.name, policy.signals.len());
    format!(
        r#"#include <stdio.h>
#include <string.h>
#include "{n}.h"
int main(void)
{{
    {n}_state state;
    {n}_measurement measured;
    {n}_command command;
    uint32_t words[{signals}], answer[4], step;
    while (fread(&state, 4u, {u}_STATE_WORDS, stdin) == {u}_STATE_WORDS) {{
        for (step = 0u; step < {STEPS}u; ++step) {{
            if (fread(words, 4u, {signals}u, stdin) != {signals}u) {{ return 1; }}
            memcpy(&measured, words, sizeof(measured));
            {n}_step(&state, &measured, &command);
            memcpy(answer, &command.duty, 4u);
            memcpy(answer + 1, &command.duty_sim, 4u);
            answer[2] = command.action_index;
            answer[3] = command.status;
            (void)fwrite(answer, 4u, 4u, stdout);
            (void)fwrite(&state, 4u, {u}_STATE_WORDS, stdout);
        }}
    }}
    return 0;
}}
"#,
        u = n.to_uppercase()
    )
}

/// The same in Rust; it stands in the module of the controller, whose state is private.
fn program_in_rust(policy: &Policy) -> String {
    let program = codegen::lower(policy, targets::host(), Language::Rust);
    let (n, mut next, mut set) = (&policy.name, 0, String::new());
    let mut number = |count: usize| {
        next += count;
        (next - count..next)
            .map(|word| format!("f32::from_bits(w[{word}])"))
            .collect::<Vec<_>>()
    };
    for member in &program.state {
        let name = &member.name;
        match &member.value {
            StateValue::Numbers(values) => {
                let _ = writeln!(set, "c.{name} = [{}];", number(values.len()).join(", "));
            }
            StateValue::Number(_) | StateValue::Coefficient(_) => {
                let _ = writeln!(set, "c.{name} = {};", number(1).join(""));
            }
            StateValue::Check(_) | StateValue::Word => {
                let _ = writeln!(set, "c.{name} = {}.to_bits();", number(1).join(""));
            }
        }
    }
    let fields = policy.signals.iter().enumerate().map(|(at, signal)| match signal.adc {
        Some(_) => format!("{}: w[{at}] as i32", signal.name),
        None => format!("{}: f32::from_bits(w[{at}])", signal.name),
    });
    let fields = fields.collect::<Vec<_>>().join(", ");
    let (words, signals) = (program.state_words(), policy.signals.len());
    format!(
        r#"#![allow(dead_code)]
include!("{n}.rs");
fn read<const N: usize>() -> Option<[u32; N]> {{
    use std::io::Read;
    let mut words = [0; N];
    for word in &mut words {{
        let mut bytes = [0; 4];
        std::io::stdin().lock().read_exact(&mut bytes).ok()?;
        *word = u32::from_le_bytes(bytes);
    }}
    Some(words)
}}
fn main() {{
    use std::io::Write;
    let mut out = std::io::BufWriter::new(std::io::stdout());
    while let Some(w) = read::<{words}>() {{
        let mut c = Controller::new();
        {set}
        for _ in 0..{STEPS} {{
            let w = read::<{signals}>().unwrap();
            let command = c.step(&Measurement {{ {fields} }});
            let head = [command.duty.to_bits(), command.duty_sim.to_bits(), command.action_index, command.status];
            for word in head.into_iter().chain(c.state_words()) {{
                out.write_all(&word.to_le_bytes()).unwrap();
            }}
        }}
    }}
}}
"#
    )
}

/// The answers of a program to all flips.
fn answers_of(policy: &Policy, core: Output, compiler: &[&str], flips: &[Flip]) -> Vec<u32> {
    let folder = tempfile::tempdir().unwrap();
    let files = codegen::generate(policy, targets::host(), &[core], None).unwrap().files;
    for (name, text) in &files {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    let (main, text) = match core {
        Output::C => ("main.c", program_in_c(policy)),
        _ => ("main.rs", program_in_rust(policy)),
    };
    std::fs::write(folder.path().join(main), text).unwrap();
    let mut command = Command::new(compiler[0]);
    command.args(&compiler[1..]).arg(main).current_dir(folder.path());
    if core == Output::C {
        command.arg(format!("{}.c", policy.name));
    }
    let built = tests::tools::run(command.args(["-o", "flips"]));
    assert_eq!(built.code, Some(0), "{compiler:?}: {}", built.stderr);
    run(&folder.path().join("flips"), flips)
}

fn run(program: &Path, flips: &[Flip]) -> Vec<u32> {
    let mut child = Command::new(program)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut words = Vec::new();
    for flip in flips {
        words.extend(&flip.state);
        words.extend(flip.samples.iter().flatten().map(|sample| word(*sample)));
    }
    let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    let mut input = child.stdin.take().unwrap();
    // apart: the program answers while it reads
    let writer = std::thread::spawn(move || input.write_all(&bytes).unwrap());
    let output = child.wait_with_output().unwrap();
    writer.join().unwrap();
    assert!(output.status.success());
    let words = output.stdout.chunks_exact(4);
    words.map(|word| u32::from_le_bytes(word.try_into().unwrap())).collect()
}

#[test]
fn interpreter_c_and_rust_agree_to_the_bit_after_each_flip() {
    const COMPILERS: [(Output, &[&str]); 4] = [
        (Output::C, &["gcc", "-std=c99", "-O2", "-ffp-contract=off"]),
        (Output::C, &["clang", "-std=c99", "-O1", "-ffp-contract=off"]),
        (Output::Rust, &["rustc", "--edition=2021", "-O"]),
        (Output::Rust, &["rustc", "--edition=2021"]),
    ];
    let integers = [NumericFormat::I16, NumericFormat::I8].map(|format| constructs().with_format(format));
    let [i16, i8] = integers;
    let policies = [example(), constructs(), i16, i8];
    for policy in policies {
        let flips = flips(&policy);
        let answers: Vec<Vec<u32>> = flips.iter().flat_map(|flip| answered(&policy, flip)).collect();
        for (core, compiler) in COMPILERS {
            let words = answers_of(&policy, core, compiler, &flips);
            assert_eq!(words.len(), answers.iter().map(Vec::len).sum::<usize>(), "{compiler:?}");
            let length = answers[0].len();
            for (at, (found, expected)) in words.chunks_exact(length).zip(&answers).enumerate() {
                let flip = &flips[at / STEPS];
                assert_eq!(
                    found,
                    expected,
                    "{} {compiler:?}: step {} behind a flip in word {} of {:x?}",
                    policy.name,
                    at % STEPS,
                    flip.word,
                    flip.state
                );
            }
        }
    }
}
