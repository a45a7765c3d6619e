//! Contracts and trainings for converters whose output answers the wrong way at first.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use closed_loop::baselines::{Baseline, Kind};
use closed_loop::environment::Varied;
use closed_loop::limit::Question;
use closed_loop::scenario::{Finding, Task, survey_all};
use closed_loop::{Agent, Converter};
use plant::{Parameters, Sample};
use train::start::{Start, Wanted};
use train::{Contract, Ended, Settings, Trainer};

struct Desk {
    plant: Parameters,
    v_ref: f64,
    contract: Contract,
    settings: Settings,
    converter: Converter,
}

const LOADS: [f64; 2] = [20.0, 120.0];

/// How the inductor current is measured: 12 bits for 16 A, with a step of noise.
const SENSOR: &str = "\n[sensors.i_l]\nlsb = 0.0039\nnoise = 0.0039\n";

/// What `new --plant` writes for an example with a sensor or without one, read back.
fn desk(name: &str, v_ref: f64, sensor: &str) -> Desk {
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../examples/plants/{name}.toml"));
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}-{}", sensor.len()));
    std::fs::create_dir_all(&folder).unwrap();
    let file = folder.join("plant.toml");
    std::fs::write(&file, std::fs::read_to_string(&example).unwrap() + sensor).unwrap();
    let plant = Parameters::from_file(file.as_path()).unwrap();
    let start = Start::new(&plant, &file, Wanted { v_ref, loads: LOADS }).unwrap();
    let path = folder.join("policy.toml");
    std::fs::write(&path, start.contract()).unwrap();
    let text = start.training("policy.toml", &file.display().to_string());
    let settings = Settings::parse(&text, &folder.join("train.toml")).unwrap_or_else(|faults| panic!("{faults}"));
    let contract = Contract::load(&path, &settings.hidden).unwrap_or_else(|faults| panic!("{faults}"));
    let converter = Converter::load(&file, &settings.set).unwrap();
    Desk {
        plant,
        v_ref,
        contract,
        settings,
        converter,
    }
}

fn task() -> Task {
    let [low, high] = LOADS;
    Task {
        // the loop of the buck-boost has a time constant of 70 periods
        after: 600,
        load_steps: vec![[low, high], [high, low]],
        ..Task::default()
    }
}

/// The law alone, on converters whose L and C are off by this factor.
fn law(desk: &Desk, factor: f64) -> Vec<Finding> {
    let keys = ["converter.inductance", "converter.capacitance"];
    let nominal = |key: &str| plant::parameter(key).unwrap().get(&desk.plant);
    let numbers = keys.map(|key| (key.to_owned(), factor * nominal(key)));
    let converter = Varied::new(&desk.converter, numbers.to_vec());
    let mut agent = Agent::<f32>::new(&desk.contract.policy.law_alone().unwrap()).unwrap();
    let controller = move |sample: &Sample| agent.step(&sample.measured).unwrap();
    survey_all(&converter, &controller, desk.v_ref, &task(), &task().all_instants()).unwrap()
}

/// Current control that measures the inductor current and knows the parts as they are.
fn feed_forward(desk: &Desk, other: &Parameters, factor: f64) -> Vec<Finding> {
    let keys = ["converter.inductance", "converter.capacitance"];
    let nominal = |key: &str| plant::parameter(key).unwrap().get(&desk.plant);
    let numbers = keys.map(|key| (key.to_owned(), factor * nominal(key)));
    let converter = Varied::new(&desk.converter, numbers.to_vec());
    let mut own = Baseline::new(Kind::FeedForward, other, desk.v_ref, LOADS[1] / desk.v_ref).unwrap();
    let controller = move |sample: &Sample| own.step(sample);
    survey_all(&converter, &controller, desk.v_ref, &task(), &task().all_instants()).unwrap()
}

