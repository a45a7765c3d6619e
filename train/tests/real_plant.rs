//! Trainings on the real plant with delay, noise, quantisation and varied parameters: the same seed gives the same bytes,
//! interrupted or not, and the variation is real.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::{Arc, Mutex};

use closed_loop::{Converter, Environment, LoadPath, Start};
use common::tiny;
use plant::Sample;
use std::sync::atomic::AtomicBool;
use train::{Contract, Ended, Settings, Trainer};

static NEVER: AtomicBool = AtomicBool::new(false);

const SOFT: &str = "algorithm = \"dqn\"\ntarget_update = { soft = 5e-3 }\n";
const HARD: &str =
    "algorithm = \"double-dqn\"\ntarget_update = { hard = 70 }\nloss = \"squared\"\nupdates_per_step = 2\n";

const VARIED: &str = r#"
[[randomise]]
key = "converter.inductance"
factor = [0.9, 1.1]

[[randomise]]
key = "switch.v_f"
value = [0.0, 1.5]
"#;

/// The tiny training with other `learning` keys, on the paper's converter as a bench would show it.
fn bench(learning: &str) -> (Settings, Contract, Converter) {
    let (_, contract) = tiny();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/tiny.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    let kept = |line: &&str| !line.starts_with("algorithm") && !line.starts_with("target_update");
    let text: String = text.lines().filter(kept).map(|line| format!("{line}\n")).collect();
    let text = text.replace("[learning]\n", &format!("[learning]\n{learning}")) + VARIED;
    let mut settings = Settings::parse(&text, &path).unwrap_or_else(|faults| panic!("{faults}"));
    settings.steps = 1000;
    let plant = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/plants/paper-model.toml");
    let set = [
        ("pwm.duty_delay", 1.0),
        ("sensors.v_out.noise", 0.04),
        ("sensors.v_out.lsb", 0.061),
        ("sensors.i_out.noise", 0.005),
        ("sensors.i_l.low_pass", 2e-5),
    ];
    let set = set.map(|(key, value)| (key.to_owned(), value));
    (settings, contract, Converter::load(&plant, &set).unwrap())
}

#[test]
fn the_same_seed_gives_the_same_files_twice() {
    let run = |seed| {
        let (settings, contract, converter) = bench(SOFT);
        let mut trainer = Trainer::new(&settings, &contract, &converter, seed).unwrap();
        let ended = trainer.run(&NEVER, |_| {}).unwrap();
        (trainer.finish(ended).unwrap().files, trainer.checkpoint().unwrap())
    };
    let (first, second, other) = (run(3), run(3), run(4));
    assert!(first == second);
    assert!(first.0["net.safetensors"] != other.0["net.safetensors"]);
}

/// Stops at odd places: before the first update, inside episodes, with a duty on its way, behind a look.
fn goes_on_to_the_same_bytes(learning: &str) {
    let (settings, contract, converter) = bench(learning);
    let fresh = |seed| Trainer::new(&settings, &contract, &converter, seed).unwrap();
    let mut whole = fresh(3);
    assert_eq!(whole.run(&NEVER, |_| {}).unwrap(), Ended::Budget);

    let mut trainer = fresh(3);
    for stop in [17, 100, 333, 334, 500, 777] {
        assert_eq!(trainer.run_until(stop, &NEVER, |_| {}).unwrap(), Ended::Interrupted);
        let bytes = trainer.checkpoint().unwrap();
        trainer = fresh(9);
        trainer.resume(&bytes).unwrap();
        assert_eq!(trainer.step_count(), stop);
        assert!(trainer.checkpoint().unwrap() == bytes);
    }
    assert_eq!(trainer.run(&NEVER, |_| {}).unwrap(), Ended::Budget);
    assert!(trainer.checkpoint().unwrap() == whole.checkpoint().unwrap());
    let files = |trainer: &Trainer<Converter>| trainer.finish(Ended::Budget).unwrap().files;
    assert!(files(&trainer) == files(&whole));
}

#[test]
fn an_interrupted_dqn_goes_on_to_the_same_bytes() {
    goes_on_to_the_same_bytes(SOFT);
}

#[test]
fn an_interrupted_double_dqn_with_hard_updates_goes_on_to_the_same_bytes() {
    goes_on_to_the_same_bytes(HARD);
}

/// Keys and values of an episode.
type Varied = Vec<(String, f64)>;

/// The converter, and what its episodes vary.
#[derive(Debug, Clone)]
struct Witness {
    converter: Converter,
    starts: Arc<Mutex<Vec<Varied>>>,
    /// Voltage after the same 50 periods from the same start, in microvolts.
    ends: Arc<Mutex<BTreeSet<i64>>>,
}

