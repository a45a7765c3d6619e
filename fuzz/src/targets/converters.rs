//! What a simulation and a training are made of: plants, scenarios, training files, checkpoints.

use std::cell::RefCell;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use closed_loop::{Converter, Scenario};
use plant::{Load, Parameters, Plant};
use train::{Contract, Settings, Trainer};

use super::Target;
use super::folders::Desk;
use super::seeds::{answer, at, files, read, refused};
use crate::forms::Form;
use crate::guard::{Answer, Limits, Reader};

/// Control periods that a plant which is taken runs.
// two, so that what a period owes the next is met; the slowest plant that is taken needs a quarter of a second for each
const PERIODS: usize = 2;
/// Control periods that a training goes on behind a checkpoint.
const GONE_ON: u64 = 2;

pub(super) static TARGETS: &[Target] = &[
    Target {
        name: "plant",
        about: "a plant file; what is taken runs two periods",
        form: Form::Bytes,
        words: PLANT_WORDS,
        limits: Limits::READER,
        seeds: plant_seeds,
        reader: || Ok(Box::new(plant_file)),
    },
    Target {
        name: "scenario",
        about: "a scenario file",
        form: Form::Bytes,
        words: SCENARIO_WORDS,
        limits: Limits::READER,
        seeds: || {
            files(&[
                "examples/simulate/paper.toml",
                "examples/simulate/paper-delay.toml",
                "examples/simulate/paper-table.toml",
                "examples/simulate/sb3-buck12.toml",
                "examples/drm/cases.toml",
                "examples/drm/what-a-mapping-repairs.toml",
            ])
        },
        reader: || {
            Ok(Box::new(|bytes| match std::str::from_utf8(bytes) {
                Ok(text) => answer(Scenario::from_toml(Path::new("scenario.toml"), text), |_| {
                    "scenario".to_owned()
                }),
                Err(_) => Answer::refused("no text"),
            }))
        },
    },
    Target {
        name: "training",
        about: "a training file",
        form: Form::Bytes,
        words: TRAINING_WORDS,
        limits: Limits::READER,
        seeds: || {
            files(&[
                "examples/train/blind.toml",
                "examples/train/measured.toml",
                "examples/train/paper-table.toml",
                "examples/train/paper12.toml",
                "examples/train/wide.toml",
                "train/tests/fixtures/tiny.toml",
            ])
        },
        reader: || {
            Ok(Box::new(|bytes| match std::str::from_utf8(bytes) {
                Ok(text) => answer(Settings::parse(text, Path::new("training.toml")), |_| {
                    "training".to_owned()
                }),
                Err(_) => Answer::refused("no text"),
            }))
        },
    },
    Target {
        name: "training-contract",
        about: "a contract without its weights, as a training reads it",
        form: Form::Bytes,
        words: CONTRACT_WORDS,
        limits: Limits::READER,
        seeds: || {
            files(&[
                "examples/train/paper12/policy.toml",
                "examples/train/measured/policy.toml",
                "examples/train/wide/policy.toml",
                "examples/train/blind/policy.toml",
                "train/tests/fixtures/tiny/policy.toml",
                "tests/golden/cases/continuous/policy.toml",
            ])
        },
        reader: training_contract,
    },
    Target {
        name: "checkpoint",
        about: "a checkpoint of a training, its digest made right",
        form: Form::Digested,
        words: &[
            "policyc-train\0v1",
            "\"parameters\"",
            "null",
            "1e999",
            "nan",
            "\"queue\"",
            "[]",
            "{}",
        ],
        limits: Limits::READER,
        seeds: checkpoint_seeds,
        reader: checkpoint,
    },
];

const PLANT_WORDS: &[&str] = &[
    "topology",
    "\"buck\"",
    "\"boost\"",
    "\"buck-boost\"",
    "[converter]",
    "v_in",
    "inductance",
    "capacitance",
    "f_sw",
    "periods_per_sample",
    "[switch]",
    "v_f",
    "r_ds_on",
    "r_d",
    "dead_time",
    "[inductor]",
    "dcr",
    "saturation",
    "core_loss",
    "[capacitor]",
    "esr",
    "esl",
    "[load]",
    "[source]",
    "resistance",
    "inductance",
    "[cable]",
    "[sensors]",
    "gain",
    "offset",
    "noise",
    "seed",
    "quantisation",
    "low_pass",
    "delay",
    "[duty]",
    "quantisation",
    "minimum_on_time",
    "model",
    "\"switched\"",
    "\"averaged\"",
    "[control]",
    "phase",
    "sampling",
    "diode",
    "derating",
    "cpl_bandwidth",
    "cpl_fold",
    "bleed",
    "input_ripple",
];
const CONTRACT_WORDS: &[&str] = &[
    "[network]",
    "weights",
    "golden",
    "\"weights.safetensors\"",
    "\"../w\"",
    "\"/\"",
    "\"\"",
    "[mapping]",
    "file",
    "\"drm.toml\"",
    "[[feature]]",
    "source",
    "[actions]",
    "duties",
    "pairs",
    "continuous",
    "hidden_activation",
    "\"relu\"",
    "\"tanh\"",
    "{",
    "}",
    "network = {",
    "[[signal]]",
    "range",
    "load_current",
    "scale",
    "clip",
    "filters",
    "numeric_format",
];
const SCENARIO_WORDS: &[&str] = &[
    "plant",
    "[set]",
    "v_ref",
    "load_steps",
    "current_steps",
    "resistance_steps",
    "instants",
    "sampling_instants",
    "lead",
    "after",
    "tail",
    "baselines",
    "\"pid\"",
    "\"deadbeat\"",
    "\"cascade\"",
    "limit",
    "false",
    "[[0.44, 0.55], [0, 1]]",
    "\"converter.v_in\"",
    "[[200, 500]]",
    "[[case]]",
    "name",
    "policy",
    "mapping",
];
const TRAINING_WORDS: &[&str] = &[
    "plant",
    "contract",
    "seeds",
    "steps",
    "[set]",
    "[network]",
    "hidden",
    "[learning]",
    "algorithm",
    "\"dqn\"",
    "\"double-dqn\"",
    "learning_rate",
    "batch",
    "replay",
    "warm_up",
    "every",
    "discount",
    "target_update",
    "soft",
    "hard",
    "epsilon",
    "start",
    "end",
    "huber",
    "[reward]",
    "v_ref",
    "band",
    "power",
    "duty_change",
    "[episode]",
    "load_every",
    "any_phase",
    "loads",
    "values",
    "range",
    "share",
    "[[randomise]]",
    "key",
    "factor",
    "absolute",
    "[[curriculum]]",
    "until",
    "randomise",
    "[selection]",
    "[evaluation]",
    "load_steps",
    "[requirement]",
    "settling",
    "overshoot",
    "instants",
    "tail",
    "gradient_norm",
    "weight_decay",
    "[[200, 500]]",
];

