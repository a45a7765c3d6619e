//! `policyc diagnose --retrain`: files for a training on the extended plant, the training as `policyc train` does it, and the
//! closed loop before and after.
//!
//! ```text
//!   DIR/plant.extended.toml          the plant
//!   DIR/retrain/contract/policy.toml the contract, sensors corrected; a mapping beside it
//!   DIR/retrain/train.toml           the training file on both
//!   DIR/retrain/policy               what comes out: `policyc train` writes it, and goes on with it
//! ```

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use ::diagnose::diagnosis::Diagnosis;
use ::diagnose::retrain::contract::{Corrected, corrected};
use ::diagnose::retrain::judged::{Asked, Judged, judged};
use ::diagnose::retrain::settings::moved;
use ::diagnose::retrain::{Plan, Refusal, plan, true_sensors};
use closed_loop::Converter;
use closed_loop::scenario::Finding;
use policy::Policy;
use toml_input::{Fault, Message};
use train::score::Scoring;
use train::{Contract, Settings};

use crate::arguments::{Diagnose, Foreign, Train};
use crate::commands::train as training;
use crate::failure::Failure;
use crate::outcome::Outcome;
use crate::output;

/// Everything of a training on the extended plant, below `--out`.
const FOLDER: &str = "retrain";
const POLICY: &str = "policy";
const SETTINGS: &str = "train.toml";
const CONTRACT: &str = "contract/policy.toml";

/// What was read for a training before the diagnosis began.
pub struct Prepared {
    settings: Settings,
    text: String,
    contract: Contract,
    old: Option<Policy>,
    out: PathBuf,
    /// A policy that an earlier run has trained: it is judged, and nothing is trained.
    is_trained: bool,
}

/// What became of it.
pub enum Ended {
    /// Nothing to train on.
    Refused(Refusal),
    /// A signal came.
    Interrupted,
    /// Trained and judged; whether the specification is missed.
    Judged(Box<Judged>, bool),
}

/// Reads what a training needs, so that its faults are told before a diagnosis that takes its time.
///
/// # Errors
/// Faults of the files; a folder that holds a policy or an interrupted training, or with `--resume` none.
pub fn prepare(options: &Diagnose) -> Result<Option<Prepared>, Failure> {
    let Some(file) = &options.retrain else { return Ok(None) };
    let settings = Settings::load(file)?;
    let text = std::fs::read_to_string(file).map_err(|error| {
        let message = Message::new(format!("cannot read the file: {error}"));
        Fault::in_file(file, message)
    })?;
    let contract = Contract::load(&settings.contract, &settings.hidden)?;
    let v_ref = settings.reward.v_ref;
    let model = super::model(options)?;
    closed_loop::suits(&contract.policy, &model, v_ref, &options.model)?;
    closed_loop::holds_power(&model, v_ref, &options.model)?;
    // before the diagnosis: a training file that cannot be moved is told now
    moved(&text, "plant", "contract", &[]).map_err(|message| Fault::in_file(file, message))?;
    let old = options
        .policy
        .as_deref()
        .map(|path| crate::commands::load(path, options.outside))
        .transpose()?;
    if let (Some(old), Some(path)) = (&old, &options.policy) {
        closed_loop::suits(old, &model, v_ref, path)?;
    }
    let out = options.out.join(FOLDER);
    let is_trained = options.resume && out.join(POLICY).join("policy.toml").exists();
    if !is_trained {
        training::ready(&out.join(POLICY), &settings.seeds, options.resume)?;
    }
    Ok(Some(Prepared {
        settings,
        text,
        contract,
        old,
        out,
        is_trained,
    }))
}

/// Trains on the extended plant, which is written by now, and judges.
///
/// # Errors
/// If a file cannot be written, or the training fails.
pub fn run(options: &Diagnose, prepared: &Prepared, diagnosis: &Diagnosis) -> Result<Ended, Failure> {
    let plan = match plan(diagnosis) {
        Ok(plan) => plan,
        Err(refusal) => return Ok(Ended::Refused(refusal)),
    };
    let (files, corrected, mut notes) = files(prepared, &plan, diagnosis)?;
    output::replace_own_texts(&prepared.out, &files, options.replacing)?;
    let policy = prepared.out.join(POLICY);
    let mut missed = false;
    if !prepared.is_trained {
        let asked = Train {
            settings: prepared.out.join(SETTINGS),
            out: policy.clone(),
            // the extended plant is one of numbers
            foreign: Foreign { run_fmu: false },
            seeds: Vec::new(),
            threads: 0,
            tensorboard: None,
            resume: options.resume,
            json: false,
        };
        match training::run(&asked)? {
            Outcome::Interrupted => return Ok(Ended::Interrupted),
            outcome => missed = outcome == Outcome::Different,
        }
    }
    notes.extend(
        corrected
            .left
            .iter()
            .map(|left| format!("Not corrected in the contract, so that the network had to learn it: {left}.")),
    );
    let new = crate::commands::load(&policy, options.outside)?;
    let settings = &prepared.settings;
    let scoring = Scoring::new(&settings.evaluation.load_steps, &settings.specification, 1.0);
    let found = judged(
        &plan,
        Asked {
            folder: format!("{FOLDER}/{POLICY}"),
            old: prepared.old.as_ref(),
            new: &new,
            v_ref: settings.reward.v_ref,
            task: &settings.evaluation,
            corrections: corrected.taken,
            before: corrected.before,
            notes,
            cost: &|findings: &[Finding]| scoring.score(findings).cost,
        },
    )?;
    Ok(Ended::Judged(Box::new(found), missed))
}

type Texts = BTreeMap<String, String>;

/// Training file, contract and mapping.
fn files(prepared: &Prepared, plan: &Plan, diagnosis: &Diagnosis) -> Result<(Texts, Corrected, Vec<String>), Failure> {
    // a plant that cannot be simulated is told before hours of training
    Converter::new(&plan.plant)?;
    let (text, beside) = prepared.contract.sources();
    let corrected = corrected(text, &plan.corrections);
    let set = true_sensors(&corrected.before);
    let moved = moved(&prepared.text, "../plant.extended.toml", CONTRACT, &set)?;
    let mut notes = moved.notes;
    let mut files = Texts::new();
    for (name, bytes) in beside {
        let own = String::from_utf8_lossy(bytes).into_owned();
        // the policy before has shown which duties the extended model needs
        let refitted = diagnosis.control.as_ref().filter(|control| control.findings.refitted);
        let text = match refitted {
            Some(control) => {
                notes.push("Its mapping is the one that was refitted to the extended model.".to_owned());
                control.mapping.clone()
            }
            None => own,
        };
        files.insert(beside_contract(name), text);
    }
    files.insert(CONTRACT.to_owned(), corrected.text.clone());
    files.insert(SETTINGS.to_owned(), moved.text);
    Ok((files, corrected, notes))
}

fn beside_contract(name: &str) -> String {
    Path::new(CONTRACT).with_file_name(name).display().to_string()
}
