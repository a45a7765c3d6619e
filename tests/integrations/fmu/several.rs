//! Several outputs: a variable for each duty and action, coefficients for each mapping.

use codegen::Output;
use interp::{Controller, Real, Sample};
use policy::{Policy, Scalar};
use random::{Random, SplitMix};
use tests::tools::is_without;
use verify::traces::sample_of;

use super::super::legs;
use super::unit::{Descriptions, Unit, VERSIONS};
use super::{FMPY, FMPY_FROM_SOURCES, simulated};

/// Samples that mostly lie within their ranges, and what the interpreter answers: bits of each duty, actions, status.
fn interpreted(policy: &Policy, steps: usize) -> (Vec<Vec<Sample>>, Vec<String>) {
    match policy.numeric_format.scalar() {
        Scalar::F32 => interpreted_in::<f32>(policy, steps),
        Scalar::F64 => interpreted_in::<f64>(policy, steps),
    }
}

fn interpreted_in<T: Real>(policy: &Policy, steps: usize) -> (Vec<Vec<Sample>>, Vec<String>) {
    let mut controller = Controller::<T>::new(policy);
    let mut random = SplitMix::new(11);
    let answer = |_| {
        let samples: Vec<Sample> = policy
            .signals
            .iter()
            .map(|signal| {
                let beyond = if random.one_in(30) { 0.2 } else { 0.0 };
                let share = random.uniform(-beyond, 1.0 + beyond);
                let x = signal.range.low + share * (signal.range.high - signal.range.low);
                sample_of(policy.numeric_format.scalar(), signal, x)
            })
            .collect();
        let commands: Vec<_> = controller.step(&samples).unwrap().commands().collect();
        let duties = commands
            .iter()
            .map(|command| format!("{:016x}", command.duty.to_f64().to_bits()));
        let actions = commands.iter().map(|command| command.action_index.to_string());
        let status = commands[0].status.to_string();
        let words: Vec<String> = duties.chain(actions).chain([status]).collect();
        (samples, words.join(" "))
    };
    (0..steps).map(answer).unzip()
}

#[test]
fn fmpy_simulates_every_duty_of_several() {
    if is_without("FMPy") {
        return;
    }
    for case in ["constructs", "wide"] {
        let policy = legs(case);
        let (samples, expected) = interpreted(&policy, 500);
        simulated(&policy, &samples, &expected, &VERSIONS, FMPY);
    }
    let policy = legs("constructs");
    let (samples, expected) = interpreted(&policy, 100);
    simulated(&policy, &samples, &expected, &VERSIONS, FMPY_FROM_SOURCES);
}

#[test]
fn the_importing_program_sees_every_duty_of_several() {
    if is_without("FMPy") {
        return;
    }
    for (policy, output) in [(legs("constructs"), Output::Fmu2), (legs("wide"), Output::Fmu3)] {
        let unit = Unit::new(&policy, output);
        unit.build_importer();
        let ran = unit.check();
        assert_eq!(ran.stdout, "PASS\n", "{} {output:?}\n{}", policy.name, ran.stderr);
        let (samples, expected) = interpreted(&policy, 1000);
        let mut running = unit.run();
        for (step, (samples, expected)) in samples.iter().zip(expected).enumerate() {
            assert_eq!(running.line(samples), Ok(expected), "{} {output:?} {step}", policy.name);
        }
    }
}

#[test]
fn the_description_names_the_outputs_and_a_signal_keeps_such_a_name() {
    if is_without("FMPy") {
        return;
    }
    let mut descriptions = Descriptions::default();
    for output in VERSIONS {
        let text = descriptions.add(&legs("constructs"), output, "", "");
        for name in [
            "duty_left",
            "duty_right",
            "duty_mid",
            "action_left",
            "action_mid",
            "status",
            "a_left",
            "r_left",
            "c_right",
        ] {
            assert_eq!(text.matches(&format!(" name=\"{name}\"")).count(), 1, "{name}\n{text}");
        }
        // three terms, and no mapping
        assert!(!text.contains("\"r_right\"") && !text.contains("\"a_mid\""), "{text}");
        let mut policy = legs("constructs");
        policy.signals[0].name = "duty_right".to_owned();
        let text = descriptions.add(&policy, output, "", "");
        assert!(text.contains(" name=\"duty_right_\""), "{text}");
    }
    assert_eq!(descriptions.problems(), [""; 4]);
}

#[test]
fn planted_faults_in_a_duty_or_mapping_of_several_are_seen() {
    if is_without("FMPy") {
        return;
    }
    let policy = legs("constructs");
    let good = Unit::new(&policy, Output::Fmu2);
    good.build_importer();
    let (samples, expected) = interpreted(&policy, 1000);
    let faults = [
        (
            "_fmu.c",
            "outputs[1] = answer.duty_right",
            "outputs[1] = answer.duty_left",
        ),
        (
            "_block.c",
            "outputs[2] = answer.duty_mid",
            "outputs[2] = answer.duty_right",
        ),
        (
            "_block.c",
            "outputs[4] = answer.action_right",
            "outputs[4] = answer.action_left",
        ),
        (
            "_fmu.c",
            "fmu->state.coefficients[4] = ",
            "fmu->state.coefficients[4] = 0.99 * ",
        ),
        ("_fmu.c", "#define OUTPUTS 7u", "#define OUTPUTS 6u"),
        ("_block.c", "_FALLBACK_MID;", "_FALLBACK_LEFT;"),
    ];
    for (ending, from, to) in faults {
        let unit = Unit::edited(&policy, Output::Fmu2, ending, from, to);
        unit.take_importer(&good);
        let mut running = unit.run();
        let differs = samples
            .iter()
            .zip(&expected)
            .any(|(samples, expected)| running.line(samples).as_ref() != Ok(expected));
        drop(running);
        assert!(differs || unit.check().code == Some(1), "not seen: {from} -> {to}");
    }
}
