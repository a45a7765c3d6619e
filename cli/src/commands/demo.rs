//! `policyc demo`: the whole way on the built-in example.

use std::path::Path;

use codegen::Output;

use super::{compile, inspect, verify};
use crate::arguments::{Demo, Inspect, Outside, Verify};
use crate::failure::Failure;
use crate::outcome::Outcome;
use crate::output;

/// The example as shipped, so that the demo runs anywhere. Copies of examples/buck12: a published crate holds no file of another.
const EXAMPLE: [(&str, &[u8]); 4] = [
    ("policy.toml", include_bytes!("../../example/policy.toml")),
    ("drm.toml", include_bytes!("../../example/drm.toml")),
    (
        "weights.safetensors",
        include_bytes!("../../example/weights.safetensors"),
    ),
    ("golden.safetensors", include_bytes!("../../example/golden.safetensors")),
];

/// Inspect, compile, verify; prints where the files are.
pub fn run(options: &Demo) -> Result<Outcome, Failure> {
    let policy_folder = options.out.join("policy");
    let files = EXAMPLE
        .iter()
        .map(|(name, content)| ((*name).to_owned(), content.to_vec()))
        .collect();
    output::replace_own(&policy_folder, files, options.replacing)?;
    heading("The policy", &format!("policyc inspect {}", policy_folder.display()))?;
    inspect::run(&Inspect {
        outside: Outside::default(),
        policy: policy_folder.clone(),
        format: None,
        json: false,
    })?;

    let generated = options.out.join("generated");
    let command = format!(
        "policyc compile {} --emit c,rust --out {}",
        policy_folder.display(),
        generated.display()
    );
    heading("The code", &command)?;
    let policy = super::load(&policy_folder, Outside::default())?;
    let target = ::targets::host();
    let files = codegen::generate(&policy, target, &Output::CORES, None)?.files;
    let written = compile::write(&generated, &files, &[], options.replacing)?;
    compile::say(&policy, target, &written, &[], &[])?;

    let (policy, generated) = (policy_folder.display(), generated.display());
    heading(
        "The proof",
        &format!(
            "policyc verify {policy} --generated {generated} --steps {}",
            options.steps
        ),
    )?;
    let outcome = verify::run(&Verify {
        outside: Outside::default(),
        policy: policy_folder.clone(),
        steps: options.steps,
        seed: 1,
        target: None,
        format: None,
        generated: Some(options.out.join("generated")),
        golden_decisions: None,
        drift_only: false,
        replacing: options.replacing,
        report: Vec::new(),
        annotations: None,
        trace: Vec::new(),
        map: Vec::new(),
        every: Default::default(),
        json: false,
    })?;
    output::say("\nfiles")?;
    show(
        &policy_folder,
        "the policy: edit policy.toml and run the commands above again",
    )?;
    show(
        &options.out.join("generated"),
        "the controller in C and Rust, and manifest.json",
    )?;
    Ok(outcome)
}

fn heading(title: &str, command: &str) -> Result<(), Failure> {
    output::say(&format!("\n== {title} ==   {command}\n"))
}

fn show(folder: &Path, meaning: &str) -> Result<(), Failure> {
    output::say(&format!("  {}   {meaning}", folder.display()))
}