/// The sensors have 12 bits and noise here, and the duty waits for a period.
#[test]
fn the_law_that_new_writes_holds_to_a_tenth_of_the_limit_and_to_a_thousandth_at_rest_with_smaller_parts() {
    for (name, v_ref, sensor) in [
        ("boost-24-48", 48.0, ""),
        ("boost-24-48", 48.0, SENSOR),
        ("buck-boost-12-24", 24.0, ""),
        ("buck-boost-12-24", 24.0, SENSOR),
    ] {
        let desk = desk(name, v_ref, sensor);
        for factor in [1.0, 0.85] {
            let mut other = desk.plant.clone();
            other.converter.inductance *= factor;
            other.converter.capacitance *= factor;
            let findings = law(&desk, factor).into_iter().zip(feed_forward(&desk, &other, factor));
            for (step, (finding, measured)) in task().load_steps.iter().zip(findings) {
                // of the duties that the contract allows
                let question = Question::new(&other, v_ref, (*step).into(), [0.0, 0.95]).unwrap();
                let limit = question.of_all_instants().worst.deviation;
                let found = finding.worst;
                // the noise of the sensor stands in both
                let mut reach = 1.1 * limit + 0.001 * v_ref;
                if sensor.is_empty() && factor < 1.0 {
                    // an estimate rests on parts that are not these: it has to do as well as a measurement
                    reach = reach.max(measured.worst.deviation);
                }
                assert!(
                    found.deviation < reach,
                    "{name} {sensor} {factor} {step:?}: {found:?}, limit {limit}, measured {measured:?}"
                );
                assert!(found.tail_max < 1e-3 * v_ref, "{name} {factor} {step:?}: {found:?}");
            }
        }
    }
}

#[test]
fn a_boost_that_was_trained_for_a_short_time_regulates_better_than_its_duty_at_rest() {
    let mut desk = desk("boost-24-48", 48.0, "");
    desk.settings.steps = 1500;
    let never = AtomicBool::new(false);
    let mut trainer = Trainer::new(&desk.settings, &desk.contract, &desk.converter, 0).unwrap();
    let ended = trainer.run(&never, |_| ()).unwrap();
    let outcome = trainer.finish(ended).unwrap();
    // on loads of constant power the duty at rest alone loses the voltage
    let open = survey_all(
        &desk.converter,
        &|_: &Sample| 0.5,
        48.0,
        &task(),
        &task().all_instants(),
    )
    .unwrap();
    for (trained, open) in outcome.findings.iter().zip(&open) {
        assert!(
            trained.worst.deviation < 0.5 * open.worst.deviation,
            "{trained:?} {open:?}"
        );
        assert!(trained.worst.tail_max < 0.5, "{trained:?}");
    }
}

/// A buck-boost whose law hardly any network betters: two looks at hardly trained ones.
#[test]
fn a_training_that_finds_nothing_better_than_the_law_keeps_the_law() {
    let mut desk = desk("buck-boost-12-24", 24.0, "");
    (desk.settings.steps, desk.settings.selection.every) = (60, 30);
    let never = AtomicBool::new(false);
    let mut trainer = Trainer::new(&desk.settings, &desk.contract, &desk.converter, 0).unwrap();
    let law = trainer.best().expect("the law is there from the start").score;
    assert_eq!(trainer.run(&never, |_| ()).unwrap(), Ended::Budget);
    assert!(trainer.curve().iter().all(|look| look.cost >= law.cost));
    let outcome = trainer.finish(Ended::Budget).unwrap();
    assert_eq!((outcome.best_step, outcome.selected), (0, law));
    for (policy, law) in outcome.judged.iter().zip(&outcome.law) {
        assert_eq!(policy.findings, law.findings, "to the bit");
    }
    let report = String::from_utf8(outcome.files["report.txt"].clone()).unwrap();
    assert!(
        report.contains("kept        the law alone") && report.contains("The policy does here what the law alone does"),
        "{report}"
    );
}