impl Environment for Witness {
    fn t_sample(&self) -> f64 {
        self.converter.t_sample()
    }

    fn parameter(&self, key: &str) -> Option<f64> {
        self.converter.parameter(key)
    }

    fn ideal_ripple(&self, v_out: f64) -> f64 {
        self.converter.ideal_ripple(v_out)
    }

    fn identity(&self) -> Vec<u8> {
        self.converter.identity()
    }

    fn restart(&mut self, start: &Start<'_>) -> Result<Sample, closed_loop::Error> {
        let varied = start.varied.iter().map(|(key, value)| ((*key).to_owned(), *value));
        self.starts.lock().unwrap().push(varied.collect());
        let load = plant::Load::resistor(50.0);
        let mut same = self.converter.clone();
        let mut sample = same.restart(&Start {
            v_out: 100.0,
            i_l: 2.0,
            load,
            seed: 0,
            ..*start
        })?;
        for _ in 0..50 {
            sample = same.step(0.5, &LoadPath::constant(load));
        }
        self.ends.lock().unwrap().insert((1e6 * sample.v_out) as i64);
        self.converter.restart(start)
    }

    fn step(&mut self, duty: f64, load: &LoadPath) -> Sample {
        self.converter.step(duty, load)
    }

    fn save(&self) -> Result<Vec<u8>, closed_loop::Error> {
        self.converter.save()
    }

    fn load(&mut self, bytes: &[u8]) -> Result<(), closed_loop::Error> {
        self.converter.load(bytes)
    }
}

#[test]
fn every_episode_behind_the_curriculum_has_a_converter_of_its_own() {
    let (mut settings, contract, converter) = bench(SOFT);
    settings.steps = 3000;
    settings.selection.every = 5000;
    settings.selection.task.load_steps.truncate(1);
    let witness = Witness {
        converter,
        starts: Arc::default(),
        ends: Arc::default(),
    };
    let mut trainer = Trainer::new(&settings, &contract, &witness, 3).unwrap();
    trainer.run_until(2999, &NEVER, |_| {}).unwrap();

    let starts = witness.starts.lock().unwrap();
    let nominal = |start: &Vec<(String, f64)>| start.iter().any(|(key, value)| key == "switch.v_f" && *value == 0.0);
    let varied: Vec<_> = starts.iter().filter(|start| !nominal(start)).collect();
    // `randomise = 0.0` up to step 500, episodes of 230 periods at most
    assert!(starts.len() - varied.len() >= 3, "{starts:?}");
    assert!(varied.len() >= 10, "{}", varied.len());
    for (key, [low, high]) in [
        ("converter.inductance", [1.8e-3, 2.2e-3]),
        ("switch.v_f", [0.0, 1.5]),
        ("converter.v_in", [196.0, 204.0]),
    ] {
        let values: BTreeSet<u64> = varied
            .iter()
            .flat_map(|start| start.iter().filter(|(name, _)| name == key))
            .map(|(_, value)| {
                assert!((low..=high).contains(value), "{key} {value}");
                value.to_bits()
            })
            .collect();
        assert_eq!(values.len(), varied.len(), "{key}");
    }
    // and they behave differently
    assert_eq!(witness.ends.lock().unwrap().len(), varied.len() + 1);
}

#[test]
fn a_spread_that_makes_no_converter_is_refused_before_the_training() {
    let (settings, contract, converter) = bench(SOFT);
    for (lines, parts) in [
        (
            "factor = { \"converter.f_sw\" = 0.9 }",
            ["[[spread]]", "converter.f_sw"],
        ),
        (
            "set = { \"converter.topology\" = 1 }",
            ["[[spread]]", "another `converter.topology`"],
        ),
        // a duty ratio of what it was is one; a thousand times the largest inductance is none
        (
            "factor = { \"converter.inductance\" = 1e12 }",
            ["inductance", "out of range"],
        ),
    ] {
        let text = std::fs::read_to_string(&settings.file).unwrap() + "[[spread]]\n" + lines + "\n";
        let settings = Settings::parse(&text, &settings.file).unwrap_or_else(|faults| panic!("{faults}"));
        let Err(error) = Trainer::new(&settings, &contract, &converter, 1) else {
            panic!("accepted: {lines}")
        };
        let said = error.to_string();
        assert!(parts.iter().all(|part| said.contains(part)), "{lines}\n{said}");
    }
}