fn plant_seeds() -> Result<Vec<Vec<u8>>, String> {
    files(&[
        "examples/plants/paper-model.toml",
        "examples/plants/paper-table.toml",
        "examples/plants/sb3-buck12.toml",
        "examples/diagnose/buck24.toml",
        "examples/diagnose/buck24-u.toml",
        "examples/blind/plant.toml",
        "examples/drm/plants/far.toml",
        "examples/drm/plants/lossy.toml",
        "examples/drm/plants/sampled-late.toml",
        "examples/drm/plants/sensor-gain.toml",
    ])
}

fn plant_file(bytes: &[u8]) -> Answer {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return Answer::refused("no text");
    };
    let parameters = match Parameters::from_toml(Path::new("plant.toml"), text) {
        Ok(parameters) => parameters,
        Err(faults) => return refused(&faults),
    };
    match Plant::new(&parameters) {
        Err(faults) => refused(&faults),
        Ok(mut plant) => {
            let load = Load::power(10.0);
            for _ in 0..PERIODS {
                plant.step(0.5, &load);
            }
            Answer::accepted("plant")
        }
    }
}

fn training_contract() -> Result<Box<Reader>, String> {
    let desk = Desk::new()?;
    desk.file("drm.toml", &read("examples/train/blind/drm.toml")?);
    Ok(Box::new(move |bytes| {
        match Contract::load_any(&desk.file("policy.toml", bytes), &[3, 2]) {
            Ok(contract) => {
                assert_eq!(contract.network().inputs(), contract.policy.features.len());
                Answer::accepted("contract")
            }
            // the lines below it quote the file
            Err(error) => Answer::refused(error.to_string().lines().next().unwrap_or_default()),
        }
    }))
}

fn tiny() -> Result<(Settings, Contract, Converter), String> {
    let settings = Settings::load(&at("train/tests/fixtures/tiny.toml")).map_err(|error| error.to_string())?;
    let contract = Contract::load(&settings.contract, &settings.hidden).map_err(|error| error.to_string())?;
    let converter = Converter::load(&at("examples/plants/paper-model.toml"), &[]).map_err(|error| error.to_string())?;
    Ok((settings, contract, converter))
}

fn trainer() -> Result<Trainer<Converter>, String> {
    let (settings, contract, converter) = tiny()?;
    Trainer::new(&settings, &contract, &converter, 3).map_err(|error| error.to_string())
}

fn checkpoint_seeds() -> Result<Vec<Vec<u8>>, String> {
    let mut trainer = trainer()?;
    let fresh = trainer.checkpoint().map_err(|error| error.to_string())?;
    let never = AtomicBool::new(false);
    let mut seeds = vec![fresh];
    // in the middle of an episode, with a replay buffer that holds something
    trainer
        .run_until(45, &never, |_| {})
        .map_err(|error| error.to_string())?;
    seeds.push(trainer.checkpoint().map_err(|error| error.to_string())?);
    Ok(seeds)
}

fn checkpoint() -> Result<Box<Reader>, String> {
    // one trainer for all inputs: `resume` writes every value that it later reads, in the order of the file
    let trainer = RefCell::new(trainer()?);
    let never = AtomicBool::new(false);
    Ok(Box::new(move |bytes| {
        let Ok(mut trainer) = trainer.try_borrow_mut() else {
            return Answer::refused("the trainer is in use");
        };
        match trainer.resume(bytes) {
            Err(error) => Answer::refused(error.to_string()),
            Ok(()) => {
                let again = trainer.checkpoint();
                assert!(again.is_ok(), "what was read is not written again");
                let last = trainer.step_count().saturating_add(GONE_ON);
                // a plant that can no longer be simulated may be refused, in words
                let _ = trainer.run_until(last, &never, |_| {});
                Answer::accepted("resumed")
            }
        }
    }))
}
